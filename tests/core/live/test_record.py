"""A camera and a radar recorded together: nothing lost, and events at one time."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.cli import build_parser, run
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video
from sd2core.live.cameras import CameraChoice
from sd2core.live.clocks import Clocks, fit_line
from sd2core.live.filming import Film
from sd2core.live.rehearsal import EVENT_S, FLASH_S, share_of_event
from sd2core.placements.placements import PlacementGrid
from sd2core.recording.recording import Recording, open_recording
from tests.core.io.radar.dca1000_files import TiRecording, cfg_of

RECORD = [sys.executable, "-m", "sd2core.cli", "record"]


def _centres_s(times_s: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Centres of the events in a clip, weighted by their shares of the frames."""
    shows = np.flatnonzero(shares > 0.05)
    groups = np.split(shows, np.flatnonzero(np.diff(times_s[shows]) > EVENT_S / 2) + 1)
    inside = [
        one
        for one in groups
        if times_s[0] + 0.1 < times_s[one[0]] <= times_s[one[-1]] < times_s[-1] - 0.1
    ]
    return np.array([np.average(times_s[one], weights=shares[one]) for one in inside])


def _events_s(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Times of flashes in the video and of bursts in the radar, on the recording's clock."""
    with open_video(recording.folder / "video.mp4") as video:
        light = np.array([picture[:4].mean() for picture in video.frames()])
        pictures_s = video.timebase.times_s
    flashes = np.clip((light - light.min()) / (light.max() - light.min()), 0.0, None)
    capture = recording.load_capture()
    samples = np.asarray(capture.samples[:], float).reshape(len(capture.timebase), -1)
    power = samples.var(axis=1)
    bursts = np.sqrt(np.clip(power - np.median(power), 0.0, None))
    radar_s = capture.timebase.times_s + recording.radar_offset_s
    return _centres_s(pictures_s, flashes), _centres_s(radar_s, bursts / bursts.max())


@given(st.floats(-1e5, 1e5), st.floats(-4e-4, 4e-4), st.floats(30.0, 3000.0), st.integers(0, 2**32))
def test_a_clock_is_found_whatever_is_held_up(
    start_s: float, drift: float, length_s: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    times_s = np.arange(0.0, length_s, length_s / 900)
    arrivals_s = start_s + (1.0 + drift) * times_s + rng.normal(0.0, 1e-3, len(times_s))
    late = rng.random(len(times_s)) < 0.1
    arrivals_s[late] += rng.exponential(0.3, late.sum())
    line = fit_line(times_s, arrivals_s)
    ends_s = line.start_s + line.rate * times_s[[0, -1]]
    np.testing.assert_allclose(ends_s, start_s + (1.0 + drift) * times_s[[0, -1]], atol=3e-3)
    assert 0.5e-3 < line.jitter_s < 2e-3


def test_clocks_that_run_alike_are_not_made_to_differ() -> None:
    times_s = np.arange(0.0, 60.0, 0.05)
    rates = [
        fit_line(times_s, times_s + np.random.default_rng(seed).normal(0.0, 2e-3, 1200)).rate
        for seed in range(20)
    ]
    assert rates.count(1.0) > 15  # in 5 % of the cases an interval of 95 % is wrong


def test_too_little_is_no_drift_and_another_rate_is_no_clock() -> None:
    times_s = np.arange(0.0, 10.0, 0.05)
    assert fit_line(times_s, 1.0005 * times_s).rate == 1.0
    with pytest.raises(Sd2Error, match=r"1\.5000 s for every second"):
        fit_line(3.0 * times_s, 4.5 * times_s)
    with pytest.raises(Sd2Error, match="No frame"):
        fit_line(times_s[:0], times_s[:0])


def test_delays_are_taken_off_both_sides() -> None:
    clocks = Clocks(video_first_s=100.0, video_delay_s=0.05, radar_delay_s=0.02)
    line = fit_line(np.array([0.0, 1.0]), np.array([103.0, 104.0]))
    # The first exposure was at 99.95 s, the radar's first chirps at 102.98 s.
    assert clocks.offset_s(line) == pytest.approx(3.03)


def test_a_frame_has_the_share_of_an_event_that_it_sees() -> None:
    edges_s = np.linspace(0.5, 4.5, 401)
    shares = [share_of_event(a, b) for a, b in pairwise(edges_s)]
    assert sum(shares) * 0.01 == pytest.approx(2 * FLASH_S)


@pytest.mark.parametrize(
    ("rate_hz", "seconds", "events"),
    [
        (30, 4, 1),
        pytest.param(30, 9, 3, marks=pytest.mark.slow),
        pytest.param(20, 9, 3, marks=pytest.mark.slow),
    ],
)
def test_events_that_both_see_are_at_one_time_as_seen_from_a_place_that_was_found(
    tmp_path: Path, rate_hz: int, seconds: int, events: int
) -> None:
    out = tmp_path / "take.sd2"
    radar = "test" if rate_hz == 30 else f"test:{rate_hz}"
    words = ["--camera", "test", "--radar", radar, "--out", str(out), "--placement", "2.2,-15"]
    command = [*RECORD, *words, "--seconds", str(seconds), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    told = [json.loads(line) for line in done.stdout.splitlines()]
    end = next(one for one in told if one["event"] == "end")
    clocks = next(one for one in told if one["event"] == "clocks")
    recording = open_recording(out)
    with open_video(out / "video.mp4") as video:
        assert len(video) == clocks["pictures"]
        assert clocks["pictures_dropped"] == 0
    assert len(recording.load_capture().timebase) == end["recorded"]
    assert (end["dropped"], end["lost"]) == (0, 0)
    assert recording.simulated
    assert recording.placements == PlacementGrid((2.2,), (-15.0,), (0.0,))
    flashes_s, bursts_s = _events_s(recording)
    assert len(flashes_s) >= events
    apart_s = flashes_s[:, None] - bursts_s
    nearest_s = apart_s[np.arange(len(flashes_s)), np.abs(apart_s).argmin(axis=1)]
    # The radar looks half of the time: one event alone is known to some 10 ms.
    assert abs(nearest_s.mean()) < 0.03 / events + clocks["jitter_s"]


@pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there")
def test_a_kill_loses_no_more_than_the_second_in_flight(tmp_path: Path) -> None:
    out = tmp_path / "take.sd2"
    words = ["--camera", "test", "--radar", "test", "--out", str(out), "--json"]
    process = subprocess.Popen([*RECORD, *words], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    last = {"recorded": 0, "pictures": 0}
    for line in process.stdout:
        told = json.loads(line)
        last = told if told["event"] == "frames" else last
        if last["recorded"] > 45 and last["pictures"] > 45:
            break
    for child in _children(process.pid):
        os.kill(child, signal.SIGKILL)
    process.kill()
    process.wait()
    process.stdout.close()
    recording = open_recording(out)
    with open_video(out / "video.mp4") as video:
        assert len(video) >= last["pictures"] - 30
    assert len(recording.load_capture().timebase) >= last["recorded"]
    assert recording.radar_offset_s != 0.0


def _children(pid: int) -> list[int]:
    import psutil

    return [one.pid for one in psutil.Process(pid).children()]


@pytest.mark.slow
def test_a_video_that_is_deleted_is_put_back(tmp_path: Path) -> None:
    folder = tmp_path / "take"
    folder.mkdir()
    film = Film(CameraChoice("test"))
    film.begin(folder / "video.mp4")
    _wait_for(lambda: film.filmed.recorded > 20)
    folder.rename(tmp_path / "gone")
    shutil.rmtree(tmp_path / "gone")
    _wait_for(lambda: film.filmed.put_back > 0)
    film.end()
    film.close()
    with open_video(folder / "video.mp4") as video:
        assert len(video) == film.filmed.recorded


def _wait_for(is_so) -> None:
    until_s = time.monotonic() + 30.0
    while not is_so():
        assert time.monotonic() < until_s
        time.sleep(0.01)


def refused(out: Path, camera: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Words by which the command refuses to record a camera and the radar of tests."""
    words = ["record", "--camera", camera, "--radar", "test", "--out", str(out)]
    assert run(build_parser(typed=words)[0], words) == 1
    return capsys.readouterr().err


def test_a_camera_that_is_not_there_is_named_and_leaves_nothing(tmp_path: Path, capsys) -> None:
    out = tmp_path / "take.sd2"
    assert "sd2: Camera 97 cannot be opened, or gives no picture." in refused(out, "97", capsys)
    assert not out.exists()


def test_what_was_recorded_is_not_recorded_over(tmp_path: Path, capsys) -> None:
    out = tmp_path / "take.sd2"
    out.mkdir()
    assert "take.sd2 exists. Expected: a new folder." in refused(out, "test", capsys)


@pytest.mark.slow
def test_a_radar_that_is_silent_leaves_the_video(tmp_path: Path) -> None:
    out, setup = tmp_path / "take.sd2", tmp_path / "walk.cfg"
    setup.write_text(cfg_of(TiRecording()), encoding="utf-8")
    words = ["--camera", "test", "--radar", "127.0.0.1:0", "--setup", str(setup)]
    words += ["--out", str(out), "--seconds", "1"]
    done = subprocess.run([*RECORD, *words], capture_output=True, text=True, check=True)
    assert "No frame of the radar came: the recording holds the video alone." in done.stdout
    recording = open_recording(out)
    assert recording.radar is None
    with open_video(recording.video) as video:
        assert len(video) > 10
