"""Playback of one span in a loop."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2core.labels.spans import Span


class SpanLoop(QObject):
    """Plays a span in a loop, also while its edges are moved, until the user seeks elsewhere."""

    changed = Signal()

    def __init__(self, labels: LabelsModel, playback: PlaybackModel, parent: QObject) -> None:
        super().__init__(parent)
        self._labels, self._playback = labels, playback
        self.span: Span | None = None  # played in a loop
        labels.changed.connect(self._follow_span)
        playback.stretch_changed.connect(self._follow_clock)

    def play(self, span: Span) -> None:
        """Play a span from its start in a loop."""
        self.span = span
        self._playback.play_stretch(span.start_s, span.end_s)
        self.changed.emit()

    def end(self) -> None:
        """Leave the loop and play on."""
        self._playback.set_stretch(None)

    def _follow_span(self) -> None:
        if self.span is None:
            return
        now = next((one for one in self._labels.labels.spans if one.id == self.span.id), None)
        if now is None:
            self.end()
        elif now != self.span:
            self.span = now
            self._playback.set_stretch((now.start_s, now.end_s))
            self.changed.emit()

    def _follow_clock(self) -> None:
        if self._playback.stretch_s is None and self.span is not None:
            self.span = None
            self.changed.emit()
