"""What is done for a fitted mesh: posing its surface, and finding how well its map is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from timing import best_s

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body
from sd2core.body.rotations import about
from sd2core.body.skinning import pose_vertices
from sd2core.doppler import Synthesizer
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor
from tools.build_sample.posing import posed

FRAMES = 64


@pytest.fixture(scope="module", autouse=True)
def kernels() -> None:
    warm_up()


def test_posing_the_finest_surface(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    body = Body.load("high")
    random = np.random.default_rng(0)
    turns = np.tile(np.eye(3), (FRAMES, len(body.skeleton), 1, 1))
    for bone in range(len(body.skeleton)):
        axis = random.normal(size=3)
        turns[:, bone] = about(axis / np.linalg.norm(axis), random.uniform(-30, 30, FRAMES))
    transforms = body.skeleton.transforms(turns)
    slots_s = best_s(lambda: posed(body, turns), 3)
    kernel_s = benchmark.pedantic(lambda: best_s(lambda: pose_vertices(body, transforms), 5))
    with capsys.disabled():
        print(
            f"\nposing {len(body.vertices_m)} vertices: {1e3 * kernel_s / FRAMES:.2f} ms/frame,"
            f" {slots_s / kernel_s:.0f} x as fast as slot by slot"
        )
    assert slots_s >= 8 * kernel_s


@pytest.fixture(scope="module")
def sample() -> MeshSequence:
    """The bundled sample, as if its arms were known to ±0.2 m/s."""
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    body = next(
        body
        for body in map(Body.load, ("low", "medium", "high"))
        if len(body.vertices_m) == mesh.vertex_count
    )
    sigma = np.array([0.2 if "arm" in limb or "hand" in limb else 0.03 for limb in LIMBS])
    along = np.tile(sigma, (mesh.frame_count, 1))
    known = VelocityUncertainty(LIMBS, vertex_limbs(body), along, 0.3 * along)
    return replace(mesh, uncertainty=known)


def test_finding_how_well_a_map_is_known(
    benchmark: Any, sample: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    maker = Synthesizer(sample)
    maker.prepare()
    moves = iter(np.arange(1, 100) * 1e-3)
    map_s = best_s(lambda: maker.map(VirtualSensor((next(moves), 0.0, 0.0))), 3)
    sensor = VirtualSensor()
    maker.map(sensor)
    spent_s = benchmark.pedantic(lambda: best_s(lambda: maker.uncertainty(sensor), 3))
    with capsys.disabled():
        print(
            f"\nuncertainty of {sample.frame_count} frames of {sample.vertex_count} vertices:"
            f" {spent_s:.2f} s, {spent_s / map_s:.1f} x the exact map"
        )
    assert spent_s <= 8 * map_s
