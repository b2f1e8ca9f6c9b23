"""The tolerance: a number, and the usual ones with what each costs here."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.accuracy.model import PRESETS, TradeModel
from sd2app.widgets.inputs import NumberBox
from sd2app.widgets.panel import title
from sd2app.widgets.text import milliseconds, number, percent


class ToleranceRow(QWidget):
    """How much of the map may differ from the reference."""

    def __init__(self, trade: TradeModel, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._trade = trade
        self._box = NumberBox(
            0.05,
            50.0,
            " %",
            "Tolerance: how much of the map may differ from the reference, after smoothing",
            decimals=2,
            step=0.5,
        )
        self._box.valueChanged.connect(lambda value: trade.set_tolerance(value / 100))
        head = QHBoxLayout()
        head.addWidget(title("Tolerance"))
        head.addStretch(1)
        head.addWidget(self._box)
        row = QHBoxLayout()
        row.setSpacing(4)
        self._presets: dict[float, QToolButton] = {}
        for tolerance in PRESETS:
            button = QToolButton(self)
            button.setObjectName("preset")
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _=False, value=tolerance: trade.set_tolerance(value))
            row.addWidget(button, 1)
            self._presets[tolerance] = button
        self._meaning = QLabel(self)
        self._meaning.setObjectName("muted")
        self._meaning.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addLayout(head)
        layout.addLayout(row)
        layout.addWidget(self._meaning)
        trade.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        trade = self._trade
        self._box.show_value(100 * trade.tolerance)
        clicked = trade.in_use is not None and trade.in_use.origin == "clicked"
        known = trade.measured.counting is not None
        for tolerance, button in self._presets.items():
            cost_ms = trade.cost_at(tolerance)
            cost = number(cost_ms) if cost_ms is not None else "–"
            # What a tolerance costs stands under it once the scene has been measured.
            button.setText(f"{percent(tolerance)}\n{cost}" if known else percent(tolerance))
            button.setChecked(not clicked and abs(tolerance - trade.tolerance) < 1e-9)
            price = "measure this scene to see its cost"
            if known:
                price = "no plan holds it"
            if cost_ms is not None:
                price = f"{milliseconds(cost_ms)} per frame here"
            button.setToolTip(f"Accept an error of {percent(tolerance)}: {price}")
            button.setAccessibleName(button.toolTip())
        here = " Under each its cost here, ms per frame." if known else ""
        self._meaning.setText(
            f"{percent(trade.tolerance)}: the differences from the reference map add up to"
            f" {percent(trade.tolerance)} of it.{here}"
        )
