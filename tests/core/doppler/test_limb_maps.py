"""Limb maps are the same counts as the map's, apart for each part of the body."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import options, sensor_at, wobbling
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.maps import LimbMaps
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts

SENSOR = sensor_at(0.3, -0.2, 0.1)
MESH = wobbling(12, divisions=2)


def parted(mesh: MeshSequence, parts: int, seed: int = 3) -> VertexParts:
    numbers = np.random.default_rng(seed).integers(parts, size=mesh.vertex_count)
    return VertexParts(tuple(f"part {number}" for number in range(parts)), numbers.astype(np.uint8))


@settings(max_examples=25, deadline=None)
@given(
    parts=st.integers(1, 14),
    visibility=st.sampled_from(["none", "facing", "exact"]),
    weight=st.sampled_from(["count", "area", "projected"]),
    beyond=st.sampled_from(["drop", "wrap", "clip"]),
    velocity=st.sampled_from(["central", "vid2doppler"]),
    exponent=st.sampled_from([0.0, 4.0]),
    compiled=st.booleans(),
)
def test_the_parts_add_up_to_the_map(
    parts: int,
    visibility: Any,
    weight: Any,
    beyond: Any,
    velocity: Any,
    exponent: float,
    compiled: bool,
) -> None:
    chosen = replace(
        PRESETS["paper"],
        visibility=visibility,
        weight=weight,
        beyond=beyond,
        velocity=velocity,
        range_exponent=exponent,
    )
    with pytest.MonkeyPatch.context() as patch:
        if not compiled:
            plainly(patch)
        maker = Synthesizer(MESH, chosen)
        whole = maker.map(SENSOR)
        found = maker.limb_maps(SENSOR, parted(MESH, parts))
    assert found.limbs is not None
    assert found.limbs.values.shape == (parts, 32, 12)
    np.testing.assert_allclose(found.values, whole.values, rtol=1e-6, atol=1e-12)
    scale = max(float(whole.values.max()), 1e-9)
    total = found.limbs.values.sum(axis=0, dtype=np.float64)
    np.testing.assert_allclose(total, whole.values, rtol=1e-5, atol=1e-6 * scale)


@pytest.mark.parametrize("velocity", ["central", "vid2doppler"])
@pytest.mark.parametrize("compiled", [True, False])
def test_a_part_is_the_map_of_its_vertices_alone(
    velocity: Any, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled:
        plainly(monkeypatch)
    cloud = replace(MESH, faces=None)
    chosen = options(visibility="none", velocity=velocity)
    parts = parted(cloud, 3)
    found = Synthesizer(cloud, chosen).limb_maps(SENSOR, parts)
    assert found.limbs is not None
    for number, values in enumerate(found.limbs.values):
        rows = parts.numbers == number
        alone = replace(cloud, vertices=cloud.read(0, 12)[:, rows])
        expected = Synthesizer(alone, chosen).map(SENSOR).values * rows.mean()
        # Around another origin a vertex may fall on the other side of an edge.
        assert np.abs(values - expected).sum(axis=0).max() < 3.0 / cloud.vertex_count


def test_a_vertex_of_a_decimated_mesh_counts_for_those_it_stands_for() -> None:
    mesh = decimate(wobbling(8), 0.3)
    maker = Synthesizer(mesh, options(visibility="none"))
    found = maker.limb_maps(SENSOR, parted(mesh, 4))
    assert found.limbs is not None
    np.testing.assert_allclose(
        found.limbs.values.sum(axis=0), maker.map(SENSOR).values, rtol=1e-5, atol=1e-7
    )


def test_some_frames_are_columns_of_the_whole() -> None:
    maker = Synthesizer(MESH)
    parts = parted(MESH, 3)
    whole, some = maker.limb_maps(SENSOR, parts), maker.limb_maps(SENSOR, parts, frames=(4, 9))
    assert whole.limbs is not None
    assert some.limbs is not None
    np.testing.assert_array_equal(some.limbs.values, whole.limbs.values[..., 4:9])
    np.testing.assert_array_equal(whole.between(4, 9).limbs.values, some.limbs.values)  # type: ignore[union-attr]


def test_parts_of_another_mesh_are_refused() -> None:
    other = VertexParts(("all",), np.zeros(MESH.vertex_count + 1, np.uint8))
    with pytest.raises(Sd2Error, match=rf"{MESH.vertex_count + 1} vertices.*{MESH.vertex_count}"):
        Synthesizer(MESH).limb_maps(SENSOR, other)
    with pytest.raises(Sd2Error, match="numbers up to 2"):
        VertexParts(("a", "b"), np.array([0, 1, 2], np.uint8))
    with pytest.raises(Sd2Error, match="at least one part"):
        LimbMaps(("a",), np.zeros((2, 32, 3), np.float32))
