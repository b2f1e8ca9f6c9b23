"""Whole maps at the extremes: weights, visibility, long walks, and very many of everything."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from extreme_tables import Scene, every_scene, exact_ranges
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.reference import reference_stretch
from sd2core.errors import Sd2Error
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.numerics.precision import ROUNDING, velocity_error_mps
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

RAW = replace(
    PRESETS["paper"],
    null_bins=(),
    range_exponent=0.0,
    velocity_sigma_bins=0.0,
    time_sigma_s=0.0,
)
POINTS = 60


@pytest.fixture(scope="module", autouse=True)
def kernels() -> None:
    warm_up()


def ball(radius_m: float, divisions: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    import trimesh

    made = trimesh.creation.icosphere(subdivisions=divisions, radius=radius_m)
    return np.asarray(made.vertices), np.asarray(made.faces, np.int32)


def gesture(
    times_s: NDArray[np.float64], radius_m: float = 0.3, divisions: int = 2
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Two balls, one before the other, that sway at up to 1.5 m/s and breathe: (T, V, 3)."""
    vertices, faces = ball(radius_m, divisions)
    both = np.concatenate([vertices, 0.5 * vertices + radius_m * np.array([0.3, 0.2, -2.0])])
    phase = 2 * np.pi * np.outer(times_s, [0.6, 1.1, 1.7])
    sway = radius_m * np.array([[0.5, 0.2, -0.9], [0.1, 0.3, 0.4], [-0.2, 0.1, 0.3]])
    positions = both * (1 + 0.1 * np.sin(phase[:, 1]))[:, None, None]
    positions = positions + (np.sin(phase) @ sway)[:, None]
    return positions, np.concatenate([faces, faces + len(vertices)]).astype(np.int32)


def at(*place_m: float) -> VirtualSensor:
    return VirtualSensor((place_m[0], place_m[1], place_m[2]))


@pytest.mark.one_in(7)
@pytest.mark.parametrize("scene", every_scene(), ids=str)
@pytest.mark.parametrize("exponent", [4.0, 2.5])
def test_what_the_range_law_lets_through(scene: Scene, exponent: float) -> None:
    frames = np.arange(-1, 2)[:, None, None]
    vertices = scene.points(POINTS).T + frames * scene.step(POINTS).T
    mesh = MeshSequence(vertices, None, Timebase.regular(3, scene.rate_hz), str(scene))
    chosen = replace(RAW, visibility="none", beyond="clip", range_exponent=exponent)
    made = Synthesizer(mesh, chosen).map(at(*scene.sensor_m))
    ranges = np.array([float(value) for value in exact_ranges(vertices[1].T, scene.sensor_m)])
    near = np.maximum(ranges, NEAREST_RANGE_M)
    weights = (2.2 / near) ** exponent
    # The exponent times the range's own rounding, as predicted for single precision,
    # and some roundings of the power and of the sum.
    extent_m = float(np.abs(vertices - scene.offset_m).max())
    relative = exponent * velocity_error_mps(extent_m, 1.0) / near + 16 * ROUNDING
    found = made.values[:, 1].sum(dtype=np.float64) * POINTS
    assert abs(found - weights.sum()) <= (weights * np.minimum(relative, 0.01)).sum()


@pytest.mark.parametrize("distance_m", [1e-3, 0.03, 2.2, 300.0, 1e6])
@pytest.mark.parametrize("scale_m", [1e-3, 1.0, 1e3])
def test_area_that_is_turned_towards_the_sensor(scale_m: float, distance_m: float) -> None:
    vertices, faces = ball(scale_m, 2)
    path = vertices + 0.1 * scale_m * np.arange(3)[:, None, None] / 30.0
    mesh = MeshSequence(path, faces, Timebase.regular(3, 30.0), "ball")
    chosen = replace(RAW, weight="projected", visibility="none", beyond="clip")
    sensor = path[1, 7] * (1 + distance_m / scale_m)
    made = Synthesizer(mesh, chosen).map(at(*sensor))
    corner = path[1][faces]
    vectors = np.zeros_like(vertices)
    thirds = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 6
    np.add.at(vectors, faces.ravel(), np.repeat(thirds, 3, axis=0))
    ray = sensor - path[1]
    range_m = np.linalg.norm(ray, axis=1)
    projected = np.maximum((ray * vectors).sum(axis=1), 0) / range_m
    truth = projected.sum() / np.linalg.norm(thirds, axis=1).sum() / 3
    # Area vectors are rounded to single, positions to single around the clip's origin:
    # that turns the line of sight by so much of the range.
    slack = 8 * ROUNDING + 2 * ROUNDING * np.abs(path).max() / range_m.min()
    assert made.values[:, 1].sum(dtype=np.float64) == pytest.approx(truth, rel=0, abs=slack)


