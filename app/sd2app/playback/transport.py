"""Play, step, scrub; time, frame and speed in words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import QSignalBlocker, Qt, SignalInstance
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSlider, QToolButton, QWidget

from sd2app.session.playback import PlaybackModel
from sd2app.widgets.time_axis import clock_text
from sd2core.labels.spans import Span

_BUTTONS = ("first_frame", "previous_frame", "play", "next_frame", "last_frame", "loop")


class Looped(Protocol):
    """Span that is played in a loop."""

    @property
    def changed(self) -> SignalInstance:
        """Emitted when a loop begins or ends."""

    @property
    def span(self) -> Span | None:
        """The span, or None."""

    def end(self) -> None:
        """Leave the loop and play on."""


class TransportBar(QWidget):
    """One row of controls over the clock."""

    def __init__(
        self,
        playback: PlaybackModel,
        looped: Looped,
        action: Callable[[str], QAction],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._playback, self._looped = playback, looped
        layout = QHBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 4)
        layout.setSpacing(4)
        for name in _BUTTONS:
            button = QToolButton(self)
            button.setDefaultAction(action(name))
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            layout.addWidget(button)
        self._stretch = QToolButton(self)
        self._stretch.setObjectName("outlined")
        self._stretch.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._stretch.setToolTip("Play on beyond the span (Esc)")
        self._stretch.clicked.connect(looped.end)
        layout.addWidget(self._stretch)
        self._time = QLabel(self)
        self._time.setMinimumWidth(self._time.fontMetrics().horizontalAdvance("00:00.000 ") + 8)
        self._frame = QLabel(self)
        self._frame.setObjectName("muted")
        self._frame.setMinimumWidth(
            self._frame.fontMetrics().horizontalAdvance("frame 162000 / 162000")
        )
        self._slider = QSlider(Qt.Orientation.Horizontal, self)
        self._slider.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._slider.setAccessibleName("Frame")
        self._slider.valueChanged.connect(playback.seek_frame)
        slower, faster = QToolButton(self), QToolButton(self)
        slower.setDefaultAction(action("slower"))
        faster.setDefaultAction(action("faster"))
        self._speed = QLabel(self)
        self._speed.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._speed.setMinimumWidth(self._speed.fontMetrics().horizontalAdvance("0.25×") + 8)
        layout.addSpacing(8)
        layout.addWidget(self._time)
        layout.addWidget(self._frame)
        layout.addWidget(self._slider, 1)
        for widget in (slower, self._speed, faster):
            widget.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            layout.addWidget(widget)
        playback.frame_changed.connect(self._refresh)
        playback.speed_changed.connect(self._refresh)
        looped.changed.connect(self._show_stretch)
        self._show_stretch()
        self._refresh()

    def _refresh(self) -> None:
        playback = self._playback
        last = len(playback.timebase) - 1
        with QSignalBlocker(self._slider):
            self._slider.setRange(0, last)
            self._slider.setValue(playback.frame)
        self._time.setText(clock_text(playback.time_s))
        self._frame.setText(f"frame {playback.frame} / {last}")
        self._speed.setText(f"{playback.speed:g}×")

    def _show_stretch(self) -> None:
        span = self._looped.span
        self._stretch.setVisible(span is not None)
        if span is not None:
            stretch = f"{clock_text(span.start_s)} – {clock_text(span.end_s)}"
            label = self.fontMetrics().elidedText(span.label, Qt.TextElideMode.ElideRight, 120)
            self._stretch.setText(f"Looping {label}  {stretch}  ✕")
            self._stretch.setAccessibleName(f"End the loop of {span.label}, {stretch}")
