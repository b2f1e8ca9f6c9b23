"""Suggestions by real keys and clicks in the whole window, on a map in which little moves."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import label_hands as hands
import numpy as np
import pytest
from answering import once_asked
from copied import copied_record
from finding import button_of
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication, QComboBox, QInputDialog, QToolButton, QWidget
from whole_window import opened
from window_models import models_of

from sd2app.labels.painting import lane_box, text_on
from sd2app.labels.timeline import TargetLine
from sd2app.suggestions.feature import SuggestionBar
from sd2app.widgets.text import quoted
from sd2core.cli.classify.trained import Apply
from sd2core.cli.labels.suggest import Suggest
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis

ARROW_PX = 24  # and the frame
NONE = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def moving(window, qtbot):
    """Something moves from frame 5 to 15 and from 40 to 50; nothing is marked."""
    c = models_of(window)
    values = np.ones((32, 60), np.float32)
    values[:, 5:15] = values[:, 40:50] = 100.0
    c.synthetic.set_map(DopplerMap(values, VelocityAxis(), c.playback.timebase, "synthetic"))
    for _ in range(2):
        qtbot.keyClick(window, Qt.Key.Key_N)
        qtbot.keyClick(window, Qt.Key.Key_Backspace)
        c.playback.seek_frame(0)
    return window


def key(window, qtbot, name: str, modifier=NONE) -> None:
    qtbot.keyClick(window, getattr(Qt.Key, f"Key_{name}"), modifier)


def asked(window, qtbot) -> None:
    key(window, qtbot, "F")
    qtbot.waitUntil(lambda: not models_of(window).suggestions.waiting, timeout=10_000)
    qtbot.waitUntil(window.action("accept_suggestion").isEnabled)


def decided(window) -> list[tuple[str, str]]:
    return [(span.label, span.origin) for span in models_of(window).labels.labels.spans]


def test_found_by_a_key_and_decided_on_by_one_key_each(moving, qtbot) -> None:
    bar, c = moving.findChild(SuggestionBar), models_of(moving)
    assert not bar.isVisible()
    asked(moving, qtbot)
    assert bar.isVisible()
    assert decided(moving) == [("gesture", "suggestion")] * 2
    assert len(c.labels.selected) == 1
    key(moving, qtbot, "3")
    assert decided(moving) == [("up-to-down", "person"), ("gesture", "suggestion")]
    key(moving, qtbot, "W")
    assert decided(moving) == [("up-to-down", "person")]
    for _ in range(2):
        key(moving, qtbot, "Z", Qt.KeyboardModifier.ControlModifier)
    assert decided(moving) == [("gesture", "suggestion")] * 2
    c.labels.set_label("down-to-up")
    offered: list[str] = []

    def choose(dialog: QInputDialog) -> None:
        offered.append(dialog.textValue())
        dialog.setTextValue("right-to-left")
        dialog.accept()

    once_asked(QInputDialog, choose)
    key(moving, qtbot, "Y", Qt.KeyboardModifier.ShiftModifier)
    assert offered == ["down-to-up"], "the one used last comes first"
    assert decided(moving) == [("right-to-left", "person")] * 2


def test_the_search_is_copied_as_a_command(moving, qtbot) -> None:
    asked(moving, qtbot)
    bar, c = moving.findChild(SuggestionBar), models_of(moving)
    bar._threshold.setValue(9.0)
    qtbot.mouseClick(button_of(bar, "Copy command"), Qt.MouseButton.LeftButton)
    command = copied_record()
    assert isinstance(command, Suggest)
    assert command.map == c.document.recording.folder
    assert (command.of, command.high_db, command.low_db) == ("synthetic", 9.0, 5.0)


def test_the_search_of_a_classifier_is_copied_as_its_command(window) -> None:
    c = models_of(window)
    c.classify.path = Path("g.safetensors")
    line = quoted(c.classify.words(Path("walk.sd2"), 60.0))
    QGuiApplication.clipboard().setText(line)
    command = copied_record()
    assert isinstance(command, Apply)
    assert (command.map, command.model) == (Path("walk.sd2"), Path("g.safetensors"))
    assert command.min_confidence == pytest.approx(0.6)
    c.classify.path = None


def test_nobody_says_that_a_suggestion_without_a_name_is_sure(moving, qtbot) -> None:
    c = models_of(moving)
    values = c.synthetic.map.values.copy()
    values[:, 40:50] *= 100.0
    c.synthetic.set_map(replace(c.synthetic.map, values=values))
    asked(moving, qtbot)
    arrays = c.labels.arrays
    assert [text_on(span, arrays) for span in arrays.spans] == ["#2 gesture", "#1 gesture"]


def test_the_bar_does_the_same(moving, qtbot) -> None:
    asked(moving, qtbot)
    bar = moving.findChild(SuggestionBar)
    buttons = {one.text(): one for one in bar.findChildren(QToolButton)}
    for text in ("Reject", "Accept"):
        qtbot.mouseClick(buttons[text], Qt.MouseButton.LeftButton)
    assert decided(moving) == [("left-to-right", "person")]
    qtbot.waitUntil(lambda: not buttons["Accept"].isEnabled())
    assert bar.findChildren(QToolButton)[-1].accessibleName() == "Close the suggestions"
    qtbot.mouseClick(buttons["✕"], Qt.MouseButton.LeftButton)
    assert not bar.isVisible()


def test_closed_with_space_it_leaves_the_keyboard_to_the_window(moving, qtbot) -> None:
    asked(moving, qtbot)
    bar, playback = moving.findChild(SuggestionBar), models_of(moving).playback
    while QApplication.focusWidget() is not bar.findChildren(QToolButton)[-1]:
        key(QApplication.focusWidget() or moving, qtbot, "Tab")
    key(QApplication.focusWidget(), qtbot, "Space")
    assert not bar.isVisible()
    key(QApplication.focusWidget() or moving, qtbot, "Space")
    assert playback.playing
    playback.pause()


@pytest.mark.one_in(3)
@pytest.mark.parametrize("size", [(1280, 720), (1600, 1000), (2560, 1440)])
def test_no_word_of_the_bar_is_cut_short(moving, qtbot, size) -> None:
    moving.resize(*size)
    asked(moving, qtbot)
    bar = moving.findChild(SuggestionBar)

    def laid_out() -> None:
        shown = [one for one in bar.findChildren(QWidget) if one.parent() is bar]
        shown = [one for one in shown if one.isVisible()]
        assert shown
        for one in shown:
            assert one.width() >= one.sizeHint().width()
            if isinstance(one, QComboBox):
                text_px = one.fontMetrics().horizontalAdvance(one.currentText())
                assert one.width() >= text_px + ARROW_PX
            assert bar.rect().contains(one.geometry())
        assert not any(
            one.geometry().intersects(other.geometry()) for one, other in combinations(shown, 2)
        )

    # A layout follows its window by events of its own, of which a busy machine leaves some over.
    qtbot.waitUntil(laid_out)
    moving.resize(1280, 800)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("panel", ["Sensor", "Labels"])
def test_a_panel_over_the_maps_leaves_the_bar_free(moving, qtbot, panel) -> None:
    moving.resize(1000, 640)
    moving.fold_side(True)
    asked(moving, qtbot)
    bar, side = moving.findChild(SuggestionBar), moving.side
    moving.bring_up(panel)

    def beside_each_other() -> None:
        edge_px = side.mapToGlobal(QPoint(0, 0)).x()
        assert edge_px < bar.mapToGlobal(bar.rect().topRight()).x(), "it lies over the maps"
        for one in bar.findChildren(QToolButton):
            assert one.mapToGlobal(one.rect().topRight()).x() < edge_px, one.text()
            assert one.width() >= one.sizeHint().width(), one.text()
            assert one.height() >= one.sizeHint().height(), one.text()

    qtbot.waitUntil(beside_each_other)
    moving.fold_side(True)
    qtbot.waitUntil(lambda: bar.contentsMargins().right() == 0)
    moving.resize(1280, 800)


def test_suggestions_are_saved_with_the_labels(moving, qtbot, tmp_path) -> None:
    from sd2core.recording.recording import open_recording

    asked(moving, qtbot)
    models_of(moving).document.save_as(tmp_path / "saved.sd2")
    assert [span.origin for span in open_recording(tmp_path / "saved.sd2").labelled.spans] == [
        "suggestion"
    ] * 2


@pytest.mark.slow
def test_while_it_plays_a_label_key_marks_also_with_a_suggestion_selected(moving, qtbot) -> None:
    asked(moving, qtbot)
    c = models_of(moving)
    assert [span.origin for span in c.labels.selected] == ["suggestion"]
    c.playback.toggle()
    key(moving, qtbot, "3")
    c.playback.toggle()
    assert [mark.label for mark in c.labels.marks] == ["up-to-down"]
    assert len(c.suggestions.pending) == 2


def marked_by_key(window, qtbot, at_frame: int) -> str:
    """Mark ten frames with a key; the track that the new span is on."""
    c = models_of(window)
    key(window, qtbot, "Escape")
    before = {span.id for span in c.labels.labels.spans}
    for frame in (at_frame, at_frame + 9):
        c.playback.seek_frame(frame)
        key(window, qtbot, "3")
    (made,) = (span for span in c.labels.labels.spans if span.id not in before)
    return made.track


def test_new_labels_never_go_to_the_track_of_the_suggestions(moving, qtbot, tmp_path) -> None:
    c, line = models_of(moving), moving.findChild(TargetLine)
    own = c.labels.track
    assert not line.isVisible(), "one track needs no telling which"
    asked(moving, qtbot)
    assert [span.track for span in c.labels.selected] == ["Suggestions"]
    assert (line.isVisible(), line.text()) == (True, f"Marking on: {own}")
    assert marked_by_key(moving, qtbot, 20) == own
    # By the mouse neither: not by the name, not by drawing there, not by a click on one of them.
    hands.click(moving, c.suggestions.pending[0].start_s + 0.1, track="Suggestions")
    view = hands.timeline(moving)
    name = hands.at(moving, 0.0, "Suggestions")
    name.setX(10)
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, NONE, name)
    assert c.labels.track == own
    before = len(c.labels.labels.of_track(own))
    ends = (hands.at(moving, time_s, "Suggestions") for time_s in (1.05, 1.25))
    hands.pull(view, *ends, hands.ALT)
    assert len(c.labels.labels.of_track(own)) == before + 1
    # Nor once they are saved and opened again, nor once all are rejected.
    folder = tmp_path / "saved.sd2"
    c.document.save_as(folder)
    opened(moving, qtbot, folder)
    assert line.text() == f"Marking on: {own}"
    assert marked_by_key(moving, qtbot, 0) == own
    key(moving, qtbot, "W", Qt.KeyboardModifier.ShiftModifier)
    assert [track.name for track in c.labels.labels.tracks] == [own]
    assert marked_by_key(moving, qtbot, 50) == own
    assert not line.isVisible()


def test_the_last_suggestion_deleted_takes_its_track_along(moving, qtbot) -> None:
    asked(moving, qtbot)
    c = models_of(moving)
    key(moving, qtbot, "A", Qt.KeyboardModifier.ControlModifier)
    key(moving, qtbot, "Backspace")
    assert "Suggestions" not in [track.name for track in c.labels.labels.tracks]


def test_with_suggestions_alone_accepting_makes_a_track_and_marking_says_what_to_do(
    moving, qtbot
) -> None:
    c, line = models_of(moving), moving.findChild(TargetLine)
    asked(moving, qtbot)
    own = c.labels.track
    moving.action("remove_track").trigger()
    assert (c.labels.track, line.isVisible()) == ("", True)
    assert "Add track" in line.text()
    key(moving, qtbot, "Escape")
    key(moving, qtbot, "3")
    assert not c.labels.marks
    assert "Add track" in moving.messages.text
    key(moving, qtbot, "Y")
    assert [track.name for track in c.labels.labels.tracks] == [own, "Suggestions"]
    assert c.labels.track == own


def buttons_of(window) -> dict[str, QRect]:
    """Places of the buttons on the selected suggestion, by their signs."""
    view = hands.timeline(window)
    placed = view.buttons.placed(view.scale, view.plot_rect(), view.rows)
    return {sign: place.toAlignedRect() for place, sign, _ in placed}


def boxes_of_others(window) -> list[QRectF]:
    """Boxes of the spans that are not selected, on the timeline."""
    view, c = hands.timeline(window), models_of(window)
    arrays = c.labels.arrays
    return [
        lane_box(
            view.rows.row_of(span.track),
            lane,
            view.scale.x_of(span.start_s),
            view.scale.x_of(span.end_s),
        )
        for span, lane in zip(arrays.spans, arrays.lanes.tolist(), strict=True)
        if span.id not in c.labels.selected_ids
    ]


def test_buttons_at_the_span_decide_on_it(moving, qtbot) -> None:
    c, view = models_of(moving), hands.timeline(moving)
    assert not buttons_of(moving)
    asked(moving, qtbot)
    first, second = c.suggestions.pending
    assert c.labels.selected == (first,)
    places = buttons_of(moving)
    assert list(places) == ["✓", "✗"]
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=places["✗"].center())
    assert c.suggestions.pending == (second,)
    assert c.document.undo_stack.undoText() == "Reject suggestion"
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=buttons_of(moving)["✓"].center())
    assert decided(moving) == [(c.labels.label, "person")]
    assert not buttons_of(moving), "nothing is left to decide on"
    for _ in range(2):
        key(moving, qtbot, "Z", Qt.KeyboardModifier.ControlModifier)
    assert len(c.suggestions.pending) == 2
    # Let go elsewhere, nothing is decided; and a span of one's own has no buttons.
    c.labels.select([first.id])
    place = buttons_of(moving)["✓"].center()
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=place)
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=place + QPoint(120, 0))
    assert len(c.suggestions.pending) == 2


def test_the_buttons_follow_the_span_and_cover_no_other(moving, qtbot) -> None:
    c, view = models_of(moving), hands.timeline(moving)
    asked(moving, qtbot)
    plot = view.plot_rect()
    wide = seen = 0
    for name, times in (("Plus", 6), ("BracketRight", 1), ("Minus", 8)):
        for _ in range(times):
            first = c.labels.selected[0]
            places = buttons_of(moving).values()
            left, right = (view.scale.x_of(one) for one in (first.start_s, first.end_s))
            for place in places:
                seen += 1
                assert plot.left() <= place.left() <= place.right() <= plot.right() + 1
                assert not any(box.intersects(QRectF(place)) for box in boxes_of_others(moving))
                wide += left < place.left() < place.right() < right
                near = min(abs(place.left() - right), abs(place.right() - left))
                assert left <= place.center().x() <= right or near < 50
            if name == "BracketRight":  # from here on the suggestion is a short one
                c.playback.seek_frame(7)
            key(moving, qtbot, name)
    assert seen > wide > 0, "on the span and beside it"
