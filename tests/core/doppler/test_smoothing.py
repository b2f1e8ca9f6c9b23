from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from sd2core.doppler.smoothing import frames_within_reach, smooth_time, velocity_kernel


@pytest.mark.parametrize("sigma", [0.7, 1.0, 5.0])
def test_velocity_kernel_is_scipys(sigma: float) -> None:
    values = np.random.default_rng(0).random((32, 9))
    np.testing.assert_allclose(
        velocity_kernel(32, sigma) @ values, gaussian_filter1d(values, sigma, axis=0), atol=1e-14
    )


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
