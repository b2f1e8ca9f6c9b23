from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.identity import similarity
from sd2core.body.roi import Sightings, roi_of, roi_path, smooth_over_time


class TestSmoothing:
    @pytest.mark.parametrize("even", [True, False])
    def test_a_straight_line_stays_to_its_ends(self, even: bool) -> None:
        rng = np.random.default_rng(3)
        times = np.arange(80) / 15.0
        if not even:
            times = np.sort(times + 0.02 * rng.standard_normal(80))
        lines = np.stack([3.0 + 7.0 * times, -2.0 * times], axis=1)
        np.testing.assert_allclose(smooth_over_time(times, lines, 0.2), lines, atol=1e-9)

    def test_noise_is_averaged(self) -> None:
        """Over 2 σ √π f frames, for Gaussian weights inside the clip."""
        noise = np.random.default_rng(5).standard_normal((4000, 1))
        smooth = smooth_over_time(np.arange(4000) / 15.0, noise, 0.5)
        expected = 1.0 / np.sqrt(2.0 * 0.5 * np.sqrt(np.pi) * 15.0)
        assert smooth.std() == pytest.approx(expected, rel=0.1)

    def test_no_lag(self) -> None:
        times = np.arange(300) / 15.0
        wave = np.sin(2 * np.pi * 0.5 * times)[:, None]
        smooth = smooth_over_time(times, wave, 0.2)[60:240, 0]
        inner = wave[60:240, 0]
        shifted = [np.corrcoef(smooth, np.roll(wave[:, 0], k)[60:240])[0, 1] for k in (-1, 0, 1)]
        assert int(np.argmax(shifted)) == 1
        # A Gaussian of 0.2 s passes exp(-(2π f σ)² / 2) of 0.5 Hz.
        assert smooth @ inner / (inner @ inner) == pytest.approx(0.82, abs=0.02)

    @pytest.mark.parametrize("count", [1, 2])
    def test_few(self, count: int) -> None:
        values = np.arange(count, dtype=float)[:, None]
        np.testing.assert_allclose(
            smooth_over_time(np.arange(count) / 15.0, values, 0.2), values, atol=1e-12
        )


class TestPath:
    def test_between_and_where_there_is_nobody(self) -> None:
        """Seen in frames 0 to 8 and 16 to 20, looked for in every second one."""
        frames = np.arange(0, 22, 2)
        rois = np.stack(
            [10.0 * frames, 100.0 - frames, np.full(11, 50.0), np.full(11, 0.1)], axis=1
        ).astype(float)
        rois[5:8] = np.nan
        rows = roi_path(
            Sightings(frames, rois, np.ones(11), np.zeros(11, bool), np.zeros((11, 4), bool)),
            np.arange(21) / 30.0,
        )
        path = [roi_of(row) for row in rows]
        there = [k for k, roi in enumerate(path) if roi is not None]
        assert there == [*range(9), *range(16, 21)]
        for frame in there:
            roi = path[frame]
            assert roi is not None
            assert roi.centre_x_px == pytest.approx(10.0 * frame)
            assert roi.centre_y_px == pytest.approx(100.0 - frame)
            assert roi.size_px == pytest.approx(50.0)
            assert roi.angle_rad == pytest.approx(0.1)

    def test_an_angle_that_passes_half_a_turn(self) -> None:
        angles = np.pi + 0.05 * np.arange(-10, 11)
        rois = np.stack([np.full(21, 9.0), np.full(21, 9.0), np.full(21, 5.0), angles], axis=1)
        rois[:, 3] = np.remainder(angles + np.pi, 2 * np.pi) - np.pi
        path = roi_path(
            Sightings(
                np.arange(21), rois, np.ones(21), np.zeros(21, bool), np.zeros((21, 4), bool)
            ),
            np.arange(21) / 15.0,
        )
        np.testing.assert_allclose(np.remainder(path[:, 3], 2 * np.pi), angles, atol=1e-9)


def test_likeness() -> None:
    rng = np.random.default_rng(0)
    one = rng.random((2, 512)).astype(np.float32)
    one /= one.sum(axis=1, keepdims=True)
    other = np.zeros((2, 512), np.float32)
    other[:, 0] = 1.0
    assert similarity(one, one) == pytest.approx(1.0, abs=1e-5)
    assert similarity(other, np.roll(other, 1, axis=1)) == 0.0
    nothing = np.zeros((2, 512), np.float32)
    assert similarity(one, nothing) == 0.0
    half = one.copy()
    half[1] = 0.0  # thighs out of the picture
    assert similarity(one, half) == pytest.approx(1.0, abs=1e-5)
