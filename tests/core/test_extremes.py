"""Radial velocity and counting at the extremes of distance, speed, rate, scale and place.

References are exact ranges in decimal arithmetic (see ``extreme_tables``). Every
tolerance is a number of roundings of the largest coordinate over the time between two
positions: a range is a distance, so it can be no better than the places it lies between.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from extreme_tables import PLACES, Scene, every_scene, exact_velocities
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.counting import relative_range
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.numerics.precision import SHARE_OF_A_BIN, velocity_error_mps
from sd2core.scattering.velocity import radial_velocity
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

DOUBLE = 2.0**-53
POINTS = 60
EVERY_SCENE = pytest.mark.parametrize("scene", every_scene(), ids=str)


@pytest.fixture(scope="module", autouse=True)
def kernels() -> None:
    warm_up()


def ends(scene: Scene, count: int = POINTS) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions one frame before and one after, (3, count) each."""
    middle, step = scene.points(count), scene.step(count)
    return middle - step, middle + step


def largest(*arrays: Any) -> float:
    return float(max(np.abs(array).max() for array in arrays))


@pytest.mark.one_in(7)
@EVERY_SCENE
def test_radial_velocity_in_double_precision(scene: Scene) -> None:
    before, after = ends(scene)
    truth = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    found = radial_velocity(before, after, scene.sensor_m, scene.duration_s)
    # The inputs are exact and every difference of two of them is rounded relative to
    # itself, so what is wrong is a few parts of the step (10 operations, 2 more to divide).
    speed = np.linalg.norm(after - before, axis=0).max() / scene.duration_s
    assert np.abs(found - truth).max() <= 12 * DOUBLE * speed
    assert np.isfinite(found).all()


@pytest.mark.one_in(7)
@EVERY_SCENE
def test_single_precision_is_as_good_as_predicted(scene: Scene) -> None:
    before, after = ends(scene)
    truth = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    # As prepared: around an origin near the body, which is taken off in double precision.
    origin = np.full(3, scene.offset_m)
    place = scene.sensor_m - origin
    near = [(points - origin[:, None]) for points in (before, after)]
    tolerance = velocity_error_mps(largest(*near), scene.duration_s)
    first, last = (points.astype(np.float32) for points in near)
    ranges = [relative_range(points, place).astype(float) for points in (first, last)]
    for found in (
        (ranges[0] - ranges[1]) / scene.duration_s,
        radial_velocity(first, last, place, scene.duration_s),
    ):
        assert np.abs(found - truth).max() <= tolerance


RAW = replace(
    PRESETS["paper"],
    visibility="none",
    null_bins=(),
    range_exponent=0.0,
    velocity_sigma_bins=0.0,
    time_sigma_s=0.0,
)
FRAMES = 5


def clip_of(scene: Scene, count: int = POINTS) -> MeshSequence:
    """Five frames around the scene's middle, as a point cloud in double precision."""
    number = np.arange(FRAMES) - FRAMES // 2
    vertices = scene.points(count).T + number[:, None, None] * scene.step(count).T
    return MeshSequence(vertices, None, Timebase.regular(FRAMES, scene.rate_hz), str(scene))


def assert_counted(
    column: NDArray[Any],
    velocity: NDArray[np.float64],
    axis: VelocityAxis,
    beyond: str,
    slack: float,
) -> None:
    """Each bin holds all that is certainly in it, and nothing that certainly is not."""
    width, v_max = axis.bin_width_mps, axis.v_max_mps
    place = velocity + v_max
    if beyond == "clip":
        place = np.clip(place, 0.0, 2 * v_max)
    elif beyond == "wrap":
        inside = (place >= 0) & (place <= 2 * v_max)
        place = np.where(inside, place, place % (2 * v_max))
    low = np.arange(axis.bins)[:, None] * width
    # Round the circle where it wraps; the two ends of the axis are closed.
    turns = (-2 * v_max, 0.0, 2 * v_max) if beyond == "wrap" else (0.0,)
    possible = np.zeros((axis.bins, len(place)), bool)
    for turn in turns:
        possible |= (place + turn >= low - slack) & (place + turn <= low + width + slack)
    certain = (place > low + slack) & (place < low + width - slack)
    if beyond == "clip":
        certain[0] |= place < width - slack
        certain[-1] |= place > 2 * v_max - width + slack
    assert (certain.sum(axis=1) <= column).all()
    assert (column <= possible.sum(axis=1)).all()
    if beyond != "drop":
        assert column.sum() == len(place)


