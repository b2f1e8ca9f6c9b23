"""The double-precision histogram: right where the answer is known, and what speed gives up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doppler_scenes import (
    CAMERA,
    RAW,
    moving,
    options,
    plate,
    reference_velocities,
    sensor_at,
    wobbling,
)
from numpy.typing import NDArray
from oracles.surfaces import vertex_areas

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.doppler.reference import reference_stretch
from sd2core.io.mesh import load_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

SENSOR = sensor_at(0.3, -0.2, 0.1)
TIMES_S = np.arange(9) / 30

RANGE_ERROR = 7e-7
"""Of a change of range in single precision, in metres per metre from the clip's origin."""


def test_a_tilted_plate_at_a_range() -> None:
    vertices, faces = plate(0.01)
    cos, sin = np.cos(0.7), np.sin(0.7)
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 4.0 - 1.3 * TIMES_S], axis=1)
    mesh = moving(vertices @ [[1, 0, 0], [0, cos, sin], [0, -sin, cos]], faces, path, TIMES_S)
    factors = {"count": 1.0, "area": 1.0, "projected": cos}
    for weight, factor in factors.items():
        for law in ("vertex", "frame"):
            chosen = options(weight=weight, range_exponent=4.0, range_law=law)
            raw = reference_stretch(mesh, CAMERA, chosen, 0, 9)
            expected = factor * (2.2 / path[:, 2]) ** 4
            # The plate is 0.01 m wide: nothing varies over it by more than half a percent,
            # and its mean by the square of that.
            np.testing.assert_allclose(raw[RAW.axis.bin_of(1.3)], expected, rtol=1e-4)
            assert not np.delete(raw, RAW.axis.bin_of(1.3), axis=0).any()


@pytest.mark.parametrize(
    ("beyond", "home"), [("drop", None), ("clip", 31), ("wrap", RAW.axis.bin_of(2.45 - 4.0))]
)
def test_beyond_the_axis(beyond: Any, home: int | None) -> None:
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 6.0 - 2.45 * TIMES_S], axis=1)
    raw = reference_stretch(
        moving(*plate(0.1), path, TIMES_S), CAMERA, options(beyond=beyond), 2, 5
    )
    expected = np.zeros((32, 3))
    if home is not None:
        expected[home] = 1.0
    np.testing.assert_allclose(raw, expected, atol=1e-12)


@pytest.mark.parametrize("every", [1, 2, 3, 8])
def test_velocities_of_uniform_acceleration(every: int) -> None:
    range_m = 5.0 - 18.0 * (TIMES_S - TIMES_S[4]) ** 2
    path = np.stack([0 * range_m, 0 * range_m, range_m], axis=1)
    mesh = moving(np.zeros((1, 3)), None, path, TIMES_S)
    chosen = options(visibility="none", oversampling=every)
    for frame in range(2, 7):
        moments = (np.arange(every) - (every - 1) / 2) / every / 30 + TIMES_S[frame] - TIMES_S[4]
        found = reference_velocities(mesh, CAMERA, chosen, frame)
        np.testing.assert_allclose(found[:, 0], 36.0 * moments, atol=1e-11)


def test_it_sees_what_nothing_hides() -> None:
    mesh = wobbling(6)
    raw = reference_stretch(mesh, SENSOR, options(beyond="clip"), 0, 6)
    maker = Synthesizer(mesh, options())
    seen = [maker.frame(SENSOR, index).visible.mean() for index in range(6)]
    np.testing.assert_allclose(raw.sum(axis=0), seen, rtol=1e-12)


def test_one_frame_and_no_surface_give_an_empty_map() -> None:
    one = wobbling(1, divisions=1)
    for preset in PRESETS.values():
        assert not reference_stretch(one, CAMERA, preset, 0, 1).any()
    flat = MeshSequence(
        np.asarray(wobbling(4, divisions=1).vertices), np.array([[0, 0, 1]]), Timebase(TIMES_S[:4])
    )
    assert not reference_stretch(flat, CAMERA, options(weight="area"), 0, 4).any()


