"""Tracks of labels by real keys and a real mouse, in the whole window."""

from __future__ import annotations

import pytest
from answering import once_asked
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
    pull,
    spans,
    timeline,
)
from PySide6.QtCore import QPoint
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QCheckBox, QInputDialog, QLineEdit
from window_models import menu_of, models_of

from sd2app.labels.actions import TrackDialog
from sd2app.labels.timeline import LabelArea

THERE, BACK = ("there", 6, 24), ("back", 30, 60)


@pytest.fixture
def two_tracks(labelled):
    """The same with a track on which spans may overlap."""
    assert models_of(labelled).label_tracks.add("Hands", "free")
    return labelled


def tracks(window) -> list[tuple[str, str]]:
    return [(track.name, track.overlap) for track in models_of(window).labels.labels.tracks]


def run(window, name: str) -> None:
    action = window.action(name)
    assert action.isEnabled()
    action.trigger()


def test_tracks_are_added_renamed_freed_moved_and_removed_step_by_step(labelled, qtbot) -> None:
    c = models_of(labelled)

    def fill_in(dialog: TrackDialog) -> None:
        dialog.findChild(QLineEdit).setText("Hands")
        dialog.findChild(QCheckBox).click()
        dialog.accept()

    once_asked(TrackDialog, fill_in)
    run(labelled, "add_track")
    assert tracks(labelled) == [("Gestures", "exclusive"), ("Hands", "free")]
    assert c.labels.track == "Hands"
    run(labelled, "overlap")
    assert tracks(labelled)[1] == ("Hands", "exclusive")
    run(labelled, "track_up")
    assert [name for name, _ in tracks(labelled)] == ["Hands", "Gestures"]
    labelled.activateWindow()
    qtbot.waitUntil(labelled.isActiveWindow)
    key(labelled, "Down", SHIFT)
    assert c.labels.track == "Gestures"

    def rename(dialog: QInputDialog) -> None:
        dialog.setTextValue("Swipes")
        dialog.accept()

    once_asked(QInputDialog, rename)
    run(labelled, "rename_track")
    assert (c.labels.track, spans(labelled, "Swipes")) == ("Swipes", [THERE, BACK])
    run(labelled, "remove_track")
    assert tracks(labelled) == [("Hands", "exclusive")]
    assert spans(labelled) == []
    assert "with 2 spans" in labelled.messages.text
    stack = c.document.undo_stack
    assert [stack.text(step) for step in range(stack.count())] == [
        "Add track",
        "Change overlaps of track",
        "Move track",
        "Rename track",
        "Remove track with 2 spans",
    ]
    labelled.activateWindow()
    qtbot.waitUntil(labelled.isActiveWindow)
    for _ in range(5):
        key(labelled, "Z", CONTROL)
    assert tracks(labelled) == [("Gestures", "exclusive")]
    assert spans(labelled) == [THERE, BACK]


@pytest.mark.slow
def test_what_a_track_may_not_be_is_said(two_tracks) -> None:
    c = models_of(two_tracks)
    assert not c.label_tracks.add("Hands", "free")
    assert "a name of its own" in two_tracks.messages.text
    hand = timeline(two_tracks)
    for start_s, stop_s in ((0.1, 0.5), (0.9, 0.3)):
        pull(hand, at(two_tracks, start_s, "Hands"), at(two_tracks, stop_s, "Hands"), ALT)
    assert len(spans(two_tracks, "Hands")) == 2
    c.label_tracks.toggle_overlap()
    assert "spans apart from each other" in two_tracks.messages.text
    assert c.label_tracks.free


