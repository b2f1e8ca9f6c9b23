"""Counting only what moves: the same numbers as counting everything."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from oracles.counting import places

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.histogram import Counting, Frames, place_in_bins
from sd2core.doppler.kernels import DROP
from sd2core.doppler.moving import find_moving, still_bins
from sd2core.doppler.moving_kernels import GROUP
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.prepared import PreparedMesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FRAMES, RATE = 9, 30.0


@pytest.fixture(autouse=True, scope="module")
def _compiled(compiled_kernels: None) -> None:
    """The plain form counts everything."""


def body(seed: int, share: float, away_m: float, counts: bool) -> MeshSequence:
    """A ball of 162 vertices; a share of them mostly moves, by up to 0.6 m/s, the others hardly."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.4)
    speed_mps = rng.uniform(0.0, 0.1, (FRAMES, len(ball.vertices), 1))
    mostly = rng.random((FRAMES, len(ball.vertices), 1)) < 0.8
    moves = mostly & (rng.random((len(ball.vertices), 1)) < share)
    speed_mps = np.where(moves, rng.uniform(0.05, 0.6, speed_mps.shape), speed_mps)
    way = rng.normal(size=(FRAMES, len(ball.vertices), 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    places = ball.vertices + np.cumsum(speed_mps * way / RATE, axis=0)
    places[:, :, 2] += away_m
    numbers = rng.integers(1, 4, len(ball.vertices)) if counts else None
    return MeshSequence(
        places.astype(np.float32),
        np.asarray(ball.faces, np.int32),
        Timebase(np.arange(FRAMES) / RATE),
        vertex_counts=numbers,
    )


OPTIONS = st.builds(
    lambda **changes: replace(PRESETS["paper"], **changes),
    visibility=st.sampled_from(("none", "facing", "exact", "depth")),
    weight=st.sampled_from(("count", "area", "projected")),
    null_bins=st.sampled_from(((), (14, 15, 16), (15, 16), (16,), (12, 13, 14, 15, 16, 17))),
    beyond=st.sampled_from(("drop", "wrap", "clip")),
    oversampling=st.sampled_from((1, 2, 3, 8)),
    trajectory_smoothing_s=st.sampled_from((0.0, 0.05)),
    range_exponent=st.sampled_from((0.0, 2.0, 4.0, 3.3)),
    range_law=st.sampled_from(("vertex", "frame")),
    mask_stride=st.sampled_from((1, 3)),
)


def everything(mesh: MeshSequence, options: SynthesisOptions) -> Synthesizer:
    """A synthesizer that counts all vertices."""

    class Dense(PreparedMesh):
        def moving(self, *_: object) -> None:
            return None

    made = Synthesizer(mesh, options)
    made.prepared.__class__ = Dense
    return made


@given(
    seed=st.integers(0, 10**6),
    share=st.sampled_from((0.0, 0.05, 0.2, 0.9)),
    away_m=st.sampled_from((2.0, 30.0, 5000.0)),
    counts=st.booleans(),
    options=OPTIONS,
    place=st.tuples(*[st.floats(-3.0, 3.0)] * 3) | st.just((1e9, -3e8, 2.0)),
    split=st.booleans(),
)
def test_the_same_map_bit_by_bit(
    seed: int,
    share: float,
    away_m: float,
    counts: bool,
    options: SynthesisOptions,
    place: tuple[float, float, float],
    split: bool,
) -> None:
    mesh, sensor = body(seed, share, away_m, counts), VirtualSensor(position_m=place)
    numbers = np.random.default_rng(seed).integers(0, 3, mesh.vertex_count).astype(np.uint8)
    parts = VertexParts(("a", "b", "c"), numbers) if split else None
    whole, sparse = everything(mesh, options), Synthesizer(mesh, options)
    wanted = whole.stretch(sensor, 0, FRAMES, parts=parts)
    found = sparse.stretch(sensor, 0, FRAMES, parts=parts)
    quick = sparse.stretch(sensor, 2, 7, parts=parts, shares=False)
    light = Synthesizer(mesh, options).stretch(sensor, 2, 7, parts=parts, shares=False)
    if split:
        assert found.limbs is not None
        assert wanted.limbs is not None
        np.testing.assert_array_equal(found.limbs.values, wanted.limbs.values)
    for name in ("values", "raw", "visible_share", "beyond_share"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name), name)
    np.testing.assert_array_equal(quick.values, wanted.values[:, 2:7])
    np.testing.assert_array_equal(light.values, quick.values)
    assert quick.visible_share is None


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
def test_most_vertices_are_left_out_where_few_move(share: float) -> None:
    made = Synthesizer(body(1, share, 2.0, counts=False), PRESETS["paper"])
    block = made.prepared.block(0)
    moving = made.prepared.moving(block, made._frames.counting)
    assert moving is not None
    groups = -(-FRAMES // GROUP)
    assert len(moving.vertex) <= 1.3 * share * groups * made.mesh.vertex_count
    restless = Synthesizer(body(1, 0.9, 2.0, counts=False), PRESETS["paper"])
    assert restless.prepared.moving(restless.prepared.block(0), made._frames.counting) is None


def test_a_plate_that_sinks_slowly_past_the_sensor_is_seen_from_then_on() -> None:
    """Slower than any bin that is kept; it keeps its normal, which points up."""
    corners = np.array([(x, y, 0.0) for x in (1.0, 2.0) for y in (-1.0, 0.0, 1.0)])
    faces = np.array([(0, 3, 1), (1, 3, 4), (1, 4, 2), (2, 4, 5)], np.int32)
    height_m = 0.00525 - 0.001 * np.arange(FRAMES)
    places = (corners + height_m[:, None, None] * (0, 0, 1)).astype(np.float32)
    plate = MeshSequence(places, faces, Timebase(np.arange(FRAMES) / RATE))
    seen = Synthesizer(plate).map(VirtualSensor(), visibility="facing").meta["visible_share"]
    assert seen == (height_m < 0).tolist()


def test_maps_of_what_moves_keep_a_quarter_of_the_mesh() -> None:
    """Of a ball of which a twentieth moves at a time, as a body's gestures do."""
    mesh, options = body(3, 0.02, 2.0, counts=False), replace(PRESETS["paper"], visibility="facing")
    whole, light = everything(mesh, options), Synthesizer(mesh, options)
    for made in (whole, light):
        made.stretch(VirtualSensor(), 0, FRAMES, shares=False)
    assert light.prepared.budget.used_bytes < 0.25 * whole.prepared.budget.used_bytes
    # What needs the rest reads it again.
    wanted, found = (made.map(VirtualSensor(), visibility="exact") for made in (whole, light))
    np.testing.assert_array_equal(found.values, wanted.values)
    assert found.meta["visible_share"] == wanted.meta["visible_share"]


@given(data=st.data(), precision=st.sampled_from((np.float32, np.float64)))
def test_what_is_left_out_is_in_an_emptied_bin_from_any_place(data: Any, precision: Any) -> None:
    """Vertices that move straight to or from the sensor at just about the limit."""
    seed, extent_m = data.draw(st.integers(0, 10**6)), data.draw(st.sampled_from((0.5, 3.0, 60.0)))
    rng = np.random.default_rng(seed)
    counting = Counting(32, 2.0, DROP, 0.0, 2.2)
    null_bins = data.draw(st.sampled_from(((14, 15, 16), (15, 16), (13, 14, 15, 16, 17, 18))))
    limit_mps = still_bins(32, null_bins) * 0.125
    sensor = rng.normal(size=3) * 10.0 ** data.draw(st.integers(-1, 6))
    middle = rng.uniform(-extent_m, extent_m, (3, 400))
    ray = (middle - sensor[:, None]) / np.linalg.norm(middle - sensor[:, None], axis=0)
    off = 10.0 ** -data.draw(st.integers(1, 7)) * rng.uniform(-1, 1, 400)
    half_m = 0.5 * limit_mps * (1.0 + off) * rng.choice((-1.0, 1.0), 400) * (2 / RATE) * ray
    positions = np.stack([middle - half_m, middle, middle + half_m]).astype(precision)
    frames = Frames(
        positions, np.array([1]), np.array([[0]]), np.array([[2]]), np.array([[2 / RATE]])
    )
    reach_m = float(np.abs(positions).max())
    moving = find_moving(frames, reach_m, counting, still_bins(32, null_bins))
    if moving is None:
        return
    number, _ = place_in_bins(places(frames, 0, 0, sensor[None], counting), counting)
    left_out = np.setdiff1d(np.arange(400), moving.vertex)
    assert set(number[left_out]) <= set(null_bins)


@pytest.mark.parametrize(
    ("null_bins", "still"),
    [((), 0.0), ((14, 15, 16), 1.0), ((15, 16), 1.0), ((16,), 0.0), ((3, 13, 14, 15, 16, 17), 2.0)],
)
def test_nearest_kept_bin(null_bins: tuple[int, ...], still: float) -> None:
    assert still_bins(32, null_bins) == still
