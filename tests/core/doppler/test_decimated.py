"""The Doppler of a decimated mesh is a share of the vertices that there were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from doppler_scenes import CAMERA, moving, options, plate, sensor_at, wobbling
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence

SENSOR = sensor_at(0.3, -0.2, 0.1)


@pytest.mark.parametrize("weight", ["count", "area", "projected"])
def test_a_rigid_plate_gives_the_same_map(weight: Any) -> None:
    times = np.arange(8) / 30
    path = np.stack([0 * times, 0 * times, 6.0 - 1.3 * times], axis=1)
    mesh = moving(*plate(0.2, 20), path, times)
    small = decimate(mesh, 0.25)
    assert small.vertex_count < 0.35 * mesh.vertex_count
    chosen = options(weight=weight, visibility="facing", range_exponent=4.0)
    whole, part = (Synthesizer(each, chosen).stretch(CAMERA, 0, 8) for each in (mesh, small))
    # Where vertices are picked instead of placed, a few triangles fold over: they turn
    # away as much as they add.
    a, b, c = small.frame(0)[small.faces].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 2]
    folded = -turned[turned > 0].sum() / turned[turned < 0].sum()
    expected = whole.values * (1 - 2 * folded / (1 + folded) if weight == "projected" else 1)
    # From 5.7 m on, a corner is farther than the middle by 0.14²/2/5.7² = 3e-4 of the
    # range: cos θ / R⁴ varies by five times that, and so may its mean over any part.
    np.testing.assert_allclose(part.values, expected, rtol=1.5e-3)
    np.testing.assert_array_equal(part.visible_share, whole.visible_share)


@pytest.mark.parametrize("beyond", ["drop", "wrap", "clip"])
@pytest.mark.parametrize("velocity", ["central", "vid2doppler"])
def test_each_vertex_counts_for_those_it_stands_for(beyond: Any, velocity: Any) -> None:
    mesh = decimate(wobbling(12), 0.2)
    assert mesh.vertex_counts is not None
    chosen = options(beyond=beyond, velocity=velocity, axis=replace(options().axis, v_max_mps=0.7))
    maker = Synthesizer(mesh, chosen)
    stretch = maker.stretch(SENSOR, 0, 12, "none")
    low, high = chosen.axis.edges_mps[[0, -1]]
    for index in range(2, 10):
        speed = maker.frame(SENSOR, index, "none").velocity_mps.astype(float)
        outside = (speed < low) | (speed > high)
        folded = {
            "drop": speed,
            "clip": np.clip(speed, low, high),
            "wrap": np.where(outside, (speed - low) % (high - low) + low, speed),
        }[beyond]
        expected = np.histogram(folded, chosen.axis.edges_mps, weights=mesh.vertex_counts)[0]
        # Single precision may move a vertex over an edge, with all it stands for.
        one = mesh.vertex_counts.max() / mesh.represented_count
        difference = np.abs(stretch.values[:, index] - expected / mesh.represented_count)
        assert difference.max() <= one
        assert (difference > 1e-6).sum() <= 2
        share = mesh.vertex_counts[outside].sum() / mesh.represented_count
        assert abs(stretch.beyond_share[index] - share) <= one
    np.testing.assert_array_equal(stretch.visible_share, 1.0)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("visibility", ["none", "facing", "exact"])
@pytest.mark.parametrize(
    "changes", [{}, {"range_exponent": 4.0}, {"range_exponent": 4.0, "range_law": "frame"}], ids=str
)
def test_plain_form_gives_the_same(
    visibility: Any, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = decimate(wobbling(10), 0.3)
    assert mesh.vertex_counts is not None
    chosen = options(visibility=visibility, axis=replace(options().axis, v_max_mps=0.9), **changes)
    compiled = Synthesizer(mesh, chosen).stretch(SENSOR, 0, 10)
    plainly(monkeypatch)
    plain = Synthesizer(mesh, chosen).stretch(SENSOR, 0, 10)
    assert compiled.beyond_share.any()
    np.testing.assert_allclose(plain.visible_share, compiled.visible_share, atol=1e-6)
    # Fused multiplication may move a vertex over an edge, with all it stands for.
    one = mesh.vertex_counts.max() / mesh.represented_count
    assert np.abs(plain.beyond_share - compiled.beyond_share).max() <= one / 0.2
    assert np.abs(plain.values - compiled.values).max() <= one * 20
    assert (np.abs(plain.values - compiled.values) > 1e-5 * compiled.values.max()).sum() <= 4


def test_more_vertices_come_nearer_to_the_whole() -> None:
    mesh = wobbling(24, divisions=4)
    chosen = options(velocity_sigma_bins=1.0)
    whole = Synthesizer(mesh, chosen).map(SENSOR).values
    errors = [
        np.abs(Synthesizer(decimate(mesh, kept), chosen).map(SENSOR).values - whole).sum()
        / whole.sum()
        for kept in (0.02, 0.1, 0.5)
    ]
    assert errors[0] > errors[1] > errors[2], errors
    assert errors[2] < 0.1


def test_streamed_from_disk(tmp_path: Path) -> None:
    mesh = wobbling(200, divisions=2)
    stored = zarr.create_array(
        tmp_path / "mesh.zarr", shape=mesh.vertices.shape, chunks=(37, 324, 3), dtype="f4"
    )
    stored[:] = np.asarray(mesh.vertices)
    on_disk = decimate(MeshSequence(stored, mesh.faces, mesh.timebase, "zarr"), 0.5)
    small = decimate(mesh, 0.5)
    chosen = PRESETS["paper"]
    streamed = Synthesizer(on_disk, chosen, memory_budget_bytes=200_000)
    assert streamed.prepared.block_count > 8
    whole = Synthesizer(small, chosen).map(SENSOR)
    np.testing.assert_array_equal(streamed.map(SENSOR).values, whole.values)
    assert "decimated to" in whole.meta["source"]
