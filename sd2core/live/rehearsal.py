"""A camera and a radar without hardware: both show the same events, on this computer's clock.

Every 2.03 s of the monotonic clock a light flashes and a reflector appears, for a tenth of a
second. A frame shows an event by the share of its exposure that it took, so that the centre of an
event is known far better than to a frame: what is between picture and radar is measured with it.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.io.radar.growing import GrowingHead
from sd2core.live.sources import Frame, Source, Take
from sd2core.radar_config import SPEED_OF_LIGHT_MPS
from sd2core.radar_profiles import RADARS

EVENT_S = 2.03
"""Between two events, which so fall anywhere within frames of any usual rate."""
FLASH_S = 0.1
"""Length of an event."""
TEST = "test"
"""Name of these sources."""

TEST_RATE_HZ = 30.0
_SWAY_S, _SWAY_M, _DISTANCE_M = 4.0, 0.25, 1.5
_ECHO, _BURST = 0.05, 0.35
"""Amplitudes relative to full scale."""
_DOT_SHARE = 0.12
"""Radius of the dot that sways, of the picture's height."""


def share_of_event(start_s: float, stop_s: float) -> float:
    """Share of an interval of the monotonic clock, shorter than a second, that an event takes."""
    event_s = EVENT_S * math.floor(stop_s / EVENT_S)
    inside_s = min(stop_s, event_s + FLASH_S) - max(start_s, event_s)
    return max(inside_s, 0.0) / (stop_s - start_s)


def sway_m(time_s: float) -> float:
    """Distance of what sways in front of both, in metres."""
    return _DISTANCE_M + _SWAY_M * math.sin(2.0 * math.pi * time_s / _SWAY_S)


class TestCamera:
    """Pictures of a dot that comes and goes, and of a light that flashes."""

    __test__ = False  # no test, though its name begins like one
    simulated = True

    def __init__(
        self, size_px: tuple[int, int] = (640, 360), rate_hz: float = TEST_RATE_HZ
    ) -> None:
        self.size_px, self.rate_hz = size_px, rate_hz
        self.about = f"test pictures, {size_px[0]} × {size_px[1]} px at {rate_hz:g} frames/s"
        self.delay_s = 0.5 / rate_hz
        self._next_s = time.monotonic()
        width, height = size_px
        y, x = np.ogrid[:height, :width]
        self._radius_px = np.hypot(x - width / 2, y - height / 2)

    def read(self) -> tuple[NDArray[np.uint8], float] | None:
        """Wait for the next picture, (height, width, 3); with the time at which it was there."""
        self._next_s = max(self._next_s + 1.0 / self.rate_hz, time.monotonic() - 1.0)
        time.sleep(max(self._next_s - time.monotonic(), 0.0))
        taken_s = time.monotonic()
        light = share_of_event(taken_s - 1.0 / self.rate_hz, taken_s)
        grey = np.full(self._radius_px.shape, 40 + round(180 * light), np.uint8)
        near = _DISTANCE_M / sway_m(taken_s)
        grey[self._radius_px < _DOT_SHARE * self.size_px[1] * near] = 120
        return np.repeat(grey[..., None], 3, axis=2), taken_s

    def close(self) -> None:
        """Nothing is held."""


class TestSource(Source):
    """Frames of a small radar in front of a reflector that sways, and of one that appears."""

    __test__ = False

    def __init__(self, rate_hz: float = TEST_RATE_HZ) -> None:
        radar = replace(RADARS["bgt60"], frame_repetition_s=1.0 / rate_hz, name="Test radar")
        self._head = GrowingHead(
            radar=radar,
            word="uint16",
            simulated=True,
            source="test radar",
            notes=("Simulated: a reflector that sways, and one that appears every two seconds.",),
            start_unix_s=0.0,
        )
        self.delay_s = 0.5 * radar.chirps_per_frame * radar.chirp_repetition_s
        self.about = f"Test radar, simulated, {rate_hz:g} frames/s"

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames."""
        return self._head.model_copy(update={"start_unix_s": start_unix_s})

    def run(self, take: Take, stop: threading.Event) -> None:
        """Hand frames over at their times."""
        begin_s, period_s = time.monotonic(), self._head.radar.frame_repetition_s
        for number in itertools.count():
            due_s = begin_s + (number + 1) * period_s
            if stop.wait(max(due_s - time.monotonic(), 0.0)):
                return
            take(Frame(due_s, number * period_s, time.monotonic()))

    def words(self, frame: Frame) -> NDArray[Any]:
        """Samples of a frame whose chirps ended at ``frame.content``, (1, chirps, samples)."""
        radar = self._head.radar
        chirps_s = frame.content - radar.chirp_repetition_s * np.arange(
            radar.chirps_per_frame, 0, -1
        )
        burst = share_of_event(chirps_s[0], chirps_s[-1] + radar.chirp_repetition_s)
        range_m = _DISTANCE_M + _SWAY_M * np.sin(2.0 * np.pi * chirps_s / _SWAY_S)
        # The reflector that appears turns fast, so that no filter of what stands takes it out.
        fast_m = _DISTANCE_M - 1.0 * (chirps_s - chirps_s[0])
        signal = _ECHO * self._beat(range_m) + _BURST * burst * self._beat(fast_m)
        counts = (1 << radar.adc_bits) - 1
        samples = np.rint((signal + 1.0) * counts / 2).astype(np.uint16)
        return self._head.as_stored(samples[None])

    def _beat(self, range_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Beat signal of a reflector, (chirps, samples), of amplitude 1."""
        radar = self._head.radar
        frequency_hz = np.linspace(
            radar.start_frequency_hz, radar.end_frequency_hz, radar.samples_per_chirp
        )
        return np.cos(4.0 * np.pi * range_m[:, None] * frequency_hz / SPEED_OF_LIGHT_MPS)