def test_several_are_marked_at_once_on_a_free_track(two_tracks) -> None:
    c = models_of(two_tracks)
    for frame, name in ((2, "1"), (5, "3"), (9, "1"), (12, "4"), (15, "3"), (20, "4")):
        c.playback.seek_frame(frame)
        key(two_tracks, name)
        if frame == 5:
            assert [mark.label for mark in c.labels.marks] == ["left-to-right", "up-to-down"]
            assert timeline(two_tracks).rows.mark_lanes == (0, 1)
    assert spans(two_tracks, "Hands") == [
        ("left-to-right", 2, 9),
        ("up-to-down", 5, 15),
        ("down-to-up", 12, 20),
    ]
    assert spans(two_tracks, "Gestures") == [THERE, BACK]
    # Overlapping spans are apart, and the third has room in the first lane.
    assert timeline(two_tracks).rows.row_of("Hands").lanes == 2
    QTest.mouseClick(timeline(two_tracks), LEFT, NONE, at(two_tracks, 8 / 30, "Hands", 1))
    c.labels.select(())
    QTest.mouseClick(timeline(two_tracks), LEFT, NONE, at(two_tracks, 10 / 30, "Hands", 1))
    assert chosen(two_tracks) == ["up-to-down"]


def test_marks_on_two_tracks_at_once(two_tracks) -> None:
    c = models_of(two_tracks)
    c.playback.seek_frame(24)
    key(two_tracks, "1")
    key(two_tracks, "Up", SHIFT)
    key(two_tracks, "3")
    assert [(mark.track, mark.label) for mark in c.labels.marks] == [
        ("Hands", "left-to-right"),
        ("Gestures", "up-to-down"),
    ]
    c.playback.seek_frame(28)
    key(two_tracks, "E")
    assert spans(two_tracks, "Hands") == [("left-to-right", 24, 28)]
    assert spans(two_tracks, "Gestures") == [THERE, ("up-to-down", 24, 28), BACK]


def test_what_is_marked_goes_with_its_track(two_tracks) -> None:
    c = models_of(two_tracks)
    key(two_tracks, "1")
    assert c.labels.marks
    run(two_tracks, "remove_track")
    assert not c.labels.marks
    two_tracks.grab()


def test_a_name_chooses_the_track_and_spans_change_theirs(two_tracks) -> None:
    c = models_of(two_tracks)
    row = timeline(two_tracks).rows.tracks[0]
    QTest.mouseClick(timeline(two_tracks), LEFT, NONE, QPoint(20, round(row.top_px + 10)))
    assert c.labels.track == "Gestures"
    click(two_tracks, 0.5)
    key(two_tracks, "Down", ALT)
    assert spans(two_tracks, "Hands") == [THERE]
    assert (c.labels.track, chosen(two_tracks)) == ("Hands", ["there"])
    key(two_tracks, "Down", ALT)
    key(two_tracks, "Up", ALT)
    assert spans(two_tracks, "Gestures") == [THERE, BACK]


def test_many_tracks_are_scrolled_and_the_chosen_one_is_in_view(labelled, qtbot) -> None:
    c, view = models_of(labelled), timeline(labelled)
    width_px = view.width()
    for number in range(20):
        c.label_tracks.add(f"Track {number}", "exclusive")
    area = labelled.findChild(LabelArea)
    assert view.height() > 2 * area.height()
    assert view.width() == width_px == area.width()
    assert area.horizontalScrollBar().maximum() == 0
    for track in ("Gestures", "Track 19", "Track 9"):
        c.labels.set_track(track)
        row = view.rows.row_of(track)

        def in_view(row=row) -> bool:
            seen = view.visibleRegion().boundingRect()
            return seen.top() <= row.top_px and row.top_px + row.height_px <= seen.bottom() + 1

        qtbot.waitUntil(in_view, timeout=5000)


@pytest.mark.slow
def test_the_menu_shows_the_tracks_and_the_one_that_is_chosen(two_tracks) -> None:
    c, menu = models_of(two_tracks), menu_of(two_tracks, "Tracks")
    menu.aboutToShow.emit()
    entries = [one for one in menu.actions() if one.actionGroup()]
    assert [(one.text().replace("&", ""), one.isChecked()) for one in entries] == [
        ("Gestures", False),
        ("Hands", True),
    ]
    entries[0].trigger()
    assert c.labels.track == "Gestures"
    c.document.undo_stack.undo()
    menu.aboutToShow.emit()
    entries = [one for one in menu.actions() if one.actionGroup()]
    assert [one.text().replace("&", "") for one in entries] == ["Gestures"]
