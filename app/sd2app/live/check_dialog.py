"""Dialog that shows what camera and radar see of somebody who walks, and what follows from it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QImage, QPixmap, QResizeEvent
from PySide6.QtWidgets import QDialogButtonBox, QLabel, QWidget

from sd2app.live.process import PlaceCheck
from sd2app.manual.help import with_help
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.layouts import STRETCH, column_of, grid_of, row_of
from sd2app.widgets.panel import outlined, say, sentence, title
from sd2core.placements.placements import Place

_NAMES = {"motion": "Motion", "range": "Range", "view": "View", "agreement": "Agreement"}
_PICTURE = QSize(416, 234)
_LINES = 3
"""Of a sentence, so that nothing moves when it gets another."""
_WAITS = "Walk towards both and away again, a few times."


class CheckDialog(Dialog):
    """A view of :class:`PlaceCheck`.

    Parameters
    ----------
    check : PlaceCheck
    again : callable
        Begins it once more.
    take_over : callable
        Called with the place that was found, if it is to be kept.
    parent : QWidget
    """

    def __init__(
        self,
        check: PlaceCheck,
        again: Callable[[], object],
        take_over: Callable[[Place], object],
        parent: QWidget,
    ) -> None:
        super().__init__("Check the place", parent)
        self._check, self._take_over = check, take_over
        self._picture = _LivePicture(self)
        self._head = sentence("", "title")
        self._rows = {
            name: (QLabel(self), title(text), sentence("")) for name, text in _NAMES.items()
        }
        for mark, name, words in self._rows.values():
            words.setMinimumHeight(_LINES * words.fontMetrics().lineSpacing())
            for label in (mark, name, words):
                label.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        findings = grid_of(*self._rows.values(), gaps_px=(10, 12), wide=(2,))
        self._place = sentence("")
        tip = "Keep it as the planned placement of what is recorded"
        self._take = outlined("Take over", tip, self._taken, self)
        buttons = closing(self)
        action = QDialogButtonBox.ButtonRole.ResetRole
        self._stop = buttons.addButton("Stop", action)
        self._stop.clicked.connect(check.stop)
        self._again = buttons.addButton("Again", action)
        self._again.clicked.connect(again)
        column = column_of(self._head, findings, STRETCH, spacing_px=16, margins_px=0)
        below = row_of((self._place, 1), self._take, spacing_px=12)
        parts = row_of((self._picture, 1), (column, 1), spacing_px=20)
        foot = with_help("Check the place", buttons)
        self.setLayout(column_of((parts, 1), below, foot, spacing_px=16, margins_px=16))
        check.changed.connect(self._refresh)
        check.pictured.connect(self._picture.show_image)
        self._refresh()
        self.resize(1000, self.sizeHint().height() + _LINES * self.fontMetrics().lineSpacing())

    def done(self, result: int) -> None:
        """Let go of radar and camera with it."""
        self._check.close()
        super().done(result)

    def _taken(self) -> None:
        if self._check.place is not None:
            self._take_over(self._check.place)
            self.accept()

    def _refresh(self) -> None:
        check = self._check
        self._stop.setVisible(check.busy)
        self._stop.setEnabled(check.state != "stopping")
        self._again.setVisible(not check.busy)
        findings = {one.name: one for one in check.findings}
        say(self._head, self._words(), "warning" if check.state == "failed" else "title")
        for name, (mark, _, words) in self._rows.items():
            one = findings.get(name)
            text, role = (
                ("…", "muted") if one is None else ("✓", "") if one.passed else ("✗", "warning")
            )
            say(mark, text, role)
            mark.setAccessibleName("not known" if one is None else "good" if one.passed else "bad")
            say(words, "" if one is None else one.sentence, "muted" if one is None else role)
        place = check.place
        self._take.setEnabled(place is not None)
        say(self._place, _place_words(place))

    def _words(self) -> str:
        check = self._check
        if check.state == "failed":
            return check.text
        if check.busy:
            return f"{_WAITS} {check.left_s} s left." if check.findings else "Opening both…"
        bad = sum(not one.passed for one in check.findings)
        return f"{bad} of {len(check.findings)} are bad." if bad else "All is good."


class _LivePicture(QLabel):
    """The newest picture of the camera, as large as there is room."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._image = QImage()
        self.setObjectName("panel")
        self.setAccessibleName("What the camera sees")
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setMinimumSize(_PICTURE)

    def show_image(self, image: QImage) -> None:
        """Show a picture."""
        self._image = image
        self._scale()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the picture."""
        super().resizeEvent(event)
        self._scale()

    def _scale(self) -> None:
        if not self._image.isNull():
            ways = Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
            self.setPixmap(QPixmap.fromImage(self._image.scaled(self.size(), *ways)))


def _place_words(place: Place | None) -> str:
    if place is None:
        return "Where the radar is follows once range and view are good."
    return f"As seen from whoever moves, a radar beside the camera is at {place.words}."
