"""What checks of every chunk cost when a mesh is read and written; decision 59 quotes it.

``pytest tests/benchmarks/test_mesh_reading_speed.py --benchmark-only --capture=no`` prints
processor time with the checks as a multiple of that without, in one run.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from timing import spent_s
from zarr.codecs import BloscCodec

from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

FRAMES, VERTICES = 1800, 5000
ROUNDS = 7


@pytest.fixture(scope="module")
def mesh() -> MeshSequence:
    """A minute of a body's size that moves a little everywhere: 108 MB."""
    rng = np.random.default_rng(1)
    steps = rng.normal(scale=0.003, size=(FRAMES, VERTICES, 3)).astype(np.float32)
    vertices = np.cumsum(steps, axis=0) + rng.normal(scale=0.3, size=(VERTICES, 3)) + [0, 0, 3]
    return MeshSequence(vertices.astype(np.float32), None, Timebase.regular(FRAMES, 30.0))


def bare(mesh: MeshSequence, path: Path) -> Any:
    """The same chunks without checksums."""
    step = 34
    array = zarr.open_group(str(path), mode="w").create_array(
        "vertices", shape=mesh.vertices.shape, dtype="<f4", chunks=(step, VERTICES, 3),
        compressors=BloscCodec(cname="lz4", clevel=5, shuffle="shuffle"),
        fill_value=float("nan"),
    )  # fmt: skip
    for start in range(0, FRAMES, step):
        array[start : start + step] = mesh.read(start, min(start + step, FRAMES))
    return array


@pytest.mark.benchmark(group="meshes: checks of every chunk")
def test_reading_and_writing_with_checks(
    benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path, mesh: MeshSequence
) -> None:
    plain = bare(mesh, tmp_path / "bare.zarr")
    save_mesh(mesh, tmp_path / "checked.zarr")
    step = plain.chunks[0]

    def read_plain() -> None:
        for start in range(0, FRAMES, step):
            read = np.asarray(plain[start : start + step])
            part = np.empty_like(read)
            part[:] = read
            assert np.isfinite(part.sum())

    def read_checked() -> None:
        for start in range(0, FRAMES, step):
            checked.vertices[start : start + step]

    checked = load_mesh(tmp_path / "checked.zarr")
    ratios = {
        "reading": spent_s(read_checked, ROUNDS) / spent_s(read_plain, ROUNDS),
        "writing": spent_s(lambda: save_mesh(mesh, tmp_path / "again.zarr"), 3)
        / spent_s(lambda: bare(mesh, tmp_path / "again_bare.zarr"), 3),
        "opening, of a whole reading": spent_s(lambda: load_mesh(tmp_path / "checked.zarr"), ROUNDS)
        / spent_s(read_plain, ROUNDS),
    }
    benchmark.pedantic(read_checked, rounds=3)
    with capsys.disabled():
        for what, ratio in ratios.items():
            print(f"\n{what}: {ratio:.2f}")
    assert ratios["reading"] < 1.3
