from __future__ import annotations

import time

import numpy as np
import pytest

from sd2app.session.playback import PlaybackModel
from sd2app.session.video_frames import VideoModel
from sd2core.timebase import Timebase


class SlowReader:
    """A video whose pictures hold their frame number and take 20 ms each."""

    timebase = Timebase.regular(250, 30.0)

    def __init__(self, broken=frozenset()):
        self.broken = broken

    def read(self, frame):
        time.sleep(0.02)
        if frame in self.broken:
            raise OSError(f"frame {frame} cannot be decoded")
        return np.full((2, 2, 3), frame, np.uint8)


@pytest.fixture
def models(qtbot):
    playback = PlaybackModel()
    playback.set_timebase(SlowReader.timebase)
    video = VideoModel(playback)
    yield playback, video
    video.close()


def test_fast_scrubbing_shows_pictures_on_the_way_and_the_last(models, qtbot):
    playback, video = models
    video.set_reader(SlowReader())
    shown = []
    video.frame_changed.connect(lambda: shown.append(video.shown_frame))
    for frame in range(200):
        playback.seek_frame(frame)
        qtbot.wait(2)
    qtbot.waitUntil(lambda: video.shown_frame == 199)
    assert (video.picture == 199).all()
    assert shown == sorted(shown)
    assert len(shown) > 5


def test_a_picture_that_cannot_be_decoded_is_reported_and_the_next_is_shown(models, qtbot):
    playback, video = models
    with qtbot.waitSignal(video.failed) as failure:
        video.set_reader(SlowReader(broken={0}))
    assert "frame 0" in failure.args[0]
    playback.seek_frame(3)
    qtbot.waitUntil(lambda: video.shown_frame == 3)


def test_without_a_video_there_is_no_picture(models, qtbot):
    playback, video = models
    video.set_reader(SlowReader())
    qtbot.waitUntil(lambda: video.shown_frame == 0)
    video.set_reader(None)
    assert video.picture is None
    playback.seek_frame(5)
    assert not video.busy