def damaged(kind: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The two balls, less whole."""
    vertices, faces = gesture(np.arange(6) / 30.0)
    if kind == "open":
        return vertices, faces[: len(faces) // 3]
    if kind == "duplicate vertices":
        return vertices[:, faces.ravel()], np.arange(faces.size, dtype=np.int32).reshape(-1, 3)
    if kind == "zero area":
        return vertices, np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]]).astype(np.int32)
    if kind == "slivers":
        between = 0.5 * (vertices[:, :40] + vertices[:, 1:41]) + 1e-9
        thin = np.stack([np.arange(40), np.arange(1, 41), vertices.shape[1] + np.arange(40)], 1)
        vertices = np.concatenate([vertices, between], axis=1)
        return vertices, np.concatenate([faces, thin]).astype(np.int32)
    fins = np.stack([faces[:30, 0], faces[:30, 1], np.arange(200, 230)], axis=1)
    return vertices, np.concatenate([faces, fins]).astype(np.int32)


@pytest.mark.one_in(7)
@pytest.mark.parametrize("weight", ["count", "area", "projected"])
@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
@pytest.mark.parametrize(
    "kind", ["open", "duplicate vertices", "zero area", "slivers", "not a manifold"]
)
@pytest.mark.parametrize("place_m", [(0.0, 0.0, -2.2), (0.0, 0.0, 0.0), (0.0, 0.0, 1e6)])
def test_damaged_surfaces(place_m: Any, kind: str, visibility: Any, weight: Any) -> None:
    vertices, faces = damaged(kind)
    mesh = MeshSequence(vertices, faces, Timebase.regular(6, 30.0), kind)
    chosen = replace(RAW, visibility=visibility, weight=weight, beyond="clip")
    values = Synthesizer(mesh, chosen).map(at(*place_m)).values.astype(np.float64)
    assert np.isfinite(values).all()
    assert (values >= 0).all()
    # Shares: at most everything, and everything where all count alike.
    share = values.sum(axis=0)
    assert (share <= 1 + 1e-5).all()
    if visibility == "none" and weight != "projected":
        np.testing.assert_allclose(share, 1.0, rtol=1e-5)


@pytest.mark.parametrize("exponent", [4.0, 8.0])
def test_a_map_too_faint_for_its_numbers_says_so(exponent: float) -> None:
    times = np.arange(6) / 30.0
    vertices, faces = gesture(times)
    mesh = MeshSequence(vertices, faces, Timebase(times), "balls")
    made = Synthesizer(mesh, replace(RAW, range_exponent=exponent)).map(at(0, 0, -1e6))
    assert np.isfinite(made.values).all()
    said = [note for note in made.meta["notes"] if "range law" in note]
    assert bool(said) == (exponent == 8.0)
    assert bool(made.values.any()) == (not said)


@pytest.mark.parametrize(
    ("offset_m", "dtype", "said"), [(0, np.float32, 0), (1e6, np.float32, 1), (1e6, np.float64, 0)]
)
def test_a_map_of_rounded_coordinates_says_so(offset_m: float, dtype: Any, said: int) -> None:
    times = np.arange(6) / 30.0
    vertices, faces = gesture(times)
    mesh = MeshSequence((vertices + offset_m).astype(dtype), faces, Timebase(times), "balls")
    notes = Synthesizer(mesh, RAW).map(at(offset_m, offset_m, offset_m - 2.2)).meta["notes"]
    assert len([note for note in notes if "single precision" in note]) == said


@pytest.mark.one_in(5)
@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
@pytest.mark.parametrize("weight", ["count", "area", "projected"])
@pytest.mark.parametrize("factor", [2.0**-10, 2.0**10])
def test_a_world_a_thousand_times_as_large_has_the_same_map(
    factor: float, weight: Any, visibility: Any
) -> None:
    # Body, sensor and speeds alike: powers of two change no digit. A body of 300 m is
    # counted in double precision, where a vertex may leave a bin that it only touched.
    times = np.arange(8) / 30.0
    vertices, faces = gesture(times)
    usual, large = (
        Synthesizer(
            MeshSequence(vertices * by, faces, Timebase(times), "balls"),
            replace(RAW, weight=weight, axis=VelocityAxis(32, 2.0 * by)),
        ).map(at(0.3 * by, 0.1 * by, -2.2 * by), visibility=visibility)
        for by in (1.0, factor)
    )
    assert usual.values.any()
    apart = np.abs(usual.values - large.values)
    assert apart.max() <= 1.001 * heaviest(vertices, faces, weight)
    assert (apart > 1e-6).sum() <= 4


def heaviest(vertices: NDArray[np.float64], faces: NDArray[np.int32], weight: str) -> float:
    """The largest share of the whole that one vertex can have."""
    if weight == "count":
        return 1.0 / vertices.shape[1]
    from oracles.surfaces import vertex_areas

    areas = vertex_areas(np.ascontiguousarray(vertices.transpose(0, 2, 1)), faces)
    return float((areas.max(axis=1) / areas.sum(axis=1)).max())


@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
@pytest.mark.parametrize("oversampling", [1, 8])
def test_ten_kilometres_down_the_road_nothing_has_changed(
    visibility: Any, oversampling: int
) -> None:
    times = np.arange(24) / 30.0
    vertices, faces = gesture(times)
    # Far out from the fourth frame on; the step is a jump that only its neighbours see.
    away = np.where(np.arange(24) < 4, 0.0, 1e4)[:, None, None] * np.array([0.6, 0.0, 0.8])
    here = MeshSequence(vertices, faces, Timebase(times), "here")
    there = MeshSequence(vertices + away, faces, Timebase(times), "there")
    chosen = replace(RAW, oversampling=oversampling)
    near = Synthesizer(here, chosen).map(at(0, 0, -2.2), visibility=visibility)
    far = Synthesizer(there, chosen).map(at(6e3, 0, 8e3 - 2.2), visibility=visibility)
    # Doubles end at 2e-12 m here, but shapes are rounded to single around another place.
    apart = np.abs(near.values - far.values)[:, 8:]
    assert apart.max() <= 1.001 / vertices.shape[1]
    assert (apart > 1e-6).sum() <= 6


@pytest.mark.one_in(5)
@pytest.mark.parametrize("weight", ["count", "projected"])
@pytest.mark.parametrize("visibility", ["facing", "depth", "exact"])
@pytest.mark.parametrize("away_m", [0.0, 1e4])
def test_numpy_makes_the_same_maps(
    away_m: float, visibility: Any, weight: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = np.arange(6) / 30.0
    vertices, faces = gesture(times)
    path = np.where(np.arange(6) < 1, 0.0, away_m)[:, None, None] * np.array([0.6, 0.0, 0.8])
    mesh = MeshSequence(vertices + path, faces, Timebase(times), "balls")
    chosen = replace(RAW, visibility=visibility, weight=weight, range_exponent=4.0)
    sensor = at(0.6 * away_m, 0.1, 0.8 * away_m - 2.2)
    compiled = Synthesizer(mesh, chosen).map(sensor).values
    plainly(monkeypatch)
    plain = Synthesizer(mesh, chosen).map(sensor).values
    # One rounding more or less decides a tie for a vertex or two.
    apart = np.abs(plain - compiled)
    assert (apart > 1e-5 * compiled.max()).sum() <= 4
    assert apart.max() <= 2 * 8.3 * heaviest(vertices, faces, weight)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("oversampling", [1, 8])
@pytest.mark.parametrize("weight", ["count", "area", "projected"])
@pytest.mark.parametrize(
    ("rate_hz", "away_m", "offset_m"),
    [(30.0, 0.0, 0.0), (1e4, 0.0, 0.0), (30.0, 1e4, 0.0), (1.0, 1e6, 0.0), (30.0, 0.0, 1e6)],
)
def test_whole_maps_against_the_reference(
    rate_hz: float, away_m: float, offset_m: float, weight: Any, oversampling: int
) -> None:
    times = np.arange(7) / rate_hz
    vertices, faces = gesture(times)
    # The body leaves the clip's first place after one frame.
    path = np.where(np.arange(7) < 1, 0.0, away_m)[:, None, None] * np.array([0.6, 0.0, 0.8])
    mesh = MeshSequence(vertices + path + offset_m, faces, Timebase(times), "balls")
    sensor = at(0.6 * away_m + offset_m, offset_m, 0.8 * away_m + offset_m - 2.2)
    chosen = replace(
        RAW, weight=weight, range_exponent=4.0, beyond="wrap", oversampling=oversampling
    )
    found = Synthesizer(mesh, chosen).map(sensor).values[:, 3:6]
    truth = reference_stretch(mesh, sensor, chosen, 3, 6)
    apart = np.abs(found - truth)
    # A vertex within a hundredth of a bin of an edge may change sides: 2 % of 324, of
    # which each changes two bins. Range weights are up to (2.2 / 1.3)^4 here.
    assert apart.max() <= 8.3 * heaviest(vertices, faces, weight)
    assert (apart > 1e-4 * truth.max()).sum() <= 6


PLACES_M = st.sampled_from([0.0, -0.0, 1e-12, -1e-3, 0.1, 1.0, -1.0, 1e3, 1e6, -1e6])


@pytest.mark.slow
@given(
    points=st.lists(st.tuples(PLACES_M, PLACES_M, PLACES_M), min_size=6, max_size=12),
    corners=st.lists(st.integers(0, 2), min_size=12, max_size=12),
    sensor_m=st.tuples(PLACES_M, PLACES_M, PLACES_M),
    rate_hz=st.sampled_from([1.0, 30.0, 1e4]),
    visibility=st.sampled_from(["none", "facing", "depth", "exact"]),
    weight=st.sampled_from(["count", "area", "projected"]),
    preset=st.sampled_from(list(PRESETS)),
    single=st.booleans(),
)
@settings(max_examples=150, derandomize=True)
def test_nothing_makes_what_is_not_a_number(
    points: Any,
    corners: Any,
    sensor_m: Any,
    rate_hz: float,
    visibility: Any,
    weight: Any,
    preset: str,
    single: bool,
) -> None:
    # Frames of three vertices each, at random corners of a very large room.
    count = len(points) // 3
    vertices = np.array(points[: 3 * count]).reshape(count, 3, 3)
    vertices = vertices.astype(np.float32 if single else np.float64)
    faces = np.array(corners, np.int32).reshape(-1, 3)
    mesh = MeshSequence(vertices, faces, Timebase.regular(count, rate_hz), "heap")
    chosen = replace(PRESETS[preset], visibility=visibility, weight=weight)
    maker = Synthesizer(mesh, chosen)
    values = maker.map(VirtualSensor(sensor_m)).values
    assert np.isfinite(values).all()
    assert (values >= 0).all()
    frame = maker.frame(VirtualSensor(sensor_m), 0)
    assert np.isfinite(frame.velocity_mps).all()
    assert np.isfinite(frame.range_m).all()


@pytest.mark.parametrize("preset", list(PRESETS))
@pytest.mark.parametrize("place_m", [(0.0, 0.0, 1e10), (math.nan, 0.0, 0.0), (0.0, -math.inf, 0.0)])
def test_no_sensor_is_beyond_the_moon(preset: str, place_m: Any) -> None:
    with pytest.raises(Sd2Error, match="up to 1e\\+09"):
        VirtualSensor(place_m)
    mesh = MeshSequence(*gesture(np.arange(4) / 30.0), Timebase.regular(4, 30.0), "balls")
    assert np.isfinite(Synthesizer(mesh, preset).map(at(0, 0, 1e9)).values).all()


@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
def test_one_vertex(visibility: Any) -> None:
    times = np.arange(5) / 30.0
    path = np.stack([0 * times, 0 * times, 3 - 1.3 * times], axis=1)[:, None]
    faces = None if visibility == "none" else np.array([[0, 0, 0]], np.int32)
    mesh = MeshSequence(path, faces, Timebase(times), "a point")
    made = Synthesizer(mesh, replace(RAW, visibility=visibility)).map(at(0, 0, 0))
    assert made.values[RAW.axis.bin_of(1.3), 2] == 1.0
    assert made.values.sum() == 5.0


@pytest.mark.parametrize("scale", [2.0**-10, 1.0, 2.0**10])
@pytest.mark.parametrize("offset_m", [0.0, 1e6])
def test_decimation_keeps_the_same_vertices_anywhere(scale: float, offset_m: float) -> None:
    vertices, faces = gesture(np.arange(3) / 30.0, divisions=3)
    clock = Timebase.regular(3, 30.0)
    usual = decimate(MeshSequence(vertices, faces, clock), 0.2)
    moved = decimate(MeshSequence(vertices * scale + offset_m, faces, clock), 0.2)
    assert usual.vertex_counts is not None
    assert moved.vertex_counts is not None
    # A power of two changes no digit. Many edges of these regular balls are equally good,
    # and at 10^6 m the last digits decide between them.
    kept = {tuple(point) for point in np.round(usual.frame(1), 5).tolist()}
    back = (moved.frame(1) - offset_m) / scale
    same = {tuple(point) for point in np.round(back, 5).tolist()}
    assert moved.vertex_count == usual.vertex_count
    assert len(kept & same) >= (0.8 if offset_m else 1.0) * usual.vertex_count
    assert moved.vertex_counts.sum() == vertices.shape[1]


@pytest.mark.slow
@pytest.mark.parametrize("visibility", ["facing", "depth", "exact"])
def test_a_million_vertices(visibility: Any) -> None:
    # 655,362 on a ball, and 327,680 loose ones that everyone sees.
    vertices, faces = ball(1.0, 8)
    loose = 1.5 * vertices[:: len(vertices) // 327_680][:327_680]
    both = np.concatenate([vertices, loose])
    times = np.arange(3) / 30.0
    path = both + (3.0 - 1.01 * times)[:, None, None] * np.array([0.0, 0.0, 1.0])
    mesh = MeshSequence(path.astype(np.float32), faces, Timebase(times), "a large ball")
    made = Synthesizer(mesh, replace(RAW, visibility=visibility)).map(at(0, 0, -1e3))
    seen = vertices[:, 2] < -1.0 / 1003.0
    share = made.values[:, 1].sum(dtype=np.float64) * len(both)
    # At the rim a vertex's normal, one edge of 0.004 rad and the buffer's bias (0.15 rad)
    # decide; loose vertices behind the ball are hidden.
    hidden = np.hypot(loose[:, 0], loose[:, 1]) < 1.0
    hidden &= loose[:, 2] > 0
    expected = seen.sum() + len(loose) - (0 if visibility == "facing" else hidden.sum())
    slack = {"facing": 0.01, "depth": 0.16, "exact": 0.005}[visibility]
    assert abs(share - expected) <= slack * len(both)


@pytest.mark.slow
def test_a_hundred_thousand_frames() -> None:
    # At 10,000 frames/s, streamed within a small budget: stretches give what a short clip
    # of the same motion gives.
    times = np.arange(100_000) / 1e4
    vertices, faces = gesture(times, divisions=0)
    mesh = MeshSequence(vertices, faces, Timebase(times), "long")
    bare = replace(RAW, range_exponent=4.0)
    whole = Synthesizer(mesh, bare, memory_budget_bytes=64 << 20).map(at(0, 0, -2.2)).values
    assert whole.shape == (32, 100_000)
    assert np.isfinite(whole).all()
    for start in (0, 12_345, 99_000):
        part = slice(start, start + 1000)
        short = MeshSequence(vertices[part], faces, Timebase(times[part] - times[start]), "short")
        alone = Synthesizer(short, bare).map(at(0, 0, -2.2)).values
        inside = slice(start + 1, start + 999)
        apart = np.abs(whole[:, inside] - alone[:, 1:-1])
        # Times at 10 s end at 2e-15 s, of 2e-4 s: velocities are the same to 1e-11, and a
        # vertex in ten million may leave a bin that it only touched.
        assert (apart > 1e-5 * whole.max()).sum() <= 2
