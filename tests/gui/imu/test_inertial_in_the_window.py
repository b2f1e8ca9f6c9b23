"""Inertial sensors by real clicks and keys in the whole window; asserted on the models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from answering import menu_at, pick, texts_of
from dropping import drop, hover
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QCheckBox, QFileDialog, QMenu
from window_models import models_of

from sd2app.dataset_export.feature import ExportDialog
from sd2app.imu.feature import LANES, InertialTrack
from sd2app.imu.model import reading_lines
from sd2app.maps.arrangement import HEADER_PX
from sd2app.scene.inertial import PLACING_HINT
from sd2app.shell import files
from sd2core.imu.files import read_signals, write_signals
from sd2core.imu.signals import InertialSignals
from sd2core.recording.recording import open_recording

LEFT = Qt.MouseButton.LeftButton
CTRL = Qt.KeyboardModifier.ControlModifier
HANDLE, TITLE = QPoint(10, HEADER_PX // 2), QPoint(150, HEADER_PX // 2)


def settle(window, qtbot) -> None:
    qtbot.waitUntil(lambda: not models_of(window).imu.busy, timeout=20_000)


def vertex_px(window, vertex: int) -> QPoint:
    """Where a vertex of the frame on screen is in the 3D view."""
    view = window.features.scene.view
    view.grab()
    x, y, _ = view.scene.pose.project(view.scene.body.points[vertex])[0]
    return QPoint(round(x), round(y))


def front_vertex(window) -> int:
    """A vertex in front, well inside the ball's outline."""
    view = window.features.scene.view
    view.grab()
    pixels = view.scene.pose.project(view.scene.body.points)
    middle = pixels[:, :2].mean(axis=0)
    near = np.hypot(*(pixels[:, :2] - middle).T) < 0.3 * np.ptp(pixels[:, 0])
    return int(np.where(near, pixels[:, 2], np.inf).argmin())


def menu_of_scene(window, place: QPoint) -> QMenu:
    """Context menu that a right click in the 3D view brings up."""
    click_scene(window, place, Qt.MouseButton.RightButton)
    view = window.features.scene.view
    return view.findChildren(QMenu, options=Qt.FindChildOption.FindDirectChildrenOnly)[-1]


def click_scene(window, place: QPoint, button: Qt.MouseButton = LEFT) -> None:
    QTest.mouseClick(window.features.scene.view.childAt(place), button, pos=place)


@pytest.fixture
def track(window) -> InertialTrack:
    found = window.findChild(InertialTrack)
    assert found is not None
    return found


@pytest.fixture
def placed(window, track, qtbot) -> InertialTrack:
    """The track of a sensor that was placed by a key and a click."""
    qtbot.keyClick(window, Qt.Key.Key_I)
    click_scene(window, vertex_px(window, front_vertex(window)))
    settle(window, qtbot)
    yield track
    models_of(window).imu.set_folded(False)


def wrist(path: Path, start_s: float = 0.5) -> Path:
    values = np.random.default_rng(2).normal(size=(2, 100, 3))
    write_signals(path, InertialSignals(start_s + np.arange(100) / 100, *values))
    return path


def test_a_key_and_a_click_place_a_sensor_and_undo_takes_it_away(window, track, qtbot) -> None:
    models = models_of(window)
    assert not track.isVisible()
    qtbot.keyClick(window, Qt.Key.Key_I)
    assert models.placing.active
    overlay = window.features.scene.view.overlay
    assert overlay.hint == PLACING_HINT
    vertex = front_vertex(window)
    place = vertex_px(window, vertex)
    QTest.mouseMove(window.features.scene.view.childAt(place), place)
    assert overlay.reading == f"inertial sensor at vertex {vertex}"
    click_scene(window, place)
    assert models.document.recording.imu_places == (str(vertex),)
    assert not models.placing.active
    assert overlay.hint == ""
    settle(window, qtbot)
    assert track.isVisible()
    assert models.imu.signals.meta["at"] == f"vertex {vertex}"
    assert "simulated, low pass 6 Hz" in track.accessibleName()
    # On the clock of the mesh, which swings by 0.2 m once a second.
    felt = models.imu.signals.acceleration_mps2
    moved = np.linalg.norm(felt - felt.mean(axis=0), axis=1)
    assert moved.max() == pytest.approx(0.2 * (2 * np.pi) ** 2, rel=0.05)
    # A marker sits on the vertex.
    view = window.features.scene.view
    view.grab()
    np.testing.assert_allclose(view.scene.inertial.points, view.scene.body.points[[vertex]])

    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL)
    assert models.document.recording.imu_places == ()
    assert not track.isVisible()


def test_escape_and_a_click_beside_the_body_place_nothing(window, qtbot) -> None:
    models = models_of(window)
    qtbot.keyClick(window, Qt.Key.Key_I)
    click_scene(window, QPoint(5, 5))
    assert models.placing.active
    qtbot.keyClick(window, Qt.Key.Key_Escape)
    assert not models.placing.active
    click_scene(window, vertex_px(window, front_vertex(window)))
    assert models.document.recording.imu_places == ()


