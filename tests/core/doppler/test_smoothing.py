from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from doppler_scenes import CAMERA, wobbling
from scipy.ndimage import gaussian_filter1d

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.doppler.smoothing import (
    frames_within_reach,
    smooth,
    smooth_time,
    velocity_kernel,
)


@pytest.mark.parametrize("bins", [2, 31, 32])
@pytest.mark.parametrize("sigma", [0.1, 0.7, 1.0, 2.306556260347933, 5.0, 20.0])
def test_velocity_kernel_is_scipys_bit_by_bit(sigma: float, bins: int) -> None:
    expected = gaussian_filter1d(np.eye(bins), sigma, axis=0)
    np.testing.assert_array_equal(velocity_kernel(bins, sigma), expected)


def test_smoothing_a_map_is_both_with_the_notch_around_them() -> None:
    random = np.random.default_rng(4)
    times = np.cumsum(random.uniform(0.02, 0.05, 40))
    raw = random.random((32, 40))
    for after in (True, False):
        chosen = SynthesisOptions(
            velocity_sigma_bins=1.3, time_sigma_s=0.06, null_after_smoothing=after
        )
        raw[list(chosen.null_bins)] = 0
        expected = gaussian_filter1d(raw, 1.3, axis=0)
        bell = np.exp(-0.5 * ((times[:, None] - times) / 0.06) ** 2)
        bell[np.abs(times[:, None] - times) > 4 * 0.06] = 0
        expected = expected @ (bell / bell.sum(axis=0))
        if after:
            expected[14:17] = 0
        np.testing.assert_allclose(smooth(raw, times, 0, 0, 40, chosen), expected, atol=1e-12)


def test_a_stretch_has_both_before_and_after() -> None:
    maker = Synthesizer(wobbling(30, divisions=2), replace(PRESETS["paper"], time_sigma_s=0.1))
    whole, part = maker.stretch(CAMERA, 0, 30), maker.stretch(CAMERA, 11, 17)
    bare = replace(maker.options, velocity_sigma_bins=0.0, time_sigma_s=0.0)
    plain = Synthesizer(maker.mesh, bare).stretch(CAMERA, 0, 30)
    np.testing.assert_array_equal(whole.raw.astype(np.float32), plain.values)
    np.testing.assert_array_equal(part.raw, whole.raw[:, 11:17])
    assert not np.allclose(whole.values, plain.values)
    again = smooth(whole.raw, maker.mesh.times_s, 0, 0, 30, maker.options)
    np.testing.assert_array_equal(again.astype(np.float32), whole.values)


def test_velocity_kernel_loses_nothing() -> None:
    np.testing.assert_allclose(velocity_kernel(32, 2.0).sum(axis=0), 1.0, atol=1e-12)
    np.testing.assert_array_equal(velocity_kernel(8, 0.0), np.eye(8))


def test_time_smoothing_on_an_even_clock_is_scipys_away_from_the_ends() -> None:
    values, times = np.random.default_rng(1).random((4, 60)), np.arange(60) / 30
    ours = smooth_time(values, times, 0, 0, 60, 1.5 / 30)
    theirs = gaussian_filter1d(values, 1.5, axis=1, truncate=4.0)
    np.testing.assert_allclose(ours[:, 6:-6], theirs[:, 6:-6], atol=1e-12)


def test_a_constant_stays_on_any_clock() -> None:
    times = np.cumsum(np.random.default_rng(2).uniform(0.01, 0.2, 50))
    np.testing.assert_allclose(smooth_time(np.ones((3, 50)), times, 0, 0, 50, 0.1), 1.0)


@pytest.mark.parametrize("sigma_s", [0.0, 1 / 30, 0.05, 3.0])
def test_stretches_join_without_a_seam(sigma_s: float) -> None:
    random = np.random.default_rng(3)
    values = random.random((5, 80))
    for times in (np.arange(80) / 30, np.cumsum(random.uniform(0.01, 0.09, 80))):
        whole = smooth_time(values, times, 0, 0, 80, sigma_s)
        for start, stop in ((0, 1), (3, 40), (40, 41), (41, 80)):
            first, last = frames_within_reach(times, start, stop, sigma_s)
            part = smooth_time(values[:, first:last], times, first, start, stop, sigma_s)
            np.testing.assert_array_equal(part, whole[:, start:stop])


def test_a_clock_since_1970_smooths_as_one_that_starts_with_the_clip() -> None:
    """Four frames away is four sigmas: the last digit decided, frame by frame."""
    values, times_s = np.random.default_rng(5).random((8, 90)), np.arange(90) / 30.0
    here, since_1970 = (
        smooth_time(values, clock, 0, 0, 90, 1.0 / 30.0) for clock in (times_s, 1.7e9 + times_s)
    )
    np.testing.assert_allclose(since_1970, here, rtol=2e-5)
