"""Suggested spans, to be accepted or rejected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QInputDialog, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.labels.actions import editing
from sd2app.labels.edits import LabelEdits
from sd2app.session.session import Session
from sd2app.suggestions.bar import SuggestionBar
from sd2app.suggestions.finders import MotionFinder, SpanFinder
from sd2app.suggestions.model import SuggestionsModel
from sd2app.widgets.text import counted


class SuggestionsFeature(Feature):
    """Spans found by motion in a map, or by another finder."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        edits: LabelEdits,
        others: Sequence[SpanFinder],
        parent: QObject,
    ) -> None:
        self._shell, self._edits, maps = shell, edits, session.maps
        searched = maps.synthetic, maps.denoised, maps.real
        finders = (MotionFinder(searched), *others)
        self.model = SuggestionsModel(edits, finders, parent)
        self.changing = self.model.changed, *(track.came_or_went for track in searched)
        self.closing = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Find, accept, reject."""
        model = self.model
        return editing(
            self._edits,
            Action(
                "suggest", "Labels", "Suggest spans", ("F",),
                "Find where something moves in a map; each suggestion is then accepted or rejected",
                lambda: model.start(), lambda: not model.finders[0].why_not,
            ),
            Action(
                "accept_suggestion", "Labels", "Accept suggestion", ("Y",),
                "Take the one that is selected, or the next; a label's own key takes it as that",
                lambda: model.accept(), self._pending,
            ),
            Action(
                "reject_suggestion", "Labels", "Reject suggestion", ("W",),
                "Let the one that is selected go, or the next; it is not suggested again",
                lambda: model.reject(), self._pending,
            ),
            Action(
                "accept_suggestions", "Labels", "Accept all suggestions…", ("Shift+Y",),
                "Take all that there is room for; which label those without a name get is asked",
                self._accept_all, self._pending,
            ),
            Action(
                "reject_suggestions", "Labels", "Reject all suggestions", ("Shift+W",),
                "Let all go; they are not suggested again", model.reject_all, self._pending,
            ),
        )  # fmt: skip

    def _accept_all(self) -> None:
        model, labels = self.model, self._edits.labels
        if not model.unnamed:
            model.accept_all()
            return
        names = [label.name for label in labels.labels.label_set.labels] or [labels.label]
        asked = f"Label of {counted(len(model.unnamed), 'span')} in which something moves:"
        used_last = names.index(labels.label) if labels.label in names else 0
        label, accepted = QInputDialog.getItem(
            self._shell.dialog_parent, "Accept all suggestions", asked, names, used_last, False
        )
        if accepted:
            model.accept_all(label)

    def _pending(self) -> bool:
        return bool(self.model.pending)

    def panels(self) -> Mapping[str, QWidget]:
        """The bar below the maps."""
        return {"suggestions": SuggestionBar(self.model, self._shell.action)}

    def attach(self) -> None:
        """Begin without suggestions."""
        self.model.open()
