"""Files of arrays: meshes, pairs, data sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.sources import pair_sources
from sd2core.datasets.writing import write_dataset
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import read_pairs
from sd2core.timebase import Timebase
from tests.mutants.target import Target
from tests.small_pairs import write_pairs


def _write_mesh(path: Path) -> None:
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(400, 500, 3)).astype(np.float32) * 0.3 + np.float32([0, 0, 3])
    faces = np.stack([np.arange(398), np.arange(398) + 1, np.arange(398) + 2], axis=1)
    present = np.arange(400) > 4
    save_mesh(MeshSequence(vertices, faces, Timebase.regular(400, 30.0), present=present), path)


def _read_mesh(path: Path) -> None:
    mesh = load_mesh(path)
    mesh.read(0, mesh.frame_count)


def _write_pairs(path: Path) -> None:
    write_pairs(path, ("s1", "s2"))


def _write_dataset(path: Path) -> None:
    pairs = path.with_name("pairs-of-set.zarr")
    _write_pairs(pairs)
    sources = pair_sources([pairs], ("synthetic", "simulated"))
    write_dataset(path, sources, DatasetOptions(length=30, overlap=10))


def _read_dataset(path: Path) -> None:
    with open_dataset(path) as dataset:
        list(dataset.sources())
        for name in dataset.arrays:
            dataset[name][:]


TARGETS = [
    Target("mesh.zarr", _write_mesh, _read_mesh),
    Target("mesh.zarr.zip", _write_mesh, _read_mesh),
    Target("pairs.zarr", _write_pairs, read_pairs),
    Target("set.zarr", _write_dataset, _read_dataset),
]
