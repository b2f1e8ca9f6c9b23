"""What a hand does to labels in the window: keys, clicks and drags, and what came of it."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from window_models import models_of

from sd2app.labels.timeline import LabelTimeline
from sd2app.maps.heatmap import HeatmapView

NONE = Qt.KeyboardModifier.NoModifier
SHIFT, CONTROL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier
ALT = Qt.KeyboardModifier.AltModifier
LEFT = Qt.MouseButton.LeftButton


def spans(window: Any, track: str | None = None) -> list[tuple[str, int, int]]:
    """What is labelled, in frames; all of it, or on one track."""
    base = models_of(window).playback.timebase
    return [
        (span.label, *base.frames_between(span.start_s, span.end_s))
        for span in models_of(window).labels.labels.spans
        if track in (None, span.track)
    ]


def chosen(window: Any) -> list[str]:
    """The labels of what is selected."""
    return [span.label for span in models_of(window).labels.selected]


def key(window: Any, name: str, modifier: Qt.KeyboardModifier = NONE) -> None:
    """Press a key."""
    QTest.keyClick(window, getattr(Qt.Key, f"Key_{name}"), modifier)


def timeline(window: Any) -> LabelTimeline:
    """Where labels are drawn."""
    return window.findChild(LabelTimeline)


def at(window: Any, time_s: float, track: str = "", lane: int = 0) -> QPoint:
    """A place on the timeline."""
    view = timeline(window)
    row = view.rows.row_of(track) if track else view.rows.tracks[0]
    top_px, height_px = row.lane_px(lane)
    return QPoint(round(view.scale.x_of(time_s)), round(top_px + height_px / 2))


def click(
    window: Any, time_s: float, modifier: Qt.KeyboardModifier = NONE, track: str = ""
) -> None:
    """Click a place on the timeline."""
    QTest.mouseClick(timeline(window), LEFT, modifier, at(window, time_s, track))


def pull(
    view: Any,
    start: QPoint,
    end: QPoint,
    modifier: Qt.KeyboardModifier = NONE,
    release: bool = True,
) -> None:
    """Drag from one place to another."""
    QTest.mousePress(view, LEFT, modifier, start)
    for share in (0.3, 0.7, 1.0):
        QTest.mouseMove(view, start + (end - start) * share)
        QTest.qWait(5)
    if release:
        QTest.mouseRelease(view, LEFT, modifier, end)


def on_map(view: HeatmapView, time_s: float) -> QPoint:
    """A place on a map."""
    return QPoint(round(view.scale.x_of(time_s)), round(view.plot_rect().center().y()))
