from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.session.playback import SPEEDS, PlaybackModel
from sd2core.timebase import Timebase


@pytest.fixture
def playback(qtbot):
    model = PlaybackModel()
    model.set_timebase(Timebase.regular(90, 30.0))
    yield model
    model.pause()


@given(moves=st.lists(st.one_of(
    st.tuples(st.just("frames"), st.integers(-200, 200)),
    st.tuples(st.just("seconds"), st.floats(-10, 10)),
    st.tuples(st.just("seek"), st.floats(-10, 10)),
), max_size=20))  # fmt: skip
def test_paused_time_is_always_the_time_of_the_frame(moves):
    playback = PlaybackModel()
    playback.set_timebase(Timebase(np.cumsum(np.full(40, 0.04)) + 1.5))
    for move, amount in moves:
        getattr(playback, {"frames": "step_frames", "seconds": "step_seconds"}.get(move, move))(
            amount
        )
        assert 0 <= playback.frame < 40
        assert playback.time_s == playback.timebase.time_of(playback.frame)


def test_steps_go_one_frame(playback):
    playback.step_frames(1)
    assert playback.frame == 1
    playback.step_frames(-1)
    playback.step_frames(-1)
    assert playback.frame == 0
    playback.step_seconds(1.0)
    assert playback.frame == 30


def test_playing_advances_and_ends_on_the_last_frame(playback, qtbot):
    playback.set_timebase(Timebase.regular(6, 30.0))
    frames = []
    playback.frame_changed.connect(frames.append)
    playback.play()
    qtbot.waitUntil(lambda: not playback.playing)
    assert playback.frame == 5
    assert frames == sorted(frames)
    playback.play()
    assert playback.frame == 0


def test_looping_starts_again(playback, qtbot):
    playback.set_timebase(Timebase.regular(4, 60.0))
    playback.set_loop(True)
    playback.play()
    seen = []
    playback.frame_changed.connect(seen.append)
    qtbot.waitUntil(lambda: any(a > b for a, b in itertools.pairwise(seen)))
    assert playback.playing


def test_speed_moves_along_the_table(playback):
    playback.change_speed(1)
    assert playback.speed == SPEEDS[SPEEDS.index(1.0) + 1]
    playback.change_speed(99)
    assert playback.speed == SPEEDS[-1]


def test_pausing_stays_on_the_frame(playback, qtbot):
    playback.play()
    qtbot.waitUntil(lambda: playback.frame > 2)
    playback.pause()
    frame = playback.frame
    assert playback.time_s == playback.timebase.time_of(frame)


def test_one_frame_does_not_play(playback):
    playback.set_timebase(Timebase([0.0]))
    playback.play()
    assert not playback.playing


@given(
    frames=st.integers(1, 20),
    more=st.lists(st.integers(1, 5), min_size=1, max_size=10),
    at=st.integers(0, 19),
)
def test_the_newest_frame_of_a_growing_recording_stays_on_screen(frames, more, at):
    playback = PlaybackModel()
    playback.set_timebase(Timebase.regular(frames, 30.0))
    playback.seek_frame(at)
    at_end = playback.frame == frames - 1
    for count in more:
        before = playback.time_s
        frames += count
        playback.extend(Timebase.regular(frames, 30.0))
        assert playback.frame == (frames - 1 if at_end else at)
        assert playback.time_s == playback.timebase.time_of(playback.frame)
        assert at_end or playback.time_s == before


def test_playing_goes_on_into_what_was_added(playback, qtbot):
    playback.set_timebase(Timebase.regular(3, 30.0))
    playback.play()
    playback.extend(Timebase.regular(12, 30.0))
    assert playback.playing
    qtbot.waitUntil(lambda: not playback.playing, timeout=20_000)
    assert playback.frame == 11
