"""A camera and a radar that stay open from recording to recording: no frame of one is lost."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from sd2core.io.video import open_video
from sd2core.live.cameras import CameraChoice
from sd2core.live.cameras import TestCamera as RehearsedCamera
from sd2core.live.joint import JointRecording, Station
from sd2core.live.listening import Listening
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording
from sd2core.live.rehearsal import TestSource as RehearsedSource
from sd2core.live.sources import Frame, ReplaySource, Source
from sd2core.recording.recording import open_recording
from tests.core.live.fast_captures import fast_swipes


class Numbered(Source):
    """Frames that are numbered, handed over a little after they arrived; every tenth was lost."""

    def __init__(self, period_s: float = 0.004) -> None:
        self.period_s = period_s
        self.arrivals_s: list[float] = []
        self.closed = 0

    def run(self, take, stop: threading.Event) -> None:
        begin_s = time.monotonic()
        while not stop.is_set():
            number = len(self.arrivals_s)
            time.sleep(max(begin_s + number * self.period_s - time.monotonic(), 0.0))
            self.arrivals_s.append(time.monotonic())
            time.sleep(0.002)  # on its way
            lost = int(number % 10 == 0)
            take(Frame(number, number * self.period_s, self.arrivals_s[-1], lost=lost))

    def close(self) -> None:
        self.closed += 1


def _wait_for(is_so) -> None:
    until_s = time.monotonic() + 30.0
    while not is_so():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def _recorded(reception: Reception, seconds: float) -> tuple[list[Frame], float, float]:
    """Frames of a take, and when it began and ended."""
    frames: list[Frame] = []
    begin_s = time.monotonic()
    reception.begin(frames.append)
    time.sleep(seconds)
    end_s = time.monotonic()
    reception.end()
    return frames, begin_s, end_s


def test_takes_have_all_frames_that_arrived_in_them_and_no_others() -> None:
    source = Numbered()
    reception = Reception(source)
    takes = []
    for _ in range(3):
        takes.append(_recorded(reception, 0.3))
        time.sleep(0.1)
    reception.close()
    assert source.closed == 1
    arrivals_s = np.array(source.arrivals_s)
    for frames, begin_s, end_s in takes:
        numbers = [frame.content for frame in frames]
        assert numbers == list(range(numbers[0], numbers[-1] + 1))
        # The thread of a take needs a moment to begin; what it was given goes to the very end.
        assert begin_s - 0.01 <= arrivals_s[numbers[0]] < begin_s + 0.1
        assert numbers[-1] >= np.flatnonzero(arrivals_s <= end_s)[-1]
        assert frames[0].time_s == 0.0
        assert frames[0].lost == 0
        assert sum(frame.lost for frame in frames[1:]) == sum(n % 10 == 0 for n in numbers[1:])
    # Between takes frames came, and went.
    assert takes[1][0][0].content > takes[0][0][-1].content + 10


def test_the_clock_is_that_of_the_whole_session() -> None:
    class Drifting(Source):
        """An hour of frames at once, of a clock that is slow by 200 millionths."""

        def run(self, take, stop: threading.Event) -> None:
            begin_s = time.monotonic() - 3600.0
            for time_s in np.arange(0.0, 3600.0, 1.0):
                take(Frame(None, float(time_s), begin_s + 1.0002 * float(time_s)))

    reception = Reception(Drifting())
    _recorded(reception, 0.5)
    assert reception.is_over
    assert reception.rate == pytest.approx(1.0002, abs=1e-6)
    reception.close()


def test_what_stopped_the_radar_is_raised_in_the_take(tmp_path: Path) -> None:
    class Broken(RehearsedSource):
        def run(self, take, stop: threading.Event) -> None:
            raise OSError("pulled out")

    reception = Reception(Broken())
    listening = Listening(reception, GrowingRecording(tmp_path / "take.sd2"))
    listening.start()
    _wait_for(lambda: listening.is_over)
    for what in (lambda: listening.next_column(0.01), listening.stop):
        with pytest.raises(OSError, match="pulled out"):
            what()
    reception.close()


def _made(station: Station, folder: Path, frames: int) -> JointRecording:
    with station.begin(folder) as take:
        take.listening.start()
        _wait_for(lambda: take.listening.counts.recorded >= frames and take.film.filmed.recorded)
        take.stop()
        assert take.correct_clocks() is not None
    return take


def test_a_station_films_and_receives_take_after_take(tmp_path: Path) -> None:
    opened: list[Source] = []

    def radar() -> Source:
        opened.append(RehearsedSource(30.0))
        return opened[-1]

    delays_s = RehearsedCamera().delay_s, RehearsedSource(30.0).delay_s
    with Station(CameraChoice("test", (64, 48), 100.0), radar, lambda *_: delays_s) as station:
        takes = [_made(station, tmp_path / f"take{k}.sd2", 20) for k in range(2)]
        pictures = [take.film.filmed.recorded for take in takes][-1:]
    assert len(opened) == 1
    assert takes[0].film is takes[1].film
    recordings = [open_recording(take.folder) for take in takes]
    for take, recording in zip(takes, recordings, strict=True):
        capture = recording.load_capture()
        assert len(capture.timebase) == take.listening.counts.recorded
        assert take.listening.counts.whole
        np.testing.assert_allclose(np.diff(capture.timebase.times_s), 1 / 30, atol=1e-9)
        with open_video(take.folder / "video.mp4") as video:
            assert video.timebase.times_s[0] == 0.0
            assert np.diff(video.timebase.times_s).max() < 0.5
    with open_video(takes[1].folder / "video.mp4") as video:
        assert [len(video)] == pictures
    # A second take begins where the first one has ended, by the clock of both.
    starts_s = [recording.load_capture().start_unix_s for recording in recordings]
    assert starts_s[1] - starts_s[0] > 0.6


@pytest.mark.slow
def test_a_replayed_radar_and_a_played_video_begin_anew_with_each_take(tmp_path: Path) -> None:
    capture = fast_swipes(20, 100.0)
    film = tmp_path / "film.mp4"
    from sd2core.io.video_writing import write_video

    pictures = [np.full((48, 64, 3), 12 * k, np.uint8) for k in range(20)]
    write_video(film, pictures, 50, (64, 48))
    radar = lambda: ReplaySource(capture)  # noqa: E731
    with Station(CameraChoice(str(film)), radar, lambda *_: (0.0, 0.0)) as station:
        for k in range(2):
            with station.begin(tmp_path / f"take{k}.sd2") as take:
                take.listening.start()
                _wait_for(lambda: take.listening.is_over or take.listening.next_column(0.01))
                _wait_for(lambda: take.film.is_over)
                _wait_for(lambda: take.listening.counts.recorded == 20)
                take.stop()
                assert take.film.filmed.recorded == 20