def assert_scene_counted(scene: Scene) -> None:
    """Every vertex of the scene's middle frame in its bin, off the axis as asked."""
    mesh = clip_of(scene)
    middle = FRAMES // 2
    before, after = (np.asarray(mesh.vertices)[middle + step].T for step in (-1, 1))
    sensor = VirtualSensor(tuple(scene.sensor_m.tolist()))
    velocity = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    around = np.full(3, scene.offset_m)[:, None]
    extent_m = largest(before - around, after - around)
    # The axis that a user keeps, and one that the scene's own speeds spread over.
    for axis in (VelocityAxis(), VelocityAxis(32, 0.7 * scene.speed_mps)):
        # A hundredth of a bin is promised. Double precision, which is all there is,
        # rounds ranges 2^29 times as finely, and the times of the frames: the last of
        # four steps is good to an eighth of its own rounding.
        slack = SHARE_OF_A_BIN * axis.bin_width_mps
        slack += velocity_error_mps(extent_m, scene.duration_s) / 2**29
        slack += 8 * DOUBLE * scene.speed_mps
        for beyond in ("drop", "wrap", "clip"):
            maker = Synthesizer(mesh, replace(RAW, axis=axis, beyond=beyond))
            made = maker.map(sensor)
            assert np.isfinite(made.values).all()
            column = made.values[:, middle].astype(float) * POINTS
            np.testing.assert_allclose(column, np.rint(column), atol=1e-4)
            assert_counted(np.rint(column), velocity, axis, beyond, slack)
        # What is shown for each vertex is rounded to single at the end.
        shown = maker.frame(sensor, middle).velocity_mps
        assert np.abs(shown - velocity).max() <= slack + 2.0**-23 * scene.speed_mps


@pytest.mark.one_in(7)
@EVERY_SCENE
def test_every_vertex_is_counted_in_its_bin(scene: Scene) -> None:
    assert_scene_counted(scene)


@pytest.mark.one_in(7)
@EVERY_SCENE
def test_numpy_counts_every_vertex_in_its_bin(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    plainly(monkeypatch)
    assert_scene_counted(scene)


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers spread evenly over their logarithm."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: 10.0**power)


@given(
    st.builds(
        Scene,
        distance_m=decades(1e-3, 1e6),
        place=st.sampled_from(PLACES),
        speed_mps=decades(1e-9, 300.0),
        rate_hz=decades(1.0, 1e4),
        scale_m=decades(1e-3, 1e3),
        offset_m=st.sampled_from([0.0, -12.5, 1e6]),
    )
)
@settings(max_examples=60, derandomize=True)
def test_any_scene_is_counted(scene: Scene) -> None:
    assert_scene_counted(scene)


@pytest.mark.parametrize("start_s", [0.0, 1e5, 1.7e9])
def test_any_clock(start_s: float) -> None:
    scene = Scene(speed_mps=2.0)
    mesh = clip_of(scene)
    late = replace(mesh, timebase=mesh.timebase.shifted(start_s))
    chosen = replace(RAW, beyond="wrap", axis=VelocityAxis(254, 1.5))
    sensor = VirtualSensor(tuple(scene.sensor_m.tolist()))
    found = Synthesizer(late, chosen).map(sensor).values[:, 2].astype(float) * POINTS
    before, after = (np.asarray(mesh.vertices)[step].T for step in (1, 3))
    velocity = exact_velocities(before, after, scene.sensor_m, scene.duration_s)
    # Seconds since 1970 are good to 1.2e-7 s, twice in the 0.067 s of a velocity.
    slack = (SHARE_OF_A_BIN * chosen.axis.bin_width_mps) + scene.speed_mps * (
        2 * DOUBLE * (start_s + 1.0) / scene.duration_s
    )
    assert_counted(np.rint(found), velocity, chosen.axis, "wrap", slack)


@pytest.mark.parametrize(
    ("changes", "precision"),
    [
        ({}, np.float32),
        ({"rate_hz": 1e4}, np.float64),
        ({"scale_m": 1e3}, np.float64),
        ({"scale_m": 1e-3, "rate_hz": 1e4}, np.float32),
        ({"offset_m": 1e6}, np.float32),
        ({"distance_m": 1e6}, np.float32),
        ({"speed_mps": 300.0}, np.float32),
    ],
    ids=str,
)
def test_double_precision_only_where_it_is_needed(changes: Any, precision: Any) -> None:
    maker = Synthesizer(clip_of(Scene(**changes)), RAW)
    assert maker.prepared.block(0).frames.positions.dtype == precision
