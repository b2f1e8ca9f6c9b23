"""Edits of labels with their undo history, without a document and files."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from PySide6.QtGui import QUndoStack

from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2core.timebase import Timebase


def label_edits(timebase: Timebase) -> LabelEdits:
    """Edits on a model and a clock of their own, which nobody refuses and nothing keeps."""
    document: Any = SimpleNamespace(
        recording=SimpleNamespace(labels=None, unlabel=lambda: None),
        mesh=None,
        undo_stack=QUndoStack(),
        renamed=SimpleNamespace(connect=lambda _: None),
    )
    session: Any = SimpleNamespace(refusal="", keep=lambda *_: None)
    playback = PlaybackModel()
    playback.set_timebase(timebase)
    return LabelEdits(document, LabelsModel(), playback, session)
