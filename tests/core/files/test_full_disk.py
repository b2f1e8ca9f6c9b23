"""A full disk under everything that is saved or exported: which file, what to do, the old whole."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from full_disk import full_disk
from lazy_sources import write_dataset

from sd2core.datasets.source import Source
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.io.mesh import save_mesh
from sd2core.io.radar.infineon import write_capture
from sd2core.labels.formats import write_labels
from sd2core.labels.spans import Labels, Span
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import PairWriter, Take
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files")

AXIS = VelocityAxis(64, 2.0)
RNG = np.random.default_rng(0)
LABELS = Labels(spans=tuple(Span(k + 1, "Gestures", k, k + 0.5, "swipe") for k in range(800)))


def a_map() -> DopplerMap:
    values = RNG.random((AXIS.bins, 400)).astype(np.float32)
    return DopplerMap(values, AXIS, Timebase.regular(400, 20.0), "synthetic")


def a_mesh() -> MeshSequence:
    vertices = RNG.random((50, 300, 3)).astype(np.float32)
    return MeshSequence(
        vertices, np.arange(30, dtype=np.int32).reshape(10, 3), Timebase.regular(50, 20.0)
    )


def labels(path: Path) -> None:
    write_labels(path, LABELS, Timebase.regular(24_000, 30.0))


def figure(path: Path) -> None:
    from matplotlib.figure import Figure

    drawn = Figure()
    drawn.subplots().imshow(RNG.random((200, 200)))
    save_figure(drawn, path)


def data_set(path: Path) -> None:
    maps = {"synthetic": a_map()}
    write_dataset(path, [Source("anna", "r1", 0, VirtualSensor(), maps, np.zeros(400, np.int16))])


def pairs(path: Path) -> None:
    writer = PairWriter(
        path, kind="simulated", axis=AXIS, null_bins=(), frame_rate_hz=20.0, labels=["none"],
        provenance={},
    )  # fmt: skip
    synthetic, radar = RNG.random((2, 300, AXIS.bins)).astype(np.float32)
    times_s, label = np.arange(300) / 20, np.zeros(300, np.int8)
    writer.append(Take("s1", "walk", synthetic, radar, times_s, label, np.zeros(3)))


def capture(path: Path) -> None:
    shape = (10, 1, PAPER_RADAR.chirps_per_frame, PAPER_RADAR.samples_per_chirp)
    samples = RNG.integers(0, 4000, shape).astype(np.uint16)
    write_capture(path, samples, PAPER_RADAR, np.arange(10) / 20, simulated=True)


def network(path: Path) -> None:
    import torch

    from sd2core.files.atomic import atomic_write

    with atomic_write(path) as stream:
        torch.save({"weights": torch.rand(200, 200)}, stream)


WRITERS: dict[str, Callable[[Path], object]] = {
    "labels.json": labels, "l.csv": labels, "l.eaf": labels, "l.TextGrid": labels,
    "l.boris": labels, "map.npz": lambda path: a_map().save(path),
    "m.npz": lambda path: save_mesh(a_mesh(), path),
    "m.zarr": lambda path: save_mesh(a_mesh(), path),
    "m.zarr.zip": lambda path: save_mesh(a_mesh(), path),
    "f.png": figure, "f.svg": figure, "f.pdf": figure,
    "set.zarr": data_set, "set.h5": data_set, "set.npz": data_set,
    "pairs.zarr": pairs, "capture": capture, "network.pt": network,
}  # fmt: skip


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", WRITERS)
def test_names_the_file_and_what_to_do(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    with (
        full_disk(6000),
        pytest.raises(OSError, match="free some, or write to another place") as caught,
    ):
        WRITERS[name](path)
    assert caught.value.filename == str(path)
    WRITERS[name](path)
    assert path.exists()


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    "name", [name for name in WRITERS if name.startswith(("l", "map", "m.npz", "m.zarr.zip", "f."))]
)
def test_leaves_the_old_file_whole_and_nothing_beside_it(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"old")
    with full_disk(6000), pytest.raises(OSError, match="free some"):
        WRITERS[name](path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_recording_stays_as_it_was_saved(tmp_path: Path) -> None:
    (tmp_path / "walk.npz").write_text("mesh")
    made = Recording.create(tmp_path / "walk.sd2", mesh=tmp_path / "walk.npz")
    made.labels = Labels(spans=LABELS.spans[:3])
    made.save()
    before = {path.name: path.read_bytes() for path in made.folder.iterdir()}
    made.labels = LABELS
    with full_disk(6000), pytest.raises(OSError, match="free some") as caught:
        made.save()
    assert caught.value.filename == str(made.folder / "labels.json")
    assert {path.name: path.read_bytes() for path in made.folder.iterdir()} == before
    made.save()


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_copy_into_a_recording_names_the_copy(kind: str, tmp_path: Path) -> None:
    mesh = tmp_path / ("walk.npz" if kind == "file" else "meshes")
    large = mesh if kind == "file" else mesh / "0.npz"
    large.parent.mkdir(exist_ok=True)
    large.write_bytes(resource_path("swipes.sd2").joinpath("video.mp4").read_bytes())
    with full_disk(6000), pytest.raises(OSError, match="free some") as caught:
        Recording.create(tmp_path / "walk.sd2", mesh=mesh, copy=True)
    assert caught.value.filename == str(tmp_path / "walk.sd2" / mesh.name)
    assert not (tmp_path / "walk.sd2").exists()
