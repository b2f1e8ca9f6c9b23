"""A guided session: its process, and the window that a person reads from three metres."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

from PySide6.QtCore import QObject, QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QCloseEvent,
    QColor,
    QFont,
    QFontMetricsF,
    QGuiApplication,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
)
from PySide6.QtWidgets import QFrame, QLabel, QScrollArea, QScrollBar, QWidget

from sd2app.live.process import COMMAND, ListenRequest, SteeredCommand
from sd2app.widgets.mesh_painting import draw_mesh
from sd2app.widgets.panel import outlined
from sd2core.body.camera import PinholeCamera
from sd2core.files.resources import resource_path
from sd2core.files.tables import counted
from sd2core.live.session import Phase
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import open_recording


@dataclass(frozen=True)
class Step:
    """Step of a session that is to be done now."""

    phase: Phase
    number: int  # of the take, from 1
    takes: int
    left_s: int | None = None
    person: str = ""
    gesture: str = ""
    instruction: str = ""


class GuidedModel(SteeredCommand):
    """``sd2 record --protocol`` beside the window."""

    first_event = "session"

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent, command)
        self.step: Step | None = None
        self.consent = ""
        self.missing: tuple[str, ...] = ()  # names of takes, once it has ended
        self.not_agreed: tuple[str, ...] = ()  # people of whom takes are missing, likewise

    def start(self, request: ListenRequest) -> None:
        """Begin a session, or go on with one."""
        if self.busy:
            return
        self.request, self.step = request, None
        self.missing = self.not_agreed = ()
        self._launch(request.words())

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "session":
                self.consent = event["consent"]
            case "step":
                self.step = Step(**{name: event[name] for name in _STEP if name in event})
            case "stored":
                for doubt in event["doubts"]:
                    self.warned.emit(f"{event['take']}: {doubt}")
            case "missing":
                self.missing = tuple(event["takes"])
                self.not_agreed = tuple(event["not_agreed"])

    def _end(self, code: int, error_text: str) -> None:
        super()._end(code, error_text)
        if code:
            self.warned.emit(self.text)


_STEP = tuple(one.name for one in fields(Step))


KEYS_OF_CONSENT = "Y: I agree    N: I do not agree    ↑ ↓: read on    Esc: stop    F11: full screen"
KEYS = "Space: go on    A: again    S: skip    Esc: stop    F11: full screen"
KEYS_AT_END = "Esc: close    F11: full screen"


def keys_text(model: GuidedModel) -> str:
    """Keys that do something now."""
    if not model.busy:
        return KEYS_AT_END
    return KEYS_OF_CONSENT if asks_consent(model) else KEYS


def asks_consent(model: GuidedModel) -> bool:
    """True while a person is to read what they agree to."""
    return model.state == "running" and model.step is not None and model.step.phase == "consent"


def headline(model: GuidedModel) -> str:
    """Headline: what to do, in few words."""
    step = model.step
    if model.state == "failed":
        return "The session has failed"
    if model.state == "stopped":
        return "Thank you" if not model.missing else "Stopped"
    if model.state == "stopping" or step is None:
        return "One moment…"
    if step.phase == "consent":
        return f"{step.person}, do you agree?"
    if step.phase == "ready":
        return f"{step.person}, please"
    if not step.instruction:
        return "That was the last take"
    return step.instruction


def count_text(model: GuidedModel) -> str:
    """Seconds that are left, where somebody waits for their end."""
    step = model.step
    counts = step is not None and step.phase in ("countdown", "prompt", "pause")
    return "" if not counts or not model.busy or step is None else str(step.left_s)


def detail(model: GuidedModel) -> str:
    """Line below the headline."""
    step = model.step
    if model.state == "failed":
        return model.text
    if model.state == "stopped":
        if not model.missing:
            return "Nothing is missing."
        lacking = f"{counted(len(model.missing), 'take')} missing: {', '.join(model.missing)}"
        without = f"Not agreed: {', '.join(model.not_agreed)}" if model.not_agreed else ""
        return "\n".join(filter(None, (lacking, without)))
    if step is None or not model.busy:
        return ""
    match step.phase:
        case "ready":
            return "Space begins."
        case "pause" if not step.instruction:
            return "A makes it once more."
        case "pause":
            return "Next. Rest until then."
        case "opening" | "countdown":
            return "Stand still"
        case "prompt":
            return "Now"
    return ""


def progress_text(model: GuidedModel) -> str:
    """Place of the take among all."""
    step = model.step
    return "" if step is None else f"Take {step.number} of {step.takes}"


_AROUND_S = 0.2
"""Of the body before and after a gesture."""
_CAMERA = PinholeCamera()
"""What the sample was drawn through."""


@cache
def _sample() -> tuple[MeshSequence, dict[str, tuple[float, float]]]:
    """Body of the sample, and begin and end of the first of each gesture."""
    recording = open_recording(resource_path("swipes.sd2"))
    spans = {one.label: (one.start_s, one.end_s) for one in reversed(recording.labelled.spans)}
    return recording.load_mesh(), spans


def has_picture(gesture: str) -> bool:
    """True if a body can be shown that makes a gesture."""
    return bool(gesture) and gesture in _sample()[1]


def _draw_gesture(
    painter: QPainter, room: QRectF, gesture: str, time_s: float, colour: QColor
) -> None:
    """Draw a body, as high as the room, that makes a gesture again and again, as in a mirror."""
    mesh, spans = _sample()
    start_s, end_s = spans[gesture]
    shown_s = start_s - _AROUND_S + time_s % (end_s - start_s + 2 * _AROUND_S)
    box = QRectF(0.0, 0.0, room.height() * _CAMERA.width / _CAMERA.height, room.height())
    box.moveCenter(-room.center())
    box.moveTop(room.top())
    painter.save()
    painter.setClipRect(room)
    painter.scale(-1.0, 1.0)  # who sees it does the same on the same side
    draw_mesh(painter, box, mesh, shown_s, _CAMERA, colour, 1.0)
    painter.restore()


_FRAME_MS = 50
_HEAD, _COUNT, _DETAIL, _SMALL, _READ = 0.1, 0.26, 0.075, 0.028, 0.036
"""Heights of letters, as shares of the window's height."""
_MARGIN = 0.05
_MIN_PX, _MIN_READ_PX = 11.0, 15.0
_CONSENT_TOP, _CONSENT_BOTTOM = 0.28, 0.15
"""Shares of the window's height above and below the text to agree to."""
_KEYS: dict[int, str] = {
    Qt.Key.Key_Space: " ",
    Qt.Key.Key_Return: " ",
    Qt.Key.Key_Enter: " ",
    Qt.Key.Key_A: "a",
    Qt.Key.Key_S: "s",
    Qt.Key.Key_Y: "y",
    Qt.Key.Key_N: "n",
}
"""Those of ``sd2 record``."""
_SCROLLS: dict[int, QScrollBar.SliderAction] = {
    Qt.Key.Key_Up: QScrollBar.SliderAction.SliderSingleStepSub,
    Qt.Key.Key_Down: QScrollBar.SliderAction.SliderSingleStepAdd,
    Qt.Key.Key_PageUp: QScrollBar.SliderAction.SliderPageStepSub,
    Qt.Key.Key_PageDown: QScrollBar.SliderAction.SliderPageStepAdd,
}
_CENTRED = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignVCenter
_WRAPPED = _CENTRED | Qt.TextFlag.TextWordWrap


