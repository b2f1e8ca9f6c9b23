"""Captures that are replayed faster than they were taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sd2core.files.resources import resource_path
from sd2core.io.radar import load_capture
from sd2core.io.radar.capture import LazySamples, RadarCapture
from sd2core.timebase import Timebase


def fast(capture: RadarCapture, frames: int, faster: float) -> RadarCapture:
    """First frames of a capture, with times that pass faster, and nothing of its simulation."""
    samples = capture.samples
    shape = (frames, *samples.shape[1:])
    return replace(
        capture,
        samples=LazySamples(shape, samples.dtype, lambda some: samples[:frames][some]),
        timebase=Timebase(capture.timebase.times_s[:frames] / faster),
        meta={},
    )


def fast_swipes(frames: int = 90, faster: float = 6.0) -> RadarCapture:
    """The bundled sample, from where somebody swipes."""
    capture = load_capture(resource_path("swipes.sd2") / "radar")
    return fast(capture, frames, faster)


def assert_same_samples(one: RadarCapture, other: RadarCapture) -> None:
    """Both hold the same frames, to the bit."""
    assert one.frame_count == other.frame_count
    assert one.config == other.config
    assert one.samples.dtype == other.samples.dtype
    np.testing.assert_array_equal(one.read(0, one.frame_count), other.read(0, other.frame_count))
