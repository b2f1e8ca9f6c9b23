"""Results of a study: two confusion matrices and learning curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from sd2app.manual.help import help_button
from sd2app.session.display import DisplayModel
from sd2app.study.result import ClassResult, Matrix
from sd2app.widgets.canvas import AT_RIGHT, Canvas, faint
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import sentence, title

_WIDTH_PX = 860
_STRONGEST = 120
"""Tint of a cell that holds all; text on it stays legible in both themes."""
_CELL_PX = (92, 40)
_GAP_PX = 6
_COLOURS = ("real", "synthetic", "denoised", "before", "inertial", "warning", "muted")
_ASIDE_PX = 8
"""Shift between learning curves, so that their bars do not cover each other."""
_PAD = 1.15
_HEAD = "each true class (a row) was taken for, %"


class ConfusionView(Canvas):
    """Confusion matrix: true classes from top to bottom, answers from left to right."""

    def __init__(self, display: DisplayModel) -> None:
        super().__init__()
        self._display = display
        self.follow(display.theme_changed)
        self._classes: tuple[str, ...] = ()
        self.matrix: Matrix | None = None  # that is shown
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_matrix(self, matrix: Matrix, classes: tuple[str, ...]) -> None:
        """Show another matrix."""
        self.matrix, self._classes = matrix, classes
        self.setAccessibleName(f"Confusion matrix: {matrix.title}")
        self.setAccessibleDescription(
            "; ".join(
                f"{true} taken for {predicted}: {matrix.cell(row, column).text()} %"
                for row, true in enumerate(classes)
                for column, predicted in enumerate(classes)
            )
        )
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """Room for all numbers."""
        left, top = self._margins()
        count = len(self._classes)
        return QSize(left + count * _CELL_PX[0], top + count * _CELL_PX[1] + 2)

    def minimumSizeHint(self) -> QSize:
        """Size at which no cell is cut off."""
        return self.sizeHint()

    def _margins(self) -> tuple[int, int]:
        metrics = self.fontMetrics()
        widest = max(map(metrics.horizontalAdvance, self._classes), default=0)
        return widest + 2 * _GAP_PX, 2 * metrics.height() + _GAP_PX

    def paint(self, painter: QPainter) -> None:
        """Paint names, cells and numbers."""
        if self.matrix is None:
            return
        palette, (left, top) = self._display.palette, self._margins()
        width = min((self.width() - left) / len(self._classes), 1.5 * _CELL_PX[0])
        height, line = _CELL_PX[1], self.fontMetrics().height()
        centre = Qt.AlignmentFlag.AlignCenter
        painter.setPen(QColor(palette.muted))
        painter.drawText(QPointF(0, self.fontMetrics().ascent()), _HEAD)
        for number, name in enumerate(self._classes):
            painter.setFont(self.font())
            painter.setPen(QColor(palette.muted))
            painter.drawText(QRectF(left + number * width, line, width, line), centre, name)
            room = QRectF(0, top + number * height, left - _GAP_PX, height)
            painter.drawText(room, AT_RIGHT, name)
            for column in range(len(self._classes)):
                box = QRectF(left + column * width, top + number * height, width, height)
                self._paint_cell(painter, box, number, column)

    def _paint_cell(self, painter: QPainter, box: QRectF, row: int, column: int) -> None:
        assert self.matrix is not None
        palette, value = self._display.palette, self.matrix.cell(row, column)
        tint = palette.accent if row == column else palette.real
        share = value.mean if value.mean == value.mean else 0.0
        painter.fillRect(box, QColor(palette.panel))
        painter.fillRect(box, faint(tint, round(_STRONGEST * min(max(share, 0.0), 1.0))))
        painter.setPen(QPen(QColor(palette.border), 1))
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
        painter.setPen(QColor(palette.text))
        font = self.font()
        font.setBold(row == column)
        painter.setFont(font)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, value.text())


class ClassResultDialog(Dialog):
    """Reference matrix on the left, a chosen matrix on the right, learning curves below."""

    def __init__(self, result: ClassResult, display: DisplayModel, parent: QWidget) -> None:
        super().__init__(f"Classifiers: {result.path.parent.name or result.path.name}", parent)
        self._result = result
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        first, *others = result.matrices
        columns = [_MatrixColumn(display, QLabel(first.title))]
        columns[0].show_matrix(first, result)
        if others:
            self._right = _MatrixColumn(display, self._what_else(others))
            self._choose(_usual(others))
            columns.append(self._right)
        layout = column_of(row_of((title(result.heading), 1), help_button("Study", self)))
        self.setLayout(layout)  # first, so that the keyboard goes from top to bottom
        if result.summary:
            layout.addWidget(sentence(result.summary))
        layout.addLayout(row_of(*((column, 1) for column in columns), spacing_px=24))
        if any(len(curve) > 1 for curve in result.curves):
            layout.addSpacing(8)
            curves = _LearningCurves(display, "Learning curve", learning_chart(result))
            layout.addWidget(curves, 1)
        layout.addWidget(closing(self))
        self.resize(_WIDTH_PX, self.sizeHint().height())

    def _what_else(self, matrices: Sequence[Matrix]) -> QWidget:
        """Choice of the matrix on the right, or its title if there is only one."""
        if len(matrices) == 1:
            return QLabel(matrices[0].title, self)
        choice = Choice("What is compared with it", self)
        choice.addItems([matrix.title for matrix in matrices])
        choice.setCurrentIndex(_usual(matrices))
        choice.currentIndexChanged.connect(self._choose)
        return choice

    def _choose(self, at: int) -> None:
        self._right.show_matrix(self._result.matrices[1 + at], self._result)


class _MatrixColumn(QWidget):
    """A heading, the matrix, and its mean recall."""

    def __init__(self, display: DisplayModel, heading: QWidget) -> None:
        super().__init__()
        head = row_of(heading, STRETCH)
        # As high with a title as with a choice, so that the matrices line up.
        head.addStrut(28)
        self._view = ConfusionView(display)
        self._recall = sentence("", "plain")
        self.setLayout(column_of(head, self._view, self._recall, STRETCH, margins_px=0))

    def show_matrix(self, matrix: Matrix, result: ClassResult) -> None:
        self._view.show_matrix(matrix, result.classes)
        text = f"Mean recall {matrix.recall.text()} %"
        if matrix.gain is not None:
            text += f": {matrix.gain.text(signed=True)} points over the radar alone"
        self._recall.setText(text)


def _usual(matrices: Sequence[Matrix]) -> int:
    """Default choice: denoised synthetic maps of the radar's own place, if present."""
    titles = [matrix.title for matrix in matrices]
    return titles.index("+ denoised") if "+ denoised" in titles else 0


