"""Agree panel: agreement of another person's labels with those of the recording."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from sd2app.agreement.model import AgreementModel
from sd2app.agreement.text import facts, label_facts, verdict, where
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.inputs import action_button
from sd2app.widgets.panel import ElidedLabel, FactRows, rule, sentence, title

_MOST_FACTS, _MOST_LABELS = 10, 12
_NOTHING = (
    "Choose the file of another person who labelled this recording. Agreement is measured frame by"
    " frame and span by span, and their labels are shown below yours."
)
_MEANING = "1 is agreement in every frame, 0 what chance alone would give (Cohen's kappa)."


class AgreementPanel(QWidget):
    """A view of :class:`AgreementModel`."""

    def __init__(
        self,
        model: AgreementModel,
        playback: PlaybackModel,
        action: Callable[[str], QAction],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._model = model
        self._name = ElidedLabel(self)
        self._name.setObjectName("title")
        self._verdict, self._where = sentence("", "plain"), sentence("", "plain")
        self._facts = FactRows(_MOST_FACTS, at_the_edge=True, parent=self)
        self._labels = FactRows(_MOST_LABELS, at_the_edge=True, parent=self)
        self._nothing = sentence(_NOTHING)
        self._result = self._lay_out_result(action)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setSpacing(8)
        layout.addLayout(
            _row(self._name, action, ("compare_labels", "File…"), ("end_comparison", "End"))
        )
        layout.addWidget(self._nothing)
        layout.addWidget(self._result)
        layout.addStretch(1)
        model.changed.connect(self._refresh)
        playback.frame_changed.connect(self._follow_cursor)
        self._refresh()

    def _lay_out_result(self, action: Callable[[str], QAction]) -> QWidget:
        result = QWidget(self)
        layout = QVBoxLayout(result)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        buttons = (("previous_disagreement", "Previous"), ("next_disagreement", "Next"))
        layout.addWidget(self._verdict)
        layout.addWidget(sentence(_MEANING))
        layout.addWidget(rule())
        layout.addLayout(_row(title("Disagreements"), action, *buttons))
        layout.addWidget(self._where)
        layout.addWidget(rule())
        layout.addWidget(self._facts)
        layout.addWidget(rule())
        layout.addWidget(title("Kappa of each label"))
        layout.addWidget(self._labels)
        return result

    def _refresh(self) -> None:
        model = self._model
        self._name.setText(f"With {model.name}" if model.active else "No comparison")
        self._name.setToolTip(str(model.path or ""))
        self._nothing.setVisible(not model.active)
        self._result.setVisible(model.active)
        if model.active:
            self._verdict.setText(verdict(model))
            self._facts.show_facts(facts(model))
            self._labels.show_facts(label_facts(model)[:_MOST_LABELS])
            self._follow_cursor()

    def _follow_cursor(self) -> None:
        if self._model.active:
            self._where.setText(where(self._model))


def _row(
    heading: QWidget, action: Callable[[str], QAction], *buttons: tuple[str, str]
) -> QHBoxLayout:
    row = QHBoxLayout()
    row.setSpacing(6)
    row.addWidget(heading, 1)
    for name, text in buttons:
        button = action_button(action(name), text)
        button.setObjectName("outlined")
        button.setAccessibleName(text)
        row.addWidget(button)
    return row
