"""A small recording, and the whole window on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from fake_accuracy import FakeAccuracy
from fake_classifiers import FakeClassifiers
from fake_denoisers import FakeDenoisers
from grey_video import FRAMES, RATE, write_video
from PySide6.QtCore import QPoint
from PySide6.QtGui import QCursor
from whole_window import close_window, new_window, opened

from sd2core.io.mesh import save_mesh
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording, Span
from sd2core.timebase import Timebase


def swinging_ball() -> MeshSequence:
    """A ball of 0.3 m at 2 m that swings by 0.2 m along the line of sight, once a second."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    times_s = np.arange(FRAMES) / RATE
    depth = 2.0 + 0.2 * np.sin(2 * np.pi * times_s)
    vertices = np.repeat(ball.vertices[None], FRAMES, axis=0).astype(np.float32)
    vertices[:, :, 2] += depth[:, None].astype(np.float32)
    return MeshSequence(vertices, np.asarray(ball.faces, np.int32), Timebase(times_s))


@pytest.fixture(scope="session")
def small_recording(tmp_path_factory) -> Path:
    """Folder of a recording with video, mesh, simulated radar and two spans."""
    folder = tmp_path_factory.mktemp("recordings") / "ball.sd2"
    folder.mkdir()
    write_video(folder / "video.mp4")
    save_mesh(swinging_ball(), folder / "mesh.npz")
    samples = np.random.default_rng(1).integers(
        1800, 2200, (FRAMES, 1, PAPER_RADAR.chirps_per_frame, PAPER_RADAR.samples_per_chirp)
    )
    write_capture(
        folder / "radar",
        samples.astype(np.uint16),
        PAPER_RADAR,
        np.arange(FRAMES) / RATE,
        simulated=True,
    )
    Recording.create(
        folder,
        video=folder / "video.mp4",
        mesh=folder / "mesh.npz",
        radar=folder / "radar",
        spans=(Span(start_s=0.2, end_s=0.8, label="there"), Span(start_s=1, end_s=2, label="back")),
        title="ball",
        simulated=True,
    )
    return folder


@pytest.fixture
def recording_copy(small_recording, tmp_path) -> Path:
    """The small recording in a folder of its own, to be changed."""
    import shutil

    return Path(shutil.copytree(small_recording, tmp_path / small_recording.name))


@pytest.fixture(autouse=True)
def pointer_elsewhere(qapp) -> None:
    """The pointer is where no test left it: what goes where it is already is no move."""
    QCursor.setPos(QPoint(5_000, 5_000))


@pytest.fixture(autouse=True)
def own_data(tmp_path_factory, monkeypatch) -> Path:
    """Runs and models of whoever runs the tests are left alone."""
    folder = tmp_path_factory.mktemp("data")
    monkeypatch.setenv("XDG_DATA_HOME", str(folder))
    return folder


@pytest.fixture
def fake() -> FakeAccuracy:
    """Chooses exact visibility unless a test tells it otherwise."""
    return FakeAccuracy()


@pytest.fixture
def fake_models() -> FakeDenoisers:
    """No model, unless a test adds some."""
    return FakeDenoisers()


@pytest.fixture
def fake_classes() -> FakeClassifiers:
    """No classifier, unless a test adds some."""
    return FakeClassifiers()


@pytest.fixture
def fakes(fake, fake_models, fake_classes):
    """What the window is made with, by the names of the fixtures."""
    return {"fake": fake, "fake_models": fake_models, "fake_classes": fake_classes}


@pytest.fixture
def empty_window(qtbot, compiled_kernels, fakes):
    """A new window without a recording, all views in place."""
    window = new_window(qtbot, **fakes)
    yield window
    for one in fakes.values():
        one.gate.set()
    close_window(window)


@pytest.fixture
def window(qtbot, empty_window, small_recording):
    """The window on the small recording, everything computed."""
    return opened(empty_window, qtbot, small_recording)


@pytest.fixture
def labelled(qtbot, empty_window, recording_copy):
    """The window on the small recording: "there" 0.2 to 0.8 s, "back" 1 to 2 s, 60 frames."""
    return opened(empty_window, qtbot, recording_copy)
