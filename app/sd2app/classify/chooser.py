"""Menu of classifiers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import SignalInstance

from sd2app.classify.model import ClassifyModel
from sd2app.classify.text import classifier_title, learned_text, network_text
from sd2app.widgets.model_menu import Entry, Face


class ClassifierChooser:
    """Classifiers to choose from."""

    title = "Classify with"
    role = "Classifier"
    none_tip = "Say nothing of gestures"

    def __init__(self, classify: ClassifyModel) -> None:
        self._classify = classify

    @property
    def changed(self) -> SignalInstance:
        """Signal that texts or models may have changed."""
        return self._classify.changed

    @property
    def path(self) -> Path | None:
        """The model in use."""
        return self._classify.path

    def entries(self) -> Sequence[Entry]:
        """The models as they are on disk now."""
        return [
            Entry(
                f"{classifier_title(card)}\t{network_text(card)}",
                f"{network_text(card)}, {learned_text(card)}\n{card.path}",
                card.path,
            )
            for card in self._classify.available()
        ]

    def face(self) -> Face:
        """Text and tooltip for the model in use."""
        card, path = self._classify.card, self._classify.path
        if self._classify.problem:
            return Face("Classifier not usable", self._classify.problem)
        if card is not None:
            title = classifier_title(card)
            return Face(title, f"{title}: {network_text(card)}, {learned_text(card)}")
        if path is not None:
            return Face(f"Loading {path.stem}…", str(path))
        return Face("No classifier", "Choose a model that says which gesture a frame shows")
