"""What a key marks is the frame on screen, exactly.

The sample's eight gestures, marked by keys in one play-through, come back from every format as
they were marked. The clock is turned by hand, so that the scripted hand presses when it
says; `slow` does the same at 1× by the clock on the wall.
"""

from __future__ import annotations

import random
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from label_hands import key, spans
from numbered_videos import number_in, write_video
from PySide6.QtCore import Qt, QTimer
from window_models import models_of

from sd2app.session import playback as playback_module
from sd2core.files.resources import resource_path
from sd2core.labels.formats import FORMATS, read_labels, write_labels
from sd2core.labels.spans import Labels
from sd2core.recording.recording import open_recording

SAMPLE = resource_path("swipes.sd2")
TWO_FRAMES_S = 2 / 30
FRAMES = 40
UNEVEN_MS = np.cumsum([0, *random.Random(3).choices([11, 33, 34, 70, 240], k=FRAMES - 1)])
RATES = pytest.mark.parametrize("rate", ["constant", "variable"])


class HandClock:
    """Stands in for the timer of the clock; the time is what the test says."""

    now_ns = 0

    def __init__(self) -> None:
        self._started_ns = HandClock.now_ns

    def start(self) -> None:
        self._started_ns = HandClock.now_ns

    def nsecsElapsed(self) -> int:
        return HandClock.now_ns - self._started_ns


@pytest.fixture
def by_hand(monkeypatch):
    """A clock that stands until the test turns it."""
    monkeypatch.setattr(HandClock, "now_ns", 0)
    monkeypatch.setattr(playback_module, "QElapsedTimer", HandClock)


def open_video(window, qtbot, folder: Path, rate: str) -> np.ndarray:
    """Open a video of numbered frames; returns the times at which they are to be shown."""
    if rate == "constant":
        path, times_s = write_video(folder / "v.mp4", FRAMES), np.arange(FRAMES) / 30
    else:
        path = write_video(folder / "v.mkv", FRAMES, times_ms=UNEVEN_MS.tolist())
        times_s = UNEVEN_MS / 1000
    window.open_paths([path])
    qtbot.waitUntil(lambda: models_of(window).document.content is not None, timeout=20_000)
    return times_s


def turn_to(window, qtbot, time_s: float) -> None:
    """Let the clock of the window come to a time, while it plays."""
    playback = models_of(window).playback
    HandClock.now_ns += round((time_s - playback.time_s) * 1e9) + 1
    qtbot.waitUntil(lambda: playback.time_s >= time_s, timeout=5000)


@pytest.mark.one_in(2)
@RATES
def test_a_mark_has_the_time_of_the_frame_that_is_shown(
    empty_window, qtbot, tmp_path, rate: str
) -> None:
    times_s, c = open_video(empty_window, qtbot, tmp_path, rate), models_of(empty_window)

    def shown() -> int:
        return -1 if c.video.picture is None else number_in(c.video.picture)

    for frame in range(FRAMES):
        c.playback.seek_frame(frame)
        qtbot.waitUntil(lambda frame=frame: shown() == frame, timeout=5000)
        key(empty_window, "1")
        (mark,) = c.labels.marks
        assert mark.start_s == pytest.approx(times_s[shown()], rel=0, abs=1e-9)
        key(empty_window, "Escape")


@pytest.mark.slow
@pytest.mark.usefixtures("by_hand")
@RATES
def test_a_key_while_it_plays_marks_the_frame_on_screen(
    empty_window, qtbot, tmp_path, rate: str
) -> None:
    times_s, c = open_video(empty_window, qtbot, tmp_path, rate), models_of(empty_window)
    rng = random.Random(1)
    pressed = sorted(rng.sample(range(1, FRAMES - 1), 20))
    c.playback.play()
    for frame in pressed:
        # Anywhere while it is on screen: just come, about to go, in between.
        share = rng.choice([0.001, 0.5, 0.999])
        turn_to(empty_window, qtbot, times_s[frame] + share * np.diff(times_s)[frame])
        assert c.playback.frame == frame
        key(empty_window, "1")
    c.playback.pause()
    found_s = [edge for span in c.labels.labels.spans for edge in (span.start_s, span.end_s)]
    assert found_s == pytest.approx(times_s[pressed], rel=0, abs=1e-9)


# --- the sample, from end to end --------------------------------------------------------------


@pytest.fixture
def unlabelled_sample(empty_window, qtbot):
    """The sample without its labels."""
    c = models_of(empty_window)
    empty_window.open_paths([SAMPLE])
    qtbot.waitUntil(lambda: c.document.content is not None and empty_window.settled, timeout=60_000)
    key(empty_window, "A", Qt.KeyboardModifier.ControlModifier)
    key(empty_window, "Backspace")
    assert spans(empty_window) == []
    c.playback.seek_frame(0)
    return empty_window


