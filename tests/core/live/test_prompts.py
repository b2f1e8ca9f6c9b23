"""Prompts become labels: of maps that are made here, and of whole sessions with test sources."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.cli import build_parser, run
from sd2core.datasets.reading import open_dataset
from sd2core.files.lock import FileLock
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.video import open_video
from sd2core.io.video_writing import HEADS_COVERED, write_video
from sd2core.live.clocks import Clocks
from sd2core.live.prompting import NO_MOTION, prompted_span
from sd2core.maps import DopplerMap
from sd2core.options.suggesting import SuggestOptions
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

SD2 = [sys.executable, "-m", "sd2core.cli"]
BINS, RATE_HZ, FRAMES = 16, 20.0, 200
MARGINS = SuggestOptions()
FRAME_S = 1.0 / RATE_HZ
PROTOCOL = """
format = "sd2-protocol"
version = 1
title = "Try"
people = ["anna"]
order = "fixed"
take_s = 1
pause_s = 1
countdown_s = 1
consent = "You are filmed."

[[gestures]]
name = "left-to-right"
instruction = "Swipe to your left"

[[gestures]]
name = "wave"
instruction = "Wave"
"""


def _map(*moving_s: tuple[float, float]) -> DopplerMap:
    """Ten seconds of quiet, but for what moves."""
    timebase = Timebase.regular(FRAMES, RATE_HZ)
    values = np.ones((BINS, FRAMES), np.float32)
    for start_s, end_s in moving_s:
        moves = (timebase.times_s >= start_s) & (timebase.times_s < end_s)
        values[:4, moves] = 1000.0
    return DopplerMap(values, VelocityAxis(BINS, 2.0), timebase, "real")


@given(st.floats(1.0, 3.0), st.floats(0.5, 1.0), st.floats(0.5, 2.0), st.floats(0.5, 1.5))
def test_edges_snap_to_the_motion(
    prompt_s: float, late_s: float, first_s: float, second_s: float
) -> None:
    begin_s = prompt_s + late_s
    again_s = begin_s + first_s + 1.0
    found = prompted_span(
        _map((begin_s, begin_s + first_s), (again_s, again_s + second_s)), "up", prompt_s, 9.5, 0.3
    )
    assert (found.label, found.note) == ("up", "")
    assert found.start_s == pytest.approx(begin_s - MARGINS.margin_s, abs=2 * FRAME_S + 0.05)
    after_s = MARGINS.margin_s + MARGINS.hold_s
    assert found.end_s == pytest.approx(again_s + second_s + after_s, abs=2 * FRAME_S + 0.05)


def test_motion_that_was_there_before_the_prompt_or_goes_on_after_it_moves_no_edge() -> None:
    found = prompted_span(_map((1.0, 4.0)), "up", 2.0, 3.5, 0.3)
    assert (found.start_s, found.end_s, found.note) == (2.3, 3.5, "")
    before = prompted_span(_map((0.5, 1.0)), "up", 2.0, 3.5, 0.3)
    assert (before.start_s, before.end_s, before.note) == (2.3, 3.5, NO_MOTION)


@given(
    st.lists(st.tuples(st.floats(0.0, 9.0), st.floats(0.2, 2.0)), max_size=4),
    st.floats(1.0, 5.0),
    st.floats(0.6, 4.0),
)
def test_a_label_is_in_its_prompt_and_never_a_sliver(
    moving: list[tuple[float, float]], prompt_s: float, long_s: float
) -> None:
    doppler = _map(*((start_s, start_s + for_s) for start_s, for_s in moving))
    found = prompted_span(doppler, "up", prompt_s, prompt_s + long_s, 0.3)
    assert prompt_s <= found.start_s < found.end_s <= prompt_s + long_s
    assert found.duration_s >= MARGINS.min_duration_s


def test_an_event_is_put_on_the_clock_of_the_video() -> None:
    clocks = Clocks(video_first_s=100.0, video_delay_s=0.1, radar_delay_s=0.0)
    assert clocks.recording_s(103.0) == pytest.approx(3.1)


def _session(
    protocol: Path, folder: Path, key_at: Callable[[dict[str, Any]], str]
) -> list[dict[str, Any]]:
    """Run a session whose keys are pressed as its events say; return the events."""
    words = ["record", "--camera", "test", "--radar", "test", "--json"]
    process = subprocess.Popen(
        [*SD2, *words, "--protocol", str(protocol), "--out", str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    told = []
    for line in process.stdout:
        told.append(json.loads(line))
        if key := key_at(told[-1]):
            process.stdin.write(key)
            process.stdin.flush()
    process.communicate()
    assert process.returncode == 0
    return told


@pytest.mark.slow
def test_a_session_ends_in_recordings_of_the_right_labels(tmp_path: Path) -> None:
    protocol, folder = tmp_path / "try.toml", tmp_path / "session"
    protocol.write_text(PROTOCOL.replace('["anna"]', '["anna", "ben"]'), encoding="utf-8")
    pressed: list[str] = []

    def keys(event: dict[str, Any]) -> str:
        if event["event"] != "step":
            return ""
        key = ""
        match event["phase"], event.get("gesture"):
            case "consent", _:
                key = " y" if event["person"] == "anna" else " n"  # Space is no agreement
            case "ready", _:
                key = " "
            case "prompt", "left-to-right" if "a" not in pressed:
                key = "a"
            case "pause", "wave" if "s" not in pressed:
                key = "s"
        pressed.extend(key)
        return key

    told = _session(protocol, folder, keys)
    stored = [one for one in told if one["event"] == "stored"]
    assert [one["take"] for one in stored] == ["anna-left-to-right-1"]
    lacks = ["anna-wave-1", "ben-left-to-right-1", "ben-wave-1"]
    assert told[-1] == {"event": "missing", "takes": lacks, "not_agreed": ["ben"]}
    assert {one.name for one in folder.iterdir()} == {"anna-left-to-right-1.sd2", "consent.json"}

    # The same command goes on with what is missing; a leftover of a killed one is no take. The
    # last take is made again after it, in its own place.
    (folder / "unfinished" / "anna-wave-1.sd2").mkdir(parents=True)
    pressed = []

    def keys_of_the_second(event: dict[str, Any]) -> str:
        after_all = event.get("phase") == "pause" and "gesture" not in event
        key = {"ready": "\n", "consent": "n"}.get(event.get("phase", ""), "")
        if after_all and "a" not in pressed:
            key = "a"
        pressed.extend(key)
        return key

    told = _session(protocol, folder, keys_of_the_second)
    assert told[0]["missing"] == 3
    asked = {one["person"] for one in told if one.get("phase") == "consent"}
    assert asked == {"ben"}  # anna has agreed before
    assert [one["take"] for one in told if one["event"] == "stored"] == 2 * ["anna-wave-1"]
    assert told[-1] == {"event": "missing", "takes": lacks[1:], "not_agreed": ["ben"]}
    assert not (folder / "unfinished").exists()

    for name, gesture in (("anna-left-to-right-1", "left-to-right"), ("anna-wave-1", "wave")):
        recording = open_recording(folder / f"{name}.sd2")
        (span,) = recording.labelled.spans
        assert (span.label, recording.subject, recording.title) == (gesture, "anna", name)
        # The prompt came after a second of standing still, and went a second later.
        assert 0.9 < span.start_s < span.end_s
        assert span.end_s - span.start_s < 1.3
        assert recording.missing() == {}

    out = tmp_path / "set.npz"
    words = ["export", str(folder), "--segments", "spans", "--out", str(out)]
    subprocess.run([*SD2, *words], check=True, capture_output=True)
    with open_dataset(out) as made:
        assert made.header.subjects == ("anna",)
        segments = [
            (made.header.labels[label], made.header.classes.get(made.header.labels[label]))
            for label in made["segment_label"][:].tolist()
        ]
    assert sorted(segments) == [("left-to-right", "horizontal"), ("wave", "wave")]


def test_what_cannot_be_is_refused_before_anything_is_made(tmp_path: Path, capsys) -> None:
    words = ["record", "--camera", "test", "--radar", "test", "--out", str(tmp_path / "some")]
    for more, said in (
        (["--protocol", "none.toml"], "sd2: There is no protocol none.toml"),
        (["--protocol", "paper", "--seconds", "3"], "--protocol is given with --seconds"),
    ):
        assert run(build_parser(typed=words)[0], [*words, *more]) != 0
        assert said in capsys.readouterr().err
    assert not (tmp_path / "some").exists()


@pytest.mark.slow
def test_a_session_that_goes_on_elsewhere_is_not_joined(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    protocol, folder = tmp_path / "try.toml", tmp_path / "session"
    protocol.write_text(PROTOCOL, encoding="utf-8")
    folder.mkdir()
    held = FileLock(folder / ".session.lock")
    assert held.take()
    words = ["record", "--camera", "test", "--radar", "test", "--out", str(folder)]
    words += ["--protocol", str(protocol)]
    assert run(build_parser(typed=words)[0], words) == 1
    assert f"A session goes on in {folder} already" in " ".join(capsys.readouterr().err.split())
    held.release()
    begun = subprocess.run([*SD2, *words], capture_output=True, check=False, input=b"q")
    assert begun.returncode == 0
    assert [*folder.iterdir()] == []


@pytest.fixture(scope="module")
def second(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Video and mesh of the sample's first second."""
    folder, sample = tmp_path_factory.mktemp("second"), resource_path("swipes.sd2")
    save_mesh(load_mesh(sample / "fit.zarr").between(0, 30), folder / "mesh.npz")
    with open_video(sample / "video.mp4") as video:
        write_video(
            folder / "video.mp4", islice(video.frames(), 30), 30, (video.width, video.height)
        )
    return folder


