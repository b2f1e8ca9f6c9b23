"""A radar that is listened to: a reflector that comes nearer, simulated."""

import itertools
import time

import numpy as np

from sd2core import PAPER_RADAR
from sd2core.io.radar.growing import GrowingHead
from sd2core.live.radars import LiveRadar
from sd2core.live.sources import Frame, Source

SD2_PLUGIN_API = 1


class Cup(Source):
    about = "Tea cup, simulated"

    def __init__(self, place, setup):
        self.speed_mps = float(place or 0.5)

    def head(self, start_unix_s):
        return GrowingHead(
            radar=PAPER_RADAR, word="uint16", simulated=True, start_unix_s=start_unix_s
        )

    def run(self, take, stop):
        for number in itertools.count():
            if stop.wait(PAPER_RADAR.frame_repetition_s):
                return
            time_s = number * PAPER_RADAR.frame_repetition_s
            take(Frame(content=number, time_s=time_s, received_s=time.monotonic()))

    def words(self, frame):
        chirps_s = PAPER_RADAR.chirp_repetition_s * np.arange(PAPER_RADAR.chirps_per_frame)
        turns = 2.0 * (2.0 - self.speed_mps * chirps_s) / PAPER_RADAR.wavelength_m
        gate = np.arange(PAPER_RADAR.samples_per_chirp) / 8.0
        beat = np.cos(2.0 * np.pi * (turns[:, None] + gate))
        return self.head(0.0).as_stored(np.rint(2048 + 900 * beat).astype(np.uint16)[None])


CUP = LiveRadar(Cup)
