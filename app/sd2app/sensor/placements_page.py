"""Placements: a grid or a cloud of sensors around the body, and what their maps cost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QRectF, QSignalBlocker, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QCheckBox, QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from sd2app.accuracy.model import AccuracyModel
from sd2app.sensor.placement_fields import KINDS, NAMES, Kind, Name, PlacementFields
from sd2app.sensor.placement_text import (
    cost_source_text,
    cost_text,
    count_text,
    current_text,
    limit_facts,
    limits_text,
)
from sd2app.sensor.placements import PlacementsModel
from sd2app.widgets.inputs import Choice, TypedLine
from sd2app.widgets.panel import FactRows, outlined, rule, sentence, side_by_side, title
from sd2core.figures.colours import SEQUENTIAL

_KIND_TEXT: dict[Kind, str] = {"none": "None", "grid": "Grid", "cloud": "Random cloud"}
_LABELS: dict[Name, str] = {
    "range": "Ranges, m",
    "azimuth": "Azimuths, °",
    "elevation": "Elevations, °",
    "count": "Count",
    "seed": "Seed",
}
_MEANINGS: dict[Name, str] = {
    "range": "Distance from the body's centre",
    "azimuth": "0 is between body and camera, positive to the right",
    "elevation": "Positive is above the body's centre",
    "count": "How many places",
    "seed": "Another number gives other places, the same one the same",
}
_HOW: dict[Kind, str] = {
    "none": "",
    "grid": "Numbers such as 1, 2.5, or from:to:step",
    "cloud": "from:to",
}
_NOTHING = (
    "A map from every place around the body is more data to learn from. Plan a grid or a cloud of"
    " places: they are drawn in the scene, and a click on one puts the sensor there."
)
_NO_BODY = "There is no body in this recording to place sensors around."


class PlacementsPage(QWidget):
    """A view of :class:`PlacementsModel`.

    ``take`` asks for a file with a plan, ``export`` where to write one; ``batch`` sets up a
    batch with it.
    """

    def __init__(
        self,
        placements: PlacementsModel,
        trade: AccuracyModel,
        take: Callable[[], None],
        export: Callable[[], None],
        batch: Callable[[], None],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._model, self._trade = placements, trade
        self._fields = PlacementFields(placements, self)
        self._kind = Choice("What is planned", self)
        for kind in KINDS:
            self._kind.addItem(_KIND_TEXT[kind], kind)
        self._kind.currentIndexChanged.connect(lambda index: self._fields.set_kind(KINDS[index]))
        head = QHBoxLayout()
        head.addWidget(title("Plan"))
        head.addStretch(1)
        head.addWidget(self._kind)
        self._nothing = sentence("")
        self._planned = QWidget(self)
        self._lay_out_plan(QVBoxLayout(self._planned))
        self._take = outlined("Import…", "Take a plan from a file", take, self)
        self._export = outlined("Export…", "Write the plan, as for sd2 placements", export, self)
        self._batch = outlined("Batch…", "Make the maps, of many recordings", batch, self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 4)
        layout.setSpacing(6)
        layout.addLayout(head)
        layout.addWidget(self._nothing)
        layout.addWidget(self._planned)
        layout.addLayout(side_by_side(self._take, self._export, self._batch, spacing_px=6))
        layout.addStretch(1)
        placements.current_changed.connect(self._show_current)
        for signal in (placements.changed, trade.changed, self._fields.changed):
            signal.connect(self._refresh)
        self._refresh()

    # --- building -------------------------------------------------------------------------

    def _lay_out_plan(self, layout: QVBoxLayout) -> None:
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(self._form())
        self._how, self._problem = sentence(""), sentence("", "warning")
        self._count = title("")
        self._count.setAccessibleName("How many placements")
        self._scale = RangeScale(self)
        self._limits = FactRows(3, at_the_edge=True, parent=self)
        self._radar = sentence("")
        self._cost = title("")
        self._cost.setWordWrap(True)
        self._cost.setAccessibleName("What the maps cost")
        self._source = sentence("")
        self._shown = QCheckBox("In the scene", self)
        self._shown.setToolTip("Draw them in the scene")
        self._shown.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._shown.toggled.connect(self._model.set_shown)
        self._current = sentence("", "plain")
        model = self._model
        back = outlined("Previous", "Put the sensor there", lambda: model.step(-1), self)
        on = outlined("Next", "Put the sensor there", lambda: model.step(1), self)
        for above in (self._how, self._problem, rule()):
            layout.addWidget(above)
        layout.addLayout(_apart(self._count, self._shown))
        for fact in (self._scale, self._limits, self._radar):
            layout.addWidget(fact)
        layout.addLayout(_apart(self._current, back, on))
        for below in (rule(), self._cost, self._source):
            layout.addWidget(below)

    def _form(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(3)
        grid.setColumnStretch(1, 1)
        self._rows: dict[Name, tuple[QLabel, TypedLine]] = {}
        for row, name in enumerate(NAMES):
            label = QLabel(_LABELS[name], self)
            label.setObjectName("muted")
            label.setToolTip(_MEANINGS[name])
            line = TypedLine(_LABELS[name], _MEANINGS[name], self)
            line.typed.connect(lambda text, name=name: self._fields.set_text(name, text))
            line.ended.connect(self._fields.end)
            grid.addWidget(label, row, 0)
            grid.addWidget(line, row, 1)
            self._rows[name] = (label, line)
        return grid

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        model, fields = self._model, self._fields
        planned = fields.kind != "none"
        with QSignalBlocker(self._kind):
            self._kind.setCurrentIndex(KINDS.index(fields.kind))
        self._kind.setEnabled(model.possible)
        self._nothing.setText(_NOTHING if model.possible else _NO_BODY)
        self._nothing.setVisible(not planned)
        self._planned.setVisible(planned)
        self._take.setEnabled(model.possible)
        self._export.setEnabled(planned)
        if not planned:
            return
        for name, (label, line) in self._rows.items():
            for widget in (label, line):
                widget.setVisible(name in fields.names)
            line.show_text(fields.text(name))
        _say(self._how, "" if fields.problem else _HOW[fields.kind])
        _say(self._problem, fields.problem)
        self._count.setText(count_text(model))
        self._scale.show_ranges([place.range_m for place in model.planned.places])
        self._limits.show_facts(limit_facts(model))
        _say(self._radar, limits_text(model))
        self._show_current()
        with QSignalBlocker(self._shown):
            self._shown.setChecked(model.shown)
        cost, in_use = model.cost, self._trade.in_use
        self._cost.setText("Their cost is being computed…" if cost is None else cost_text(cost))
        known = cost is not None and in_use is not None
        _say(self._source, cost_source_text(cost, in_use) if known else "")  # type: ignore[arg-type]

    def _show_current(self) -> None:
        if self._model.plan is not None:
            self._current.setText(current_text(self._model))


class RangeScale(QWidget):
    """Colour scale of the placements in the scene: near to far."""

    _BAR = 8

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._ends = ("", "")
        self.setAccessibleName("Colours of the placements: range")

    def show_ranges(self, ranges_m: list[float]) -> None:
        """Show the range from nearest to farthest, or nothing where all are equal."""
        ends = ("", "")
        if ranges_m and max(ranges_m) > min(ranges_m):
            ends = (f"{min(ranges_m):.3g} m", f"{max(ranges_m):.3g} m")
        self.setVisible(bool(ends[0]))
        if ends != self._ends:
            self._ends = ends
            self.update()

    def sizeHint(self) -> QSize:
        """Size of one line."""
        return QSize(120, self.fontMetrics().height() + 2)

    def minimumSizeHint(self) -> QSize:
        """Size of one line."""
        return QSize(60, self.fontMetrics().height() + 2)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint a colour bar between two texts."""
        painter = QPainter(self)
        painter.setPen(QColor(self.palette().text().color()))
        near, far = self._ends
        flags = Qt.AlignmentFlag.AlignVCenter
        painter.drawText(self.rect(), flags | Qt.AlignmentFlag.AlignLeft, near)
        painter.drawText(self.rect(), flags | Qt.AlignmentFlag.AlignRight, far)
        left, right = (self.fontMetrics().horizontalAdvance(word) + 8 for word in (near, far))
        strip = np.ascontiguousarray(SEQUENTIAL).reshape(1, -1, 3)
        image = QImage(
            strip.data, strip.shape[1], 1, 3 * strip.shape[1], QImage.Format.Format_RGB888
        )
        top = (self.height() - self._BAR) / 2
        painter.drawImage(QRectF(left, top, self.width() - left - right, self._BAR), image)


def _apart(wide: QWidget, *others: QWidget) -> QHBoxLayout:
    """Row with one widget that stretches and others at the right edge."""
    row = QHBoxLayout()
    row.setSpacing(6)
    row.addWidget(wide, 1)
    for widget in others:
        row.addWidget(widget)
    return row


def _say(label: QLabel, text: str) -> None:
    """Show words, and take no room without."""
    label.setText(text)
    label.setVisible(bool(text))
