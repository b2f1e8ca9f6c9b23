"""Actions for marking, for spans that are selected, and for tracks: rows of the one table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sd2app.feature import Action, has_content, has_spans, some_selected

if TYPE_CHECKING:
    from sd2app.shell.window import MainWindow
    from sd2app.shell.wiring import Context


def _has_marks(context: Context) -> bool:
    return bool(context.labels.marks)


def _has_track(context: Context) -> bool:
    return bool(context.labels.track)


def _has_tracks(context: Context) -> bool:
    return len(context.labels.labels.tracks) > 1


def _can_leave(context: Context) -> bool:
    c = context
    at_work = c.label_dragging.dragging or c.span_loop.span is not None
    return at_work or bool(c.labels.marks or c.labels.selected)


def _leave(window: MainWindow) -> None:
    c = window.context
    if c.label_dragging.dragging:
        c.label_dragging.cancel_drag()
    elif c.labels.marks:
        c.label_marking.drop_marks()
    elif c.span_loop.span is not None:
        c.span_loop.end()
    else:
        c.labels.select(())


def _loop(window: MainWindow) -> None:
    c = window.context
    c.span_loop.play(c.labels.selected[0])


MARKING: tuple[Action, ...] = (
    Action(
        "end_marks", "Labels", "End what is being marked", ("E",),
        "End all spans that have begun, before the frame on screen",
        lambda w: w.context.label_marking.end_marks(), _has_marks,
        separator_before=True, edits_labels=True,
    ),
    Action(
        "carve_marks", "Labels", "End what is being marked, cutting others", ("K",),
        "The same, taking from other spans of the track what they hold of it",
        lambda w: w.context.label_marking.end_marks(cutting=True), _has_marks, edits_labels=True,
    ),
    Action(
        "leave", "Labels", "Leave off", ("Esc",),
        "Let go of what is dragged; else forget what is being marked; else end the loop of a span;"
        " else select nothing",
        _leave, _can_leave,
    ),
)  # fmt: skip

SPANS: tuple[Action, ...] = (
    Action(
        "duplicate_spans", "Labels", "Duplicate selected spans here", ("C",),
        "The copies begin with the frame on screen, or behind the spans where that is within them",
        lambda w: w.context.label_edits.duplicate(), some_selected, edits_labels=True,
    ),
    Action(
        "meet_spans", "Labels", "Let two selected spans meet here", ("J",),
        "The first ends and the second begins with the frame on screen",
        lambda w: w.context.label_edits.meet(), lambda c: len(c.labels.selected) == 2,
        edits_labels=True,
    ),
    Action(
        "fill_gaps", "Labels", "Fill gaps of the track with background", ("Shift+F",),
        "A span in every gap, with the label of the class background or the one last used",
        lambda w: w.context.label_edits.fill_gaps(), lambda c: has_content(c) and _has_track(c),
        edits_labels=True,
    ),
    Action(
        "loop_span", "Labels", "Play selected span in a loop", ("O",),
        "Again and again, also while its edges are moved, until Esc or going elsewhere",
        _loop, some_selected, separator_before=True,
    ),
    Action(
        "select_all", "Labels", "Select all spans", ("Ctrl+A",), "On all tracks",
        lambda w: w.context.labels.select_all(), has_spans,
    ),
)  # fmt: skip

TRACKS: tuple[Action, ...] = (
    Action(
        "previous_track", "Tracks", "Previous track", ("Shift+Up",),
        "New spans come on the track above",
        lambda w: w.context.label_tracks.step(-1), _has_tracks, separator_before=True,
    ),
    Action(
        "next_track", "Tracks", "Next track", ("Shift+Down",),
        "New spans come on the track below",
        lambda w: w.context.label_tracks.step(1), _has_tracks,
    ),
    Action(
        "spans_up", "Tracks", "Put selected spans on the track above", ("Alt+Up",),
        "At the times that they have",
        lambda w: w.context.label_tracks.put_spans(-1),
        lambda c: some_selected(c) and _has_tracks(c), edits_labels=True,
    ),
    Action(
        "spans_down", "Tracks", "Put selected spans on the track below", ("Alt+Down",),
        "At the times that they have",
        lambda w: w.context.label_tracks.put_spans(1),
        lambda c: some_selected(c) and _has_tracks(c), edits_labels=True,
    ),
    Action(
        "add_track", "Tracks", "Add track…", (), "A row of spans below the others",
        lambda w: w.track_dialogs.add(), has_content, separator_before=True, edits_labels=True,
    ),
    Action(
        "rename_track", "Tracks", "Rename track…", (), "The one on which new spans come",
        lambda w: w.track_dialogs.rename(), _has_track, edits_labels=True,
    ),
    Action(
        "overlap", "Tracks", "Spans of the track may overlap", (),
        "Several at once, drawn one below the other",
        lambda w: w.context.label_tracks.toggle_overlap(), _has_track,
        lambda c: c.label_tracks.free, edits_labels=True,
    ),
    Action(
        "track_up", "Tracks", "Move track up", (), "Above the one before it",
        lambda w: w.context.label_tracks.move(-1), _has_tracks, edits_labels=True,
    ),
    Action(
        "track_down", "Tracks", "Move track down", (), "Below the one after it",
        lambda w: w.context.label_tracks.move(1), _has_tracks, edits_labels=True,
    ),
    Action(
        "remove_track", "Tracks", "Remove track", (), "With its spans; undo brings them back",
        lambda w: w.track_dialogs.remove(), _has_track, edits_labels=True,
    ),
)  # fmt: skip