class PromptWindow(QWidget):
    """A view of :class:`GuidedModel`; its keys are those of a foot switch, too."""

    def __init__(self, model: GuidedModel, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self._model = model
        self.setWindowTitle("Session")
        self.setAccessibleName("What to do")
        self.resize(960, 600)
        self._full = outlined("Full screen", "Full screen, or back (F11)", self._turn_full, self)
        self._full.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # Space is for the session
        self._consent_text = QLabel()
        self._consent = _consent_area(self._consent_text, self)
        self._clock = QTimer(self)
        self._clock.setInterval(_FRAME_MS)
        self._clock.timeout.connect(self.update)
        model.changed.connect(self._refresh)
        self._refresh()

    def open_beside(self) -> None:
        """Show it, on another screen than the window where there is one."""
        window = self.parentWidget()
        own = None if window is None else window.screen()
        others = [one for one in QGuiApplication.screens() if one is not own]
        if others and own is not None:
            self.setGeometry(others[0].availableGeometry())
        self.show()
        self.activateWindow()

    def _refresh(self) -> None:
        words = [progress_text(self._model), headline(self._model), detail(self._model)]
        if bool(gesture := self._picture()) != self._clock.isActive():
            self._clock.start() if gesture else self._clock.stop()
        self._full.setVisible(not self._prompts)
        if shown := asks_consent(self._model):
            words.append(self._model.consent)
            self._consent_text.setText(self._model.consent)
        self._consent.setVisible(shown)
        self.setAccessibleDescription(". ".join(filter(None, (*words, count_text(self._model)))))
        self.update()

    @property
    def _prompts(self) -> bool:
        """True while the person is to move."""
        step = self._model.step
        return self._model.state == "running" and step is not None and step.phase == "prompt"

    def _picture(self) -> str:
        """Gesture that is shown by a body, empty for none."""
        step = self._model.step
        if step is None or self._model.state != "running" or step.phase in ("consent", "ready"):
            return ""
        return step.gesture if has_picture(step.gesture) else ""

    def _turn_full(self) -> None:
        self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen)

    # --- keys -----------------------------------------------------------------------------

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Steer the session."""
        match event.key():
            case key if key in _KEYS:
                self._model.press(_KEYS[key])
            case key if key in _SCROLLS:
                self._consent.verticalScrollBar().triggerAction(_SCROLLS[key])
            case Qt.Key.Key_Escape if self._model.busy:
                self._model.stop()
            case Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_F11:
                self._turn_full()
            case _:
                super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the session with it."""
        self._model.stop()
        self._clock.stop()
        super().closeEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the button in its corner, and the text to agree to between head and keys."""
        super().resizeEvent(event)
        height, width = self.height(), self.width()
        font = QFont(self.font())
        font.setPixelSize(round(max(_READ * height, _MIN_READ_PX)))
        self._consent_text.setFont(font)
        top, bottom, side = (
            round(share * height) for share in (_CONSENT_TOP, _CONSENT_BOTTOM, 2 * _MARGIN)
        )
        self._consent.setGeometry(side, top, width - 2 * side, height - top - bottom)
        margin, size = round(_MARGIN * self.height()), self._full.sizeHint()
        corner = QRect(self.rect().bottomRight(), QSize(0, 0))
        self._full.setGeometry(
            corner.adjusted(-margin - size.width(), -margin - size.height(), -margin, -margin)
        )

    # --- painting -------------------------------------------------------------------------

    def paintEvent(self, _: QPaintEvent) -> None:
        """Paint everything as large as the window allows."""
        model, colours = self._model, self.palette()
        # The whole window turns: that is seen without reading.
        step, role = model.step, QPalette.ColorRole
        figure = role.HighlightedText if self._prompts else role.Highlight
        pair = (role.Highlight, figure) if self._prompts else (role.Window, role.WindowText)
        ground, ink = map(colours.color, pair)
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), ground)
            painter.setPen(ink)
            margin = _MARGIN * self.height()
            room = QRectF(self.rect()).adjusted(margin, margin, -margin, -margin)
            small = _SMALL * self.height()
            who = "" if step is None else step.person
            left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
            self._write(painter, room, progress_text(model), 1.6 * small, left)
            self._write(painter, room, who, 1.6 * small, right)
            low = Qt.AlignmentFlag.AlignBottom | left
            self._write(painter, room, keys_text(model), small, low)
            middle = room.adjusted(0.0, 2.5 * small, 0.0, -2.5 * small)
            if gesture := self._picture():
                body = QRectF(middle)
                body.setWidth(0.36 * room.width())
                _draw_gesture(painter, body, gesture, time.monotonic(), colours.color(figure))
                middle.setLeft(body.right() + margin)
            if asks_consent(model):
                middle.setBottom((_CONSENT_TOP - 0.03) * self.height())
            self._paint_words(painter, middle)

    def _paint_words(self, painter: QPainter, room: QRectF) -> None:
        """Headline, count and detail, below each other."""
        count, height = count_text(self._model), self.height()
        text = detail(self._model)
        shares = (0.44, 0.36, 0.2) if count else (0.4, 0.0, 0.6) if text else (1.0, 0.0, 0.0)
        top = room.top()
        for words, share, size in zip(
            (headline(self._model), count, text), shares, (_HEAD, _COUNT, _DETAIL), strict=True
        ):
            part = QRectF(room.left(), top, room.width(), share * room.height())
            self._write(painter, part, words, size * height, _WRAPPED, bold=size != _DETAIL)
            top = part.bottom()

    def _write(
        self,
        painter: QPainter,
        room: QRectF,
        text: str,
        letters_px: float,
        how: Qt.AlignmentFlag | Qt.TextFlag,
        *,
        bold: bool = False,
    ) -> None:
        """Write a text, smaller where it would not fit."""
        font = QFont(self.font())
        font.setBold(bold)
        size_px = max(letters_px, _MIN_PX)
        while True:
            font.setPixelSize(round(size_px))
            needed = QFontMetricsF(font).boundingRect(room, int(how), text)
            fits = needed.height() <= room.height() and needed.width() <= room.width() + 1.0
            if fits or size_px <= _MIN_PX:
                break
            size_px = max(0.9 * size_px, _MIN_PX)
        painter.setFont(font)
        painter.drawText(room, int(how), text)


def _consent_area(text: QLabel, parent: QWidget) -> QScrollArea:
    """Area with the text that a person agrees to; the keys stay those of the window."""
    area = QScrollArea(parent)
    text.setWordWrap(True)
    text.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
    text.setTextFormat(Qt.TextFormat.PlainText)
    area.setWidget(text)
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return area
