"""What the FMCW simulation costs and how far it is from a converged one, in one run.

One frame and convergence: the real walk seen from the camera, 13,718 vertices and
27,420 triangles, of which nothing hides some 13,000; 7,400 of these, evenly chosen,
stand for the size that the limits are written for. The whole clip: the bundled
recording, 450 frames. What a run measures is printed; ratios and limits are asserted.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from timing import best_s

from sd2core.compiled import worker_count
from sd2core.fmcw import WaveOptions, simulate_radar
from sd2core.fmcw.kernels import compile_kernels
from sd2core.fmcw.sums import Echoes, direct, nufft
from sd2core.fmcw.wave import WaveScene
from sd2core.io.mesh import load_mesh
from sd2core.mesh import MeshSequence
from sd2core.progress import Cancelled
from sd2core.resources import resource_path
from sd2core.sensor import PAPER_RADAR, VirtualSensor
from sd2core.simulate.sample import facet_visibility
from sd2core.timebase import Timebase

FRAMES = 450
FACETS = 7400
CAMERA = VirtualSensor()


@pytest.fixture(scope="module")
def mesh(shared_data: Path) -> MeshSequence:
    compile_kernels()
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        vertices, faces = data["vertices"], data["faces"]
    there_and_back = np.abs((np.arange(FRAMES) + 88) % 176 - 88)
    return MeshSequence(vertices[there_and_back], faces, Timebase.regular(FRAMES, 30.0), "walk")


@pytest.fixture(scope="module")
def visible(mesh: MeshSequence) -> NDArray[np.bool_]:
    """Facets that nothing hides, (450, F), looked at once per pose."""
    once = MeshSequence(mesh.read(0, 89), mesh.faces, Timebase.regular(89, 30.0))
    pose = facet_visibility(once, CAMERA)
    back = np.abs((np.arange(FRAMES) + 88) % 176 - 88) - np.abs((0 + 88) % 176 - 88)
    return pose[np.abs(back) % 89]


@pytest.mark.benchmark(group="FMCW, one frame")
def test_one_frame(
    benchmark: Any,
    mesh: MeshSequence,
    visible: NDArray[np.bool_],
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene = WaveScene(mesh, PAPER_RADAR, CAMERA)
    position, velocity = scene.scene.moving(40 / 30)
    shown = np.flatnonzero(visible[40])
    seen = np.zeros(len(scene.faces), np.bool_)
    seen[shown[np.linspace(0, len(shown) - 1, FACETS).astype(int)]] = True
    echoes = scene.echoes(position, velocity, seen)

    def frame() -> None:
        nufft(scene.echoes(position, velocity, seen), PAPER_RADAR)

    benchmark.pedantic(frame, rounds=100, warmup_rounds=5)
    # In turns, so that a busy machine slows both.
    whole, summed, factors = [], [], []
    for _ in range(3):
        whole.append(best_s(frame, 20))
        factors.append(best_s(lambda: scene.echoes(position, velocity, seen), 20))
        summed.append(best_s(lambda: direct(echoes, PAPER_RADAR), 1))
    ratio = min(summed) / min(whole)
    reference = direct(echoes, PAPER_RADAR)
    lines = [
        f"{len(echoes.amplitude)} of {len(scene.faces)} facets: {1e3 * min(whole):.2f} ms a frame"
        f" on one thread, {1e3 * min(factors):.2f} ms of it amplitudes and closed form;"
        f" direct complex128 sum {1e3 * min(summed):.0f} ms = {ratio:.0f} times as long"
    ]
    for blocks in (1, 2, 4, 64):
        apart = np.linalg.norm(nufft(echoes, PAPER_RADAR, blocks) - reference)
        spent = best_s(lambda blocks=blocks: nufft(echoes, PAPER_RADAR, blocks), 5)
        lines.append(
            f"  {blocks:2} blocks: {apart / np.linalg.norm(reference):.1e} from the direct sum,"
            f" {1e3 * spent:.2f} ms"
        )
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert len(echoes.amplitude) == FACETS
    assert min(whole) <= 0.006
    assert ratio >= 70


@pytest.mark.benchmark(group="FMCW, whole clip")
def test_whole_clip(
    benchmark: Any,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stored = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    mesh = MeshSequence(stored.read(0, FRAMES), stored.faces, stored.timebase, "swipes")
    visible = facet_visibility(mesh, CAMERA)
    compile_kernels()

    def simulate() -> None:
        simulate_radar(mesh, PAPER_RADAR, visibility=visible)

    benchmark.pedantic(simulate, rounds=3, warmup_rounds=1)
    spent = benchmark.stats.stats.min
    # A cancel may come at any moment of any model.
    answers = {}
    begun = moment = 0.0

    def stop(done: int, total: int) -> None:
        nonlocal moment
        moment = time.perf_counter()
        if moment - begun > 0.4:
            raise Cancelled

    for model in ("nufft", "direct"):
        begun = time.perf_counter()
        with pytest.raises(Cancelled):
            simulate_radar(
                mesh,
                PAPER_RADAR,
                visibility=visible,
                wave=WaveOptions(model=model, blocks=8),  # type: ignore[arg-type]
                progress=stop,
            )
        answers[model] = time.perf_counter() - moment
    with capsys.disabled():
        print(
            f"\n{FRAMES} frames, {visible[0].sum()} of {len(visible[0])} facets: {spent:.2f} s on"
            f" {worker_count()} threads; a cancel is answered after"
            f" {1e3 * answers['nufft']:.0f} ms (nufft), {1e3 * answers['direct']:.0f} ms (direct)"
        )
    assert spent <= 2.5 * max(1.0, 2 / worker_count())
    assert max(answers.values()) <= 0.1


def subdivided(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Every triangle (n, 3, …) cut into four."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def soup(corners: NDArray[np.float64], motion: NDArray[np.float64]) -> Echoes:
    """Echoes of loose triangles with the closed form on each."""
    count = len(corners)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    vertices = corners.reshape(-1, 3)
    loose = MeshSequence(vertices[None], faces, Timebase([0.0]))
    return WaveScene(loose, PAPER_RADAR, CAMERA).echoes(vertices, motion.reshape(-1, 3), None)


def points(corners: NDArray[np.float64], motion: NDArray[np.float64]) -> Echoes:
    """The same triangles as bare points in their middles."""
    middle = corners.mean(axis=1)
    range_m = np.linalg.norm(middle, axis=1)
    normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    towards = np.maximum(-(normal * middle).sum(axis=1) / range_m, 0.0)
    rate = (middle * motion.mean(axis=1)).sum(axis=1) / range_m
    return Echoes(range_m, rate, (towards / range_m**2).astype(np.complex128))


def marginal(signal: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power over Doppler, summed over range, adding up to 1."""
    chirps, samples = signal.shape
    tapered = signal.real * np.hanning(chirps)[:, None] * np.hanning(samples)
    power = np.abs(np.fft.fft(np.fft.rfft(tapered, axis=1), axis=0)) ** 2
    total: NDArray[np.float64] = power.sum(axis=1) / power.sum()
    return total


