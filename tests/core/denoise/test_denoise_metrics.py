"""Metrics against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.denoise.metrics import (
    map_error,
    mean_velocity_error,
    peak_error,
    stands_out,
    velocity_error,
)
from sd2core.denoise.scaling import Compression
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, mean_velocity_mps, peak_velocity_mps
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis(32, 2.0)
WIDTH_MPS = 0.125


def one_hot(bins: list[int | None]) -> np.ndarray:
    """One bin of energy 1 per frame; None is an empty frame."""
    energies = np.zeros((len(bins), 32), np.float32)
    for frame, number in enumerate(bins):
        if number is not None:
            energies[frame, number] = 1.0
    return energies


bins = st.integers(0, 31)
maybe_bins = st.one_of(st.none(), bins)


@given(st.lists(st.tuples(maybe_bins, maybe_bins), min_size=1, max_size=30))
def test_peak_error_by_hand(pairs: list[tuple[int | None, int | None]]) -> None:
    estimate, target = one_hot([a for a, _ in pairs]), one_hot([b for _, b in pairs])
    centre = AXIS.centres_mps
    errors = np.array(
        [(0.0 if a is None else centre[a]) - centre[b] for a, b in pairs if b is not None]
    )
    found = peak_error(estimate, target, AXIS)
    assert found.frames == len(errors)
    assert found.empty_target == sum(b is None for _, b in pairs)
    assert found.empty_estimate == sum(a is None and b is not None for a, b in pairs)
    if len(errors) == 0:
        assert np.isnan(found.mae_mps)
        assert np.isnan(found.sd_mps)
        return
    assert found.mae_mps == pytest.approx(np.abs(errors).mean())
    assert found.bias_mps == pytest.approx(errors.mean())
    assert found.sd_mps**2 + found.bias_mps**2 == pytest.approx(found.rmse_mps**2)
    assert found.sd_absolute_mps**2 + found.mae_mps**2 == pytest.approx(found.rmse_mps**2)
    assert found.mae_mps <= found.rmse_mps + 1e-12


@given(st.lists(st.integers(5, 26), min_size=2, max_size=20), st.integers(-5, 5))
def test_a_constant_shift_has_no_spread(peaks: list[int], shift: int) -> None:
    found = peak_error(one_hot([peak + shift for peak in peaks]), one_hot(list(peaks)), AXIS)
    assert found.mae_mps == pytest.approx(abs(shift) * WIDTH_MPS)
    assert found.bias_mps == pytest.approx(shift * WIDTH_MPS)
    assert found.sd_mps == pytest.approx(0.0, abs=1e-7)


def test_a_level_changes_no_velocity() -> None:
    energies = np.random.default_rng(0).exponential(size=(50, 32)).astype(np.float32)
    for error in (peak_error, mean_velocity_error):
        found = error(1e-3 * energies, energies, AXIS)
        assert found.mae_mps == pytest.approx(0.0, abs=1e-6)
        assert found.correlation == pytest.approx(1.0)


def test_leaving_frames_empty_does_not_pay() -> None:
    target = one_hot([31, 31, 0])
    assert peak_error(one_hot([31, None, None]), target, AXIS).mae_mps == pytest.approx(
        2 * AXIS.centres_mps[31] / 3
    )


def test_only_the_frames_that_are_asked_for() -> None:
    estimate, target = one_hot([3, 9, None]), one_hot([3, 5, None])
    found = peak_error(estimate, target, AXIS, np.array([True, False, True]))
    assert (found.mae_mps, found.frames, found.empty_target) == (0.0, 1, 1)


def test_velocities_are_those_of_the_map() -> None:
    energies = np.random.default_rng(1).exponential(size=(40, 32)).astype(np.float32)
    energies[[3, 17]] = 0.0
    doppler = DopplerMap(energies.T, AXIS, Timebase.regular(40, 30.0), "real")
    np.testing.assert_array_equal(peak_velocity_mps(energies, AXIS), doppler.peak_velocity_mps())
    np.testing.assert_allclose(mean_velocity_mps(energies, AXIS), doppler.mean_velocity_mps())


@given(bins, bins, st.floats(0.1, 10.0))
def test_mean_velocity_of_two_bins(first: int, second: int, weight: float) -> None:
    energies = one_hot([first]) + np.float32(weight) * one_hot([second])
    centre = AXIS.centres_mps
    expected = (centre[first] + weight * centre[second]) / (1 + weight)
    assert mean_velocity_mps(energies, AXIS)[0] == pytest.approx(expected, abs=1e-6)


def test_a_floor_empties_frames() -> None:
    energies = one_hot([3, 9]) * np.array([[1.0], [0.25]], np.float32)
    for velocity in (peak_velocity_mps, mean_velocity_mps):
        found = velocity(energies, AXIS, 0.25)
        assert found[0] == AXIS.centres_mps[3]
        assert np.isnan(found[1])


def test_correlation_of_straight_lines() -> None:
    line = np.linspace(-1, 1, 9)
    assert velocity_error(0.5 * line + 0.3, line).correlation == pytest.approx(1.0)
    assert velocity_error(-line, line).correlation == pytest.approx(-1.0)
    assert np.isnan(velocity_error(np.zeros(9), line).correlation)


class TestMaps:
    COMPRESSION = Compression(4.0, 0.5)

    def test_by_hand(self) -> None:
        target = np.array([[4.0, 0.0, 7.0], [16.0, 4.0, 7.0]])
        estimate = np.array([[0.0, 0.0, 1.0], [4.0, 4.0, 9.0]])
        found = map_error(estimate, target, self.COMPRESSION, (2,))
        assert found.relative_l1 == pytest.approx(16 / 24)
        assert found.rmse_compressed == pytest.approx(np.sqrt((1 + 0 + 1 + 0) / 4))
        assert found.correlation == pytest.approx(np.corrcoef([0, 0, 1, 1], [1, 0, 2, 1])[0, 1])

    @given(st.integers(0, 50), st.floats(0.1, 5.0))
    def test_of_a_multiple(self, seed: int, factor: float) -> None:
        target = np.random.default_rng(seed).exponential(size=(20, 6))
        found = map_error(factor * target, target, self.COMPRESSION)
        assert found.relative_l1 == pytest.approx(abs(factor - 1))
        assert found.shape_l1 == pytest.approx(0.0, abs=1e-9)
        assert found.correlation == pytest.approx(1.0)

    def test_an_empty_estimate_has_an_error_of_one(self) -> None:
        target = np.random.default_rng(0).exponential(size=(20, 6))
        compression = Compression.fitted([target], (), 0.3)
        found = map_error(np.zeros_like(target), target, compression)
        assert found.relative_l1 == pytest.approx(1.0)
        assert found.rmse_compressed == pytest.approx(1.0)
        assert np.isnan(found.correlation)

    def test_empty_targets(self) -> None:
        nothing = np.zeros((3, 4))
        assert map_error(nothing, nothing, self.COMPRESSION).relative_l1 == 0.0
        assert map_error(nothing + 1, nothing, self.COMPRESSION).relative_l1 == np.inf


def test_frames_that_stand_out_of_the_noise() -> None:
    random = np.random.default_rng(2)
    energies = random.gamma(8.0, 1 / 8, size=(300, 32))
    energies[:, [14, 15, 16]] = 0.0
    moving = np.zeros(300, bool)
    moving[100:160] = True
    energies[moving, 5] = 30.0
    np.testing.assert_array_equal(stands_out(energies, (14, 15, 16)), moving)
    np.testing.assert_array_equal(stands_out(1e-9 * energies, (14, 15, 16)), moving)


def test_shapes_must_agree() -> None:
    with pytest.raises(Sd2Error):
        peak_velocity_mps(np.zeros((3, 31)), AXIS)
    with pytest.raises(Sd2Error):
        velocity_error(np.zeros(3), np.zeros(4))
    with pytest.raises(Sd2Error):
        map_error(np.zeros((3, 4)), np.zeros((4, 3)), Compression(1.0))