def presses() -> list[tuple[float, str]]:
    """When a hand presses which key, and what it is to mark: each gesture begun and ended."""
    gestures = open_recording(SAMPLE).labelled
    keys = {label.name: label.key for label in gestures.label_set.labels}
    rng = random.Random(7)
    return [
        (at_s + rng.uniform(-0.05, 0.05), keys[span.label])
        for span in gestures.spans
        for at_s in (span.start_s, span.end_s)
    ]


def check_marked(
    labels: Labels, script: list[tuple[float, str]], within_s: float = TWO_FRAMES_S
) -> None:
    """Eight gestures with the right labels, every edge within two frames of its press."""
    expected = open_recording(SAMPLE).labelled.spans
    assert [span.label for span in labels.spans] == [span.label for span in expected]
    edges_s = [edge for span in labels.spans for edge in (span.start_s, span.end_s)]
    assert np.abs(np.array(edges_s) - [at_s for at_s, _ in script]).max() <= within_s


def check_formats(labels: Labels, window, folder: Path) -> None:
    """Every format gives back what it can hold of them."""
    base = models_of(window).playback.timebase
    for one in FORMATS:
        path = folder / f"gestures-{one.name}{one.suffixes[0]}"
        write_labels(path, labels, base, one.name)
        back = read_labels(path, base, one.name)
        exact = one.resolution_s == 0
        again = {span.id: span for span in back.spans} if "ids" in one.keeps else {}
        for number, span in enumerate(labels.spans):
            read = again.get(span.id) or back.spans[number]
            assert (read.label, read.track) == (span.label, span.track)
            for edge_s, marked_s in ((read.start_s, span.start_s), (read.end_s, span.end_s)):
                assert base.nearest_frame(edge_s) == base.nearest_frame(marked_s)
            within_s = 1e-9 if exact else one.resolution_s
            assert (read.start_s, read.end_s) == pytest.approx(
                (span.start_s, span.end_s), rel=0, abs=within_s
            )
            if "origin" in one.keeps:
                assert read == replace(span, start_s=read.start_s, end_s=read.end_s)
        assert len(back.spans) == len(labels.spans)


@pytest.mark.slow
@pytest.mark.usefixtures("by_hand")
def test_the_eight_gestures_of_the_sample(unlabelled_sample, qtbot, tmp_path) -> None:
    c, script = models_of(unlabelled_sample), presses()
    c.playback.play()
    on_screen_s = []
    for at_s, name in script:
        turn_to(unlabelled_sample, qtbot, at_s)
        on_screen_s.append(c.playback.timebase.time_of(c.playback.frame))
        key(unlabelled_sample, name)
    c.playback.pause()
    labels = c.labels.labels
    check_marked(labels, script)
    edges_s = [edge for span in labels.spans for edge in (span.start_s, span.end_s)]
    assert edges_s == on_screen_s
    assert len({span.id for span in labels.spans}) == 8
    check_formats(labels, unlabelled_sample, tmp_path)
    c.document.undo_stack.setClean()


@pytest.mark.slow
def test_the_same_at_1x_by_the_clock_on_the_wall(unlabelled_sample, qtbot, tmp_path) -> None:
    c, script = models_of(unlabelled_sample), presses()
    # When the hand has pressed by a clock of its own, and what it saw then.
    pressed: list[tuple[float, str]] = []
    on_screen_s: list[float] = []

    def press(name: str) -> None:
        pressed.append((time.perf_counter() - began_s, name))
        on_screen_s.append(c.playback.timebase.time_of(c.playback.frame))
        key(unlabelled_sample, name)

    for at_s, name in script:
        timer = QTimer(unlabelled_sample)
        timer.setSingleShot(True)
        timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(lambda name=name: press(name))
        timer.start(round(1000 * at_s))
    # Where others hold the machine up, the screen stands; the hand marks what it sees.
    ticks_s: list[float] = []
    ticker = QTimer(unlabelled_sample)
    ticker.timeout.connect(lambda: ticks_s.append(time.perf_counter()))
    ticker.start(5)
    began_s = time.perf_counter()
    c.playback.play()
    qtbot.waitUntil(lambda: not c.playback.playing, timeout=60_000)
    ticker.stop()
    held_up_s = float(np.diff(ticks_s).max())
    labels = c.labels.labels
    assert [name for _, name in pressed] == [name for _, name in script]
    assert [edge for one in labels.spans for edge in (one.start_s, one.end_s)] == on_screen_s
    check_marked(labels, pressed, TWO_FRAMES_S + held_up_s)
    check_formats(labels, unlabelled_sample, tmp_path)
    c.document.undo_stack.setClean()
