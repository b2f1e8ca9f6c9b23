"""Captures of the paper's radar without a heading: counts, frame after frame."""

from pathlib import Path

import numpy as np

from sd2core import PAPER_RADAR, RadarCapture, Timebase
from sd2core.io.readers import FileReader

SD2_PLUGIN_API = 1


def read(path: Path) -> RadarCapture:
    radar = PAPER_RADAR
    cube = (-1, radar.channels, radar.chirps_per_frame, radar.samples_per_chirp)
    samples = np.fromfile(path, np.uint16).reshape(cube)
    times = Timebase.regular(len(samples), 1.0 / radar.frame_repetition_s)
    return RadarCapture(samples, radar, times, source=str(path))


READER = FileReader(read, (".tea",))
