"""Time window that the tracks show."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

_SHORTEST_S = 0.2
GROWING_S = 10.0
"""What is shown of a recording that grows, unless the user shows more or less."""


class TimeWindow(QObject):
    """Time axis that all tracks share: its whole extent and the part in view."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.extent_s = (0.0, 1.0)  # start and end of everything there is
        self.span_s = (0.0, 1.0)  # start and end of the part in view

    @property
    def start_s(self) -> float:
        """Left edge of the tracks."""
        return self.span_s[0]

    @property
    def end_s(self) -> float:
        """Right edge of the tracks."""
        return self.span_s[1]

    @property
    def duration_s(self) -> float:
        """Length of the time window, in seconds."""
        return self.span_s[1] - self.span_s[0]

    def set_extent(self, start_s: float, end_s: float) -> None:
        """Take over another recording and show all of it."""
        self.extent_s = (start_s, max(end_s, start_s + _SHORTEST_S))
        self.span_s = self.extent_s
        self.changed.emit()

    def extend(self, end_s: float, room_s: float = 0.0) -> None:
        """Take over another end of what there is; a window that reached to it goes along.

        All of a short recording stays in view; ``room_s`` is the least length of the extent.
        """
        first, last = self.extent_s
        shows_all, at_end = self.span_s == self.extent_s, self.end_s >= last
        self.extent_s = (first, max(end_s, first + max(_SHORTEST_S, room_s)))
        duration = self.duration_s
        if shows_all and duration < GROWING_S:
            duration = min(self.extent_s[1] - first, max(GROWING_S, duration))
        start = self.extent_s[1] - duration if at_end else self.start_s
        self.span_s = self._held(start, start + duration)
        self.changed.emit()

    def set_span(self, start_s: float, end_s: float) -> None:
        """Show a stretch, held inside the extent and not shorter than 0.2 s."""
        span = self._held(start_s, end_s)
        if span != self.span_s:
            self.span_s = span
            self.changed.emit()

    def _held(self, start_s: float, end_s: float) -> tuple[float, float]:
        first, last = self.extent_s
        duration = min(max(end_s - start_s, _SHORTEST_S), last - first)
        start = min(max(start_s, first), last - duration)
        return start, start + duration

    def zoom(self, factor: float, anchor_s: float) -> None:
        """Scale the window by ``factor`` (< 1 shows less), keeping ``anchor_s`` in place."""
        duration = min(
            max(self.duration_s * factor, _SHORTEST_S), self.extent_s[1] - self.extent_s[0]
        )
        share = (anchor_s - self.start_s) / self.duration_s
        start = anchor_s - share * duration
        self.set_span(start, start + duration)

    def pan(self, seconds: float) -> None:
        """Move the window without changing its length."""
        self.set_span(self.start_s + seconds, self.end_s + seconds)

    def fit(self) -> None:
        """Show everything."""
        self.set_span(*self.extent_s)

    def reveal(self, time_s: float) -> None:
        """Scroll by a page when ``time_s`` has left the window."""
        if time_s < self.start_s or time_s >= self.end_s:
            self.set_span(time_s, time_s + self.duration_s)

    def reveal_any(self, start_s: float, end_s: float) -> None:
        """Scroll by a page when nothing between two times is in the window."""
        if end_s <= self.start_s or start_s >= self.end_s:
            self.reveal(start_s)
