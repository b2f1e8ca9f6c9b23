"""Why a plan was chosen: what the scene requires, and what it does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

if TYPE_CHECKING:
    from sd2core.accuracy.results import Reason


class ReasonList(QWidget):
    """One line per reason: ✓ is modelled, – is left out."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._shown: tuple[Reason, ...] = ()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(6)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)

    def show_reasons(self, reasons: tuple[Reason, ...]) -> None:
        """Replace what is listed; what is modelled comes first."""
        if reasons == self._shown:
            return
        self._shown = reasons
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        for row, reason in enumerate(sorted(reasons, key=lambda reason: not reason.modelled)):
            mark = QLabel("✓" if reason.modelled else "–", self)
            sentence = reason.text[:1].upper() + reason.text[1:]
            # A number and its unit stay on one line.
            text = QLabel(sentence.replace(" %", "\N{NO-BREAK SPACE}%"), self)
            text.setWordWrap(True)
            text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            text.setAccessibleName(
                f"{'Modelled' if reason.modelled else 'Left out'}: {reason.text}"
            )
            for label in (mark, text):
                label.setObjectName("plain" if reason.modelled else "muted")
            self._grid.addWidget(mark, row, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(text, row, 1)
