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
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor
from tools.build_sample.swipes import posed

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


def test_expected_map(
    benchmark: Any, sample: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    """Target: an expected facing map while the sensor moves takes 30 ms on two idle cores."""
    facing = replace(PRESETS["paper"], visibility="facing")
    plain, spread = (
        Synthesizer(sample, replace(facing, count=count)) for count in ("plain", "expected")
    )
    vertices, moves = np.array(sample.read(0, sample.frame_count)), iter(range(1, 10**6))

    def moved(maker: Synthesizer) -> None:
        place = VirtualSensor((1e-3 * next(moves), 0.0, 0.0))
        maker.stretch(place, 0, sample.frame_count, shares=False)

    for maker in (plain, spread):
        maker.prepare()
        moved(maker)
    copy_s, plain_s, spread_s = np.min(
        [
            [best_s(one, 1) for one in (vertices.copy, lambda: moved(plain), lambda: moved(spread))]
            for _ in range(20)
        ],
        axis=0,
    )
    with capsys.disabled():
        print(
            f"\nexpected facing map of {sample.frame_count} frames of {sample.vertex_count}"
            f" vertices: {1e3 * spread_s:.1f} ms, {spread_s / plain_s:.1f} x the plain map,"
            f" {spread_s / copy_s:.1f} x a copy of the mesh"
        )
    assert spread_s <= 60 * copy_s
    benchmark.pedantic(lambda: moved(spread), rounds=10)


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
