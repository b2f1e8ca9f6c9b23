"""One way in: dialog, drop, recent and command line open the same things in the same way."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from answering import answer, once_asked, press_when_ready
from dropping import drop, hover
from PySide6.QtCore import QDir, QSettings, Qt, QTimer
from PySide6.QtGui import QDragLeaveEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit, QListView, QMenu
from window_models import menu_of, models_of

from sd2app.fit.request import FitRequest
from sd2app.foreign_mesh.feature import MeshDialog
from sd2app.settings import Settings
from sd2app.shell.open_dialog import OpenDialog, can_be_opened

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def begun_fit(small_recording, tmp_path) -> FitRequest:
    """A fit that was stopped, in a folder of its own."""
    video = Path(shutil.copy(small_recording / "video.mp4", tmp_path / "walk.mp4"))
    request = FitRequest(video, tmp_path / "walk.sd2")
    request.save()
    return request


def type_name(path: Path):
    """Answer to the dialog: type a path and press Return."""

    def type_it(dialog: OpenDialog) -> None:
        line = dialog.findChild(QLineEdit, "fileNameEdit")
        line.setText(str(path))  # what is typed is completed in a popup
        QTest.keyClick(line, Qt.Key.Key_Return)

    return type_it


def double_click(name: str):
    """Answer to the dialog: double click an entry, as soon as it is listed."""

    def click(dialog: OpenDialog) -> None:
        view = dialog.findChild(QListView, "listView")
        model, root = view.model(), view.rootIndex()
        rows = [model.index(row, 0, root) for row in range(model.rowCount(root))]
        found = [one for one in rows if one.data() == name]
        if not found:
            QTimer.singleShot(20, lambda: click(dialog))
            return
        view.scrollTo(found[0])
        at = view.visualRect(found[0]).center()
        QTest.mouseClick(view.viewport(), Qt.MouseButton.LeftButton, pos=at)
        QTest.mouseDClick(view.viewport(), Qt.MouseButton.LeftButton, pos=at)

    return click


def press(window, qtbot, key, modifiers=CONTROL) -> None:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    QTest.keyClick(window, key, modifiers)


def open_with(window, qtbot, answer) -> None:
    once_asked(OpenDialog, answer)
    with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
        press(window, qtbot, Qt.Key.Key_O)


def recent_menu(window) -> QMenu:
    menus = menu_of(window, "&File").findChildren(QMenu)
    menu = next(one for one in menus if one.title().replace("&", "") == "Open recent")
    menu.aboutToShow.emit()
    return menu


def test_one_dialog_opens_a_recording_a_capture_and_a_file(empty_window, qtbot, small_recording):
    document = models_of(empty_window).document
    open_with(empty_window, qtbot, type_name(small_recording))
    assert document.recording.folder == small_recording
    open_with(empty_window, qtbot, type_name(small_recording / "radar"))
    assert document.capture is not None
    assert document.video is None
    open_with(empty_window, qtbot, type_name(small_recording / "video.mp4"))
    assert document.video is not None
    assert document.capture is None


def test_a_double_click_opens_a_recording_and_enters_other_folders(qtbot, recording_copy):
    dialog = OpenDialog(None, "Open", recording_copy.parent)
    qtbot.addWidget(dialog)
    (recording_copy.parent / "more").mkdir()
    dialog.show()
    entered = double_click("more")
    with qtbot.waitSignal(dialog.directoryEntered, timeout=20_000):
        entered(dialog)
    assert dialog.isVisible()
    assert not dialog.paths
    dialog.setDirectory(QDir(str(recording_copy.parent)))
    with qtbot.waitSignal(dialog.accepted, timeout=20_000):
        double_click("ball.sd2")(dialog)
    assert dialog.paths == [recording_copy]


def test_folders_that_can_be_opened(small_recording, begun_fit, tmp_path):
    (tmp_path / "empty").mkdir()
    assert can_be_opened(small_recording)
    assert can_be_opened(small_recording / "radar")
    assert can_be_opened(begun_fit.folder)
    assert not can_be_opened(tmp_path / "empty")
    assert not can_be_opened(tmp_path / "missing")


def test_whatever_is_opened_or_saved_is_recent(empty_window, qtbot, recording_copy, tmp_path):
    c, settings = models_of(empty_window), empty_window.session.settings
    video, mesh = recording_copy / "video.mp4", recording_copy / "mesh.npz"
    open_with(empty_window, qtbot, type_name(recording_copy))
    assert settings.recent == [(recording_copy,)]
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        drop(empty_window, video, on=1)
    assert settings.recent == [(video,), (recording_copy,)]
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.open_paths([video, mesh])  # the command line
    assert settings.recent[0] == (video, mesh)
    with qtbot.waitSignal(c.document.failed, timeout=20_000):
        empty_window.open_paths([tmp_path / "missing.mp4"])
    assert settings.recent[0] == (video, mesh)
    saved = tmp_path / "saved.sd2"
    once_asked(QFileDialog, type_name(saved))
    press(empty_window, qtbot, Qt.Key.Key_S, CONTROL | SHIFT)
    assert settings.recent[0] == (saved,)
    # What was opened together is opened together again.
    entry = recent_menu(empty_window).actions()[1]
    assert entry.text().replace("&", "") == f"{video} + mesh.npz"
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        entry.trigger()
    assert c.document.paths == (video, mesh)


def test_recent_files_are_kept_between_sessions(tmp_path):
    store = QSettings(str(tmp_path / "settings.ini"), QSettings.Format.IniFormat)
    settings = Settings(store)
    for number in range(12):
        settings.add_recent(Path(f"/{number}.mp4"), Path(f"/{number}.npz"))
    settings.add_recent(Path("/5.mp4"), Path("/5.npz"))
    again = Settings(store).recent
    assert len(again) == 10
    assert again[:2] == [(Path("/5.mp4"), Path("/5.npz")), (Path("/11.mp4"), Path("/11.npz"))]


@pytest.mark.parametrize(
    "way",
    ["command line"]
    + [pytest.param(one, marks=pytest.mark.slow) for one in ("dialog", "drop", "recent")],
)
def test_every_way_of_opening_takes_up_a_stopped_fit(empty_window, qtbot, begun_fit, way):
    c = models_of(empty_window)
    if way == "recent":
        empty_window.session.settings.add_recent(begun_fit.folder)
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        if way == "dialog":
            once_asked(OpenDialog, type_name(begun_fit.folder))
            QTest.keyClick(empty_window, Qt.Key.Key_O, CONTROL)
        elif way == "drop":
            drop(empty_window, begun_fit.folder)
        elif way == "recent":
            recent_menu(empty_window).actions()[0].trigger()
        else:
            empty_window.open_paths([begun_fit.folder])
    assert c.fit.state == "stopped"
    assert c.fit.request.folder == begun_fit.folder
    assert c.document.paths == (begun_fit.video,)
    assert (begun_fit.folder,) in empty_window.session.settings.recent


@pytest.mark.slow
def test_a_recording_whose_fit_was_stopped_is_opened_itself(empty_window, qtbot, recording_copy):
    c = models_of(empty_window)
    FitRequest(recording_copy / "video.mp4", recording_copy).save()
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.open_paths([recording_copy])
    assert c.fit.state == "stopped"
    assert c.document.recording.folder == recording_copy


@pytest.mark.slow
def test_hovering_says_what_a_drop_would_do(empty_window, qtbot, small_recording, tmp_path):
    c = models_of(empty_window)
    video, mesh = small_recording / "video.mp4", small_recording / "mesh.npz"
    overlay = hover(empty_window, video)
    assert overlay.isVisible()
    assert [one.text for one in overlay.drops] == ["Open"]
    QApplication.sendEvent(empty_window, QDragLeaveEvent())
    assert not overlay.isVisible()
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        drop(empty_window, video)
    for paths, words in (
        ([mesh], ["Add to “video”", "Open instead of “video”"]),
        ([video], ["Add to “video”", "Open instead of “video”"]),
        ([small_recording], ["Open instead of “video”"]),
    ):
        if paths == [video]:
            paths = [Path(shutil.copy(video, tmp_path / "other.mp4"))]
            words = ["Replace the video of “video”", words[1]]
        assert [one.text for one in hover(empty_window, *paths).drops] == words
    press_when_ready(MeshDialog, "Take")
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        drop(empty_window, mesh, on=0)
    assert c.document.video is not None
    assert c.document.mesh is not None
    answer(qtbot, "Discard")
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        drop(empty_window, small_recording / "radar", on=1)
    assert c.document.mesh is None
    assert c.document.capture is not None


@pytest.mark.slow
def test_a_file_of_the_sensor_before_the_a121_is_called_what_it_is(window, qtbot, tmp_path) -> None:
    file = tmp_path / "hand.h5"
    with h5py.File(file, "w") as made:
        made["data"] = np.zeros((4, 1, 8, 5), np.uint16)
        for name, text in (("mode", "sparse"), ("sensor_config_dump", "{}")):
            made.create_dataset(name, data=text, dtype=h5py.string_dtype())
    hover(window, file)
    drop(window, file)
    qtbot.waitUntil(lambda: bool(window.messages.text), timeout=10_000)
    assert "A111" in window.messages.text
    assert "K60168A" not in window.messages.text
