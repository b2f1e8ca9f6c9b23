"""What the depth buffer and reused masks save, and what they cost in the map.

Walk and sample, each from the camera, from beside, and after a small move. What a
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

from sd2core.compiled import warm_up
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.mesh import MeshSequence
from sd2core.recording import open_recording
from sd2core.resources import resource_path
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
    assert at["walk", "camera", "depth 256"] <= 0.03


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
            maker, truth = Synthesizer(mesh, ROUGH), Synthesizer(mesh, ROUGH)
            maker.map(place)
            x, y, z = place.position_m
            moved = VirtualSensor((x + 0.1, y, z))
            reused = error(maker.map(moved, visibility="frozen").values, truth.map(moved).values)
            at[name, where, "moved"] = reused
            lines.append(f"{name}, {where}, mask reused after 0.1 m: L1 {reused:.4f}")
    return at