@pytest.mark.benchmark(group="FMCW, converged")
def test_against_facets_subdivided_until_converged(
    benchmark: Any,
    mesh: MeshSequence,
    visible: NDArray[np.bool_],
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene = WaveScene(mesh, PAPER_RADAR, CAMERA, visible)
    benchmark.pedantic(lambda: scene.frame(20 / 30), rounds=20, warmup_rounds=2)
    lines, settled, errors = [], [], {}
    for frame in (20, 60):
        position, velocity = scene.scene.moving(frame / 30)
        seen = scene.scene.visible(frame / 30)
        ours = marginal(nufft(scene.echoes(position, velocity, seen), PAPER_RADAR))
        shown = scene.faces[visible[frame]]
        corners, motion = position[shown], velocity[shown]
        by_points, by_facets = [], []
        for level in range(5):
            if level:
                corners, motion = subdivided(corners), subdivided(motion)
            by_points.append(marginal(nufft(points(corners, motion), PAPER_RADAR, 8)))
            by_facets.append(marginal(nufft(soup(corners, motion), PAPER_RADAR, 8)))
        reference = by_facets[-1]
        error = np.abs(ours - reference).sum()
        errors[frame] = float(error)
        lines.append(
            f"frame {frame}: L1 of the Doppler marginal {error:.1e}; against the reference,"
            " facets cut 1, 4, 16, 64 times: "
            + ", ".join(f"{np.abs(one - reference).sum():.1e}" for one in by_facets[:-1])
            + "; bare points cut 1 to 256 times: "
            + ", ".join(f"{np.abs(one - reference).sum():.1e}" for one in by_points)
        )
        settled.append(float(np.abs(by_facets[-2] - reference).sum()))
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert max(settled) <= 2e-3
    # Frame 20 misses 0.02 (see docs/decisions/0011): printed, and not called good.
    assert errors[60] <= 0.02
