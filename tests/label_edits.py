"""Edits of labels with their undo history, without files."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2app.session.content import UNTITLED, Content
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2core.labels.spans import Labels
from sd2core.recording.recording import Recording
from sd2core.timebase import Timebase


def label_edits(timebase: Timebase) -> LabelEdits:
    """Edits on a model and a clock of their own, which nobody refuses and nothing keeps."""
    document, labels, playback = DocumentModel(TaskList()), LabelsModel(), PlaybackModel()
    document.content = Content(Recording(UNTITLED), timebase)
    document.undo_stack.indexChanged.connect(lambda _: labels.set_labels(document.labels))
    session: Any = SimpleNamespace(refusal="")
    playback.set_timebase(timebase)
    return LabelEdits(document, labels, playback, session, Edits(document, SensorModel()))


def show_labels(edits: LabelEdits, labels: Labels) -> None:
    """Have a recording with these labels."""
    recording = edits.recording
    assert recording is not None
    recording.labels = labels
    edits.labels.open(labels)
