"""Files of arrays: meshes, pairs, data sets, maps, models, radar maps."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import h5py
import joblib
import numpy as np
import trimesh
import zarr
from numcodecs import Blosc, GZip, Zstd

from sd2core.classify.files import load_classifier, save_classifier
from sd2core.datasets.card import card_text, describe_dataset
from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.labelled import labelled_facts
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.sources import pair_sources
from sd2core.datasets.torch_dataset import SegmentDataset
from sd2core.datasets.writing import write_dataset
from sd2core.denoise.files import load_model, save_model
from sd2core.errors import Sd2Error
from sd2core.fmcw import doppler_map
from sd2core.imu.files import read_signals, write_signals
from sd2core.imu.signals import InertialSignals
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.radar import load_capture, load_recorded_map
from sd2core.io.radar.described import RadarDescription, write_description
from sd2core.io.radar.growing import GrowingHead
from sd2core.live.recording import GrowingRecording
from sd2core.live.sources import Frame
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.exporting import Exporting
from sd2core.pairs.store import read_pairs
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase
from tests.core.classify.classifiers import classifier
from tests.core.denoise.denoisers import trained
from tests.core.io.radar.acconeer_files import write_a121
from tests.core.io.radar.dca1000_files import TiRecording, pymmw_of, write_ti
from tests.core.io.radar.kkt_files import write_kkt
from tests.mutants.target import Target
from tests.mutants.telling import tell
from tests.small_pairs import write_pairs


def _mesh(frames: int = 400) -> MeshSequence:
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(frames, 500, 3)).astype(np.float32) * 0.3 + np.float32([0, 0, 3])
    faces = np.stack([np.arange(398), np.arange(398) + 1, np.arange(398) + 2], axis=1)
    present = np.arange(frames) > 4
    return MeshSequence(vertices, faces, Timebase.regular(frames, 30.0), present=present)


def _write_mesh(path: Path) -> None:
    save_mesh(_mesh(), path)


def _write_old_mesh(path: Path) -> None:
    mesh = _mesh(40)
    group = zarr.open_group(str(path), mode="w", zarr_format=2)
    group.create_array("vertices", data=mesh.vertices[:], chunks=(8, 500, 3), compressors=GZip())
    group.create_array("times_s", data=mesh.timebase.times_s, chunks=(8,), compressors=Zstd())
    group.create_array("faces", data=mesh.faces, chunks=(99, 3), compressors=Blosc())


def _person() -> dict[object, object]:
    mesh = _mesh(12)
    person = {"verts": list(mesh.vertices[:]), "frame_ids": list(range(12))}
    return {1: person, 2: {**person, "frame_ids": np.arange(12)}, "fps": 30.0}


def _read_capture(path: Path) -> None:
    doppler_map(load_capture(path))


def _write_dca1000(path: Path) -> None:
    write_ti(path, TiRecording(transmitters=2), parts=2, studio=True)


def _write_pymmw(path: Path) -> None:
    recording = TiRecording(receivers=2)
    write_ti(path, recording).with_suffix(".cfg").write_text(pymmw_of(recording))


_RADAR = RadarDescription(
    axes=("frame", "receiver", "chirp", "sample"),
    carrier_hz=24e9,
    bandwidth_hz=2e8,
    sample_rate_hz=1e6,
    chirp_repetition_s=5e-4,
    frame_repetition_s=0.05,
    full_scale=2048.0,
)


def _write_own(path: Path) -> None:
    path.mkdir()
    values = np.random.default_rng(1).integers(-2048, 2048, (5, 2, 16, 20)).astype(np.int16)
    np.save(path / "radar.npy", values)
    write_description(_RADAR, path / "radar.npy")


def _write_own_hdf5(path: Path) -> None:
    path.mkdir()
    values = np.random.default_rng(1).standard_normal((5, 2, 16, 20)).astype(np.complex64)
    with h5py.File(path / "radar.h5", "w") as file:
        file.create_dataset("adc", data=values, chunks=(2, 2, 16, 20), compression="gzip")
    write_description(_RADAR, path / "radar.h5")


def _write_sigmf(path: Path) -> None:
    path.mkdir()
    meta = {"global": {"core:datatype": "ci16_le"}, "captures": [{"core:frequency": 5.8e9}]}
    (path / "radar.sigmf-meta").write_text(json.dumps(meta))
    np.arange(1600, dtype="<i2").tofile(path / "radar.sigmf-data")
    stream = {"axes": ("stream",), "bandwidth_hz": 0.0, "samples_per_chirp": 5}
    times = {"chirps_per_frame": 16, "chirp_repetition_s": None, "frame_repetition_s": None}
    write_description(_RADAR.model_copy(update=stream | times), path / "radar.sigmf-meta")


def _write_live(path: Path) -> None:
    radar = replace(PAPER_RADAR, samples_per_chirp=8, chirps_per_frame=4)
    head = GrowingHead(radar=radar, word="int16", notes=("Times.",), start_unix_s=1.7e9)
    recording = GrowingRecording(path.with_suffix(".sd2"))
    for number in range(60):
        words = np.full(head.frame_shape, number, head.word_type)
        recording.append(words, head, Frame(None, number / 30, 0.0, lost=number % 2))
    recording.close()
    recording.radar.rename(path)
    shutil.rmtree(recording.folder)


def _write_surface(path: Path) -> None:
    mesh = _mesh(1)
    trimesh.Trimesh(mesh.vertices[0], mesh.faces, process=False).export(path)


def _write_map(path: Path) -> None:
    values = np.random.default_rng(3).random((16, 60)).astype(np.float32)
    time = Timebase.regular(60, 30.0)
    meta = {
        "sensor": {"position_m": [0.0, 0.0, 2.0], "azimuth_deg": 3.0},
        "visibility": "raster",
        "visible_share": [0.5] * 60,
        "beyond_share": [0.01] * 60,
        "mask_stride": 2,
        "count": "expected",
        "plan": {"text": "every second mask"},
        "body_error_l1": 0.3,
        "plan_error_l1": 0.05,
        "options": {"visibility": "raster", "weight": "area"},
        "radar": {"name": "r", "start_frequency_hz": 6e10, "end_frequency_hz": 6.1e10},
        "notes": ["A note."],
    }
    DopplerMap(values, VelocityAxis(16, 2.0), time, "synthetic", "share", meta=meta).save(path)


def _read_mesh(path: Path) -> None:
    mesh = load_mesh(path)
    mesh.read(0, mesh.frame_count)


def _write_imu(path: Path) -> None:
    values = np.random.default_rng(2).normal(size=(2, 300, 3))
    write_signals(path, InertialSignals(np.arange(300) / 100.0, *values, {"at": "vertex 7"}))


def _write_pairs(path: Path) -> None:
    write_pairs(path, ("s1", "s2"))


def _write_dataset(path: Path) -> None:
    pairs = path.with_name(f"pairs of {path.name}.zarr")
    _write_pairs(pairs)
    sources = pair_sources([pairs], Making(kinds=("synthetic", "simulated")))
    write_dataset(path, sources, Exporting(segment_frames=30, overlap_frames=10))


def _read_dataset(path: Path) -> None:
    """Read all of it as whoever asks for facts, learns from it or looks at it does."""
    with open_dataset(path) as dataset:
        list(dataset.sources())
        for name in dataset.arrays:
            dataset[name][:]
        card_text(describe_dataset(dataset))
    tell(path)
    with suppress(Sd2Error):  # nothing to learn from
        items = SegmentDataset(path, "synthetic", "class")
        items.__getitems__(list(range(len(items))))
    labelled_facts(LabelledSource(path))
    with open_dataset(path) as dataset:
        clips_of_dataset(dataset, "synthetic")


def _read_pairs(path: Path) -> None:
    read_pairs(path)
    tell(path)
    labelled_facts(LabelledSource(path))


def _told(read: Callable[[Path], object]) -> Callable[[Path], None]:
    """A reader, and what is said of the file to people and programs."""

    def both(path: Path) -> None:
        read(path)
        tell(path)

    return both


TARGETS = [
    Target("mesh.zarr", _write_mesh, _told(_read_mesh)),
    Target("mesh.zarr.zip", _write_mesh, _told(_read_mesh)),
    Target("pairs.zarr", _write_pairs, _read_pairs),
    Target("set.zarr", _write_dataset, _read_dataset),
    Target("set.h5", _write_dataset, _read_dataset),
    Target("set.npz", _write_dataset, _read_dataset),
    Target("old.zarr", _write_old_mesh, _told(_read_mesh)),
    Target("mesh.npz", _write_mesh, _told(_read_mesh)),
    Target("body.pkl", lambda path: path.write_bytes(pickle.dumps(_person())), _told(_read_mesh)),
    Target("old.pkl", lambda path: path.write_bytes(pickle.dumps(_person(), 2)), _told(_read_mesh)),
    Target("body.joblib", lambda path: joblib.dump(_person(), path, compress=1), _told(_read_mesh)),
    Target("plain.joblib", lambda path: joblib.dump(_person(), path), _told(_read_mesh)),
    Target("body.obj", _write_surface, _told(_read_mesh)),
    Target("body.ply", _write_surface, _told(_read_mesh)),
    Target("body.glb", _write_surface, _told(_read_mesh)),
    Target("imu.npz", _write_imu, _told(read_signals)),
    Target("map.npz", _write_map, _told(DopplerMap.load)),
    Target("model.safetensors", lambda path: save_model(path, trained("s4")), _told(load_model)),
    Target(
        "gestures.safetensors",
        lambda path: save_classifier(path, classifier()),
        _told(load_classifier),
    ),
    Target("radar.h5", write_kkt, load_recorded_map),
    Target("a121.h5", write_a121, _read_capture),
    Target("dca1000", _write_dca1000, _read_capture),
    Target("live", _write_live, _read_capture),
    Target("own", _write_own, _read_capture),
    Target("hdf5", _write_own_hdf5, lambda path: _read_capture(path / "radar.h5")),
    Target("sdk", lambda path: write_ti(path, TiRecording(lanes=4)), _read_capture),
    Target("pymmw", _write_pymmw, _read_capture),
    Target("sigmf", _write_sigmf, lambda path: _read_capture(path / "radar.sigmf-meta")),
]
