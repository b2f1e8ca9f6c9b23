"""What keeps labels safe, in the whole window by real keys and a real mouse."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys

import h5py
import numpy as np
import pytest
from answering import answer, once_asked
from finding import button_of, named
from left_behind import end_process
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolButton, QTreeWidget
from window_models import models_of

from sd2app.labels.recovery import LabelNotice, RecoverLabelsDialog
from sd2app.labels.timeline import ROW_PX, LabelTimeline
from sd2core.labels.recovery import RecoveryPlace, offers_in, recovery_folder
from sd2core.labels.spans import Span
from sd2core.placements.placements import PlacementGrid
from sd2core.recording.recording import open_recording

NONE, CONTROL = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ControlModifier
THERE, BACK, LOST = ("there", 6, 24), ("back", 30, 60), ("left-to-right", 24, 28)


@pytest.fixture
def on(empty_window, qtbot):
    """Opens something in the window."""

    def open_path(path):
        with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
            empty_window.open_paths([path])
        return empty_window

    return open_path


@pytest.fixture
def crashed(recording_copy):
    """The small recording, after a process that marked a third span and died."""
    place = RecoveryPlace(recovery_folder(), recording_copy)
    assert place.take()
    labels = open_recording(recording_copy).labelled
    lost = Span(3, labels.tracks[0].name, 24 / 30, 28 / 30, "left-to-right")
    place.begin(labels).write("Create span", labels.with_spans([lost]))
    place.release()
    return recording_copy


@pytest.fixture
def elsewhere(recording_copy):
    """The small recording, whose labels somebody else edits."""
    place = RecoveryPlace(recovery_folder(), recording_copy)
    assert place.take()
    yield place
    place.release()


def spans(window) -> list[tuple[str, int, int]]:
    base = models_of(window).playback.timebase
    return [
        (span.label, *base.frames_between(span.start_s, span.end_s))
        for span in models_of(window).labels.labels.spans
    ]


def mark(window, qtbot, first: int, stop: int) -> None:
    for frame in (first, stop):
        models_of(window).playback.seek_frame(frame)
        qtbot.keyClick(window, Qt.Key.Key_1)


def bar(window) -> LabelNotice:
    return window.findChild(LabelNotice)


def press(window, qtbot, text: str) -> None:
    """Click the button of this text in the bar over the window."""
    found = [one for one in bar(window).findChildren(QToolButton) if one.text() == text]
    assert found[0].isVisible()
    qtbot.mouseClick(found[0], Qt.MouseButton.LeftButton)


def left_behind():
    return offers_in(recovery_folder()).offers


def listed(dialog: RecoverLabelsDialog) -> QTreeWidget:
    """The labels that are offered."""
    return named(dialog, "Labels that can be recovered", QTreeWidget)


class TestAfterACrash:
    def test_it_is_said_what_is_offered_and_one_click_restores_it(self, on, qtbot, crashed) -> None:
        window = on(crashed)
        assert spans(window) == [THERE, BACK]
        said = bar(window).text
        assert said.startswith("Labels were not saved: 1 edit until ")
        assert said.endswith("the last “Create span”. 3 spans; against what is open: 1 span added.")
        press(window, qtbot, "Restore")
        assert spans(window) == [THERE, LOST, BACK]
        assert bar(window).text == ""
        assert window.action("undo").text() == "&Undo restore labels"
        qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL)
        assert spans(window) == [THERE, BACK]
        qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL | Qt.KeyboardModifier.ShiftModifier)
        qtbot.keyClick(window, Qt.Key.Key_S, CONTROL)
        assert len(json.loads((crashed / "labels.json").read_text("utf-8"))["spans"]) == 3
        assert models_of(on(crashed)).label_session.offer is None
        assert spans(window) == [THERE, LOST, BACK]

    def test_from_the_menu_too(self, on, crashed) -> None:
        window = on(crashed)
        window.action("restore_labels").trigger()
        assert spans(window) == [THERE, LOST, BACK]
        assert not window.action("restore_labels").isEnabled()

    def test_what_it_changes_follows_what_is_there(self, on, qtbot, crashed) -> None:
        window = on(crashed)
        models_of(window).label_edits.step(1)
        qtbot.keyClick(window, Qt.Key.Key_Backspace)
        assert spans(window) == [BACK]
        assert "against what is open: 2 spans added." in bar(window).text

    def test_discarded_is_not_offered_again(self, on, qtbot, crashed) -> None:
        window = on(crashed)
        press(window, qtbot, "Discard")
        assert bar(window).text == ""
        on(crashed)
        assert bar(window).text == ""
        assert spans(window) == [THERE, BACK]

    def test_not_now_is_offered_again(self, on, qtbot, crashed) -> None:
        window = on(crashed)
        press(window, qtbot, "Not now")
        assert bar(window).text == ""
        on(crashed)
        assert bar(window).text.startswith("Labels were not saved")

    def test_what_cannot_be_read_is_said_until_it_was_read(self, on, qtbot, crashed) -> None:
        (path,) = recovery_folder().rglob("*.journal")
        path.write_bytes(path.read_bytes()[:-9])
        window = on(crashed)
        assert "cannot be read and is kept" in bar(window).text
        press(window, qtbot, "✕")
        assert bar(window).text == ""

    def test_all_recordings_are_listed_and_opened_from_there(
        self, empty_window, qtbot, crashed
    ) -> None:
        window = empty_window
        models_of(window).label_session.look_around()
        assert bar(window).text.endswith("before labels were saved: ball.sd2.")

        def choose(dialog: RecoverLabelsDialog) -> None:
            row = listed(dialog).topLevelItem(0)
            assert [row.text(column) for column in (0, 2)] == ["ball.sd2", "3 spans"]
            assert row.text(1).startswith("1 edit until ")
            qtbot.keyClick(listed(dialog), Qt.Key.Key_Return)

        once_asked(RecoverLabelsDialog, choose)
        with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
            press(window, qtbot, "Recover labels…")
        press(window, qtbot, "Restore")
        assert spans(window) == [THERE, LOST, BACK]

    def test_of_a_recording_that_is_gone(
        self, empty_window, qtbot, crashed, tmp_path, monkeypatch
    ) -> None:
        crashed.rename(crashed.with_name("moved.sd2"))
        out = tmp_path / "rescued.json"

        def rescue(dialog: RecoverLabelsDialog) -> None:
            recording = button_of(dialog, "Open recording")
            assert not recording.isEnabled()
            assert "is not there any more" in recording.toolTip()
            monkeypatch.setattr(
                "PySide6.QtWidgets.QFileDialog.getSaveFileName",
                lambda *_: (str(out), ""),
            )
            qtbot.mouseClick(button_of(dialog, "Write to file…"), Qt.MouseButton.LeftButton)
            discard = button_of(dialog, "Discard")
            qtbot.mouseClick(discard, Qt.MouseButton.LeftButton)
            assert listed(dialog).topLevelItem(0).text(3) == "discarded"
            answer(qtbot, "Discard")
            qtbot.mouseClick(discard, Qt.MouseButton.LeftButton)
            assert listed(dialog).topLevelItemCount() == 0
            dialog.reject()

        once_asked(RecoverLabelsDialog, rescue)
        empty_window.action("recover_labels").trigger()
        assert len(json.loads(out.read_text("utf-8"))["spans"]) == 3
        assert not list(recovery_folder().rglob("0*"))


class TestClosing:
    def test_given_up_by_the_users_word_it_is_not_offered(
        self, on, qtbot, recording_copy, small_recording
    ) -> None:
        window = on(recording_copy)
        mark(window, qtbot, 24, 28)
        assert len(list(recovery_folder().rglob("*.journal"))) == 1
        answer(qtbot, "Cancel")
        assert not window.close()
        assert len(list(recovery_folder().rglob("*.journal"))) == 1
        answer(qtbot, "Discard")
        assert window.close()
        assert left_behind() == ()
        assert not list(recovery_folder().rglob("*.journal"))

    def test_saved_when_asked_it_is_not_offered(self, on, qtbot, recording_copy) -> None:
        window = on(recording_copy)
        mark(window, qtbot, 24, 28)
        answer(qtbot, "Save")
        assert window.close()
        assert left_behind() == ()
        assert len(open_recording(recording_copy).labelled.spans) == 3


class TestAFullDisk:
    def test_is_said_and_the_edit_is_there(self, on, qtbot, recording_copy, monkeypatch) -> None:
        window = on(recording_copy)

        def full(_: int) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            mark(window, qtbot, 24, 28)
        assert spans(window) == [THERE, LOST, BACK]
        assert "could not be kept for the case of a crash" in window.messages.text
        assert "No space left on device" in window.messages.text


class TestReadOnly:
    def test_says_who_edits_and_refuses(self, on, qtbot, elsewhere, recording_copy) -> None:
        window = on(recording_copy)
        refusal = models_of(window).label_session.refusal
        assert bar(window).text == f"Labels are read-only: {refusal}."
        assert f"(process {os.getpid()}) since " in refusal
        mark(window, qtbot, 24, 28)
        timeline, button = window.findChild(LabelTimeline), Qt.MouseButton.LeftButton
        middle, aside = (
            QPoint(round(timeline.scale.x_of(time_s)), ROW_PX // 2) for time_s in (0.5, 0.6)
        )
        QTest.mousePress(timeline, button, NONE, middle)
        for _ in range(3):
            QTest.mouseMove(timeline, aside)
        QTest.mouseRelease(timeline, button, NONE, aside)
        assert window.messages.text == refusal
        assert spans(window) == [THERE, BACK]
        assert not models_of(window).labels.marks
        # Looking is allowed.
        QTest.mouseClick(timeline, button, NONE, middle)
        assert len(models_of(window).labels.selected) == 1
        qtbot.keyClick(window, Qt.Key.Key_Backspace)
        assert spans(window) == [THERE, BACK]

    def test_actions_say_why(self, on, elsewhere, recording_copy) -> None:
        window = on(recording_copy)
        refusal = models_of(window).label_session.refusal
        models_of(window).label_edits.step(1)
        for name in ("delete_spans", "span_starts_here", "nudge_on", "split_span", "end_marks"):
            assert not window.action(name).isEnabled()
            assert window.action(name).toolTip() == refusal
        assert window.action("next_span").isEnabled()
        names = [one.name for one in models_of(window).labels.labels.label_set.labels]
        actions = window.findChildren(QAction)
        labels = [one for one in actions if one.text().replace("&", "") in names]
        assert len(labels) == len(names)
        assert all(not one.isEnabled() and one.toolTip() == refusal for one in labels)
        elsewhere.release()
        window.action("edit_labels_here").trigger()
        models_of(window).label_edits.step(1)
        assert window.action("delete_spans").isEnabled()
        assert "Undo brings them back" in window.action("delete_spans").toolTip()
        assert all(one.isEnabled() and one.toolTip() != refusal for one in labels)
        assert not window.action("edit_labels_here").isEnabled()

    @pytest.mark.slow
    def test_the_sensor_is_saved_and_their_labels_stay(
        self, on, qtbot, elsewhere, recording_copy
    ) -> None:
        window = on(recording_copy)
        theirs = open_recording(recording_copy)
        theirs.labels = theirs.labelled.with_spans(without=[1])
        theirs.save()
        models_of(window).edits.sensor_to_camera()
        qtbot.keyClick(window, Qt.Key.Key_S, CONTROL)
        assert not models_of(window).document.modified
        assert open_recording(recording_copy).labels == theirs.labels
        press(window, qtbot, "Try again")
        assert window.messages.text == models_of(window).label_session.refusal
        elsewhere.release()
        press(window, qtbot, "Try again")
        assert bar(window).text == ""
        assert spans(window) == [BACK]

    @pytest.mark.slow
    @pytest.mark.skipif(sys.platform == "win32", reason="kills a process by signal")
    def test_a_process_that_dies_lets_go_and_leaves_its_edits(
        self, on, qtbot, recording_copy
    ) -> None:
        code = (
            "import sys; from pathlib import Path;"
            " from sd2core.labels.recovery import RecoveryPlace, recovery_folder;"
            " from sd2core.recording.recording import open_recording;"
            " path = Path(sys.argv[1]); place = RecoveryPlace(recovery_folder(), path);"
            " place.take(); labels = open_recording(path).labelled;"
            " place.begin(labels).write('Delete spans', labels.with_spans(without=[1]));"
            " print(flush=True); sys.stdin.read()"
        )
        other = subprocess.Popen(
            [sys.executable, "-c", code, str(recording_copy)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        try:
            assert other.stdout.readline()
            window = on(recording_copy)
            assert f"(process {other.pid})" in bar(window).text
        finally:
            other.kill()
            other.communicate()
        press(window, qtbot, "Try again")
        assert bar(window).text.endswith("1 span removed.")
        press(window, qtbot, "Restore")
        assert spans(window) == [BACK]


class TestLabelsOfARadarFile:
    def test_go_with_its_offset_until_they_are_edited(
        self, on, qtbot, small_recording, tmp_path
    ) -> None:
        values = np.zeros((2, 32, 32, 10), np.float16)
        values[0, 3, 20] = 2.0
        with h5py.File(tmp_path / "swing.h5", "w") as file:
            file["DS1"] = values
            file["LABEL"] = np.isin(np.arange(10), (2, 3)).astype(np.uint16)[:, None]
        window = on(small_recording / "video.mp4")
        with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
            models_of(window).edits.add([tmp_path / "swing.h5"])
        labels, edits = models_of(window).labels, models_of(window).edits
        (before,) = labels.labels.spans
        edits.set_radar_offset(0.5)
        (after,) = labels.labels.spans
        assert after.start_s == pytest.approx(before.start_s + 0.5)
        models_of(window).document.undo_stack.undo()
        assert labels.labels.spans == (before,)
        models_of(window).label_edits.step(1)
        qtbot.keyClick(window, Qt.Key.Key_Backspace)
        assert labels.labels.spans == ()
        # Taken back, they are the file's again, and go with it.
        stack = models_of(window).document.undo_stack
        stack.undo()
        assert labels.labels.spans == (before,)
        stack.undo()
        assert stack.redoText() == "Add radar file"
        qtbot.waitUntil(lambda: labels.labels.spans == (), timeout=10_000)
        edits.set_radar_offset(0.5)
        assert labels.labels.spans == ()


class TestOtherEditsAfterACrash:
    """Sensor, placements and offset come back with the labels."""

    def crash(self, window) -> None:
        """What the end of a process does to the open recording."""
        end_process(models_of(window).label_session, recovery_folder())

    def edited(self, on, qtbot, path):
        """The window after a sensor moved and aimed, a plan and an offset, none of them saved."""
        window = on(path)
        c = models_of(window)
        c.edits.begin_sensor_drag()
        c.edits.drag_sensor((0.5, 0.2, 0.0))
        c.edits.end_drag()
        qtbot.keyClick(window, Qt.Key.Key_A)
        c.edits.plan_placements(PlacementGrid((2.0,), azimuths_deg=(0.0, 45.0)))
        c.edits.begin_offset_drag()
        c.edits.drag_offset(0.25)
        c.edits.end_drag()
        return window, self.state(window)

    def state(self, window) -> tuple:
        c = models_of(window)
        recording = c.document.recording
        return (c.sensor.sensor, recording.sensor, recording.placements, recording.radar_offset_s)

    def test_they_are_offered_and_restored_in_one_step(self, on, qtbot, recording_copy) -> None:
        before = self.state(on(recording_copy))
        window, edited = self.edited(on, qtbot, recording_copy)
        assert all(one != other for one, other in zip(before, edited, strict=True))
        mark(window, qtbot, 24, 28)
        self.crash(window)
        window = on(recording_copy)
        assert self.state(window) == before
        said = bar(window).text
        assert said.startswith("Edits were not saved: 5 edits until ")
        assert said.endswith(
            "1 span added, another sensor, another plan of placements, another offset of the radar."
        )
        press(window, qtbot, "Restore")
        assert self.state(window) == edited
        assert LOST in spans(window)
        qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL)
        assert (self.state(window), spans(window)) == (before, [THERE, BACK])
        qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL | Qt.KeyboardModifier.ShiftModifier)
        # What was restored is as safe as what was edited: it is offered after another crash.
        self.crash(window)
        window = on(recording_copy)
        press(window, qtbot, "Restore")
        assert self.state(window) == edited
        qtbot.keyClick(window, Qt.Key.Key_S, CONTROL)
        window = on(recording_copy)
        assert bar(window).text == ""
        assert self.state(window) == edited

    def test_without_an_edit_of_labels_too(self, on, qtbot, recording_copy) -> None:
        window, edited = self.edited(on, qtbot, recording_copy)
        for _ in range(2):
            qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL)
        self.crash(window)
        window = on(recording_copy)
        said = bar(window).text
        assert said.endswith("2 spans; against what is open: another sensor.")
        assert "the last “Undo plan placements”" in said
        press(window, qtbot, "Restore")
        assert self.state(window)[1] == edited[1]
        assert self.state(window)[2] is None

    @pytest.mark.slow
    def test_what_was_saved_or_taken_back_is_not_offered(self, on, qtbot, recording_copy) -> None:
        window, edited = self.edited(on, qtbot, recording_copy)
        qtbot.keyClick(window, Qt.Key.Key_S, CONTROL)
        self.crash(window)
        window = on(recording_copy)
        assert (bar(window).text, self.state(window)) == ("", edited)
        qtbot.keyClick(window, Qt.Key.Key_Home, Qt.KeyboardModifier.ShiftModifier)
        assert self.state(window) != edited
        qtbot.keyClick(window, Qt.Key.Key_Z, CONTROL)
        self.crash(window)
        assert bar(on(recording_copy)).text == ""
