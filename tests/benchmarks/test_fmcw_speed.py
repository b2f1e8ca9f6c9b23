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
from facet_visibility import facet_visibility
from longer_walk import FRAMES, LAST, POSES, longer_walk
from numpy.typing import NDArray
from oracles.plain_sum import plain_sum
from timing import best_s

from sd2core.files.resources import resource_path
from sd2core.fmcw import WaveOptions, simulate_radar
from sd2core.fmcw.reference import CONVERGED_L1, converged_frame, doppler_marginal
from sd2core.fmcw.sums import direct, nufft
from sd2core.fmcw.wave import WaveScene
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up, worker_count
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FACETS = 7400
CAMERA = VirtualSensor()


@pytest.fixture(scope="module")
def mesh(shared_data: Path) -> MeshSequence:
    warm_up()
    return longer_walk(shared_data)


@pytest.fixture(scope="module")
def visible(mesh: MeshSequence) -> NDArray[np.bool_]:
    """Facets that nothing hides, (450, F), looked at once per pose."""
    once = MeshSequence(mesh.read(0, LAST + 1), mesh.faces, Timebase.regular(LAST + 1, 30.0))
    pose = facet_visibility(once, CAMERA)
    return pose[POSES]


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
        summed.append(best_s(lambda: plain_sum(echoes, PAPER_RADAR), 1))
    ratio = min(summed) / min(whole)
    reference = direct(echoes, PAPER_RADAR)
    turned = best_s(lambda: direct(echoes, PAPER_RADAR), 3)
    lines = [
        f"{len(echoes.range_m)} of {len(scene.faces)} facets: {1e3 * min(whole):.2f} ms a frame"
        f" on one thread, {1e3 * min(factors):.2f} ms of it amplitudes and closed form;"
        f" every phase by itself {1e3 * min(summed):.0f} ms = {ratio:.0f} times as long"
    ]
    lines.append(f"  direct sum, a recurrence along the samples: {1e3 * turned:.0f} ms")
    for blocks in (1, 2, 4, 64):
        apart = np.linalg.norm(nufft(echoes, PAPER_RADAR, blocks) - reference)
        spent = best_s(lambda blocks=blocks: nufft(echoes, PAPER_RADAR, blocks), 5)
        lines.append(
            f"  {blocks:2} blocks: {apart / np.linalg.norm(reference):.1e} from the direct sum,"
            f" {1e3 * spent:.2f} ms"
        )
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert len(echoes.range_m) == FACETS
    assert min(whole) <= 0.006
    assert ratio >= 70


@pytest.mark.benchmark(group="FMCW, whole clip")
def test_whole_clip(
    benchmark: Any,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stored = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    mesh = MeshSequence(stored.read(0, FRAMES), stored.faces, stored.timebase, "swipes")
    warm_up()
    begun = time.perf_counter()
    visible = facet_visibility(mesh, CAMERA)
    hiding_s = time.perf_counter() - begun

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
            f" {worker_count()} threads, after {hiding_s:.2f} s for what hides them; a cancel is"
            f" answered after {1e3 * answers['nufft']:.0f} ms (nufft),"
            f" {1e3 * answers['direct']:.0f} ms (direct)"
        )
    assert spent <= 2.5 * max(1.0, 2 / worker_count())
    assert max(answers.values()) <= 0.1


@pytest.mark.benchmark(group="FMCW, converged")
def test_against_facets_subdivided_until_converged(
    benchmark: Any,
    mesh: MeshSequence,
    visible: NDArray[np.bool_],
    capsys: pytest.CaptureFixture[str],
) -> None:
    stored = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    sample = MeshSequence(stored.read(0, FRAMES), stored.faces, stored.timebase, "swipes")
    places = {"walk": (mesh, range(2, 89, 11)), "sample": (sample, range(30, FRAMES, 52))}
    lines: list[str] = []
    worst: list[float] = []
    for name, (body, frames) in places.items():
        seen = visible if name == "walk" else exact(sample, list(frames))
        scene = WaveScene(body, PAPER_RADAR, CAMERA, seen)
        if name == "walk":
            benchmark.pedantic(lambda scene=scene: scene.frame(0.7), rounds=20, warmup_rounds=2)
        errors, settled, pieces = [], [], []
        for frame in frames:
            time_s = float(body.times_s[frame])
            reference = converged_frame(scene, time_s)
            assert reference.changes[-1] <= CONVERGED_L1
            error = doppler_marginal(scene.frame(time_s)) - doppler_marginal(reference.signal)
            errors.append(float(np.abs(error).sum()))
            settled.append(reference.changes[-1])
            pieces.append(reference.pieces[-1])
        lines.append(
            f"{name}, frames {', '.join(map(str, frames))}: L1 of the Doppler marginal median"
            f" {np.median(errors):.1e}, 95 % {np.quantile(errors, 0.95):.1e}, worst"
            f" {max(errors):.1e}; reference of {min(pieces)} to {max(pieces)} pieces a facet,"
            f" last change at most {max(settled):.1e}"
        )
        worst.append(max(errors))
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert max(worst) <= 0.02


def exact(mesh: MeshSequence, frames: list[int]) -> NDArray[np.bool_]:
    """Facets that nothing hides, (T, F), looked at in some frames only."""
    assert mesh.faces is not None
    seen = np.zeros((mesh.frame_count, len(mesh.faces)), np.bool_)
    some = MeshSequence(
        mesh.vertices[frames], mesh.faces, Timebase(mesh.times_s[frames] - mesh.times_s[frames[0]])
    )
    seen[frames] = facet_visibility(some, CAMERA)
    return seen
