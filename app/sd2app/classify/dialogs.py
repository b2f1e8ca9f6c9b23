"""Dialogs of classifiers: files, training data and model card."""

from __future__ import annotations

from pathlib import Path

from sd2app.classify.model import ClassifyModel
from sd2app.classify.text import classifier_page
from sd2app.classify.training import ClassTraining
from sd2app.feature import Shell
from sd2app.session.content import UNTITLED
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file, ask_folder
from sd2app.widgets.model_card_dialog import ModelCardDialog
from sd2core.errors import Sd2Error

_FILES = "Classifiers (*.safetensors)"
_DATA = "Data sets and labelled radar files (*.h5 *.hdf5 *.npz)"


class ClassifyDialogs:
    """Dialogs, followed by calls of the models."""

    def __init__(
        self, shell: Shell, classify: ClassifyModel, training: ClassTraining, session: Session
    ) -> None:
        self.shell, self._session = shell, session
        self._parent = shell.dialog_parent
        self._classify, self._training = classify, training

    def open_classifier(self) -> None:
        """Choose a file, and use it."""
        start = str(self._classify.path or "")
        if path := ask_file(self._parent, "Open classifier file", _FILES, start):
            self.use(path)

    def use(self, path: Path | None) -> None:
        """Classify with a file, or not at all."""
        self.shell.attempt(lambda: self._classify.use(path))

    def show_card(self) -> None:
        """Show the card of the classifier in use."""
        card = self._classify.card
        if card is not None:
            ModelCardDialog(classifier_page(card), self._parent).exec()

    def is_classifier(self, path: Path) -> bool:
        """True if a file can be used as one."""
        try:
            self._classify.describe(path)
        except Sd2Error:
            return False
        return True

    # --- the panel ------------------------------------------------------------------------

    def add_folder(self) -> None:
        """Let the user choose a folder with labelled data."""
        title = "A campaign, a data set, a recording, or a folder of recordings"
        if path := ask_folder(self._parent, title):
            self._training.setup.add(path)

    def add_file(self) -> None:
        """Let the user choose a data set or a labelled radar file."""
        if path := ask_file(self._parent, "Data set or labelled radar file", _DATA):
            self._training.setup.add(path)

    def add_this(self) -> None:
        """Learn from the recording that is open."""
        recording = self._session.document.recording
        if recording is not None and self.has_this():
            self._training.setup.add(recording.folder)

    def has_this(self) -> bool:
        """True if the open recording can be learnt from: it is on disk."""
        content = self._session.document.content
        return content is not None and content.recording.folder != UNTITLED
