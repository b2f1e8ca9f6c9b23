"""Spans in the whole window: looped, taken together, copied, carved, and held on the maps."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise

import pytest
from label_hands import (
    ALT,
    CONTROL,
    LEFT,
    NONE,
    SHIFT,
    at,
    chosen,
    click,
    key,
    on_map,
    pull,
    spans,
    timeline,
)
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton
from window_models import models_of

from sd2app.labels.edits import REACTION
from sd2app.playback.feature import TimeRuler

NO_BUTTON = Qt.MouseButton.NoButton
THERE, BACK = ("there", 6, 24), ("back", 30, 60)


def looping(window) -> str:
    """What the transport says of a loop."""
    buttons = window.findChildren(QToolButton)
    return next((one.text() for one in buttons if one.isVisible() and "Looping" in one.text()), "")


def steps(window) -> list[str]:
    stack = models_of(window).document.undo_stack
    return [stack.text(step) for step in range(stack.count())]


# --- a loop -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_double_click_plays_the_span_again_and_again(labelled, qtbot) -> None:
    playback = models_of(labelled).playback
    playback.change_speed(9)
    frames = []
    playback.frame_changed.connect(frames.append)
    QTest.mouseDClick(timeline(labelled), LEFT, NONE, at(labelled, 0.5))
    assert playback.playing
    assert "there" in looping(labelled)
    qtbot.waitUntil(lambda: _times_back(frames) >= 3, timeout=10_000)
    assert {*frames} <= {*range(6, 24)}
    key(labelled, "Escape")
    assert looping(labelled) == ""
    assert playback.playing
    qtbot.waitUntil(lambda: playback.frame > 24 or not playback.playing, timeout=10_000)
    playback.pause()


def _times_back(frames: list[int]) -> int:
    return sum(later < sooner for sooner, later in pairwise(frames))


def test_going_elsewhere_ends_the_loop_and_staying_does_not(labelled) -> None:
    playback = models_of(labelled).playback
    click(labelled, 1.5)
    key(labelled, "O")
    playback.pause()
    playback.seek_frame(59)
    key(labelled, "Left")
    assert "back" in looping(labelled)
    ruler = labelled.findChild(TimeRuler)
    QTest.mouseClick(ruler, LEFT, NONE, QPoint(round(ruler.scale.x_of(0.515)), 12))
    assert looping(labelled) == ""
    assert playback.frame == 15


def test_the_loop_follows_the_span_and_ends_with_it(labelled) -> None:
    playback = models_of(labelled).playback
    click(labelled, 0.5)
    key(labelled, "O")
    playback.pause()
    playback.seek_frame(20)
    key(labelled, "BracketRight")
    assert playback.stretch_s == pytest.approx((0.2, 0.7))
    key(labelled, "Z", CONTROL)
    assert playback.stretch_s == pytest.approx((0.2, 0.8))
    key(labelled, "Backspace")
    assert playback.stretch_s is None
    assert looping(labelled) == ""


# --- several at once --------------------------------------------------------------------------


def test_shift_click_and_select_all(labelled) -> None:
    c = models_of(labelled)
    click(labelled, 0.5)
    click(labelled, 1.5, SHIFT)
    assert chosen(labelled) == ["there", "back"]
    key(labelled, "Escape")
    assert chosen(labelled) == []
    key(labelled, "A", CONTROL)
    assert chosen(labelled) == ["there", "back"]
    key(labelled, "Right", ALT)
    assert spans(labelled) == [THERE, BACK]  # the second is at the end
    key(labelled, "Left", ALT)
    assert spans(labelled) == [("there", 5, 23), ("back", 29, 59)]
    assert chosen(labelled) == ["there", "back"]
    assert steps(labelled) == ["Nudge 2 spans"]
    c.document.undo_stack.undo()
    assert spans(labelled) == [THERE, BACK]


def test_what_is_selected_is_dragged_together_and_stops_together(labelled) -> None:
    key(labelled, "A", CONTROL)
    pull(timeline(labelled), at(labelled, 0.5), at(labelled, 0.4), ALT)
    assert spans(labelled) == [("there", 3, 21), ("back", 27, 57)]
    pull(timeline(labelled), at(labelled, 0.5), at(labelled, 1.9), ALT)
    assert spans(labelled) == [THERE, BACK]
    assert steps(labelled) == ["Move 2 spans", "Move 2 spans"]


def test_copies_come_to_the_frame_on_screen_or_behind(labelled) -> None:
    c = models_of(labelled)
    click(labelled, 1.5)
    key(labelled, "Backspace")
    click(labelled, 0.5)
    key(labelled, "C")
    assert spans(labelled) == [THERE, ("there", 24, 42)]
    c.playback.seek_frame(42)
    key(labelled, "C")
    assert spans(labelled)[2] == ("there", 42, 60)
    assert steps(labelled)[-1] == "Duplicate span"


def test_two_spans_meet_and_gaps_are_filled(labelled) -> None:
    c = models_of(labelled)
    key(labelled, "A", CONTROL)
    c.playback.seek_frame(27)
    key(labelled, "J")
    assert spans(labelled) == [("there", 6, 27), ("back", 27, 60)]
    key(labelled, "F", SHIFT)
    assert spans(labelled) == [("background", 0, 6), ("there", 6, 27), ("back", 27, 60)]
    assert steps(labelled) == ["Let spans meet", "Fill gaps"]


def test_a_span_that_is_drawn_with_shift_cuts_the_others(labelled) -> None:
    models_of(labelled).labels.set_label("up-to-down")
    pull(timeline(labelled), at(labelled, 0.4), at(labelled, 1.2), SHIFT)
    assert spans(labelled) == [("there", 6, 12), ("up-to-down", 12, 36), ("back", 36, 60)]
    assert steps(labelled) == ["Create span over others"]


def test_a_mark_that_cuts_the_others(labelled) -> None:
    c = models_of(labelled)
    c.playback.seek_frame(12)
    key(labelled, "3")
    c.playback.seek_frame(36)
    key(labelled, "K")
    assert spans(labelled) == [("there", 6, 12), ("up-to-down", 12, 36), ("back", 36, 60)]


def test_an_edit_ends_the_drag_and_escape_cancels_it(labelled) -> None:
    c, hand = models_of(labelled), timeline(labelled)
    pull(hand, at(labelled, 0.5), at(labelled, 0.4), ALT, release=False)
    assert c.label_dragging.dragging
    key(labelled, "Escape")
    assert spans(labelled) == [THERE, BACK]
    QTest.mouseMove(hand, at(labelled, 0.3))
    QTest.mouseRelease(hand, LEFT, NONE, at(labelled, 0.3))
    assert spans(labelled) == [THERE, BACK]
    assert labelled.action("undo").isEnabled() is False


def test_another_recording_takes_nothing_of_a_drag_that_is_held(labelled, qtbot, tmp_path) -> None:
    c, hand = models_of(labelled), timeline(labelled)
    other = shutil.copytree(c.document.recording.folder, tmp_path / "other.sd2")
    description = json.loads((other / "recording.json").read_text())
    description["spans"] = description["spans"][1:]
    (other / "recording.json").write_text(json.dumps(description))
    pull(hand, at(labelled, 0.9), at(labelled, 0.95), ALT, release=False)
    with qtbot.waitSignal(c.document.opened, timeout=30_000):
        labelled.open_paths([other])
    QTest.mouseMove(hand, at(labelled, 0.98))
    QTest.mouseRelease(hand, LEFT, NONE, at(labelled, 0.98))
    assert spans(labelled) == [BACK]
    assert steps(labelled) == []


def test_a_new_span_begins_where_it_was_pressed_whatever_the_axis_does(labelled) -> None:
    c, hand = models_of(labelled), timeline(labelled)
    pull(hand, at(labelled, 0.85), at(labelled, 0.9), ALT, release=False)
    c.span.set_span(0.5, 1.5)  # as a page that turns, or the wheel
    QTest.mouseMove(hand, at(labelled, 0.95))
    QTest.mouseRelease(hand, LEFT, NONE, at(labelled, 0.95))
    assert spans(labelled)[1][1:] == (26, 28)


def test_a_drag_whose_release_went_elsewhere_ends_at_the_next_move(labelled) -> None:
    hand = timeline(labelled)
    pull(hand, at(labelled, 0.5), at(labelled, 0.4), ALT, release=False)
    there = QPointF(at(labelled, 0.3))
    move = QMouseEvent(QMouseEvent.Type.MouseMove, there, there, NO_BUTTON, NO_BUTTON, NONE)
    QApplication.sendEvent(hand, move)
    assert not models_of(labelled).label_dragging.dragging
    assert steps(labelled) == ["Move span"]
    assert spans(labelled) == [("there", 3, 21), BACK]
    QTest.mouseRelease(hand, LEFT, NONE, at(labelled, 0.3))


# --- reaction time ----------------------------------------------------------------------------


def test_marks_go_back_by_the_reaction_time_while_it_plays(labelled, qtbot) -> None:
    c = models_of(labelled)
    key(labelled, "A", CONTROL)
    key(labelled, "Backspace")
    c.settings.set_value(REACTION, 200)
    c.playback.change_speed(-9)
    c.playback.play()
    # At a tenth of the speed 200 ms are 20 ms of the recording: into the frame before.
    pressed = []
    for frame, name in ((10, "1"), (20, "1")):
        c.playback.seek_frame(frame)
        pressed.append(c.playback.frame)
        key(labelled, name)
    assert spans(labelled) == [("left-to-right", pressed[0] - 1, pressed[1] - 1)]
    c.playback.pause()
    c.labels.select(())
    for frame in (30, 40):
        c.playback.seek_frame(frame)
        key(labelled, "3")
    assert spans(labelled)[1] == ("up-to-down", 30, 40)


# --- on the maps ------------------------------------------------------------------------------


def test_a_region_is_selected_looped_and_its_edges_dragged(labelled) -> None:
    c, view = models_of(labelled), labelled.maps.synthetic
    QTest.mouseClick(view, LEFT, NONE, on_map(view, 1.515))
    assert (chosen(labelled), c.playback.frame) == (["back"], 45)
    QTest.mouseClick(view, LEFT, NONE, on_map(view, 0.915))
    assert (chosen(labelled), c.playback.frame) == (["back"], 27)
    pull(view, on_map(view, 1.0), on_map(view, 1.3), ALT)
    assert spans(labelled) == [THERE, ("back", 39, 60)]
    assert c.playback.frame == 27
    assert steps(labelled) == ["Move start of span"]
    # Only what is selected is held: elsewhere a drag still seeks.
    pull(view, on_map(view, 0.8), on_map(view, 0.615))
    assert spans(labelled)[0] == THERE
    assert c.playback.frame == 18
    assert chosen(labelled) == ["back"]
    QTest.mouseDClick(view, LEFT, NONE, on_map(view, 0.5))
    assert "there" in looping(labelled)
    c.playback.pause()


def test_selecting_goes_there_with_video_mesh_and_maps(labelled, qtbot) -> None:
    c = models_of(labelled)
    shown = []
    c.video.frame_changed.connect(lambda: shown.append(c.playback.frame))
    click(labelled, 1.5)
    qtbot.waitUntil(lambda: shown[-1:] == [30], timeout=5000)
    assert c.video.picture.mean() == pytest.approx(40 + 3 * 30, abs=6)


def test_the_wheel_over_the_labels_zooms_as_over_the_maps(labelled) -> None:
    span, view = models_of(labelled).span, timeline(labelled)
    place = at(labelled, 0.5)
    event = QWheelEvent(
        QPointF(place),
        QPointF(view.mapToGlobal(place)),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        NONE,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(view, event)
    assert span.duration_s == pytest.approx(1.6)
    assert view.scale.time_of(place.x()) == pytest.approx(0.5, abs=0.01)


def test_undo_moves_the_view_only_to_show_the_change(labelled) -> None:
    span, undo = models_of(labelled).span, models_of(labelled).document.undo_stack.undo
    click(labelled, 0.5)
    key(labelled, "Backspace")
    assert spans(labelled) == [BACK]
    span.set_span(0.7, 1.4)
    undo()
    assert spans(labelled) == [THERE, BACK]
    assert (span.start_s, span.end_s) == (0.7, 1.4), "0.2 to 0.8 s can be seen in part"
    span.set_span(1.2, 1.6)
    models_of(labelled).document.undo_stack.redo()
    assert span.start_s == pytest.approx(0.2)