def test_a_drag_turns_the_view_and_places_nothing(window, qtbot) -> None:
    models, view = models_of(window), window.features.scene.view
    qtbot.keyClick(window, Qt.Key.Key_I)
    start = vertex_px(window, front_vertex(window))
    before, widget = view.scene.pose, view.childAt(start)
    QTest.mousePress(widget, LEFT, pos=start)
    QTest.mouseMove(widget, start + QPoint(30, 0))
    QTest.mouseRelease(widget, LEFT, pos=start + QPoint(30, 0))
    assert view.scene.pose != before
    assert models.placing.active
    assert models.document.recording.imu_places == ()
    models.placing.end()
    view.set_view("overview")


def test_the_menu_of_the_scene_places_and_removes(window, qtbot) -> None:
    models, view = models_of(window), window.features.scene.view
    vertex = front_vertex(window)
    place = vertex_px(window, vertex)
    pick(menu_of_scene(window, place), f"Place inertial sensor at vertex {vertex}")
    assert models.document.recording.imu_places == (str(vertex),)
    settle(window, qtbot)
    place = vertex_px(window, vertex)
    pick(menu_of_scene(window, place), f"Remove inertial sensor at vertex {vertex}")
    assert models.document.recording.imu_places == ()
    beside = QPoint(5, view.height() // 2)
    assert "Place inertial sensor…" in texts_of(menu_of_scene(window, beside))
    assert models.document.undo_stack.count() == 2


def test_the_track_shares_the_maps_time_axis(window, placed, qtbot) -> None:
    models, synthetic = models_of(window), window.maps.synthetic
    for size in ((1280, 800), (1600, 1000), (960, 640)):
        window.resize(*size)
        QApplication.processEvents()
        plot, other = placed.plot_rect(), synthetic.plot_rect()
        left, right = (
            view.mapTo(window, QPoint(round(edge), 0)).x()
            for view, edge in ((placed, plot.left()), (synthetic, other.left()))
        )
        assert (left, plot.width()) == (right, other.width())
        assert window.maps.height() >= 96
    window.resize(1280, 800)
    QApplication.processEvents()
    # Between the spans, which a double click plays.
    place = QPoint(round(placed.scale.x_of(0.9)), round(placed.lane_rect(1).center().y()))
    qtbot.mouseClick(placed, LEFT, pos=place)
    assert models.playback.time_s == pytest.approx(placed.scale.time_of(place.x()), abs=1 / 30)
    before = models.span.duration_s
    wheel = QWheelEvent(
        QPointF(place), QPointF(placed.mapToGlobal(place)), QPoint(), QPoint(0, 120),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase,
        False,
    )  # fmt: skip
    QApplication.sendEvent(placed, wheel)
    assert models.span.duration_s == pytest.approx(0.8 * before)
    qtbot.mouseDClick(placed, LEFT, pos=place)
    assert models.span.duration_s == pytest.approx(before)


def test_what_is_under_the_pointer_is_read_and_copied(window, placed, qtbot) -> None:
    models = models_of(window)
    place = placed.lane_rect(0).center().toPoint()
    QTest.mouseMove(placed, place)
    time_s = placed.scale.time_of(place.x())
    assert models.pointer.time_s == pytest.approx(time_s)
    assert models.pointer.reading is None
    pick(menu_at(placed, place), "Copy value")
    text = QApplication.clipboard().text()
    nearest = int(np.abs(models.imu.signals.times_s - time_s).argmin())
    value = f"{models.imu.signals.acceleration_mps2[nearest, 2]:+.1f}".replace("-", "−")
    assert f"z {value} m/s²" in text
    assert "simulated: x" in text


def test_the_triangle_folds_the_track_for_the_maps(window, placed, qtbot) -> None:
    models, before = models_of(window), window.maps.height()
    qtbot.mouseClick(placed, LEFT, pos=HANDLE)
    assert models.imu.folded
    QApplication.processEvents()
    assert placed.height() == HEADER_PX
    assert window.maps.height() > before
    pick(menu_at(placed, TITLE), "Unfold")
    QApplication.processEvents()
    assert window.maps.height() == before


@pytest.mark.slow
def test_lines_are_drawn_in_the_colours_of_the_axes(window, placed) -> None:
    for dark in (False, True):
        models_of(window).display.set_dark(dark)
        image = placed.grab().toImage()
        for number in range(len(LANES)):
            lane = placed.lane_rect(number).toRect()
            drawn = {
                image.pixelColor(x, y).name()
                for x in range(lane.left(), lane.right(), 2)
                for y in range(lane.top(), lane.bottom())
            }
            # A ball that swings without turning: what is zero lies on each other, the last on top.
            assert placed.axis_colours[2].name() in drawn
    models_of(window).display.set_dark(False)


def test_a_real_sensors_file_is_dropped_aligned_and_removed(
    window, track, qtbot, tmp_path: Path
) -> None:
    models = models_of(window)
    overlay = hover(window, wrist(tmp_path / "wrist.csv"))
    assert [one.text for one in overlay.drops] == ["Add to “ball”"]
    drop(window, tmp_path / "wrist.csv")
    qtbot.waitUntil(lambda: models.imu.measured is not None, timeout=20_000)
    assert models.document.recording.imu == tmp_path / "wrist.csv"
    assert models.document.recording.imu_offset_s == 0.5
    assert track.isVisible()
    assert "measured: wrist.csv" in track.accessibleName()

    step_s = track.scale.seconds_per_px
    assert track.grip_rect().isEmpty()
    pick(menu_at(track, TITLE), "Align by hand")
    grip = track.grip_rect().center().toPoint()
    qtbot.mousePress(track, LEFT, pos=grip)
    for moved in (10, 25, 40):
        qtbot.mouseMove(track, grip + QPoint(moved, 0))
    qtbot.mouseRelease(track, LEFT, pos=grip + QPoint(40, 0))
    assert models.document.recording.imu_offset_s == pytest.approx(0.5 + 40 * step_s, abs=1e-3)
    assert models.document.undo_stack.count() == 2
    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL)
    assert models.document.recording.imu_offset_s == 0.5
    pick(menu_at(track, TITLE), "Remove wrist.csv")
    assert models.document.recording.imu is None
    assert not track.isVisible()


