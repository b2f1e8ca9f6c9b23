"""An ideal sensor feels what mechanics says, on paths whose derivatives are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigid_paths import ROTATIONS, VECTORS, even, path_of, turntable, wobbling
from scipy.spatial.transform import Rotation

from sd2core.errors import Sd2Error
from sd2core.imu.signals import GRAVITY_MPS2, InertialSignals, imu_signals, usual_cutoff_hz
from sd2core.timebase import Timebase

FEW = settings(max_examples=20)
INNER = slice(60, -60)
UPWARDS = np.array([0.0, -GRAVITY_MPS2, 0.0])


def assert_same(one: InertialSignals, other: InertialSignals, tolerance: float = 1e-8) -> None:
    assert one.known.all()
    np.testing.assert_allclose(one.acceleration_mps2, other.acceleration_mps2, atol=tolerance)
    np.testing.assert_allclose(one.turn_rate_radps, other.turn_rate_radps, atol=tolerance)


@FEW
@given(ROTATIONS, VECTORS)
def test_at_rest_it_reads_gravity_upwards(rotation: np.ndarray, place_m: np.ndarray) -> None:
    times_s = even()
    signals = imu_signals(path_of(times_s, np.tile(place_m, (240, 1)), rotation), times_s)
    np.testing.assert_allclose(signals.acceleration_mps2 @ rotation.T, [UPWARDS] * 240, atol=1e-9)
    np.testing.assert_allclose(signals.turn_rate_radps, 0.0, atol=1e-9)


@FEW
@given(ROTATIONS, VECTORS)
def test_in_free_fall_it_reads_nothing(rotation: np.ndarray, thrown_mps: np.ndarray) -> None:
    times_s = even()
    fall = thrown_mps * times_s[:, None] - 0.5 * UPWARDS * times_s[:, None] ** 2
    signals = imu_signals(path_of(times_s, fall, rotation), times_s)
    # To the ends of the path, which the low pass must continue.
    np.testing.assert_allclose(signals.acceleration_mps2, 0.0, atol=1e-6)


@FEW
@given(st.floats(0.05, 1.0), st.floats(0.3, 2 * np.pi))
def test_on_a_circle_it_reads_the_centripetal_acceleration(radius_m: float, radps: float) -> None:
    times_s = even()
    signals = imu_signals(turntable(times_s, radius_m, radps), times_s)
    inwards = -radius_m * radps**2
    expected = np.tile([inwards, GRAVITY_MPS2, 0.0], (240, 1))
    np.testing.assert_allclose(signals.acceleration_mps2[INNER], expected[INNER], atol=1e-4)
    np.testing.assert_allclose(signals.turn_rate_radps[INNER], [[0.0, radps, 0.0]] * 120, atol=1e-6)
    # At the ends the acceleration is taken to stay what it was for a period of the cut-off.
    most = radius_m * radps**3 / usual_cutoff_hz(60.0)
    np.testing.assert_allclose(signals.acceleration_mps2, expected, atol=most)


@FEW
@given(ROTATIONS, VECTORS)
def test_a_constant_turn_rate_is_read_about_the_sensors_own_axes(
    rotation: np.ndarray, radps: np.ndarray
) -> None:
    times_s = even()
    turns = rotation @ Rotation.from_rotvec(times_s[:, None] * radps).as_matrix()
    signals = imu_signals(path_of(times_s, np.zeros((240, 3)), turns), times_s)
    np.testing.assert_allclose(signals.turn_rate_radps[INNER], [radps] * 120, atol=1e-6)


@FEW
@given(ROTATIONS)
def test_turning_the_world_with_its_gravity_changes_nothing(turn: np.ndarray) -> None:
    times_s = even()
    path = wobbling(times_s)
    turned = replace(path, position_m=path.position_m @ turn.T, rotation=turn @ path.rotation)
    up = tuple((3.0 * turn @ [0.0, -1.0, 0.0]).tolist())
    assert_same(imu_signals(turned, times_s, 6.0, up), imu_signals(path, times_s, 6.0))


@FEW
@given(VECTORS, VECTORS)
def test_a_constant_velocity_adds_nothing(start_m: np.ndarray, mps: np.ndarray) -> None:
    times_s = even()
    path = wobbling(times_s)
    moved = replace(path, position_m=path.position_m + start_m + mps * times_s[:, None])
    assert_same(imu_signals(moved, times_s), imu_signals(path, times_s), 1e-7)


@FEW
@given(ROTATIONS)
def test_a_sensor_turned_on_its_mount_reads_the_same_vectors_in_its_axes(
    mount: np.ndarray,
) -> None:
    times_s = even()
    path = wobbling(times_s)
    signals, turned = (
        imu_signals(one, times_s) for one in (path, replace(path, rotation=path.rotation @ mount))
    )
    own = InertialSignals(
        times_s, signals.acceleration_mps2 @ mount, signals.turn_rate_radps @ mount
    )
    assert_same(turned, own)


@FEW
@given(st.floats(0.2, 5.0))
def test_slower_motion_scales_by_the_power_of_its_derivative(slower: float) -> None:
    times_s = even()
    path = wobbling(times_s)
    slow = replace(path, timebase=Timebase(times_s * slower))
    at_once = imu_signals(path, times_s, 6.0)
    later = imu_signals(slow, times_s * slower, 6.0 / slower)
    np.testing.assert_allclose(later.turn_rate_radps * slower, at_once.turn_rate_radps, atol=1e-6)
    # Gravity, which does not scale, as a sensor feels it that turns in place.
    still = imu_signals(
        replace(path, position_m=np.zeros((240, 3))), times_s, 6.0
    ).acceleration_mps2
    np.testing.assert_allclose(
        (later.acceleration_mps2 - still) * slower**2,
        at_once.acceleration_mps2 - still,
        atol=1e-6,
    )


@pytest.mark.parametrize("frames_per_s", [25.0, 30.0, 120.0])
def test_half_of_the_amplitude_is_left_at_the_cut_off(frames_per_s: float) -> None:
    times_s = even(int(10 * frames_per_s), frames_per_s)
    rate = 2 * np.pi * 4.0
    x = np.sin(rate * times_s)
    position_m = np.stack([x, 0 * x, 0 * x], axis=1)
    inner = slice(len(x) // 4, -len(x) // 4)
    for cutoff_hz, share in ((4.0, 0.5), (8.0, 1.0), (2.0, 0.0)):
        found = imu_signals(path_of(times_s, position_m), times_s, cutoff_hz).acceleration_mps2[
            inner, 0
        ]
        np.testing.assert_allclose(found, -share * rate**2 * x[inner], atol=0.012 * rate**2)


def test_frames_that_come_unevenly_give_the_same() -> None:
    rng = np.random.default_rng(5)
    uneven_s = even(360) + rng.uniform(-0.3, 0.3, 360) / 60.0
    wanted_s = np.arange(1.0, 5.0, 0.01)
    signals = imu_signals(wobbling(uneven_s), wanted_s, 6.0)
    truth = imu_signals(wobbling(even(3600, 600.0)), wanted_s, 6.0)
    assert_same(signals, truth, 2e-3)
    # As if they came evenly, they would not.
    wrong = imu_signals(replace(wobbling(uneven_s), timebase=Timebase(even(360))), wanted_s, 6.0)
    assert np.abs(wrong.acceleration_mps2 - truth.acceleration_mps2).max() > 0.2


def test_nothing_is_known_in_a_gap_nor_drawn_across_it() -> None:
    times_s = even(300)
    path = wobbling(times_s)
    position_m = path.position_m.copy()
    position_m[150:] += 5.0  # where the body is found again
    there = np.ones(300, bool)
    there[140:150] = False
    there[[200, 206]] = False  # five frames between them
    signals = imu_signals(replace(path, position_m=position_m, present=there), times_s)
    expected = there.copy()
    expected[200:207] = False
    assert (signals.known == expected).all()
    for start, stop in ((0, 140), (150, 200), (207, 300)):
        alone = path_of(times_s[start:stop], position_m[start:stop], path.rotation[start:stop])
        own = imu_signals(alone, times_s[start:stop])
        assert (own.acceleration_mps2 == signals.acceleration_mps2[start:stop]).all()
    assert not imu_signals(path, [-0.1, times_s[-1] + 0.1]).known.any()


def test_missing_frames_are_a_gap_when_there_are_many() -> None:
    times_s = even(300)
    for missing, bridged in ((3, True), (9, False)):
        kept = np.r_[0:100, 100 + missing : 300]
        signals = imu_signals(wobbling(times_s[kept]), times_s)
        assert signals.known[99 + missing // 2] == bridged


def test_the_usual_cut_off_is_within_the_frames() -> None:
    assert [usual_cutoff_hz(rate) for rate in (10.0, 30.0, 285.0)] == [2.0, 6.0, 6.0]


@pytest.mark.parametrize("cutoff_hz", [0.0, -1.0, 28.0, 31.0, np.nan])
def test_a_cut_off_beyond_the_frames_is_refused(cutoff_hz: float) -> None:
    with pytest.raises(Sd2Error, match=r"above 0, up to 27 Hz"):
        imu_signals(wobbling(even()), even(), cutoff_hz)


@pytest.mark.parametrize("up", [(0.0, 0.0, 0.0), (0.0, np.nan, 1.0), (1.0, 0.0)])
def test_a_direction_that_is_none_is_refused(up: tuple[float, ...]) -> None:
    with pytest.raises(Sd2Error, match="Upwards is"):
        imu_signals(wobbling(even()), even(), 6.0, up)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("times_s", "shape", "value", "words"),
    [
        ([0.0, 0.1], (2, 2), 0.0, "three axes"),
        ([0.0, 0.0], (2, 3), 0.0, "increase"),
        ([0.0, 0.1], (2, 3), np.inf, "infinite at 0 s"),
    ],
)
def test_samples_that_do_not_fit_are_refused(
    times_s: list[float], shape: tuple[int, int], value: float, words: str
) -> None:
    with pytest.raises(Sd2Error, match=words):
        InertialSignals(np.array(times_s), np.full(shape, value), np.zeros((2, 3)))