def assert_within_rounding(
    mesh: MeshSequence, sensor: VirtualSensor, chosen: SynthesisOptions, start: int, stop: int
) -> None:
    """The fast map differs by the vertices whose velocity is within rounding of an edge."""
    maker = Synthesizer(mesh, chosen)
    fast = maker.stretch(sensor, start, stop).raw
    truth = reference_stretch(mesh, sensor, chosen, start, stop)
    assert truth.any()
    first = mesh.frame(0).astype(float)
    origin = 0.5 * (first.min(axis=0) + first.max(axis=0))
    edges, width = chosen.axis.edges_mps, chosen.axis.bin_width_mps
    # An edge between two emptied bins, or off the axis, changes nothing.
    kept = np.ones(chosen.axis.bins + 2, bool)
    kept[1 + np.array(chosen.null_bins, int)] = False
    matters = kept[:-1] | kept[1:]
    total_allowed = 0.0
    steps_s = np.diff(mesh.times_s).min() / chosen.oversampling
    for column, frame in enumerate(range(start, stop)):
        points = mesh.frame(frame).astype(float)
        slack = RANGE_ERROR * np.linalg.norm(points - origin, axis=1).max() / steps_s
        velocities = reference_velocities(mesh, sensor, chosen, frame)
        # The axis is a whole number of bins, so folding moves no edge.
        bins = (velocities - edges[0]) / width
        edge = np.rint(bins)
        on_axis = (edge >= 0) & (edge <= chosen.axis.bins)
        number = np.mod(edge, chosen.axis.bins).astype(int)
        number[on_axis] = edge[on_axis]
        near = np.abs(bins - edge) * width <= slack
        near &= matters[number] & (on_axis | (chosen.beyond == "wrap"))
        near &= maker.frame(sensor, frame).visible
        allowed = (near.sum(axis=0) @ most_each(mesh, sensor, chosen, points)) / len(velocities)
        total_allowed += allowed
        difference = np.abs(fast[:, column] - truth[:, column])
        assert difference.sum() <= 2 * allowed + 1e-6 * truth[:, column].sum()
    # The bound says something: it is far below what is there.
    assert 2 * total_allowed <= 0.05 * truth.sum()


def most_each(
    mesh: MeshSequence, sensor: VirtualSensor, chosen: SynthesisOptions, points: NDArray[Any]
) -> NDArray[np.float64]:
    """The most that each vertex can count, as a share of the map's total."""
    counts = np.ones(len(points)) if mesh.vertex_counts is None else mesh.vertex_counts
    weight = counts / mesh.represented_count
    if chosen.weight != "count":
        assert mesh.faces is not None
        areas = vertex_areas(points.T[None], mesh.faces)[0].astype(float)
        weight = areas / areas.sum()
    ranges = np.linalg.norm(points - sensor.position_m, axis=1)
    if chosen.range_law == "frame":
        ranges = np.linalg.norm(np.average(points, axis=0, weights=counts) - sensor.position_m)
    law = chosen.reference_range_m / np.maximum(ranges, NEAREST_RANGE_M)
    most: NDArray[np.float64] = weight * law**chosen.range_exponent
    return most


@pytest.mark.one_in(5)
@pytest.mark.parametrize("beyond", ["drop", "wrap", "clip"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"range_exponent": 4.0, "null_bins": (14, 15, 16)},
        {"range_exponent": 2.5, "range_law": "frame"},
        {"weight": "area"},
        {"weight": "projected", "range_exponent": 4.0},
        {"oversampling": 3},
        {"oversampling": 8, "trajectory_smoothing_s": 0.05},
        {"axis": VelocityAxis(17, 0.7)},
    ],
    ids=str,
)
def test_the_fast_way_agrees_but_for_edges(changes: dict[str, Any], beyond: Any) -> None:
    chosen = options(beyond=beyond, **changes)
    assert_within_rounding(wobbling(14), SENSOR, chosen, 0, 14)


@pytest.mark.parametrize("distance_m", [1.0, 100.0, 1e5])
def test_the_fast_way_agrees_from_afar(distance_m: float) -> None:
    sensor = sensor_at(0.48 * distance_m, 0.6 * distance_m, -0.64 * distance_m)
    assert_within_rounding(wobbling(8), sensor, options(), 0, 8)


def test_the_fast_way_agrees_on_a_decimated_mesh() -> None:
    mesh = decimate(wobbling(14), 0.3)
    assert_within_rounding(mesh, SENSOR, options(range_exponent=4.0), 0, 14)


@pytest.mark.parametrize("smoothing_s", [0.0, 0.05])
def test_vid2dopplers_numbers_are_the_same(smoothing_s: float) -> None:
    mesh = wobbling(12, divisions=2)
    chosen = replace(PRESETS["vid2doppler"], trajectory_smoothing_s=smoothing_s)
    fast = Synthesizer(mesh, chosen).stretch(SENSOR, 0, 12).raw
    np.testing.assert_allclose(reference_stretch(mesh, SENSOR, chosen, 0, 12), fast, atol=1e-15)


@pytest.mark.parametrize("every", [1, 8])
def test_on_the_walker(shared_data: Path, every: int) -> None:
    mesh = load_mesh(shared_data / "mesh" / "walk.npz")
    chosen = replace(PRESETS["paper"], oversampling=every, weight="count")
    assert_within_rounding(mesh, CAMERA, chosen, 40, 44)
