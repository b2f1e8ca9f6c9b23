"""Labels by real keys and a real mouse, in the whole window; what counts is the model."""

from __future__ import annotations

import json

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolTip
from window_models import models_of

from sd2app.labels.painting import ROW_PX
from sd2app.labels.timeline import LabelTimeline
from sd2core.recording.recording import Recording, Span, open_recording

NONE = Qt.KeyboardModifier.NoModifier


def spans(window) -> list[tuple[str, int, int]]:
    """What is labelled, in frames."""
    base = models_of(window).playback.timebase
    return [
        (span.label, *base.frames_between(span.start_s, span.end_s))
        for span in models_of(window).labels.labels.spans
    ]


def key(window, qtbot, name: str, modifier=NONE) -> None:
    qtbot.keyClick(window, getattr(Qt.Key, f"Key_{name}"), modifier)


def at(window, time_s: float) -> QPoint:
    timeline = window.findChild(LabelTimeline)
    return QPoint(round(timeline.scale.x_of(time_s)), round(ROW_PX / 2))


def drag(window, from_s: float, to_s: float, modifier=NONE, release: bool = True) -> None:
    timeline, button = window.findChild(LabelTimeline), Qt.MouseButton.LeftButton
    QTest.mousePress(timeline, button, modifier, at(window, from_s))
    for share in (0.3, 0.7, 1.0):
        QTest.mouseMove(timeline, at(window, from_s + share * (to_s - from_s)))
        QTest.qWait(5)
    if release:
        QTest.mouseRelease(timeline, button, modifier, at(window, to_s))


THERE, BACK = ("there", 6, 24), ("back", 30, 60)


def test_a_key_marks_from_the_frame_on_screen_to_the_frame_on_screen(labelled, qtbot) -> None:
    playback = models_of(labelled).playback
    assert spans(labelled) == [THERE, BACK]
    playback.seek_frame(24)
    key(labelled, qtbot, "1")
    assert [(mark.label, mark.start_s) for mark in models_of(labelled).labels.marks] == [
        ("left-to-right", playback.timebase.time_of(24))
    ]
    playback.seek_frame(28)
    key(labelled, qtbot, "1")
    assert spans(labelled) == [THERE, ("left-to-right", 24, 28), BACK]
    assert not models_of(labelled).labels.marks
    stack = models_of(labelled).document.undo_stack
    assert stack.undoText() == "Create span"
    key(labelled, qtbot, "Z", Qt.KeyboardModifier.ControlModifier)
    assert spans(labelled) == [THERE, BACK]
    assert not models_of(labelled).document.modified


def test_what_was_marked_keeps_its_label_once_it_is_left_behind(labelled, qtbot) -> None:
    playback = models_of(labelled).playback
    models_of(labelled).labels.select_all()
    key(labelled, qtbot, "Backspace")
    for frame, name in ((5, "1"), (10, "1"), (20, "2"), (30, "2"), (30, "3")):
        playback.seek_frame(frame)
        key(labelled, qtbot, name)
    assert spans(labelled) == [("left-to-right", 5, 10), ("up-to-down", 20, 30)]
    # Chosen again by hand, it is what the key is for.
    playback.seek_frame(50)
    chosen = models_of(labelled).labels.selected_ids
    for ids in ((), chosen):
        models_of(labelled).labels.select(ids)
    key(labelled, qtbot, "4")
    assert spans(labelled)[1] == ("down-to-up", 20, 30)


def test_keys_while_it_plays(labelled, qtbot) -> None:
    c = models_of(labelled)
    c.label_edits.step(1)
    key(labelled, qtbot, "Backspace")
    c.label_edits.step(1)
    key(labelled, qtbot, "Backspace")
    assert spans(labelled) == []
    c.playback.seek_frame(0)
    pressed = []
    key(labelled, qtbot, "Space")
    # Another key on a track without overlaps ends the first span and begins the next.
    for frame, name in ((5, "1"), (20, "3"), (40, "3")):
        qtbot.waitUntil(lambda frame=frame: c.playback.frame >= frame, timeout=10_000)
        before = c.playback.frame
        key(labelled, qtbot, name)
        # The clock runs on while the key travels.
        pressed.append(range(before, c.playback.frame + 1))
    key(labelled, qtbot, "Space")
    (label, first, second), (other, again, third) = spans(labelled)
    assert (label, other) == ("left-to-right", "up-to-down")
    assert again == second
    assert all(at in when for at, when in zip((first, second, third), pressed, strict=True))


