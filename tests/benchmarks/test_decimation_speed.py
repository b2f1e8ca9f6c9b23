"""What leaving vertices out costs once, saves per frame, and does to the map."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from timing import best_s

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.io.mesh import load_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor

RAW = replace(PRESETS["paper"], velocity_sigma_bins=0.0, time_sigma_s=0.0)


@pytest.fixture(scope="module")
def mesh(shared_data: Path) -> MeshSequence:
    warm_up()
    return load_mesh(shared_data / "mesh" / "walk.npz")


@pytest.mark.parametrize("kept", [0.5, 0.25, 0.1])
@pytest.mark.benchmark(group="decimation, once per clip")
def test_decimation(
    benchmark: Any, mesh: MeshSequence, capsys: pytest.CaptureFixture[str], kept: float
) -> None:
    benchmark.pedantic(lambda: decimate(mesh, kept), rounds=5, warmup_rounds=1)
    small = decimate(mesh, kept)
    print_errors(mesh, small, benchmark.stats.stats.min, capsys)
    assert benchmark.stats.stats.min <= 0.3


def print_errors(
    mesh: MeshSequence, small: MeshSequence, spent_s: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """Relative L1 over the clip from a place in front and one aside, and the cost of a map."""
    lines = []
    for place in ((0.0, 0.0, 0.0), (1.5, -0.5, 1.0)):
        sensor = VirtualSensor(place)
        words = []
        for name, chosen in (("before", RAW), ("after", PRESETS["paper"])):
            whole = Synthesizer(mesh, chosen).map(sensor).values
            part = Synthesizer(small, chosen).map(sensor).values
            words.append(f"{np.abs(part - whole).sum() / whole.sum():.3f} {name} smoothing")
        lines.append(f"L1 {', '.join(words)} from {place}")

    def exact_map(of: MeshSequence) -> float:
        maker = Synthesizer(of)
        maker.prepare()
        moves = iter(np.arange(1, 100) * 1e-3)
        return best_s(lambda: maker.map(VirtualSensor((next(moves), 0.0, 0.0))), 3)

    with capsys.disabled():
        print(
            f"\n{small.vertex_count} of {mesh.vertex_count} vertices: {1e3 * spent_s:.0f} ms once;"
            f" exact map {1e3 * exact_map(small) / mesh.frame_count:.2f} ms a frame instead of"
            f" {1e3 * exact_map(mesh) / mesh.frame_count:.2f}; {'; '.join(lines)}"
        )
