"""What testing fewer vertices, the depth buffer and reused masks save, and cost in the map.

Walk and sample, each from the camera, from beside, and after moves. What a
run measures is printed; errors are relative L1 of the whole map against exact.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.masks import VisibilityMasks
from sd2core.doppler.prepared import Block
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.scattering.depth import depth_visibility_kernel
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

PAPER = PRESETS["paper"]
ROUGH = replace(PAPER, velocity_sigma_bins=0.0, time_sigma_s=0.0)
CAMERA = VirtualSensor()
BESIDE = VirtualSensor((1.5, 0.0, 2.0))


@pytest.fixture(scope="module")
def walk(shared_data: Path) -> MeshSequence:
    warm_up()
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        vertices, faces = data["vertices"], data["faces"]
    return MeshSequence(vertices, faces, Timebase.regular(len(vertices), 30.0), "walk")


@pytest.fixture(scope="module")
def sample() -> MeshSequence:
    warm_up()
    return open_recording(resource_path("swipes.sd2")).load_mesh()


def error(values: NDArray[np.float32], truth: NDArray[np.float32]) -> float:
    return float(np.abs(values - truth).sum() / truth.sum())


def errors(mesh: MeshSequence, place: VirtualSensor, **changes: Any) -> list[float]:
    """Before and after smoothing."""
    found = []
    for base in (ROUGH, PAPER):
        truth = Synthesizer(mesh, base).map(place).values
        found.append(error(Synthesizer(mesh, replace(base, **changes)).map(place).values, truth))
    return found


@pytest.mark.benchmark(group="depth buffer, one frame")
def test_depth_visibility(
    benchmark: Any, walk: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    points = np.ascontiguousarray(walk.read(0, 60)[::6].transpose(0, 2, 1))
    faces = np.array(walk.faces)
    needed = np.ones((len(points), points.shape[2]), np.uint8)
    visible, place = np.empty_like(needed), np.zeros(3)

    def spent_s(resolution: int) -> float:
        start = time.perf_counter()
        if resolution:
            depth_visibility_kernel(
                points, faces, True, place, resolution, needed, 0, len(points), visible
            )
        else:
            exact_visibility_kernel(points, faces, place, needed, 0, len(points), visible)
        return (time.perf_counter() - start) / len(points)

    benchmark.pedantic(spent_s, args=(256,), rounds=10, warmup_rounds=2)
    # In turns, so that a busy machine slows all.
    rounds = [[spent_s(resolution) for resolution in (128, 256, 0)] for _ in range(8)]
    coarse, fine, exact = np.array(rounds).min(axis=0)
    with capsys.disabled():
        print(
            f"\n128: {1e3 * coarse:.2f} ms, 256: {1e3 * fine:.2f} ms,"
            f" exact: {1e3 * exact:.2f} ms a frame on one thread"
            f" = {exact / coarse:.1f} and {exact / fine:.1f} times as long"
        )
    assert fine <= 0.0018
    assert coarse < fine < exact


def everything(self: VisibilityMasks, block: Block, rows: slice, place: Any) -> NDArray[np.uint8]:
    """In place of the choice of the vertices that can change the map."""
    return np.ones((rows.stop - rows.start, self._prepared.mesh.vertex_count), np.uint8)


@pytest.mark.benchmark(group="exact visibility, only vertices that matter")
def test_only_what_matters(
    benchmark: Any,
    sample: MeshSequence,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The gesture clip's exact map for a new place of the sensor, everything included."""
    maker = Synthesizer(sample, PAPER)
    maker.prepare()
    offsets = iter(np.arange(1, 10_000) * 1e-4)

    def moved() -> VirtualSensor:
        return VirtualSensor((next(offsets), 0.0, 0.0))

    benchmark.pedantic(lambda: maker.map(moved()), rounds=5, warmup_rounds=1)
    some_s, all_s = [], []
    for _ in range(8):  # in turns, so that a busy machine slows both
        place = moved()
        start = time.perf_counter()
        some = maker.map(place).values
        some_s.append(time.perf_counter() - start)
        whole = Synthesizer(sample, PAPER)
        whole.prepare()
        with monkeypatch.context() as patch:
            patch.setattr(VisibilityMasks, "_needed", everything)
            start = time.perf_counter()
            values = whole.map(place).values
            all_s.append(time.perf_counter() - start)
        np.testing.assert_array_equal(some, values)
    ratio = min(all_s) / min(some_s)
    with capsys.disabled():
        print(
            f"\nsample, exact map: {1e3 * min(some_s) / sample.frame_count:.3f} ms a frame,"
            f" with all vertices tested {1e3 * min(all_s) / sample.frame_count:.3f} ms"
            f" = {ratio:.1f} times as long; the maps are identical"
        )
    assert ratio >= 3


