"""Labels of spans in time: timeline, panel, files, safety of every edit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import QObject, SignalInstance
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.labels.actions import (
    LabelActions,
    ReactionMenu,
    TrackMenu,
    editing,
    marking_actions,
    span_actions,
    track_actions,
)
from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.cut_out_model import CutOutModel
from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits, LabelTracks
from sd2app.labels.files_dialogs import LabelFileDialogs
from sd2app.labels.label_set_dialog import LabelSetDialogs
from sd2app.labels.loop import SpanLoop
from sd2app.labels.map_dragging import SpanDragger
from sd2app.labels.marking import LabelMarking, ReactionModel
from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import map_overlay, strip_overlay
from sd2app.labels.panel import LabelsPanel
from sd2app.labels.recovery_bar import LabelBar
from sd2app.labels.recovery_dialog import choose_recovery
from sd2app.labels.timeline import LabelArea, LabelTimeline
from sd2app.labels.tracks_dialog import TrackDialogs
from sd2app.session.session import Session
from sd2app.widgets.time_plot import Overlay, TimePlot


class LabelsFeature(Feature):
    """Spans that are marked, dragged, typed or read from files; each edit is kept at once.

    ``recovery`` is the folder of edits that were not saved; ``accept`` accepts the selected
    suggestion with a label.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        recovery: Path,
        accept: Callable[[str], object],
        parent: QObject,
    ) -> None:
        self._session, self._shell, self._accept = s, _, _ = session, shell, accept
        self.model = labels = LabelsModel(parent)
        self.autosave = LabelAutosave(s.document, labels, recovery, parent)
        self.edits = LabelEdits(s.document, labels, s.playback, self.autosave, parent)
        self.reaction = ReactionModel(s.settings, parent)
        self.dragging = LabelDragging(labels, s.playback, self.edits, parent)
        self.marking = LabelMarking(labels, s.playback, self.reaction, self.edits, parent)
        self.tracks = LabelTracks(labels, self.edits)
        self.loop = SpanLoop(labels, s.playback, parent)
        maps = {"synthetic": s.maps.synthetic, "denoised": s.maps.denoised, "radar": s.maps.real}
        self.cut_out = CutOutModel(s.document, maps, s.jobs, parent)
        self.files = LabelFileDialogs(shell, s, labels, self.edits, self.cut_out)
        self._track_dialogs = TrackDialogs(shell, labels, self.tracks, self.reaction)
        self._keys: LabelActions | None = None
        self.edits.done_at.connect(s.span.reveal_any)
        self.edits.failed.connect(shell.warn)
        for model in (self.autosave, self.cut_out):
            model.failed.connect(shell.warn)
            model.noted.connect(shell.note)
        s.document.changed.connect(self._follow_capture)

    # --- menus ----------------------------------------------------------------------------

    def actions(self) -> Sequence[Action]:
        """Everything that can be done to labels."""
        s, labels, edits, autosave = self._session, self.model, self.edits, self.autosave

        def has_content() -> bool:
            return s.has_content

        def has_spans() -> bool:
            return bool(labels.labels.spans)

        return (
            *marking_actions(labels, edits, self.marking, self.dragging, self.loop),
            *span_actions(labels, edits, self.loop, has_content),
            *track_actions(labels, edits, self.tracks, self._track_dialogs, has_content),
            *editing(
                edits,
                Action(
                    "import_labels", "Labels", "Import labels…", ("Ctrl+I",),
                    "Take the labels of a file: SD² Studio, table, Audacity, ELAN, Praat, BORIS,"
                    " MNE",
                    lambda: self.files.import_labels(), has_content,
                ),
                Action(
                    "restore_labels", "Labels", "Restore labels that were not saved", (),
                    "Take over what an earlier session left behind; one undo takes that back",
                    edits.restore, lambda: autosave.offer is not None,
                ),
            ),
            Action(
                "export_labels", "Labels", "Export labels…", ("Ctrl+Shift+I",),
                "Write the labels for another program, and say what its file cannot hold",
                self.files.export_labels, has_content,
            ),
            Action(
                "cut_out", "Labels", "Export cut-outs…", ("Ctrl+Shift+X",),
                "Write video, mesh and maps of each span into a folder of its own, with an index",
                self.files.cut_out, has_spans,
            ),
            Action(
                "recover_labels", "File", "Recover labels…", (),
                "Labels that were not saved when the program ended, or that were not wanted back"
                " then",
                self._recover,
            ),
            Action(
                "edit_labels_here", "Labels", "Try again to edit labels here", (),
                "Where another window edited them: take them over, once it is closed",
                autosave.try_again, lambda: autosave.read_only,
            ),
            Action(
                "find_spans", "Labels", "Find spans…", ("Ctrl+F",),
                "Search the table of spans for a label, a note or a track",
                lambda: self._shell.bring_up("Labels", "Search"), has_content,
            ),
            Action(
                "label_set", "Labels", "Label set…", ("Ctrl+L",),
                "Names, keys, colours and classes of the labels, to be edited and shared",
                lambda: self._shell.bring_up("Labels", "Label set"),
            ),
            Action(
                "show_labels", "View", "Labels panel", ("Shift+L",),
                "The spans as a table, statistics of them, and the label set",
                lambda: self._shell.bring_up("Labels", "Spans"),
            ),
        )  # fmt: skip

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """Labels with their keys, tracks, reaction times."""
        return {
            "label keys": self._fill_keys,
            "tracks": lambda menu: TrackMenu(menu, self.model),
            "reaction": lambda menu: menu.addMenu(
                ReactionMenu(self.reaction, self._track_dialogs.reaction, menu)
            ),
        }

    def _fill_keys(self, menu: QMenu) -> None:
        self._keys = LabelActions(self.model, self._use_label, menu, self._shell.dialog_parent)

    def _use_label(self, label: str) -> None:
        chosen = self.model.selected
        if not chosen or self._session.playback.playing or self.model.marks:
            self.marking.mark(label)
        elif any(span.origin == "suggestion" for span in chosen):
            self._accept(label)
        else:
            self.edits.relabel(label)

    def refresh_menus(self) -> None:
        """Disable the keys of labels while edits are refused."""
        if self._keys is not None:
            self._keys.refresh(self.edits.refusal)

    # --- views ----------------------------------------------------------------------------

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, and the timeline below the maps."""
        s, shell = self._session, self._shell
        asks = LabelSetDialogs(shell, self.model, self.edits.apply)
        panel = LabelsPanel(s, self.model, self.edits, shell.keys, shell.action, asks)
        panel.model.noted.connect(shell.note)
        timeline = LabelTimeline(
            self.model, self.edits, self.dragging, self.loop, s.span, s.playback, s.display
        )
        return {"Labels": panel, "labels": LabelArea(timeline, self.model)}

    def bars(self) -> Sequence[QWidget]:
        """Labels that were not saved, and who else edits."""
        document, restore = self._session.document, self.edits.restore
        return (LabelBar(self.autosave, document, restore, self._recover),)

    @property
    def over_maps(self) -> Overlay:
        """Spans over a map."""
        return map_overlay(self.model)

    @property
    def over_all(self) -> Overlay:
        """Spans over the overview of the recording."""
        return strip_overlay(self.model)

    def let_drag_on(self, views: Sequence[TimePlot]) -> None:
        """Let spans be selected and their edges be dragged on maps."""
        for view in views:
            SpanDragger(view, self.model, self.dragging, self.loop)

    # --- life -----------------------------------------------------------------------------

    def _recover(self) -> None:
        """List what was not saved, and open the recording of what is chosen."""
        offer = choose_recovery(self.autosave, self._shell.dialog_parent)
        if offer is None:
            return
        if self.autosave.is_of_open(offer):
            self.autosave.ask_for(offer)
        elif self._shell.may_discard():
            self.autosave.ask_for(offer)
            self._session.document.open([offer.recording])

    def _follow_capture(self) -> None:
        """Take the labels that a radar capture brings, which follow its clock."""
        document = self._session.document
        content, recording = document.content, document.recording
        brought = content is not None and content.radar_labels is not None
        if brought and recording is not None and recording.unlabelled:
            self.model.set_labels(document.labels)

    def take_over(self) -> None:
        """Show the labels of the recording that was opened."""
        self.autosave.take_over()
        self._follow_capture()

    def take_dropped(self, path: Path) -> bool:
        """Import a file of labels that was dropped."""
        return self.files.take_dropped(path)

    def changes(self) -> Sequence[SignalInstance]:
        """Labels, selection and marks."""
        return (
            self.autosave.changed,
            self.model.changed,
            self.model.selection_changed,
            self.model.marks_changed,
            self.dragging.changed,
            self.loop.changed,
        )

    def close(self) -> None:
        """Stop cutting out, and let go of the labels."""
        self.cut_out.close()
        self.autosave.close()
