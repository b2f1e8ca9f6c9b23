"""A confusion matrix: what each class was taken for, the stronger the more often."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.classify.result import Matrix
from sd2app.session.display import DisplayModel

_STRONGEST = 120
"""Tint of a cell that holds all; text on it stays legible in both themes."""
_CELL_PX = (92, 40)
_GAP_PX = 6


class ConfusionView(QWidget):
    """True classes from top to bottom, what they were taken for from left to right."""

    def __init__(self, display: DisplayModel, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._display = display
        display.theme_changed.connect(self.update)
        self._classes: tuple[str, ...] = ()
        self._matrix: Matrix | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def matrix(self) -> Matrix | None:
        """Matrix that is shown."""
        return self._matrix

    def show_matrix(self, matrix: Matrix, classes: tuple[str, ...]) -> None:
        """Show another one."""
        self._matrix, self._classes = matrix, classes
        self.setAccessibleName(f"Confusion matrix: {matrix.title}")
        self.setAccessibleDescription(
            "; ".join(
                f"{true} taken for {found}: {matrix.cell(row, column).text()} %"
                for row, true in enumerate(classes)
                for column, found in enumerate(classes)
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
        """No cell is cut."""
        return self.sizeHint()

    def _margins(self) -> tuple[int, int]:
        metrics = self.fontMetrics()
        widest = max(map(metrics.horizontalAdvance, self._classes), default=0)
        return widest + 2 * _GAP_PX, 2 * metrics.height() + _GAP_PX

    def paintEvent(self, event: QPaintEvent) -> None:
        """Names, cells, numbers."""
        if self._matrix is None:
            return
        palette, (left, top) = self._display.palette, self._margins()
        width = min((self.width() - left) / len(self._classes), 1.5 * _CELL_PX[0])
        height, line = _CELL_PX[1], self.fontMetrics().height()
        centre = Qt.AlignmentFlag.AlignCenter
        with QPainter(self) as painter:
            painter.setPen(QColor(palette.muted))
            painter.drawText(
                QRectF(0, 0, left + width * len(self._classes), line),
                Qt.AlignmentFlag.AlignLeft,
                "each true class (a row) was taken for, %",
            )
            for number, name in enumerate(self._classes):
                painter.setPen(QColor(palette.muted))
                painter.drawText(QRectF(left + number * width, line, width, line), centre, name)
                painter.drawText(
                    QRectF(0, top + number * height, left - _GAP_PX, height),
                    Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                    name,
                )
                for column in range(len(self._classes)):
                    box = QRectF(left + column * width, top + number * height, width, height)
                    self._paint_cell(painter, box, number, column)

    def _paint_cell(self, painter: QPainter, box: QRectF, row: int, column: int) -> None:
        assert self._matrix is not None
        palette, value = self._display.palette, self._matrix.cell(row, column)
        tint = QColor(palette.accent if row == column else palette.real)
        share = value.mean if value.mean == value.mean else 0.0
        tint.setAlpha(round(_STRONGEST * min(max(share, 0.0), 1.0)))
        painter.fillRect(box, QColor(palette.panel))
        painter.fillRect(box, tint)
        painter.setPen(QPen(QColor(palette.border), 1))
        painter.drawRect(box.adjusted(0.5, 0.5, -0.5, -0.5))
        painter.setPen(QColor(palette.text))
        font = painter.font()
        font.setBold(row == column)
        painter.setFont(font)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, value.text())
        font.setBold(False)
        painter.setFont(font)
