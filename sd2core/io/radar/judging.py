"""What is unlikely about the samples of a capture, by some of its frames.

Nothing is changed: notes say what is odd and its probable cause. Only a capture in which nothing
was recorded is refused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.radar.capture import RadarCapture, Signal
from sd2core.plausibility.clock import judge_rate
from sd2core.radar_config import RadarConfig

_MAX_FRAMES, _MAX_SAMPLES = 32, 1 << 22
_WHITE_LEVEL, _WHITE_CORRELATION = 0.3, 0.1
"""Even noise over all of a converter's range has 0.58 of full scale, and 0; echoes are tones."""
_MIN_GATES = 16
_MIRRORED = 4.0
"""Ratio of powers: near echoes are the strongest, so that the far half has less."""


def judged(capture: RadarCapture) -> RadarCapture:
    """Capture with notes on what is unlikely; Sd2Error if all of it holds a single value."""
    try:
        signal = _some_frames(capture)
    except Sd2Error:  # said where these frames are needed
        return capture
    notes = _empty(signal, capture)
    if capture.config.frame_repetition_s > 1.0:
        notes += map(str, judge_rate(capture.config.frame_repetition_s))
    if capture.full_scale_known and _is_white(signal):
        notes.append(
            "The samples fill the whole range of the converter evenly, as no echo does: the file"
            " is probably no recording (firmware, or compressed), or its bytes are shifted."
        )
    elif _is_mirrored(signal, capture.config):
        notes.append(
            "Most of the power lies at negative beat frequencies: I and Q are probably swapped,"
            " which mirrors distances and directions. Change SampleSwap of adcbufCfg (iqSwapSel),"
            " or sign in the description; walk towards the radar to check."
        )
    return replace(capture, notes=(*capture.notes, *notes))


def _some_frames(capture: RadarCapture) -> Signal:
    """Frames from the first to the last, evenly between."""
    each = int(np.prod(capture.samples.shape[1:]))
    count = min(capture.frame_count, max(2, min(_MAX_FRAMES, _MAX_SAMPLES // each)))
    places = np.linspace(0, capture.frame_count - 1, count).astype(int).tolist()
    return np.concatenate([capture.read(place, place + 1) for place in places])


def _empty(signal: Signal, capture: RadarCapture) -> list[str]:
    """Notes on chirps whose samples are all the same; of a single one, on such frames."""
    first = signal[..., :1] if signal.shape[3] > 1 else signal[..., :1, :1]
    empty = (signal == first).all(axis=3 if signal.shape[3] > 1 else (2, 3))  # (n, channels, …)
    if empty.all():
        raise Sd2Error(
            f"{capture.source}: {'all' if len(empty) > 1 else 'the'} {len(empty)} frames that were"
            f" looked at, from the first to the last, hold one value ({first.flat[0]:g})",
            "samples of a radar",
            "Record again, and see that the radar sends while the recorder listens",
        )
    notes = []
    channels = np.flatnonzero(empty.reshape(*empty.shape[:2], -1).all(axis=(0, 2)))
    if len(channels):
        numbers = ", ".join(str(one + 1) for one in channels)
        notes.append(
            f"Nothing was recorded in channel {numbers} of {empty.shape[1]}: the configuration"
            " probably enables more antennas than were there."
        )
    share = float(np.delete(empty, channels, axis=1).mean())
    if share > 0:
        frames = empty.reshape(len(empty), -1).all(axis=1).sum()
        notes.append(
            f"{100 * share:.2g} % of the chirps in {len(empty)} frames that were looked at hold one"
            f" value, {frames} frames nothing else: packets were lost, or the radar had stopped."
        )
    return notes


def _is_white(signal: Signal) -> bool:
    parts = np.ascontiguousarray(signal).view(np.float32).reshape(*signal.shape, -1)
    if parts.shape[3] < _MIN_GATES or float(parts.std()) < _WHITE_LEVEL:
        return False
    power = float((parts * parts).mean())
    # A tone that is not like its next sample is like one soon after.
    alike = [abs(float((parts[..., n:, :] * parts[..., :-n, :]).mean())) for n in range(1, 5)]
    return max(alike) < _WHITE_CORRELATION * power


def _is_mirrored(signal: Signal, config: RadarConfig) -> bool:
    gates = signal.shape[3]
    if config.sampling == "real" or not config.has_beat or gates < _MIN_GATES:
        return False
    window: NDArray[np.float32] = np.hanning(gates).astype(np.float32)
    power = (np.abs(np.fft.fft(signal * window, axis=3)) ** 2).mean(axis=(0, 1, 2))
    # Without what leaks from 0 Hz, where transmitters couple into receivers.
    near, far = power[3 : gates // 2].sum(), power[gates // 2 + 1 : gates - 2].sum()
    return bool(far > _MIRRORED * near)
