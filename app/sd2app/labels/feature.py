"""Labels of spans in time: timeline, panel, files, safety of every edit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QPointF
from PySide6.QtWidgets import QApplication, QMenu, QWidget

from sd2app.feature import Action, Drop, Feature, Shell, report
from sd2app.labels.actions import LabelActions, LabelTracks, editing, offer_tracks
from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.dragging import LabelDragging, SpanDragger
from sd2app.labels.edits import LabelEdits, LabelMarking
from sd2app.labels.exports import CutOutModel, ask_for_cut_outs, export_labels
from sd2app.labels.import_dialog import import_labels, is_label_file
from sd2app.labels.loop import SpanLoop
from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import SpanButtons, map_overlay, strip_overlay
from sd2app.labels.panel import LabelsPanel
from sd2app.labels.recovery import LabelNotice, recover
from sd2app.labels.table import SpanTable
from sd2app.labels.timeline import LabelArea, LabelTimeline, TargetLine
from sd2app.maps.model import SynthesisModel
from sd2app.maps.track_mouse import TimePlot
from sd2app.session.session import Session
from sd2app.widgets.layouts import pane
from sd2app.widgets.notices import Notice


class LabelsFeature(Feature):
    """Spans that are marked, dragged, typed or read from files; each edit is kept at once.

    ``recovery`` is the folder of edits that were not saved; ``accept`` accepts the selected
    suggestion with a label.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        synthesis: SynthesisModel,
        recovery: Path,
        accept: Callable[[str], object],
    ) -> None:
        self._session, self._shell, self._accept = session, shell, accept
        self.model = labels = LabelsModel(session.parent)
        self.autosave = LabelAutosave(session.document, labels, recovery, session.parent)
        self.edits = LabelEdits(
            session.document, labels, session.playback, self.autosave, session.edits, session.parent
        )
        self.dragging = LabelDragging(self.edits, session.parent)
        self.marking = LabelMarking(self.edits, session.settings)
        self.tracks = LabelTracks(shell, self.edits)
        self.loop = SpanLoop(labels, session.playback, session.parent)
        self.over_maps, self.over_all = map_overlay(labels), strip_overlay(labels)
        self.cut_out = CutOutModel(session, synthesis, session.parent)
        self.autosave.done_at.connect(session.span.reveal_any)
        self.edits.failed.connect(shell.warn)
        report(shell, self.autosave, self.cut_out)
        session.document.changed.connect(self._follow_capture)
        shown = labels.changed, labels.selection_changed, labels.marks_changed
        self._modes = session.placing, session.aligning
        cancelled = self.dragging.changed, self.loop.changed
        self.changing = *shown, *cancelled, *(mode.changed for mode in self._modes)
        self.closing = (self.cut_out, self.autosave)

    # --- menus ----------------------------------------------------------------------------

    def actions(self) -> Sequence[Action]:
        """Everything that can be done to labels."""
        edits = *self._edits_of_spans(), *self._edits_of_tracks(), *self._edits_from_files()
        return *editing(self.edits, *edits), *self._other_actions()

    def _edits_of_spans(self) -> Sequence[Action]:
        labels, edits, marking = self.model, self.edits, self.marking
        return (
            Action(
                "end_marks", "Labels", "End what is being marked", ("E",),
                "End all spans that have begun, before the frame on screen",
                marking.end_marks, self._has_marks,
            ),
            Action(
                "carve_marks", "Labels", "End what is being marked, cutting others", ("K",),
                "The same, taking from other spans of the track what they hold of it",
                lambda: marking.end_marks(cutting=True), self._has_marks,
            ),
            Action(
                "span_starts_here", "Labels", "Selected span starts here", ("[",),
                "The frame on screen is the first one of the selected span",
                lambda: edits.edge_here("start"), self._one_selected,
            ),
            Action(
                "span_ends_here", "Labels", "Selected span ends here", ("]",),
                "The frame on screen is the last one of the selected span",
                lambda: edits.edge_here("end"), self._one_selected,
            ),
            Action(
                "nudge_back", "Labels", "Move selected spans one frame back", ("Alt+Left",),
                "They stop at their neighbours", lambda: edits.nudge(-1), self._some_selected,
            ),
            Action(
                "nudge_on", "Labels", "Move selected spans one frame on", ("Alt+Right",),
                "They stop at their neighbours", lambda: edits.nudge(1), self._some_selected,
            ),
            Action(
                "split_span", "Labels", "Split span here", ("/",),
                "Cut the span under the cursor in two, before the frame on screen",
                edits.split, self._has_spans,
            ),
            Action(
                "merge_spans", "Labels", "Merge selected spans", ("G",),
                "One span from the first start to the last end (Ctrl+click selects several)",
                edits.merge, lambda: len(labels.selected_ids) > 1,
            ),
            Action(
                "delete_spans", "Labels", "Delete selected spans", ("Backspace", "Del"),
                "Undo brings them back", edits.delete, self._some_selected,
            ),
            Action(
                "duplicate_spans", "Labels", "Duplicate selected spans here", ("C",),
                "The copies begin with the frame on screen, or behind the spans where that is"
                " within them",
                edits.duplicate, self._some_selected,
            ),
            Action(
                "meet_spans", "Labels", "Let two selected spans meet here", ("J",),
                "The first ends and the second begins with the frame on screen",
                edits.meet, lambda: len(labels.selected_ids) == 2,
            ),
            Action(
                "fill_gaps", "Labels", "Fill gaps of the track with background", ("Shift+F",),
                "A span in every gap, with the label of the class background or the one last"
                " used",
                edits.fill_gaps, lambda: self._session.has_content() and self._has_track(),
            ),
        )  # fmt: skip

    def _edits_of_tracks(self) -> Sequence[Action]:
        tracks = self.tracks
        return (
            Action(
                "spans_up", "Labels", "Put selected spans on the track above", ("Alt+Up",),
                "At the times that they have", lambda: tracks.put_spans(-1), self._can_put,
            ),
            Action(
                "spans_down", "Labels", "Put selected spans on the track below", ("Alt+Down",),
                "At the times that they have", lambda: tracks.put_spans(1), self._can_put,
            ),
            Action(
                "add_track", "Labels", "Add track…", (), "A row of spans below the others",
                tracks.ask_to_add, self._session.has_content,
            ),
            Action(
                "rename_track", "Labels", "Rename track…", (),
                "The one on which new spans come", tracks.rename, self._has_track,
            ),
            Action(
                "overlap", "Labels", "Spans of the track may overlap", (),
                "Several at once, drawn one below the other",
                tracks.toggle_overlap, self._has_track, lambda: tracks.free,
            ),
            Action(
                "track_up", "Labels", "Move track up", (), "Above the one before it",
                lambda: tracks.move(-1), self._has_tracks,
            ),
            Action(
                "track_down", "Labels", "Move track down", (), "Below the one after it",
                lambda: tracks.move(1), self._has_tracks,
            ),
            Action(
                "remove_track", "Labels", "Remove track", (),
                "With its spans; undo brings them back", tracks.remove, self._has_track,
            ),
        )  # fmt: skip

    def _edits_from_files(self) -> Sequence[Action]:
        return (
            Action(
                "import_labels", "Labels", "Import labels…", ("Ctrl+I",),
                "Take the labels of a file: SD² Studio, table, Audacity, ELAN, Praat, BORIS,"
                " MNE",
                lambda: import_labels(self._shell, self.edits), self._session.has_content,
            ),
            Action(
                "restore_labels", "Labels", "Restore edits that were not saved", (),
                "Take over what an earlier session left behind; one undo takes that back",
                self.edits.restore, lambda: self.autosave.offer is not None,
            ),
        )  # fmt: skip

    def _other_actions(self) -> Sequence[Action]:
        s, shell, labels, edits = self._session, self._shell, self.model, self.edits
        loop, tracks, autosave = self.loop, self.tracks, self.autosave
        return (
            Action(
                "leave", "Labels", "Cancel", ("Esc",),
                "Let go of what is dragged; else place no sensor, or align no more; else forget"
                " what is being marked; else end the loop of a span; else select nothing",
                lambda: next(self._to_cancel(), tuple)(), lambda: any(self._to_cancel()),
            ),
            Action(
                "loop_span", "Labels", "Play selected span in a loop", ("O",),
                "Again and again, also while its edges are moved, until Esc or going elsewhere",
                lambda: loop.play(labels.selected[0]), self._some_selected,
            ),
            Action(
                "select_all", "Labels", "Select all spans", ("Ctrl+A",), "On all tracks",
                self._select_all, self._has_spans,
            ),
            Action(
                "next_span", "Labels", "Next span", ("N",), "Select it and go to its start",
                lambda: edits.step(1), self._has_spans,
            ),
            Action(
                "previous_span", "Labels", "Previous span", ("P",), "Select it and go to its start",
                lambda: edits.step(-1), self._has_spans,
            ),
            Action(
                "previous_track", "Labels", "Previous track", ("Shift+Up",),
                "New spans come on the track above", lambda: tracks.step(-1), self._has_tracks,
            ),
            Action(
                "next_track", "Labels", "Next track", ("Shift+Down",),
                "New spans come on the track below", lambda: tracks.step(1), self._has_tracks,
            ),
            Action(
                "export_labels", "Labels", "Export labels…", ("Ctrl+Shift+I",),
                "Write the labels for another program, and say what its file cannot hold",
                lambda: export_labels(shell, s, labels), s.has_content,
            ),
            Action(
                "cut_out", "Labels", "Export cut-outs…", ("Ctrl+Shift+X",),
                "Write video, mesh and maps of each span into a folder of its own, with an index",
                lambda: ask_for_cut_outs(shell, labels, self.cut_out), self._has_spans,
            ),
            Action(
                "recover_labels", "File", "Recover labels…", (),
                "Labels that were not saved when the program ended, or that were not wanted back"
                " then",
                lambda: recover(autosave, s.document, shell),
            ),
            Action(
                "edit_labels_here", "Labels", "Try again to edit labels here", (),
                "Where another window edited them: take them over, once it is closed",
                autosave.try_again, lambda: autosave.read_only,
            ),
            Action(
                "find_spans", "Labels", "Find spans…", ("Ctrl+F",),
                "Search the table of spans for a label, a note or a track",
                lambda: shell.bring_up("Labels", "Search"), s.has_content,
            ),
            Action(
                "label_set", "Labels", "Label set…", ("Ctrl+L",),
                "Names, keys, colours and classes of the labels, to be edited and shared",
                lambda: shell.bring_up("Labels", "Label set"),
            ),
            Action(
                "show_labels", "View", "Labels panel", ("Shift+L",),
                "The spans as a table, statistics of them, and the label set",
                lambda: shell.bring_up("Labels", "Spans"),
            ),
        )  # fmt: skip

    def _has_spans(self) -> bool:
        return bool(self.model.labels.spans)

    def _has_marks(self) -> bool:
        return bool(self.model.marks)

    def _some_selected(self) -> bool:
        return bool(self.model.selected_ids)

    def _one_selected(self) -> bool:
        return len(self.model.selected_ids) == 1

    def _has_track(self) -> bool:
        return bool(self.model.track)

    def _has_tracks(self) -> bool:
        return len(self.model.targets) > 1

    def _can_put(self) -> bool:
        return self._some_selected() and self._has_tracks()

    def _select_all(self) -> None:
        """Select all spans; in the table only those that a search has left there."""
        focus = QApplication.focusWidget()
        (focus.selectAll if isinstance(focus, SpanTable) else self.model.select_all)()

    def _to_cancel(self) -> Iterator[Callable[[], object]]:
        """Things that can be let go of; the first one is."""
        if self.dragging.dragging:
            yield self.dragging.cancel_drag
        yield from (mode.end for mode in self._modes if mode.active)
        if self.model.marks:
            yield lambda: self.model.set_marks(())
        if self.loop.span is not None:
            yield self.loop.end
        if self.model.selected_ids:
            yield lambda: self.model.select(())

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """Labels with their keys, and tracks."""
        return {
            "label keys": self._fill_keys,
            "tracks": lambda menu: offer_tracks(menu, self.model),
        }

    def _fill_keys(self, menu: QMenu) -> None:
        keys = LabelActions(self.edits, self._use_label, menu, self._shell.dialog_parent)
        for signal in (self._session.document.opened, self.autosave.changed):
            signal.connect(keys.refresh)

    def _use_label(self, label: str) -> None:
        chosen = self.model.selected
        marks = self._session.playback.playing or self.model.marks or self.marking.left_behind
        if not chosen or marks:
            self.marking.mark(label)
        elif any(span.origin == "suggestion" for span in chosen):
            self._accept(label)
        else:
            self.edits.relabel(label)

    # --- views ----------------------------------------------------------------------------

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, and the timeline below the maps."""
        s, shell = self._session, self._shell
        panel = LabelsPanel(s, self.edits, shell)
        signs = ("✓", "accept_suggestion"), ("✗", "reject_suggestion")
        decisions = [(sign, shell.action(name)) for sign, name in signs]
        buttons = SpanButtons(self.model, decisions)
        timeline = LabelTimeline(s, self.edits, self.dragging, self.loop, buttons)
        self._offer_places(timeline)
        more = [shell.place_menu(name).menuAction() for name in ("Spans", "Tracks")]
        more += [shell.action(name) for name in ("export_labels", "cut_out")]
        timeline.menu_parts = (*timeline.menu_parts, lambda menu, _: menu.addActions(more))
        area = LabelArea(timeline, self.model)
        return {"Labels": panel, "labels": pane(TargetLine(self.model), area)}

    def notices(self) -> Sequence[Notice]:
        """Labels that were not saved, and who else edits."""
        return (LabelNotice(self.autosave, self.edits, self._session.document, self._shell),)

    def let_drag_on(self, views: Sequence[TimePlot]) -> None:
        """Let spans be selected and their edges be dragged on maps."""
        for view in views:
            SpanDragger(view, self.dragging, self.loop)
            self._offer_places(view)

    def _offer_places(self, view: TimePlot) -> None:
        """Offer to label from a place, in the context menu."""

        def fill(menu: QMenu, place: QPointF) -> None:
            if view.plot_rect().contains(place):
                self._fill_menu(menu, view.scale.time_of(place.x()))

        view.menu_parts = (*view.menu_parts, fill)

    def offer_frame(self, menu: QMenu, place: QPointF) -> None:
        """Offer to label from the frame on screen, in the context menu of a view of it."""
        self._fill_menu(menu, self._session.playback.time_s)

    def _fill_menu(self, menu: QMenu, time_s: float) -> None:
        """Offer to play the span at a time, and to begin another one there."""
        if not self._session.has_content():
            return
        labels = self.model
        if (span := labels.at(time_s)) is not None:
            menu.addAction(f"Play “{span.label}” in a loop", lambda: self.loop.play(span))
        begin = menu.addMenu("La&bel from here")
        begin.setEnabled(not self.edits.refusal and bool(labels.track))
        for label in labels.labels.label_set.labels:
            begin.addAction(label.name, partial(self._mark_at, time_s, label.name))

    def _mark_at(self, time_s: float, label: str) -> None:
        self._session.playback.seek(time_s)
        self.marking.mark(label)

    # --- life -----------------------------------------------------------------------------

    def _follow_capture(self) -> None:
        """Take the labels that a radar capture brings, which follow its clock."""
        document = self._session.document
        content, recording = document.content, document.recording
        brought = content is not None and content.radar_labels is not None
        if brought and recording is not None and recording.unlabelled:
            self.model.set_labels(document.labels)

    def attach(self) -> None:
        """Show the labels of the recording that was opened."""
        if not self._session.document.same_recording:
            self.dragging.cancel_drag()  # what is held is of the one before
        self.autosave.attach()
        self._follow_capture()

    def drop_of(self, path: Path) -> Drop | None:
        """Import a dropped file of labels."""
        if not is_label_file(path):
            return None
        return Drop("Import these labels", lambda: import_labels(self._shell, self.edits, path))