@pytest.mark.parametrize("kept", ["keep", "drop", pytest.param("blur", marks=pytest.mark.slow)])
def test_a_person_is_hidden_only_where_wanted_and_a_body_is_there(
    tmp_path: Path, second: Path, kept: str
) -> None:
    folder = tmp_path / "session"
    folder.mkdir()
    for name, mesh in (("anna-left-to-right-1", second / "mesh.npz"), ("anna-wave-1", None)):
        video = shutil.copy(second / "video.mp4", tmp_path / "video.mp4")
        Recording.create(folder / f"{name}.sd2", video=video, mesh=mesh, copy=True)
    before = open_recording(folder / "anna-left-to-right-1.sd2")
    with before.open_video() as reader:
        times_s = reader.timebase.times_s
    protocol = tmp_path / "try.toml"
    protocol.write_text(f'video = "{kept}"\n{PROTOCOL}', encoding="utf-8")
    told = _session(protocol, folder, lambda _: "")
    assert told[-1] == {"event": "missing", "takes": [], "not_agreed": []}
    hidden = {one["event"]: one["takes"] for one in told if one["event"] in ("dropped", "blurred")}
    event = {"drop": "dropped", "blur": "blurred"}.get(kept)
    assert hidden == ({event: ["anna-left-to-right-1"]} if event else {})
    if kept == "blur":
        again = _session(protocol, folder, lambda _: "")
        assert [one["takes"] for one in again if one["event"] == "blurred"] == [[]]
    with_body, without = (open_recording(path) for path in sorted(folder.iterdir()))
    assert without.video is not None
    assert without.video.is_file()
    assert (folder / "anna-left-to-right-1.sd2" / "video.mp4").exists() == (kept != "drop")
    assert (with_body.video is None) == (kept == "drop")
    assert with_body.missing() == {}
    if with_body.video is not None:
        with with_body.open_video() as reader:
            assert (reader.metadata.get("comment") == HEADS_COVERED) == (kept == "blur")
            np.testing.assert_allclose(reader.timebase.times_s, times_s, atol=2e-5)
    np.testing.assert_allclose(with_body.load_mesh().timebase.times_s, times_s, atol=1e-6)
