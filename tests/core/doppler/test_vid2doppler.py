"""The compatibility preset against an independent restatement of that tool."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, sensor_at, wobbling
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from sd2core.doppler import Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase


def restated(
    vertices: NDArray[Any], frames_per_s: float, sensor: VirtualSensor, seen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Histogram (32, T) of vertices (T, V, 3) of which ``seen`` (T, V) count."""
    place = vertices.astype(np.float64) - np.array(sensor.position_m)
    velocity = np.zeros(place.shape[:2])
    step = place[1:] - place[:-1]
    velocity[1:] = -np.einsum("tvi,tvi->tv", step, place[1:]) * frames_per_s
    velocity[1:] /= np.linalg.norm(place[1:], axis=2)
    mean = np.stack(
        [np.convolve(velocity[:, v], np.ones(5) / 5, mode="same") for v in range(place.shape[1])],
        axis=1,
    )
    rows = []
    for now, counted in zip(mean, seen, strict=True):
        row = np.histogram(now[counted], bins=32, range=(-2, 2))[0].astype(float)
        row[[14, 15, 16]] = 0
        rows.append(gaussian_filter1d(row / place.shape[1], 5))
    return np.array(rows).T


@pytest.mark.parametrize("visibility", ["none", "exact", "facing"])
@pytest.mark.parametrize("single", [True, False])
def test_against_the_restatement(visibility: Any, single: bool) -> None:
    mesh = wobbling(40, divisions=2)
    vertices = np.asarray(mesh.vertices)
    if not single:
        vertices = vertices.astype(np.float64) * 1.0000001
        mesh = MeshSequence(vertices, mesh.faces, mesh.timebase, "double")
    sensor = sensor_at(0.2, -0.1, 0.05)
    maker = Synthesizer(mesh, "vid2doppler")
    seen = np.stack([maker.frame(sensor, k, visibility).visible for k in range(40)])
    values = maker.map(sensor, visibility=visibility).values
    expected = restated(vertices, mesh.timebase.frames_per_s, sensor, seen)
    assert expected.max() > 1e-3
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-6)


def test_on_the_walker(shared_data: Path) -> None:
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        vertices, faces, times = data["vertices"][:30], data["faces"], data["times_s"][:30]
    mesh = MeshSequence(vertices, faces, Timebase(times), "walk.npz")
    values = Synthesizer(mesh, "vid2doppler").map(CAMERA, visibility="none").values
    seen = np.ones(vertices.shape[:2], bool)
    expected = restated(vertices, mesh.timebase.frames_per_s, CAMERA, seen)
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-6)


def test_stretches_join_without_a_seam() -> None:
    mesh = wobbling(30, divisions=2)
    whole = Synthesizer(mesh, "vid2doppler").map(CAMERA).values
    budget = mesh.vertex_count * 12 * 64
    in_blocks = Synthesizer(mesh, "vid2doppler", memory_budget_bytes=budget)
    assert in_blocks.prepared.block_count > 2
    np.testing.assert_array_equal(in_blocks.map(CAMERA).values, whole)
    parts = [in_blocks.stretch(CAMERA, a, b).values for a, b in ((0, 3), (3, 17), (17, 30))]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


@pytest.mark.parametrize("beyond", ["wrap", "clip"])
def test_other_policies_lose_nothing(beyond: Any) -> None:
    from dataclasses import replace

    from sd2core.doppler import PRESETS
    from sd2core.sensor import VelocityAxis

    chosen = replace(
        PRESETS["vid2doppler"],
        beyond=beyond,
        axis=VelocityAxis(32, 0.5),
        null_bins=(),
        velocity_sigma_bins=0.0,
    )
    made = Synthesizer(wobbling(20, divisions=2), chosen).map(CAMERA, visibility="none")
    np.testing.assert_allclose(made.values.sum(axis=0), 1.0, rtol=1e-6)
    assert np.mean(made.meta["beyond_share"]) > 0.1