def test_a_hand_draws_moves_and_shortens(labelled, qtbot) -> None:
    c, alt = models_of(labelled), Qt.KeyboardModifier.AltModifier
    labels = c.labels
    labels.set_label("down-to-up")
    drag(labelled, 0.88, 0.94, alt)
    assert spans(labelled)[1][0] == "down-to-up"
    drawn = spans(labelled)[1]
    assert 24 <= drawn[1] < drawn[2] <= 30
    assert [span.label for span in labels.selected] == ["down-to-up"]
    # It stops at its neighbours, however far the hand goes.
    drag(labelled, labels.selected[0].end_s, 1.6)
    assert spans(labelled)[1][2] == 30
    drag(labelled, labels.selected[0].start_s, 0.1)
    assert spans(labelled)[1] == ("down-to-up", 24, 30)
    drag(labelled, 0.5, 0.4)
    assert spans(labelled)[0] == ("there", 3, 21)
    stack = c.document.undo_stack
    assert [stack.text(step) for step in range(stack.count())] == [
        "Create span",
        "Move end of span",
        "Move start of span",
        "Move span",
    ]
    for _ in range(4):
        stack.undo()
    assert spans(labelled) == [THERE, BACK]


def test_escape_takes_back_what_the_hand_does(labelled, qtbot) -> None:
    drag(labelled, 0.5, 0.35, release=False)
    assert spans(labelled)[0] != THERE
    qtbot.keyClick(labelled.findChild(LabelTimeline), Qt.Key.Key_Escape)
    assert spans(labelled) == [THERE, BACK]
    assert models_of(labelled).document.undo_stack.count() == 0
    models_of(labelled).labels.select([1])
    for _ in range(2):  # there is nothing left for the second before menus know it
        labelled.action("leave").trigger()
    assert not models_of(labelled).labels.selected


def test_nothing_is_undone_under_the_hand(labelled, qtbot) -> None:
    control, timeline = Qt.KeyboardModifier.ControlModifier, labelled.findChild(LabelTimeline)
    drag(labelled, 0.5, 0.45)
    moved = spans(labelled)[0]
    drag(labelled, 0.5, 0.35, release=False)
    key(labelled, qtbot, "Z", control)
    assert spans(labelled)[0] not in (moved, THERE)
    qtbot.keyClick(timeline, Qt.Key.Key_Escape)
    assert spans(labelled)[0] == moved
    key(labelled, qtbot, "Z", control)
    assert spans(labelled)[0] == THERE


def test_a_click_selects_and_goes_there(labelled, qtbot) -> None:
    c, timeline = models_of(labelled), labelled.findChild(LabelTimeline)
    button = Qt.MouseButton.LeftButton
    QTest.mouseClick(timeline, button, NONE, at(labelled, 1.5))
    assert ([span.label for span in c.labels.selected], c.playback.frame) == (["back"], 30)
    QTest.mouseClick(timeline, button, Qt.KeyboardModifier.ControlModifier, at(labelled, 0.5))
    assert len(c.labels.selected) == 2
    key(labelled, qtbot, "G")
    assert spans(labelled) == [("there", 6, 60)]
    c.playback.seek_frame(20)
    key(labelled, qtbot, "Slash")
    assert spans(labelled) == [("there", 6, 20), ("there", 20, 60)]
    c.labels.select(())
    key(labelled, qtbot, "P")
    assert [span.start_s for span in c.labels.selected] == [pytest.approx(0.2)]
    # With a span selected a key gives it its label; brackets set its edges.
    key(labelled, qtbot, "2")
    c.playback.seek_frame(8)
    key(labelled, qtbot, "BracketLeft")
    c.playback.seek_frame(11)
    key(labelled, qtbot, "BracketRight")
    assert spans(labelled)[0] == ("right-to-left", 8, 12)


def test_labels_are_saved_and_read_back(labelled, qtbot, recording_copy) -> None:
    c = models_of(labelled)
    c.playback.seek_frame(24)
    key(labelled, qtbot, "1")
    c.playback.seek_frame(28)
    key(labelled, qtbot, "1")
    key(labelled, qtbot, "S", Qt.KeyboardModifier.ControlModifier)
    assert not c.document.modified
    written = json.loads((recording_copy / "labels.json").read_text("utf-8"))
    assert len(written["spans"]) == 3
    assert json.loads((recording_copy / "recording.json").read_text("utf-8"))["spans"] == []
    again = open_recording(recording_copy)
    assert again.labelled == c.labels.labels
    labelled.open_paths([recording_copy])
    qtbot.waitUntil(lambda: labelled.settled, timeout=20_000)
    assert spans(labelled) == [THERE, ("left-to-right", 24, 28), BACK]


def test_what_finds_no_room_is_said_at_its_place_and_nowhere_else(labelled, qtbot) -> None:
    c = models_of(labelled)
    for _ in range(3):
        for frame in (10, 12):
            c.playback.seek_frame(frame)
            key(labelled, qtbot, "1")
    assert "every frame has a span" in QToolTip.text()
    assert labelled.messages.text == ""
    QToolTip.hideText()
    assert spans(labelled) == [THERE, BACK]


def test_recordings_of_earlier_versions_keep_their_spans(tmp_path, recording_copy) -> None:
    read = open_recording(recording_copy)
    assert isinstance(read, Recording)
    assert read.labels is None
    assert read.spans == (
        Span(start_s=0.2, end_s=0.8, label="there"),
        Span(start_s=1, end_s=2, label="back"),
    )
    assert [span.label for span in read.labelled.spans] == ["there", "back"]
