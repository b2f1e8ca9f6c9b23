"""Results of a comparison of classifiers: two confusion matrices and learning curves."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from sd2app.classify.confusion_view import ConfusionView
from sd2app.classify.learning_curve import LearningCurve
from sd2app.classify.result import ClassResult, Matrix
from sd2app.session.display import DisplayModel
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import sentence, title

_WIDTH_PX = 860


class ClassResultDialog(QDialog):
    """To the left what everything is compared with, to the right what is chosen."""

    def __init__(
        self, result: ClassResult, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._result = result
        self.setWindowTitle(f"Classifiers: {result.path.parent.name or result.path.name}")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        layout = QVBoxLayout(self)
        layout.addWidget(title(result.heading))
        if result.summary:
            layout.addWidget(sentence(result.summary))
        row = QHBoxLayout()
        row.setSpacing(24)
        first = result.matrices[0]
        self._left = _MatrixColumn(display, self)
        self._left.heading.addWidget(QLabel(first.title, self))
        self._left.heading.addStretch(1)
        self._left.show_matrix(first, result)
        row.addWidget(self._left, 1)
        if len(result.matrices) > 1:
            self._right = _MatrixColumn(display, self)
            self._right.heading.addWidget(self._what_else(result.matrices[1:]))
            self._right.heading.addStretch(1)
            row.addWidget(self._right, 1)
            self._choose(_usual(result.matrices[1:]))
        layout.addLayout(row)
        if any(len(curve) > 1 for curve in result.curves):
            layout.addSpacing(8)
            layout.addWidget(LearningCurve(result, display, self), 1)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, self)
        buttons.rejected.connect(self.reject)
        layout.addWidget(buttons)
        self.resize(_WIDTH_PX, self.sizeHint().height())

    def _what_else(self, matrices: tuple[Matrix, ...]) -> QWidget:
        """A choice of what is shown to the right, or what that is where there is no other."""
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
    """A heading, the matrix, and how good it is in all."""

    def __init__(self, display: DisplayModel, parent: QWidget) -> None:
        super().__init__(parent)
        self.heading = QHBoxLayout()
        # As high with a title as with a choice, so that the matrices line up.
        self.heading.addStrut(28)
        self._view = ConfusionView(display, self)
        self._recall = sentence("", "plain")
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(self.heading)
        column.addWidget(self._view)
        column.addWidget(self._recall)
        column.addStretch(1)

    def show_matrix(self, matrix: Matrix, result: ClassResult) -> None:
        self._view.show_matrix(matrix, result.classes)
        text = f"Mean recall {matrix.recall.text()} %"
        if matrix.gain is not None:
            text += f": {matrix.gain.text(signed=True)} points over the radar alone"
        self._recall.setText(text)


def _usual(matrices: tuple[Matrix, ...]) -> int:
    """The denoised synthetic ones of the radar's own place, where there are such."""
    titles = [matrix.title for matrix in matrices]
    return titles.index("+ denoised synthetic") if "+ denoised synthetic" in titles else 0
