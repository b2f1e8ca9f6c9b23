"""A stretch that is played again and again, and the span it follows; no window."""

from __future__ import annotations

from dataclasses import replace

import pytest
from PySide6.QtCore import QTimer

from sd2app.labels.edits import LONGEST_MS, REACTION, reaction_ms
from sd2app.labels.loop import SpanLoop
from sd2app.labels.model import LabelsModel
from sd2app.session import playback as playback_module
from sd2app.session.playback import PlaybackModel
from sd2app.settings import Settings
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase


class Turned:
    """A timer that says what it is told."""

    elapsed_s = 0.0

    def start(self) -> None:
        Turned.elapsed_s = 0.0

    def nsecsElapsed(self) -> int:
        return round(1e9 * Turned.elapsed_s)


@pytest.fixture
def playback(qtbot, monkeypatch):
    monkeypatch.setattr(playback_module, "QElapsedTimer", Turned)
    model = PlaybackModel()
    model.set_timebase(Timebase.regular(90, 30.0))
    yield model
    model.pause()


def pass_by(playback: PlaybackModel, qtbot, seconds: float) -> None:
    """Let time go by, and the clock see it."""
    seen = []
    playback.findChild(QTimer).timeout.connect(lambda: seen.append(1))
    Turned.elapsed_s += seconds
    qtbot.waitUntil(lambda: len(seen) >= 1, timeout=5000)


def test_it_starts_again_where_the_stretch_does(playback, qtbot) -> None:
    playback.play_stretch(1.0, 1.5)
    assert (playback.frame, playback.playing) == (30, True)
    pass_by(playback, qtbot, 0.4)
    assert playback.frame == 42
    pass_by(playback, qtbot, 0.2)
    assert playback.time_s == pytest.approx(1.1)
    pass_by(playback, qtbot, 1.25)
    assert playback.time_s == pytest.approx(1.35)
    playback.set_stretch(None)
    pass_by(playback, qtbot, 0.4)
    assert playback.time_s == pytest.approx(1.75)


@pytest.mark.parametrize(
    ("frame", "goes_on"), [(29, False), (30, True), (44, True), (45, False), (0, False)]
)
def test_seeking_within_goes_on_and_beyond_ends_it(playback, frame, goes_on) -> None:
    playback.play_stretch(1.0, 1.5)
    playback.seek_frame(frame)
    assert (playback.stretch_s is not None) == goes_on
    assert playback.frame == frame


def test_a_stretch_between_frames_begins_with_the_frame_on_screen(playback) -> None:
    playback.play_stretch(1.01, 1.02)
    assert playback.frame == 30
    assert playback.stretch_s == (1.01, 1.02)


def test_another_recording_ends_it(playback) -> None:
    playback.play_stretch(1.0, 1.5)
    playback.set_timebase(Timebase.regular(30, 30.0))
    assert playback.stretch_s is None


def test_the_loop_follows_its_span(playback) -> None:
    labels = LabelsModel()
    span = Span(1, "Gestures", 1.0, 1.5, "wave")
    labels.open(Labels(spans=(span,)))
    loop = SpanLoop(labels, playback, playback)
    loop.play(span)
    longer = replace(span, end_s=1.8)
    labels.set_labels(Labels(spans=(longer,)))
    assert (loop.span, playback.stretch_s) == (longer, (1.0, 1.8))
    labels.set_labels(Labels())
    assert (loop.span, playback.stretch_s) == (None, None)
    loop.play(span)
    playback.seek(2.5)
    assert loop.span is None


def test_the_reaction_time_is_remembered_and_stays_within_a_second() -> None:
    settings = Settings.forgetful()
    assert reaction_ms(settings) == 0
    for stored, kept in ((250, 250), (5000, LONGEST_MS), (-1, 0), ("nonsense", 0)):
        settings.set_value(REACTION, stored)
        assert reaction_ms(settings) == kept
