"""The clock in the window: playing, stepping, and the time axis under the tracks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QAction, QColor, QPainter, QPen
from PySide6.QtWidgets import QLabel, QToolButton, QWidget

from sd2app.feature import Action, Feature
from sd2app.labels.loop import SpanLoop
from sd2app.maps.track_mouse import SeekingPlot
from sd2app.session.playback import PlaybackModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import faint
from sd2app.widgets.layouts import Part, row_of
from sd2app.widgets.panel import ElidedLabel
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, clock_text, tick_step, ticks

_BUTTONS = ("first_frame", "previous_frame", "play", "next_frame", "last_frame", "loop")


class TransportBar(QWidget):
    """One row of controls over the clock."""

    def __init__(
        self,
        playback: PlaybackModel,
        looped: SpanLoop,
        action: Callable[[str], QAction],
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self._playback, self._looped = playback, looped
        self._stretch = self._button()
        self._stretch.setObjectName("outlined")
        self._stretch.setToolTip("Play on beyond the span (Esc)")
        self._stretch.clicked.connect(looped.end)
        self._time = self._label("00:00.000 ")
        self._frame = ElidedLabel(self, "muted", "frame 162000 / 162000")
        self._speed = self._label("0.25× ")
        self._speed.setAlignment(Qt.AlignmentFlag.AlignCenter)
        steps = [self._button(action(name)) for name in _BUTTONS]
        speed = (self._button(action("slower")), self._speed, self._button(action("faster")))
        parts: tuple[Part, ...] = (
            *steps, self._stretch, 8, self._time, self._frame, *speed,
        )  # fmt: skip
        self.setLayout(row_of(*parts, spacing_px=4, margins_px=(0, 2, 0, 2)))
        playback.frame_changed.connect(self._refresh)
        playback.speed_changed.connect(self._refresh)
        looped.changed.connect(self._show_stretch)
        self._show_stretch()
        self._refresh()

    def _button(self, action: QAction | None = None) -> QToolButton:
        button = QToolButton(self)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        if action is not None:
            button.setDefaultAction(action)
        return button

    def _label(self, longest: str) -> QLabel:
        """A label that has room for a text, so that nothing beside it moves."""
        label = QLabel(self)
        label.setMinimumWidth(label.fontMetrics().horizontalAdvance(longest) + 4)
        return label

    def _refresh(self) -> None:
        playback = self._playback
        number = playback.timebase.first_number
        last = number + len(playback.timebase) - 1
        self._time.setText(clock_text(playback.time_s))
        self._frame.setText(f"frame {number + playback.frame} / {last}")
        self._speed.setText(f"{playback.speed:g}×")

    def _show_stretch(self) -> None:
        span = self._looped.span
        self._stretch.setVisible(span is not None)
        if span is not None:
            stretch = f"{clock_text(span.start_s)} – {clock_text(span.end_s)}"
            label = self.fontMetrics().elidedText(span.label, Qt.TextElideMode.ElideRight, 120)
            self._stretch.setText(f"Looping {label}  {stretch}  ✕")
            self._stretch.setAccessibleName(f"End the loop of {span.label}, {stretch}")


class TimeRuler(SeekingPlot):
    """Seconds under the tracks; click or drag seeks."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.setFixedHeight(20)
        self.follow(self._span.changed, self._playback.stretch_changed)

    def paint(self, painter: QPainter) -> None:
        """Ticks with times, and the cursor."""
        colours, scale = self._display.palette, self.scale
        painter.fillRect(self.rect(), QColor(colours.panel))
        self._paint_stretch(painter, scale)
        most = max(int(scale.plot_width_px / 80), 1)
        step = tick_step(self._span.duration_s, most)
        decimals = 0 if step >= 1 else (1 if step >= 0.1 else 2)
        painter.setPen(QColor(colours.muted))
        for time_s in ticks(self._span.start_s, self._span.end_s, most):
            x = scale.x_of(time_s)
            painter.drawLine(QPointF(x, 0), QPointF(x, 4))
            box = QRectF(x - 40, 4, 80, self.height() - 4)
            if box.right() - 20 < self.width():
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, clock_text(time_s, decimals))
        x = scale.x_of(self._playback.time_s)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colours.accent))
        painter.drawPolygon([QPointF(x - 5, 0), QPointF(x + 5, 0), QPointF(x, 7)])

    def _paint_stretch(self, painter: QPainter, scale: TimeScale) -> None:
        """Paint a bracket around the repeated time range."""
        if self._playback.stretch_s is None:
            return
        left, right = (
            min(max(scale.x_of(time_s), GUTTER_PX - 2.0), self.width() - MARGIN_PX + 2.0)
            for time_s in self._playback.stretch_s
        )
        accent = self._display.palette.accent
        painter.fillRect(QRectF(left, 0, right - left, self.height()), faint(accent, 60))
        painter.setPen(QPen(QColor(accent), 2))
        bottom = self.height() - 1
        for x, inner in ((left + 1, left + 5), (right - 1, right - 5)):
            corners = ((inner, 1), (x, 1), (x, bottom), (inner, bottom))
            painter.drawPolyline([QPointF(*corner) for corner in corners])


class PlaybackFeature(Feature):
    """Actions of the clock and of the time window."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.changing = (session.playback.playing_changed, session.playback.loop_changed)

    def actions(self) -> Sequence[Action]:
        """Play, step, speed, zoom."""
        s = self._session
        playback, span, enabled = s.playback, s.span, s.has_content
        return (
            Action(
                "play", "Play", "Play", ("Space",), "Play or pause", playback.toggle, enabled,
                lambda: playback.playing, icon="play",
            ),
            Action(
                "previous_frame", "Play", "Previous frame", ("Left",), "One frame back",
                lambda: playback.step_frames(-1), enabled, icon="previous",
            ),
            Action(
                "next_frame", "Play", "Next frame", ("Right",), "One frame on",
                lambda: playback.step_frames(1), enabled, icon="next",
            ),
            Action(
                "back_second", "Play", "Back one second", ("Shift+Left",), "One second back",
                lambda: playback.step_seconds(-1.0), enabled,
            ),
            Action(
                "on_second", "Play", "On one second", ("Shift+Right",), "One second on",
                lambda: playback.step_seconds(1.0), enabled,
            ),
            Action(
                "first_frame", "Play", "First frame", ("Home", "Ctrl+Left"), "Go to the start",
                lambda: playback.seek_frame(0), enabled, icon="first",
            ),
            Action(
                "last_frame", "Play", "Last frame", ("End", "Ctrl+Right"), "Go to the end",
                lambda: playback.seek_frame(len(playback.timebase) - 1), enabled, icon="last",
            ),
            Action(
                "slower", "Play", "Slower", (",",), "Play slower",
                lambda: playback.change_speed(-1), icon="slower",
            ),
            Action(
                "faster", "Play", "Faster", (".",), "Play faster",
                lambda: playback.change_speed(1), icon="faster",
            ),
            Action(
                "loop", "Play", "Loop", ("L",), "Start again at the end",
                lambda: playback.set_loop(not playback.loop),
                checked=lambda: playback.loop, icon="loop",
            ),
            Action(
                "zoom_in", "View", "Zoom in on time", ("+", "="),
                "Show less time, around the cursor",
                lambda: span.zoom(0.7, playback.time_s), enabled,
            ),
            Action(
                "zoom_out", "View", "Zoom out", ("-",), "Show more time",
                lambda: span.zoom(1.0 / 0.7, playback.time_s), enabled,
            ),
            Action(
                "zoom_fit", "View", "Whole recording", ("0",), "Show all of it", span.fit, enabled
            ),
        )  # fmt: skip
