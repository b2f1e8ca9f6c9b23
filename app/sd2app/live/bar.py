"""Line about the radar that is listened to: level, frames, what is missing, how late it is."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QFrame, QLabel, QToolButton

from sd2app.live.model import LiveModel
from sd2app.live.text import frames_text, latency_text, level_text, title_text
from sd2app.widgets.layouts import row_of
from sd2app.widgets.panel import ElidedLabel, outlined, say

_HEIGHT = 40


class LiveBar(QFrame):
    """Hidden until something is listened to; ``go_on`` and ``show_again`` ask before they act."""

    def __init__(
        self, live: LiveModel, go_on: Callable[[], None], show_again: Callable[[], None]
    ) -> None:
        super().__init__()
        self.setObjectName("panel")
        self.setAccessibleName("Radar that is listened to")
        self.setMinimumHeight(_HEIGHT)
        self._live = live
        self._title = ElidedLabel(self, "title")
        self._frames = QLabel(self)
        self._numbers = ElidedLabel(self, "muted")
        self._buttons = {
            "show": self._button("Show", "Show this recording again", show_again),
            "stop": self._button("Stop", "Stop, and keep all that was received", live.stop),
            "go_on": self._button(
                "Continue", "Listen again, into the same recording: the pause is a gap", go_on
            ),
            "close": self._button("✕", "Close this message", live.dismiss),
        }
        self._buttons["close"].setObjectName("")
        parts = (self._title, (self._frames, 0), (self._numbers, 1))
        self.setLayout(
            row_of(*parts, *self._buttons.values(), spacing_px=12, margins_px=(12, 4, 4, 4))
        )
        live.changed.connect(self._refresh)
        self._refresh()

    def _button(self, text: str, tip: str, run: Callable[[], object]) -> QToolButton:
        button = outlined(text, tip, run, self)
        button.setAccessibleName(tip)
        return button

    def _refresh(self) -> None:
        live = self._live
        self.setVisible(live.state != "idle")
        if live.state == "idle":
            return
        self._title.setText(title_text(live))
        if live.state == "failed":
            say(self._frames, live.text, "warning")
        else:
            say(self._frames, frames_text(live.counts), "" if live.counts.whole else "warning")
        parts = (level_text(live.level_db), latency_text(live.latency_s))
        listening = live.state == "listening"
        self._numbers.setText(" · ".join(filter(None, parts)) if listening else "")
        shown = {
            "stop": live.busy,
            "go_on": live.state in ("stopped", "failed"),
            "show": live.can_be_shown,
            "close": not live.busy,
        }
        for name, visible in shown.items():
            self._buttons[name].setVisible(visible)
        self._buttons["stop"].setEnabled(live.state != "stopping")
