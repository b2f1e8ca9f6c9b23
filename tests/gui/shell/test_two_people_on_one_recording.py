"""Two people on one recording: who edits, and what saving does after the other has saved."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest
from answering import answer
from left_behind import end_process
from PySide6.QtCore import Qt
from whole_window import close_window, new_window
from window_models import models_of

from sd2app.labels.recovery import LabelNotice
from sd2app.shell import files
from sd2core.labels.recovery import offers_in, recovery_folder
from sd2core.labels.spans import Span
from sd2core.recording.recording import open_recording

CONTROL = Qt.KeyboardModifier.ControlModifier
THERE, BACK = ("there", 6, 24), ("back", 30, 60)
MINE, THEIRS = ("left-to-right", 24, 28), ("right-to-left", 0, 4)


@pytest.fixture
def on(empty_window, qtbot):
    """Opens something in the window."""

    def open_path(path, window=empty_window):
        with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
            window.open_paths([path])
        return window

    return open_path


@pytest.fixture
def other_window(empty_window, qtbot, fakes, monkeypatch, tmp_path):
    """A window of somebody with a home of their own."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home of another"))
    window = new_window(qtbot, **fakes)
    yield window
    close_window(window)


def spans_of(labels) -> list[tuple[str, int, int]]:
    return [(one.label, round(30 * one.start_s), round(30 * one.end_s)) for one in labels.spans]


def shown(window):
    return spans_of(models_of(window).labels.labels)


def on_disk(path):
    return spans_of(open_recording(path).labelled)