@pytest.mark.parametrize("name", ["open", "add"])
def test_a_real_sensors_file_is_opened_beside_what_is_open(
    window, name: str, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    models, path = models_of(window), wrist(tmp_path / "wrist.csv")
    before = models.document.recording
    monkeypatch.setattr(files, "ask_to_open", lambda *_, **__: [path])
    window.action(name).trigger()
    qtbot.waitUntil(lambda: models.imu.measured is not None, timeout=20_000)
    assert models.document.recording is before
    assert before.imu == path
    assert models.document.undo_stack.undoText() == "Add inertial sensor's file"


def test_a_simulated_sensors_file_is_not_called_measured(
    window, track, qtbot, tmp_path: Path
) -> None:
    models, path = models_of(window), tmp_path / "wrist.csv"
    signals = read_signals(wrist(path))
    assert not signals.simulated
    write_signals(path, replace(signals, meta={"at": "left-wrist", "simulated": True}))
    models.imu.add_file(path)
    qtbot.waitUntil(lambda: models.imu.measured is not None, timeout=20_000)
    assert "simulated file: wrist.csv" in track.accessibleName()
    assert "measured" not in track.accessibleName()
    lines = reading_lines(models.imu, models.imu.offset_s)
    assert len(lines) > 1
    assert not any("measured" in line for line in lines)


def test_a_table_of_labels_is_still_one_of_labels(window, tmp_path: Path) -> None:
    labels = tmp_path / "labels.csv"
    labels.write_text("start_s,end_s,label\n0.1,0.2,there\n")
    overlay = hover(window, labels)
    assert [one.text for one in overlay.drops] == ["Import these labels"]
    overlay.hide()


def test_signals_are_saved_from_the_tracks_menu(
    window, placed, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    models, asked = models_of(window), []

    def choose(parent, title, start, kinds):
        asked.append((start, kinds))
        return str(tmp_path / "out"), kinds

    monkeypatch.setattr(QFileDialog, "getSaveFileName", choose)
    pick(menu_at(placed, TITLE), "Save signals as…")
    qtbot.waitUntil((tmp_path / "out.csv").exists, timeout=20_000)
    ((start, kinds),) = asked
    assert start.startswith("ball-vertex-")
    assert all(ending in kinds for ending in ("*.csv", "*.sto", "*.npz"))
    qtbot.waitUntil(lambda: not models.jobs.jobs, timeout=20_000)
    again = read_signals(tmp_path / "out.csv")
    np.testing.assert_allclose(again.channels, models.imu.signals.channels, rtol=1e-6, atol=1e-8)


def test_sensors_are_saved_and_exported_where_places_have_names(
    labelled, qtbot, recording_copy: Path
) -> None:
    """The ball has no named places; the recording keeps one all the same, and says so."""
    window, models = labelled, models_of(labelled)
    vertex = front_vertex(window)
    models.imu.place(vertex)
    settle(window, qtbot)
    qtbot.keyClick(window, Qt.Key.Key_S, CTRL)
    qtbot.waitUntil(lambda: not models.document.modified, timeout=20_000)
    assert open_recording(recording_copy).imu_places == (str(vertex),)
    qtbot.keyClick(window, Qt.Key.Key_D, CTRL | Qt.KeyboardModifier.ShiftModifier)
    dialog = QApplication.activeModalWidget()
    assert isinstance(dialog, ExportDialog)
    boxes = dialog.findChildren(QCheckBox)
    (box,) = (one for one in boxes if one.accessibleName() == "Inertial sensors")
    assert (box.text(), box.isEnabled(), box.isChecked()) == ("none placed", False, False)
    qtbot.waitUntil(lambda: not models.export.counting, timeout=20_000)
    dialog.close()
