"""Choosing what a scene requires must not keep anyone waiting: a 450-frame clip in 2 s."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sd2core.accuracy.choosing import choose
from sd2core.accuracy.results import Choice
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FRAMES = 450


def to_and_fro(mesh: MeshSequence) -> MeshSequence:
    """A clip of 450 frames that plays a shorter one forwards and backwards."""
    vertices = mesh.read(0, mesh.frame_count)
    once = np.concatenate([vertices, vertices[-2:0:-1]])
    times = np.arange(FRAMES) % len(once)
    return MeshSequence(once[times], mesh.faces, Timebase.regular(FRAMES, 30.0), mesh.source)


@pytest.mark.benchmark(group="choosing")
@pytest.mark.parametrize("name", ["sample", "walk"])
def test_choosing(
    benchmark: Any, name: str, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    warm_up()
    if name == "sample":
        mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    else:
        mesh = to_and_fro(load_mesh(shared_data / "mesh" / "walk.npz"))
    assert mesh.frame_count == FRAMES
    found: list[Choice] = []

    def work() -> None:
        found.append(choose(mesh, VirtualSensor(), tolerance=0.02))

    start = time.process_time()
    benchmark.pedantic(work, rounds=3, warmup_rounds=1)
    processor_s = (time.process_time() - start) / 4
    best_s = min(choice.spent_s for choice in found)
    with capsys.disabled():
        print(
            f"\n{name}, {mesh.vertex_count} vertices: chosen in {best_s:.2f} s"
            f" ({processor_s:.2f} s of processor time): {found[-1].summary}"
        )
    assert best_s <= 2.0
