"""Two meshes of one video side by side, by mouse and keys."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from copied import copied_record
from finding import button_of, words_in
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QComboBox, QFileDialog, QToolButton
from window_models import models_of

from sd2app.mesh_comparison.feature import (
    ComparedPicture,
    ComparisonWindow,
    JointCurves,
    JointTable,
    mesh_of,
)
from sd2app.mesh_comparison.model import joint_words, name_of
from sd2core.body.model import Body
from sd2core.body.rotations import about
from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import MeshReading, Recording
from sd2core.sensor import Beam, VirtualSensor
from sd2core.timebase import Timebase
from tools.build_sample.swipes import posed

ASIDE_M = 0.05
TIMES = np.arange(36) / 30.0


@pytest.fixture(scope="module")
def waving() -> MeshSequence:
    """The coarse body at 2.5 m swings its right forearm by 70°."""
    body = Body.load("low")
    turns = np.tile(np.eye(3), (len(TIMES), len(body.skeleton), 1, 1))
    swing = np.clip((TIMES - 0.3) / 0.6, 0.0, 1.0)
    elbow = body.skeleton.index["lowerarm01.R"]
    turns[:, elbow] = about(np.array([1.0, 0.0, 0.0]), -70.0 * np.sin(np.pi * swing) ** 2)
    vertices = (posed(body, turns) + np.array([0.0, 1.0, 2.5])).astype(np.float32)
    return MeshSequence(vertices, body.faces, Timebase(TIMES))


@pytest.fixture
def meshes(waving, tmp_path) -> tuple[Path, Path]:
    """The mesh of a recording, and the same mesh 5 cm aside."""
    own, other = tmp_path / "own.npz", tmp_path / "aside.npz"
    save_mesh(waving, own)
    moved = np.asarray(waving.vertices) + np.array([ASIDE_M, 0, 0], np.float32)
    save_mesh(replace(waving, vertices=moved), other)
    return own, other


@pytest.fixture
def compared(empty_window, meshes, qtbot):
    """The window of the comparison, everything worked out."""
    return compare(empty_window, *meshes, qtbot)


def compare(empty_window, own: Path, other: Path, qtbot) -> ComparisonWindow:
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([own])
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    empty_window.features.mesh_comparison.compare(other)
    window = empty_window.findChild(ComparisonWindow)
    qtbot.waitUntil(lambda: window.model.comparison is not None, timeout=30_000)
    return window


def of_joint(window, joint: str):
    """Distance, velocity and correlation of a joint."""
    found, number = window.model.difference, window.model.joints.index(joint)
    return found.distance_m[number], found.velocity_rms_mps[number], found.correlation[number]


def test_a_known_shift_is_what_is_found(compared):
    model = compared.model
    assert model.labels == ("own.npz", "aside.npz")
    assert model.difference.distance_m == pytest.approx(ASIDE_M, abs=1e-4)
    one, other = (found.jitter_mps3 for found in model.comparison.differences)
    assert one == pytest.approx(other, rel=1e-2, abs=1.0)
    # Seen from the camera the two hands move nearly alike.
    _, velocity_rms_mps, correlation = of_joint(compared, "hand.R")
    assert correlation > 0.99
    assert velocity_rms_mps < 0.1
    table = compared.findChild(JointTable)
    cells = [table.item(0, column).text() for column in range(table.columnCount())]
    assert cells[:2] == ["Head", f"{100 * ASIDE_M:.1f}"]
    assert cells[4:] == [f"{jitter[0]:.0f}" for jitter in (one, other)]
    times_s, velocity = model.curve(0)
    assert len(times_s) == len(TIMES)
    assert np.abs(velocity).max() > 0.5
    assert model.tracks[0].map.values.max() > 0
    assert model.tracks[0].reference == model.tracks[1].reference


def test_the_command_compares_the_same_meshes(compared, meshes, qtbot):
    qtbot.mouseClick(button_of(compared, "Copy command"), Qt.MouseButton.LeftButton)
    command = copied_record()
    assert command.meshes == meshes
    assert (command.labels, command.reference) == (["own.npz", "aside.npz"], "own.npz")


def test_the_command_reads_the_mesh_as_the_recording_does(
    empty_window, waving, meshes, tmp_path, qtbot
):
    np.savez(tmp_path / "mm.npz", vertices=1000 * waving.vertices, faces=waving.faces, fps=30)
    walk = Recording.create(
        tmp_path / "walk.sd2", mesh=tmp_path / "mm.npz", mesh_reading=MeshReading(scale=0.001)
    )
    window = compare(empty_window, walk.folder, meshes[1], qtbot)
    qtbot.mouseClick(button_of(window, "Copy command"), Qt.MouseButton.LeftButton)
    assert copied_record().meshes == (walk.folder, meshes[1])


def test_a_click_in_the_table_shows_that_joint(compared, qtbot):
    table = compared.findChild(JointTable)
    row = next(k for k in range(table.rowCount()) if table.item(k, 0).text() == "Left elbow")
    place = table.visualItemRect(table.item(row, 1)).center()
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert compared.model.joint == "elbow.L"
    assert np.abs(compared.model.curve(0)[1]).max() < 0.1  # it is the right one that swings


@pytest.mark.slow
def test_a_click_in_the_curves_moves_the_clock(compared, empty_window, qtbot):
    curves = compared.findChild(JointCurves)
    place = QPoint(round(curves.scale.x_of(0.6)), curves.height() // 2)
    qtbot.mouseClick(curves, Qt.MouseButton.LeftButton, pos=place)
    assert models_of(empty_window).playback.time_s == pytest.approx(0.6, abs=1 / 30)


def test_the_keys_of_the_main_window_work_here(compared, empty_window, qtbot):
    playback = models_of(empty_window).playback
    before = playback.frame
    compared.activateWindow()
    qtbot.waitUntil(compared.isActiveWindow)
    qtbot.keyClick(compared, Qt.Key.Key_Right)
    assert playback.frame == before + 1


@pytest.mark.slow
def test_the_other_one_can_be_the_reference(compared, qtbot):
    choice = compared.findChild(QComboBox)
    qtbot.keyClick(choice, Qt.Key.Key_Down)
    qtbot.waitUntil(lambda: compared.model.comparison.reference == 1, timeout=20_000)
    assert of_joint(compared, "head")[0] == pytest.approx(ASIDE_M, abs=1e-4)


@pytest.mark.slow
def test_it_follows_the_sensor(compared, empty_window, qtbot):
    sensor = VirtualSensor(position_m=(1.5, 0.0, 1.0))
    models_of(empty_window).edits.place_sensor(replace(sensor, beam=Beam(20.0, 20.0)))
    qtbot.waitUntil(lambda: compared.model.comparison.sensor == sensor, timeout=20_000)


@pytest.mark.slow
def test_each_mesh_is_drawn_in_its_own_colour(compared, qtbot):
    def tinted(picture) -> tuple[int, int]:
        image = picture.grab().toImage()
        colours = [
            image.pixelColor(x, y)
            for x in range(0, image.width(), 4)
            for y in range(30, image.height(), 4)
        ]
        blue = sum(c.blue() - c.red() > 40 for c in colours)
        orange = sum(c.red() - c.blue() > 40 for c in colours)
        return blue, orange

    first, second = (tinted(picture) for picture in compared.findChildren(ComparedPicture))
    assert first[0] > 100
    assert first[1] == 0
    assert second[0] == 0
    assert second[1] > 100


@pytest.mark.slow
def test_the_figure_is_written(compared, qtbot, tmp_path, monkeypatch):
    path = tmp_path / "both.svg"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *a, **k: (str(path), ""))
    qtbot.mouseClick(compared.findChild(QToolButton), Qt.MouseButton.LeftButton)
    assert "<svg" in path.read_text()[:600]


@pytest.mark.slow
def test_another_recording_closes_it(compared, empty_window, meshes, qtbot):
    with qtbot.waitSignal(compared.closed, timeout=20_000):
        empty_window.open_paths([meshes[1]])
    qtbot.waitUntil(lambda: empty_window.findChild(ComparisonWindow) is None)


def test_what_cannot_be_compared_is_explained(empty_window, small_recording, meshes, qtbot):
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([small_recording])
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    empty_window.features.mesh_comparison.compare(
        small_recording / "mesh.npz"
    )  # a ball has no joints
    window = empty_window.findChild(ComparisonWindow)
    qtbot.waitUntil(lambda: bool(window.model.problem), timeout=20_000)
    (warning,) = words_in(window, "warning")
    assert "joints" in warning


def test_names(tmp_path):
    assert name_of(Path("a/walk.sd2/mesh.zarr")) == "walk.sd2"
    assert name_of(Path("a/vibe_output.pkl")) == "vibe_output.pkl"
    assert mesh_of(tmp_path / "walk.zarr" / "zarr.json") == tmp_path / "walk.zarr"
    assert mesh_of(tmp_path / "frames" / "f_01.obj") == tmp_path / "frames" / "f_01.obj"
    (tmp_path / "frames").mkdir()
    assert mesh_of(tmp_path / "frames" / "f_01.obj") == tmp_path / "frames"
    assert joint_words("hand.R") == "Right hand"
    assert joint_words("pelvis") == "Pelvis"


def test_the_mesh_of_another_recording(empty_window, meshes, tmp_path, qtbot):
    other = Recording.create(tmp_path / "other.sd2", mesh=meshes[1])
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([meshes[0]])
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    empty_window.features.mesh_comparison.compare(other.folder)
    model = empty_window.findChild(ComparisonWindow).model
    qtbot.waitUntil(lambda: model.comparison is not None, timeout=20_000)
    assert model.labels == ("own.npz", "other.sd2")