class _LearningCurves(ChartView):
    HEIGHTS_PX = (180, 240, 420)


def learning_chart(result: ClassResult) -> Chart:
    """Frames found, with half an interval over movements, by the share of the radar's data."""
    points = [point for curve in result.curves for point in curve]
    low = min(point.recall.mean - point.recall.sd for point in points)
    high = max(point.recall.mean + point.recall.sd for point in points)
    least = max(math.floor(10 * low) / 10, 0.0)
    shares = sorted({100 * point.share for point in points})
    curves, marks = [], []
    for number, (curve, colour) in enumerate(zip(result.curves, cycle(_COLOURS), strict=False)):
        aside_px = _ASIDE_PX * (number - (len(result.curves) - 1) / 2)
        places = [(100 * point.share, 100 * point.recall.mean) for point in curve]
        bars = [100 * point.recall.sd for point in curve]
        curves.append(
            Curve(curve[0].title, colour, places, dot_px=3.0, bars=bars, aside_px=aside_px)
        )
        marks += [
            Mark(
                x,
                y,
                f"{point.title}, {x:g} % of the {result.kind} radar's data\n"
                f"Frames found {point.recall.text()} %",
                aside_px,
            )
            for (x, y), point in zip(places, curve, strict=True)
        ]
    return Chart(
        Scale(shares[0] / _PAD, 100 * _PAD, log=True, values=tuple(shares), text="{:g} %".format),
        Scale(100 * least, 100 * max(min(math.ceil(10 * high) / 10, 1.0), least + 0.1)),
        f"share of the {result.kind} radar's data that is learnt from",
        "mean recall of frames, %",
        curves,
        marks,
        scattered=True,
    )