@pytest.mark.benchmark(group="masks, errors")
def test_errors(
    benchmark: Any,
    walk: MeshSequence,
    sample: MeshSequence,
    capsys: pytest.CaptureFixture[str],
) -> None:
    lines: list[str] = []
    at = benchmark.pedantic(measure, args=(walk, sample, lines), rounds=1)
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    for name in ("walk", "sample"):
        for where in ("camera", "beside"):
            assert at[name, where, "depth 256"] < at[name, where, "depth 128"]
            assert at[name, where, "depth 256"] <= 0.03


def measure(
    walk: MeshSequence, sample: MeshSequence, lines: list[str]
) -> dict[tuple[str, str, str], float]:
    """Error before smoothing by scene, place and what is done; said in words in ``lines``."""
    at: dict[tuple[str, str, str], float] = {}
    for name, mesh in (("walk", walk), ("sample", sample)):
        for where, place in (("camera", CAMERA), ("beside", BESIDE)):
            for what, changes in (
                ("facing", {"visibility": "facing"}),
                ("depth 128", {"visibility": "depth", "depth_resolution": 128}),
                ("depth 256", {"visibility": "depth"}),
                ("exact, stride 5", {"mask_stride": 5}),
            ):
                before, after = errors(mesh, place, **changes)
                at[name, where, what] = before
                lines.append(f"{name}, {where}, {what}: L1 {before:.4f}, smoothed {after:.4f}")
    return at


@pytest.mark.benchmark(group="masks reused after a move, errors")
def test_moved(
    benchmark: Any,
    walk: MeshSequence,
    sample: MeshSequence,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """How the error grows with the move, and what it would be if every vertex were tested.

    The mean of moves to the right, down and forward.
    """
    lines: list[str] = []

    def measured() -> dict[tuple[str, str, float], float]:
        at: dict[tuple[str, str, float], float] = {}
        for name, mesh in (("walk", walk), ("sample", sample)):
            for where, place in (("camera", CAMERA), ("beside", BESIDE)):
                kept, complete = Synthesizer(mesh, ROUGH), Synthesizer(mesh, ROUGH)
                kept.map(place)
                with monkeypatch.context() as patch:
                    patch.setattr(VisibilityMasks, "_needed", everything)
                    complete.map(place)
                for move_m in (0.02, 0.05, 0.1, 0.3):
                    found = []
                    for axis in range(3):
                        there = VirtualSensor(
                            tuple(np.add(place.position_m, move_m * np.eye(3)[axis]).tolist())
                        )
                        truth = Synthesizer(mesh, ROUGH).map(there).values
                        found.append(
                            [
                                error(maker.map(there, visibility="frozen").values, truth)
                                for maker in (kept, complete)
                            ]
                        )
                    reused, floor = np.mean(found, axis=0)
                    at[name, where, move_m] = reused
                    lines.append(
                        f"{name}, {where}, mask reused after {move_m:g} m:"
                        f" L1 {reused:.4f} (to the right {found[0][0]:.4f}, down"
                        f" {found[1][0]:.4f}, forward {found[2][0]:.4f}), complete {floor:.4f}"
                    )
        return at

    at = benchmark.pedantic(measured, rounds=1)
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    for name in ("walk", "sample"):
        for where in ("camera", "beside"):
            grows = [at[name, where, move_m] for move_m in (0.02, 0.05, 0.1, 0.3)]
            assert grows == sorted(grows)
