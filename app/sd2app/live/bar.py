"""Line about the radar that is listened to: level, frames, what is missing, how late it is."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QLabel

from sd2app.live.model import LiveModel
from sd2app.live.text import frames_text, latency_text, level_text, title_text
from sd2app.widgets.panel import ElidedLabel, StateBar, say


class LiveBar(StateBar):
    """Hidden until something is listened to; ``go_on`` and ``show_again`` ask before they act."""

    def __init__(
        self, live: LiveModel, go_on: Callable[[], None], show_again: Callable[[], None]
    ) -> None:
        super().__init__("Radar that is listened to")
        self._live = live
        self._title = ElidedLabel(self, "title")
        self._frames = QLabel(self)
        self._numbers = ElidedLabel(self, "muted")
        gap = "Listen again, into the same recording: the pause is a gap"
        buttons = {
            "show": ("Show", "Show this recording again", show_again),
            "stop": ("Stop", "Stop, and keep all that was received", live.stop),
            "go_on": ("Continue", gap, go_on),
            "close": ("✕", "Close this message", live.dismiss),
        }
        self.lay_out((self._title, self._frames, (self._numbers, 1)), buttons, spacing_px=12)
        live.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        live = self._live
        self.setVisible(live.state != "idle")
        if live.state == "idle":
            return
        self._title.setText(title_text(live))
        if live.state == "failed":
            say(self._frames, live.text, "warning")
        else:
            whole = live.counts.whole and not live.pictures_dropped
            text = frames_text(live.counts, live.pictures, live.pictures_dropped)
            say(self._frames, text, "" if whole else "warning")
        parts = (level_text(live.level_db), latency_text(live.latency_s))
        listening = live.state == "listening"
        self._numbers.setText(" · ".join(filter(None, parts)) if listening else "")
        shown = {
            "stop": live.busy,
            "go_on": live.can_go_on,
            "show": live.can_be_shown,
            "close": not live.busy,
        }
        self.show_buttons([name for name, visible in shown.items() if visible])
        self._buttons["stop"].setEnabled(live.state != "stopping")
