"""Actions of labels: marking, spans, tracks, keys of labels, and their menus."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from PySide6.QtGui import QAction, QActionGroup, QKeySequence
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.feature import Action
from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits, LabelTracks
from sd2app.labels.loop import SpanLoop
from sd2app.labels.marking import OFFERED_MS, LabelMarking, ReactionModel
from sd2app.labels.model import LabelsModel
from sd2app.labels.tracks_dialog import TrackDialogs
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.key_text import canonical, native
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import LabelTrack


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


class LabelActions:
    """Action per label: its key marks, or relabels selected spans while paused without marks."""

    def __init__(
        self, labels: LabelsModel, use: Callable[[str], None], menu: QMenu, window: QWidget
    ) -> None:
        self._labels, self._use, self._menu, self._window = labels, use, menu, window
        self._first = menu.addSeparator()
        self._actions: list[QAction] = []
        self._shown: LabelSet | None = None
        labels.changed.connect(self._follow)
        self._follow()

    def refresh(self, refusal: str) -> None:
        """Disable the actions where ``refusal`` says why labels cannot be edited."""
        labels = self._shown.labels if self._shown is not None else ()
        for action, label in zip(self._actions, labels, strict=True):
            action.setEnabled(not refusal)
            action.setToolTip(refusal or _tip(label))

    def _follow(self) -> None:
        offered = self._labels.labels.label_set
        if offered == self._shown:
            return
        self._shown = offered
        for action in self._actions:
            self._menu.removeAction(action)
            action.deleteLater()
        self._actions = [self._made(label) for label in offered.labels]
        self._menu.insertActions(self._first, self._actions)

    def _made(self, label: Label) -> QAction:
        action = QAction(swatch_icon(label.colour), label.name, self._window)
        if label.key:
            action.setShortcut(QKeySequence(canonical(label.key)))
        action.setToolTip(_tip(label))
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _=False: self._use(label.name))
        return action


def _tip(label: Label) -> str:
    keys = f" ({native(canonical(label.key))})" if label.key else ""
    return (
        "Begin a span with this frame, or end the one that has begun; with a span selected,"
        f" give it this label{keys}"
    )


class TrackMenu:
    """Menu of tracks, the first entries of which choose the one for new spans."""

    def __init__(self, menu: QMenu, labels: LabelsModel) -> None:
        self._menu, self._labels = menu, labels
        self._group = QActionGroup(menu)
        self._first = menu.addSeparator()
        self._shown: tuple[LabelTrack, ...] = ()
        labels.changed.connect(self._follow)
        labels.selection_changed.connect(self._check)
        self._follow()

    def _follow(self) -> None:
        tracks = self._labels.labels.tracks
        if tracks != self._shown:
            self._shown = tracks
            for action in self._group.actions():
                self._group.removeAction(action)
                self._menu.removeAction(action)
                action.deleteLater()
            self._menu.insertActions(self._first, [self._made(track) for track in tracks])
        self._check()

    def _made(self, track: LabelTrack) -> QAction:
        # An ampersand would underline what comes after it.
        action = QAction(track.name.replace("&", "&&"), self._menu)
        action.setCheckable(True)
        action.setToolTip("Spans may overlap" if track.overlap == "free" else "One span at a time")
        action.triggered.connect(lambda _=False: self._labels.set_track(track.name))
        self._group.addAction(action)
        return action

    def _check(self) -> None:
        for action, track in zip(self._group.actions(), self._shown, strict=True):
            action.setChecked(track.name == self._labels.track)


class ReactionMenu(QMenu):
    """Menu of the reaction time."""

    def __init__(self, reaction: ReactionModel, ask: Callable[[], None], parent: QMenu) -> None:
        super().__init__("Reaction time", parent)
        self.setToolTipsVisible(True)
        self._reaction = reaction
        group = QActionGroup(self)
        self._offered = {offered_ms: self._made(offered_ms, group) for offered_ms in OFFERED_MS}
        self._other = self.addAction("Other…")
        self._other.setCheckable(True)
        group.addAction(self._other)
        self._other.triggered.connect(lambda _=False: (ask(), self._follow()))
        reaction.changed.connect(self._follow)
        self._follow()

    def _made(self, offered_ms: int, group: QActionGroup) -> QAction:
        action = self.addAction(f"{offered_ms} ms" if offered_ms else "None")
        action.setCheckable(True)
        action.setToolTip("Marks made while it plays begin and end earlier by so much")
        group.addAction(action)
        action.triggered.connect(lambda _=False: self._reaction.set_reaction_ms(offered_ms))
        return action

    def _follow(self) -> None:
        chosen_ms = self._reaction.reaction_ms
        other = chosen_ms not in self._offered
        self._other.setText(f"Other: {chosen_ms} ms…" if other else "Other…")
        (self._other if other else self._offered[chosen_ms]).setChecked(True)
