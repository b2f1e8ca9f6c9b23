from __future__ import annotations

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.sensor import VelocityAxis
from sd2core.spectrum import DopplerMap
from sd2core.timebase import Timebase


def test_files_are_told_apart(tmp_path):
    for name, kind in (
        ("a.MP4", "video"),
        ("b.obj", "mesh"),
        ("c.pkl", "mesh"),
        ("d.zarr.zip", "mesh"),
        ("radar.npy", "radar"),
        ("recording.json", "recording"),
    ):
        (tmp_path / name).touch()
        assert kind_of(tmp_path / name) == kind, name
    np.savez(tmp_path / "mesh.npz", vertices=np.zeros((1, 1, 3)))
    assert kind_of(tmp_path / "mesh.npz") == "mesh"
    values = np.ones((4, 2), np.float32)
    DopplerMap(values, VelocityAxis(4), Timebase([0, 1]), "real").save(tmp_path / "map.npz")
    assert kind_of(tmp_path / "map.npz") == "map"


def test_folders_are_told_apart(tmp_path):
    for name, inside, kind in (
        ("x.sd2", "recording.json", "recording"),
        ("mesh.zarr", "zarr.json", "mesh"),
        ("frames", "frame_001.ply", "mesh"),
        ("capture", "radar.npy", "radar"),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / inside).touch()
        assert kind_of(tmp_path / name) == kind
    (tmp_path / "outer" / "RadarIfxAvian_00").mkdir(parents=True)
    (tmp_path / "outer" / "RadarIfxAvian_00" / "radar.npy").touch()
    assert kind_of(tmp_path / "outer") == "radar"
    assert kind_of(tmp_path / "frames" / "*.ply") == "mesh"


def test_what_is_nothing_known_is_explained(tmp_path):
    (tmp_path / "notes.txt").touch()
    (tmp_path / "bad.npz").write_text("no zip")
    (tmp_path / "empty").mkdir()
    for name, words in (
        ("notes.txt", "is of no kind that is known"),
        ("missing.mp4", "does not exist"),
        ("bad.npz", "is not a readable .npz"),
        ("empty", "holds nothing that is known"),
    ):
        with pytest.raises(Sd2Error) as caught:
            kind_of(tmp_path / name)
        assert words in str(caught.value)
        assert name in str(caught.value)
