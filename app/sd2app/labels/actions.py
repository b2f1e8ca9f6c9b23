"""Actions of labels: marking, spans, tracks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from sd2app.feature import Action
from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits
from sd2app.labels.loop import SpanLoop
from sd2app.labels.marking import LabelMarking
from sd2app.labels.model import LabelsModel
from sd2app.labels.track_edits import LabelTracks
from sd2app.labels.tracks_dialog import TrackDialogs


class Refusing(Protocol):
    """Edits that may be refused for a while, e.g. because another window edits these labels."""

    @property
    def refusal(self) -> str:
        """Reason of the refusal; empty where labels can be edited."""


def editing(edits: Refusing, *rows: Action) -> tuple[Action, ...]:
    """Actions that change labels: disabled, with the reason, while edits are refused."""

    def enabled(row: Action) -> Callable[[], bool]:
        return lambda: row.enabled() and not edits.refusal

    def why_not(row: Action) -> Callable[[], str]:
        return lambda: edits.refusal or (row.why_not() if row.why_not is not None else "")

    return tuple(replace(row, enabled=enabled(row), why_not=why_not(row)) for row in rows)


def marking_actions(
    labels: LabelsModel,
    edits: LabelEdits,
    marking: LabelMarking,
    dragging: LabelDragging,
    loop: SpanLoop,
) -> Sequence[Action]:
    """Actions that end or cancel what is being marked."""

    def has_marks() -> bool:
        return bool(labels.marks)

    def can_cancel() -> bool:
        at_work = dragging.dragging or loop.span is not None
        return at_work or bool(labels.marks or labels.selected)

    def cancel() -> None:
        if dragging.dragging:
            dragging.cancel_drag()
        elif labels.marks:
            marking.drop_marks()
        elif loop.span is not None:
            loop.end()
        else:
            labels.select(())

    return (
        *editing(
            edits,
            Action(
                "end_marks", "Labels", "End what is being marked", ("E",),
                "End all spans that have begun, before the frame on screen",
                lambda: marking.end_marks(), has_marks,
            ),
            Action(
                "carve_marks", "Labels", "End what is being marked, cutting others", ("K",),
                "The same, taking from other spans of the track what they hold of it",
                lambda: marking.end_marks(cutting=True), has_marks,
            ),
        ),
        Action(
            "leave", "Labels", "Cancel", ("Esc",),
            "Let go of what is dragged; else forget what is being marked; else end the loop of a"
            " span; else select nothing",
            cancel, can_cancel,
        ),
    )  # fmt: skip


def span_actions(
    labels: LabelsModel, edits: LabelEdits, loop: SpanLoop, has_content: Callable[[], bool]
) -> Sequence[Action]:
    """Actions on selected spans, and steps from span to span."""

    def some_selected() -> bool:
        return bool(labels.selected)

    def one_selected() -> bool:
        return len(labels.selected) == 1

    def has_spans() -> bool:
        return bool(labels.labels.spans)

    return (
        *editing(
            edits,
            Action(
                "span_starts_here", "Labels", "Selected span starts here", ("[",),
                "The frame on screen is the first one of the selected span",
                lambda: edits.edge_here("start"), one_selected,
            ),
            Action(
                "span_ends_here", "Labels", "Selected span ends here", ("]",),
                "The frame on screen is the last one of the selected span",
                lambda: edits.edge_here("end"), one_selected,
            ),
            Action(
                "nudge_back", "Labels", "Move selected spans one frame back", ("Alt+Left",),
                "They stop at their neighbours", lambda: edits.nudge(-1), some_selected,
            ),
            Action(
                "nudge_on", "Labels", "Move selected spans one frame on", ("Alt+Right",),
                "They stop at their neighbours", lambda: edits.nudge(1), some_selected,
            ),
            Action(
                "split_span", "Labels", "Split span here", ("/",),
                "Cut the span under the cursor in two, before the frame on screen",
                edits.split, has_spans,
            ),
            Action(
                "merge_spans", "Labels", "Merge selected spans", ("G",),
                "One span from the first start to the last end (Ctrl+click selects several)",
                edits.merge, lambda: len(labels.selected) > 1,
            ),
            Action(
                "delete_spans", "Labels", "Delete selected spans", ("Backspace", "Del"),
                "Undo brings them back", edits.delete, some_selected,
            ),
            Action(
                "duplicate_spans", "Labels", "Duplicate selected spans here", ("C",),
                "The copies begin with the frame on screen, or behind the spans where that is"
                " within them",
                edits.duplicate, some_selected,
            ),
            Action(
                "meet_spans", "Labels", "Let two selected spans meet here", ("J",),
                "The first ends and the second begins with the frame on screen",
                edits.meet, lambda: len(labels.selected) == 2,
            ),
            Action(
                "fill_gaps", "Labels", "Fill gaps of the track with background", ("Shift+F",),
                "A span in every gap, with the label of the class background or the one last used",
                edits.fill_gaps, lambda: has_content() and bool(labels.track),
            ),
        ),
        Action(
            "loop_span", "Labels", "Play selected span in a loop", ("O",),
            "Again and again, also while its edges are moved, until Esc or going elsewhere",
            lambda: loop.play(labels.selected[0]), some_selected,
        ),
        Action(
            "select_all", "Labels", "Select all spans", ("Ctrl+A",), "On all tracks",
            labels.select_all, has_spans,
        ),
        Action(
            "next_span", "Labels", "Next span", ("N",), "Select it and go to its start",
            lambda: edits.step(1), has_spans,
        ),
        Action(
            "previous_span", "Labels", "Previous span", ("P",), "Select it and go to its start",
            lambda: edits.step(-1), has_spans,
        ),
    )  # fmt: skip


def track_actions(
    labels: LabelsModel,
    edits: LabelEdits,
    tracks: LabelTracks,
    dialogs: TrackDialogs,
    has_content: Callable[[], bool],
) -> Sequence[Action]:
    """Actions on the rows of labels."""

    def has_track() -> bool:
        return bool(labels.track)

    def has_tracks() -> bool:
        return len(labels.labels.tracks) > 1

    def can_put() -> bool:
        return bool(labels.selected) and has_tracks()

    return (
        Action(
            "previous_track", "Tracks", "Previous track", ("Shift+Up",),
            "New spans come on the track above", lambda: tracks.step(-1), has_tracks,
        ),
        Action(
            "next_track", "Tracks", "Next track", ("Shift+Down",),
            "New spans come on the track below", lambda: tracks.step(1), has_tracks,
        ),
        *editing(
            edits,
            Action(
                "spans_up", "Tracks", "Put selected spans on the track above", ("Alt+Up",),
                "At the times that they have", lambda: tracks.put_spans(-1), can_put,
            ),
            Action(
                "spans_down", "Tracks", "Put selected spans on the track below", ("Alt+Down",),
                "At the times that they have", lambda: tracks.put_spans(1), can_put,
            ),
            Action(
                "add_track", "Tracks", "Add track…", (), "A row of spans below the others",
                dialogs.add, has_content,
            ),
            Action(
                "rename_track", "Tracks", "Rename track…", (),
                "The one on which new spans come", dialogs.rename, has_track,
            ),
            Action(
                "overlap", "Tracks", "Spans of the track may overlap", (),
                "Several at once, drawn one below the other",
                tracks.toggle_overlap, has_track, lambda: tracks.free,
            ),
            Action(
                "track_up", "Tracks", "Move track up", (), "Above the one before it",
                lambda: tracks.move(-1), has_tracks,
            ),
            Action(
                "track_down", "Tracks", "Move track down", (), "Below the one after it",
                lambda: tracks.move(1), has_tracks,
            ),
            Action(
                "remove_track", "Tracks", "Remove track", (),
                "With its spans; undo brings them back", dialogs.remove, has_track,
            ),
        ),
    )  # fmt: skip