def press(window, qtbot, key, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
    """Press a key in one of two windows, or after a question."""
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    qtbot.keyClick(window, key, modifiers)


def mark(window, qtbot, span) -> None:
    for frame in span[1:]:
        models_of(window).playback.seek_frame(frame)
        key = Qt.Key.Key_1 if span[0] == MINE[0] else Qt.Key.Key_2
        press(window, qtbot, key)


def save(window, qtbot, button: str = "", asked: list[str] | None = None) -> None:
    """Save by key, and answer the question that is asked."""
    if button:
        answer(qtbot, button, asked)
    press(window, qtbot, Qt.Key.Key_S, CONTROL)


def undo(window, qtbot) -> None:
    press(window, qtbot, Qt.Key.Key_Z, CONTROL)


def saved_by_another(path, span=THEIRS, without=(), **settings) -> None:
    """What another program does to a recording meanwhile."""
    theirs = open_recording(path)
    label, first, stop = span
    new = Span(theirs.labelled.next_id, "Gestures", first / 30, stop / 30, label)
    theirs.labels = theirs.labelled.with_spans([new], without=without)
    for name, value in settings.items():
        setattr(theirs, name, value)
    theirs.save()


class TestTheLockBesideTheRecording:
    @pytest.mark.slow
    def test_one_with_another_home_sees_who_edits_and_only_looks(
        self, on, other_window, qtbot, recording_copy, small_recording
    ) -> None:
        first = on(recording_copy)
        second = on(recording_copy, other_window)
        assert models_of(first).label_session.refusal == ""
        refusal = models_of(second).label_session.refusal
        assert " on " in refusal
        assert "since" in refusal
        assert second.findChild(LabelNotice).text == f"Labels are read-only: {refusal}."
        mark(second, qtbot, THEIRS)
        assert shown(second) == [THERE, BACK]
        mark(first, qtbot, MINE)
        save(first, qtbot)
        on(small_recording, first)
        qtbot.waitUntil(lambda: not list(recording_copy.glob(".edited*")), timeout=20_000)
        second.action("edit_labels_here").trigger()
        assert models_of(second).label_session.refusal == ""
        assert shown(second) == [THERE, MINE, BACK]
        mark(second, qtbot, THEIRS)
        save(second, qtbot)
        assert on_disk(recording_copy) == [THEIRS, THERE, MINE, BACK]

    @pytest.mark.slow
    def test_where_the_folder_cannot_be_written_labels_are_edited_all_the_same(
        self, on, qtbot, recording_copy
    ) -> None:
        for name in (".edited.lock", ".edited-by.json"):
            (recording_copy / name).mkdir()  # root may write to any folder
        window = on(recording_copy)
        assert models_of(window).label_session.refusal == ""
        mark(window, qtbot, MINE)
        assert len(list(recovery_folder().rglob("*.journal"))) == 1

    @pytest.mark.slow
    def test_the_sample_recording_gets_no_lock(self, on, empty_window, qtbot) -> None:
        empty_window.action("sample").trigger()
        document = models_of(empty_window).document
        qtbot.waitUntil(lambda: document.recording is not None, timeout=20_000)
        assert models_of(empty_window).label_session.refusal == ""
        assert not list(document.recording.folder.glob(".edited*"))


class TestSavedMeanwhile:
    def test_merged_both_are_there_and_one_undo_takes_theirs_away(
        self, labelled, qtbot, recording_copy
    ) -> None:
        window, asked = labelled, []
        mark(window, qtbot, MINE)
        saved_by_another(recording_copy)
        save(window, qtbot, "Merge", asked)
        assert "since it was opened here: 1 span added." in asked[0]
        assert shown(window) == on_disk(recording_copy) == [THEIRS, THERE, MINE, BACK]
        assert not models_of(window).document.modified
        undo(window, qtbot)
        assert shown(window) == [THERE, MINE, BACK]
        assert models_of(window).document.modified
        # What is on disk is known by now: there is nothing to ask.
        save(window, qtbot)
        assert on_disk(recording_copy) == [THERE, MINE, BACK]

    def test_mine_is_written_over_theirs(self, labelled, qtbot, recording_copy) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        saved_by_another(recording_copy)
        save(window, qtbot, "Keep mine")
        assert shown(window) == on_disk(recording_copy) == [THERE, MINE, BACK]
        assert not models_of(window).document.modified

    def test_theirs_is_taken_and_mine_comes_back_by_undo(
        self, labelled, qtbot, recording_copy
    ) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        saved_by_another(recording_copy)
        save(window, qtbot, "Take theirs")
        assert shown(window) == on_disk(recording_copy) == [THEIRS, THERE, BACK]
        assert not models_of(window).document.modified
        undo(window, qtbot)
        assert shown(window) == [THERE, MINE, BACK]

    def test_cancelled_nothing_changes(self, labelled, qtbot, recording_copy) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        saved_by_another(recording_copy)
        save(window, qtbot, "Cancel")
        assert shown(window) == [THERE, MINE, BACK]
        assert on_disk(recording_copy) == [THEIRS, THERE, BACK]
        assert models_of(window).document.modified

    def test_what_both_changed_is_there_twice_and_is_said(
        self, labelled, qtbot, recording_copy
    ) -> None:
        window = labelled
        models_of(window).label_edits.step(1)
        qtbot.keyClick(window, Qt.Key.Key_1)
        theirs = open_recording(recording_copy)
        there = theirs.labelled.spans[0]
        theirs.labels = theirs.labelled.with_spans([replace(there, end_s=0.5)])
        theirs.save()
        save(window, qtbot, "Merge")
        assert shown(window) == [("there", 6, 15), ("left-to-right", 6, 24), BACK]
        assert [one.name for one in models_of(window).labels.labels.tracks] == [
            "Gestures", "Gestures (both)"
        ]  # fmt: skip
        assert "Of 1 span that both had changed, both are there." in window.messages.text

    def test_the_sensor_of_the_other_is_not_lost(self, labelled, qtbot, recording_copy) -> None:
        window, asked = labelled, []
        c = models_of(window)
        mark(window, qtbot, MINE)
        moved = replace(c.sensor.sensor, position_m=(0.0, 0.0, -1.0))
        theirs = open_recording(recording_copy)
        theirs.sensor, theirs.title = moved, "swing"
        theirs.save()
        before = c.sensor.sensor
        save(window, qtbot, "Merge", asked)
        assert "since it was opened here: another sensor, another title." in asked[0]
        found = open_recording(recording_copy)
        assert (found.sensor, found.title) == (moved, "swing")
        assert spans_of(found.labelled) == [THERE, MINE, BACK]
        assert c.sensor.sensor == c.document.recording.sensor == moved
        undo(window, qtbot)
        assert (c.sensor.sensor, c.document.title) == (before, "ball")
        assert shown(window) == [THERE, MINE, BACK]

    def test_of_an_offset_that_both_changed_mine_is_kept_and_said(
        self, labelled, qtbot, recording_copy
    ) -> None:
        window = labelled
        models_of(window).edits.set_radar_offset(0.5)
        theirs = open_recording(recording_copy)
        theirs.radar_offset_s = 0.25
        theirs.save()
        save(window, qtbot, "Merge")
        assert open_recording(recording_copy).radar_offset_s == 0.5
        said = "Both had changed the offset of the radar: yours is kept."
        assert said in window.messages.text

    @pytest.mark.slow
    def test_only_looking_the_labels_of_the_other_are_no_question(
        self, on, other_window, qtbot, recording_copy
    ) -> None:
        on(recording_copy)
        second = on(recording_copy, other_window)
        saved_by_another(recording_copy)
        models_of(second).edits.sensor_to_camera()
        save(second, qtbot)
        assert not models_of(second).document.modified
        assert on_disk(recording_copy) == [THEIRS, THERE, BACK]

    def test_a_file_written_again_with_the_same_content_is_no_question(
        self, labelled, qtbot, recording_copy
    ) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        path = recording_copy / "recording.json"
        path.write_text(json.dumps(json.loads(path.read_text("utf-8"))), "utf-8")
        save(window, qtbot)
        assert on_disk(recording_copy) == [THERE, MINE, BACK]

    def test_asked_before_closing_too(self, labelled, qtbot, recording_copy, monkeypatch) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        saved_by_another(recording_copy)
        answer(qtbot, "Save")
        monkeypatch.setattr(files, "ask_what_is_kept", lambda *_: "merge")
        assert window.close()
        assert on_disk(recording_copy) == [THEIRS, THERE, MINE, BACK]
        assert offers_in(recovery_folder()).offers == ()

    @pytest.mark.slow
    def test_another_process_with_another_home(
        self, labelled, qtbot, recording_copy, tmp_path, monkeypatch
    ) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        code = (
            "import sys; from pathlib import Path;"
            " from sd2core.files.edit_lock import edit_lock;"
            " from sd2core.recording.recording import open_recording;"
            " path = Path(sys.argv[1]); lock = edit_lock(path);"
            " print(lock.take(), lock.holder().pid);"
            " theirs = open_recording(path);"
            " theirs.labels = theirs.labelled.with_spans(without=[1]); theirs.save()"
        )
        monkeypatch.setenv("HOME", str(tmp_path / "home of another"))
        command = [sys.executable, "-c", code, str(recording_copy)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout == f"False {os.getpid()}\n"
        save(window, qtbot, "Merge")
        assert shown(window) == on_disk(recording_copy) == [MINE, BACK]


class TestTheFolderIsGone:
    def test_it_is_said_and_everything_is_saved_elsewhere(
        self, labelled, qtbot, recording_copy, monkeypatch, tmp_path
    ) -> None:
        window, asked = labelled, []
        mark(window, qtbot, MINE)
        moved = recording_copy.rename(tmp_path / "renamed.sd2")
        monkeypatch.setattr(files, "ask_new", lambda *_: tmp_path / "again.sd2")
        save(window, qtbot, "Save", asked)
        assert f"{recording_copy} was renamed, moved or deleted" in asked[0]
        assert "Nothing is lost" in asked[0]
        assert on_disk(tmp_path / "again.sd2") == shown(window) == [THERE, MINE, BACK]
        assert not models_of(window).document.modified
        assert on_disk(moved) == [THERE, BACK]
        assert not recording_copy.exists()
        assert "video and mesh and radar went with the folder" in window.messages.text
        models_of(window).edits.relink(moved)
        save(window, qtbot)
        assert open_recording(tmp_path / "again.sd2").missing() == {}

    def test_cancelled_the_edits_are_kept_for_recovery(self, on, qtbot, recording_copy) -> None:
        window = on(recording_copy)
        mark(window, qtbot, MINE)
        shutil.rmtree(recording_copy)
        save(window, qtbot, "Cancel")
        assert models_of(window).document.modified
        assert not recording_copy.exists()
        end_process(models_of(window).label_session, recovery_folder())
        (offer,) = offers_in(recovery_folder()).offers
        assert spans_of(offer.labels) == [THERE, MINE, BACK]

    def test_brought_back_it_is_saved(self, labelled, qtbot, recording_copy, tmp_path) -> None:
        window = labelled
        mark(window, qtbot, MINE)
        moved = recording_copy.rename(tmp_path / "renamed.sd2")
        save(window, qtbot, "Cancel")
        moved.rename(recording_copy)
        save(window, qtbot)
        assert on_disk(recording_copy) == [THERE, MINE, BACK]
