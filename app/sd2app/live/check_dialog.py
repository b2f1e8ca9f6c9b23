"""Dialog that shows what camera and radar see of somebody who walks, and what follows from it."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QDialogButtonBox, QLabel, QWidget

from sd2app.live.process import PlaceCheck
from sd2app.live.setup import ListenRequest
from sd2app.manual.help import with_help
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.layouts import STRETCH, column_of, grid_of, row_of
from sd2app.widgets.mesh_painting import paint_picture
from sd2app.widgets.panel import outlined, say, sentence, title
from sd2core.placements.placements import Place

_NAMES = {"motion": "Motion", "range": "Range", "view": "View", "agreement": "Agreement"}
_PICTURE = QSize(416, 234)
_LINES = 3
"""Of a sentence, so that nothing moves when it gets another."""
_WAITS = "Walk towards both and away again, a few times."


class CheckDialog(Dialog):
    """A view of :class:`PlaceCheck`; accepted where the place is to be kept."""

    def __init__(self, check: PlaceCheck, request: ListenRequest, parent: QWidget) -> None:
        super().__init__("Check the place", parent)
        self._check = check
        picture = _LivePicture(check, self)
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
        self._take = outlined("Take over", tip, self.accept, self)
        buttons = closing(self)
        action = QDialogButtonBox.ButtonRole.ResetRole
        self._stop = buttons.addButton("Stop", action)
        self._stop.clicked.connect(check.stop)
        self._again = buttons.addButton("Again", action)
        self._again.clicked.connect(partial(check.start, request))
        column = column_of(self._head, findings, STRETCH, spacing_px=16, margins_px=0)
        below = row_of((self._place, 1), self._take, spacing_px=12)
        parts = row_of((picture, 1), (column, 1), spacing_px=20)
        foot = with_help("Check the place", buttons)
        self.setLayout(column_of((parts, 1), below, foot, spacing_px=16, margins_px=16))
        check.changed.connect(self._refresh)
        self._refresh()
        self.resize(1000, self.sizeHint().height() + _LINES * self.fontMetrics().lineSpacing())

    def done(self, result: int) -> None:
        """Let go of radar and camera with it."""
        self._check.close()
        super().done(result)

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


class _LivePicture(Canvas):
    """The newest picture of the camera, as large as there is room."""

    def __init__(self, check: PlaceCheck, parent: QWidget) -> None:
        super().__init__(parent)
        self._check = check
        self.setObjectName("panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setAccessibleName("What the camera sees")
        self.setMinimumSize(_PICTURE)
        self.follow(check.changed)

    def paint(self, painter: QPainter) -> None:
        """Paint the picture."""
        if self._check.picture is not None:
            paint_picture(painter, self.rect(), self._check.picture)


def _place_words(place: Place | None) -> str:
    if place is None:
        return "Where the radar is follows once range and view are good."
    return f"As seen from whoever moves, a radar beside the camera is at {place.words}."
