from __future__ import annotations

import math

import numpy as np
import pytest

from sd2core.body.model import Body
from tools.fitting.clip_score import coverage, medium_in_high, peak_kept, speed_mps


def test_the_speed_along_a_circle_is_that_of_its_chords() -> None:
    times_s = np.arange(40) / 30.0
    angle = 0.5 * times_s
    path = 2.0 * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)[:, None]
    # The chord is shorter than the arc by less than 1 %.
    assert speed_mps(path, times_s)[1:-1] == pytest.approx(1.0, rel=0.01)


def test_the_peak_of_equals_is_kept() -> None:
    values = np.random.default_rng(1).normal(size=(30, 4))
    assert peak_kept(values, values) == 1.0
    assert peak_kept(0.8 * values, values) == pytest.approx(0.8)
    assert math.isnan(peak_kept(np.ones(5), np.zeros(5)))


def test_a_right_sigma_covers_two_thirds() -> None:
    errors = np.random.default_rng(2).normal(scale=0.3, size=20_000)
    assert coverage(errors, np.full(20_000, 0.3)) == pytest.approx(0.683, abs=0.01)
    assert coverage(errors, np.full(20_000, 1e-9)) < 0.001
    assert math.isnan(coverage(errors[:1] * np.nan, np.ones(1)))


def test_the_medium_surface_is_part_of_the_finest() -> None:
    rows = medium_in_high()
    np.testing.assert_array_equal(
        Body.load("high").vertices_m[rows], Body.load("medium").vertices_m
    )
