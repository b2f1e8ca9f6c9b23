"""Labels imported and exported by real keys, drops and clicks in the whole window."""

from __future__ import annotations

from pathlib import Path

import pytest
from answering import once_asked
from copied import copied_record
from dropping import drop, hover
from finding import button_of, named
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QFileDialog, QPushButton
from window_models import models_of

from sd2app.labels.exports import LabelExportDialog
from sd2app.labels.import_dialog import LabelImportDialog, import_labels
from sd2app.widgets.inputs import Choice
from sd2core.cli.labels import Convert
from sd2core.labels.formats import FORMATS, read_labels, write_labels
from sd2core.labels.spans import Labels, LabelTrack, Span

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


@pytest.fixture
def theirs(window, tmp_path) -> Path:
    """Ben's file: one span within, one that ends after the recording (2 s)."""
    spans = (Span(1, "Ben", 0.5, 1.0, "wave"), Span(2, "Ben", 1.5, 2.5, "up-to-down"))
    path = tmp_path / "ben.eaf"
    write_labels(path, Labels((LabelTrack("Ben"),), spans), models_of(window).playback.timebase)
    return path


def choose(monkeypatch, which: str, path: Path) -> None:
    monkeypatch.setattr(QFileDialog, which, lambda *_: (str(path), ""))


def button(dialog, text: str) -> QPushButton:
    return next(one for one in dialog.findChildren(QPushButton) if one.text() == text)


def key(window, qtbot, name: str, modifier) -> None:
    """After a dialog the window has the keyboard again, sooner or later."""
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    qtbot.keyClick(window, getattr(Qt.Key, f"Key_{name}"), modifier)


def press(qtbot, text: str, way: str = ""):
    """Answer an import."""

    def work(dialog: LabelImportDialog) -> None:
        for one in dialog.findChildren(QComboBox):
            if way and one.findText(way) >= 0:
                one.setCurrentText(way)
        qtbot.mouseClick(button(dialog, text), LEFT)

    once_asked(LabelImportDialog, work)


def test_an_import_is_one_step(window, theirs, qtbot, monkeypatch) -> None:
    c = models_of(window)
    before = c.labels.labels
    choose(monkeypatch, "getOpenFileName", theirs)
    press(qtbot, "Import")
    key(window, qtbot, "I", CONTROL)
    added = [span for span in c.labels.labels.spans if span.track == "Ben"]
    assert [(span.start_s, span.end_s, span.label) for span in added] == [
        (0.5, 1.0, "wave"),
        (1.5, pytest.approx(2.0), "up-to-down"),
    ]
    assert set(before.spans) < set(c.labels.labels.spans)
    assert c.document.undo_stack.undoText() == "Import 2 spans"
    key(window, qtbot, "Z", CONTROL)
    assert c.labels.labels == before
    assert not c.document.modified


def test_an_import_is_copied_as_a_command(window, theirs, qtbot, monkeypatch) -> None:
    choose(monkeypatch, "getOpenFileName", theirs)

    def copy(dialog: LabelImportDialog) -> None:
        qtbot.mouseClick(button_of(dialog, "Copy command"), LEFT)
        qtbot.mouseClick(button(dialog, "Cancel"), LEFT)

    once_asked(LabelImportDialog, copy)
    key(window, qtbot, "I", CONTROL)
    command = copied_record()
    assert isinstance(command, Convert)
    assert (command.file, command.out) == (theirs, Path("ben-imported.json"))
    assert command.recording == models_of(window).document.recording.folder


def test_a_dropped_file_is_imported(window, theirs, qtbot) -> None:
    c = models_of(window)
    assert [one.text for one in hover(window, theirs).drops] == ["Import these labels"]
    press(qtbot, "Import", "instead of all labels of this recording")
    drop(window, theirs)
    qtbot.waitUntil(lambda: len(c.labels.labels.tracks) == 1 and c.document.modified)
    assert [track.name for track in c.labels.labels.tracks] == ["Ben"]
    assert c.document.undo_stack.count() == 1


def test_cancelled_is_cancelled(window, theirs, qtbot, monkeypatch) -> None:
    choose(monkeypatch, "getOpenFileName", theirs)
    press(qtbot, "Cancel")
    key(window, qtbot, "I", CONTROL)
    assert models_of(window).document.undo_stack.count() == 0


def test_without_a_recording_it_says_what_to_do(empty_window, tmp_path) -> None:
    import_labels(empty_window, models_of(empty_window).label_edits, tmp_path / "ben.eaf")
    assert "Nothing is open" in empty_window.messages.text


def test_export_to_every_format_and_back(window, qtbot, monkeypatch, tmp_path) -> None:
    c = models_of(window)
    spans = [(span.start_s, span.end_s, span.label) for span in c.labels.labels.spans]
    for number, one in enumerate(FORMATS):
        # A name with a point in it has no ending yet.
        path = tmp_path / f"take {number}.5 m{one.suffixes[0]}"
        choose(monkeypatch, "getSaveFileName", path.with_suffix(""))

        def work(dialog: LabelExportDialog, title: str = one.title) -> None:
            named(dialog, "The program that is to read", Choice).setCurrentText(title)
            qtbot.mouseClick(button(dialog, "Export…"), LEFT)

        once_asked(LabelExportDialog, work)
        key(window, qtbot, "I", CONTROL | SHIFT)
        assert f"Wrote {path} with 2 spans." in window.messages.text
        read = read_labels(path, c.playback.timebase, one.name).spans
        assert [(span.start_s, span.end_s, span.label) for span in read] == [
            (pytest.approx(start_s, abs=5e-4), pytest.approx(end_s, abs=5e-4), label)
            for start_s, end_s, label in spans
        ]
