"""``sd2 listen``: replays and packets into recordings, killed, stopped and continued."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.classify.files import save_classifier
from sd2core.cli import listen
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.radar import load_capture
from sd2core.live.sources import Dca1000Source
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from tests.core.classify.classifiers import classifier
from tests.core.io.radar.dca1000_files import TiRecording, words_of, write_ti
from tests.core.live.fast_captures import assert_same_samples
from tests.core.live.senders import packets_of

TI = TiRecording(frames=10, loops=32, receivers=2)
SWIPES = resource_path("swipes.sd2") / "radar"


def _events(text: str) -> list[dict]:
    return [json.loads(line) for line in text.splitlines()]


def test_a_replay_ends_by_itself_and_says_what_there_is(sd2: Sd2, tmp_path: Path) -> None:
    path = write_ti(tmp_path / "ti", TI)
    outcome = sd2("listen", "--replay", path, "--out", tmp_path / "again.sd2")
    assert outcome.code == 0
    assert re.search(r"recorded +10 frames", outcome.out)
    assert "missing   nothing" in outcome.out
    assert "ms, 95 % within" in outcome.out
    recording = open_recording(tmp_path / "again.sd2")
    assert_same_samples(recording.load_capture(), load_capture(path))
    assert not recording.simulated
    # The capture of a recording, and a second session into the same one.
    outcome = sd2(
        "listen", "--replay", tmp_path / "again.sd2", "--out", tmp_path / "third.sd2", "--json"
    )
    first, *_, last = _events(outcome.out)
    assert (first["event"], first["continued"]) == ("listening", False)
    assert (last["event"], last["recorded"], last["dropped"]) == ("end", 10, 0)
    assert 0 < last["latency_median_s"] <= last["latency_95_s"]
    outcome = sd2("listen", "--replay", path, "--out", tmp_path / "again.sd2")
    assert "(continued)" in outcome.out
    assert recording.load_capture().frame_count == 20


@pytest.mark.slow
def test_a_classifier_is_asked(sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listen, "_LINE_S", 0.2)
    save_classifier(tmp_path / "g.safetensors", classifier())
    command = ("listen", "--replay", SWIPES, "--seconds", 1.0, "--classifier")
    outcome = sd2(*command, tmp_path / "g.safetensors", "--out", tmp_path / "a.sd2", "--json")
    assert outcome.code == 0
    told = [one for one in _events(outcome.out) if one["event"] == "frames"]
    assert {one["label"] for one in told} <= {"background", "horizontal", "vertical"}
    assert all(-200 < one["level_db"] < 0 and 0 < one["probability"] <= 1 for one in told)
    assert open_recording(tmp_path / "a.sd2").simulated
    outcome = sd2(*command, tmp_path / "g.safetensors", "--out", tmp_path / "b.sd2")
    assert any(f"  {name} " in outcome.out for name in ("background", "horizontal", "vertical"))
    assert "level" in outcome.out


def test_a_dca1000_is_listened_to(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_ti(tmp_path / "ti", TI)
    packets = packets_of(words_of(TI, TI.beat()).tobytes())
    ports: queue.Queue[int] = queue.Queue()
    run = Dca1000Source.run

    def told(source: Dca1000Source, *arguments: Any) -> None:
        ports.put(source.port)
        run(source, *arguments)

    monkeypatch.setattr(Dca1000Source, "run", told)

    def send() -> None:
        port = ports.get()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for one in (*packets, b"none of a card"[:9]):
                sender.sendto(one, ("127.0.0.1", port))
                time.sleep(0.002)
        ports.put(port)

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    setup = path.with_suffix(".cfg")
    out = tmp_path / "walk.sd2"
    outcome = sd2("listen", "--dca1000", ":0", "--setup", setup, "--out", out, "--seconds", 1.2)
    thread.join()
    assert outcome.code == 0
    assert f"from a DCA1000 to 127.0.0.1:{ports.get()}" in outcome.out
    assert re.search(r"recorded +10 frames", outcome.out)
    assert "none of a DCA1000, or do not fit the others: 1." in outcome.err
    assert_same_samples(open_recording(out).load_capture(), load_capture(path))


def test_silence_is_explained_and_leaves_nothing(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listen, "_SILENT_S", 0.1)
    setup = write_ti(tmp_path / "ti", TI).with_suffix(".cfg")
    command = ("listen", "--dca1000", ":0", "--setup", setup, "--out", tmp_path / "walk.sd2")
    outcome = sd2(*command, "--seconds", 0.4)
    assert outcome.code == 0
    assert outcome.err.count("Nothing comes to 127.0.0.1") == 1
    assert "192.168.33.30" in outcome.err
    assert "nothing was written" in outcome.out
    assert not (tmp_path / "walk.sd2").exists()


def test_what_does_not_go_together_is_refused(sd2: Sd2, tmp_path: Path) -> None:
    setup = write_ti(tmp_path / "ti", TI).with_suffix(".cfg")
    out = ("--out", tmp_path / "walk.sd2")
    for arguments, words in (
        (("--dca1000", *out), "without --setup"),
        (("--replay", SWIPES, "--setup", setup, *out), "--setup with --dca1000 or --radar"),
        (("--dca1000", "127.0.0.1:x", "--setup", setup, *out), "The port is 'x'"),
        (("--dca1000", "--setup", tmp_path / "none.cfg", *out), "does not exist"),
        (("--replay", tmp_path / "none", *out), "does not exist"),
        (("--replay", SWIPES, "--out", SWIPES.parent), "no radar was recorded into it"),
    ):
        outcome = sd2("listen", *arguments)
        assert outcome.code == 1
        assert words in outcome.err
    assert sd2("listen", *out).code == 2
    recording = Recording.create(tmp_path / "own.sd2", radar=SWIPES)
    assert sd2("listen", "--replay", SWIPES, "--out", recording.folder).code == 1


def _started(out: Path, **options: object) -> subprocess.Popen:
    """A replay of 15 s in a process of its own, once it has recorded some frames."""
    command = [sys.executable, "-m", "sd2core.cli", "listen", "--replay", str(SWIPES)]
    before = _frames(out)
    process = subprocess.Popen([*command, "--out", str(out)], text=True, **options)  # type: ignore[call-overload]
    until_s = time.monotonic() + 30.0
    while _frames(out) < before + 12:
        assert process.poll() is None
        assert time.monotonic() < until_s
        time.sleep(0.02)
    return process


def _frames(out: Path) -> int:
    there = (out / "recording.json").exists()
    return open_recording(out).load_capture().frame_count if there else 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_killed_continued_and_interrupted(tmp_path: Path) -> None:
    out = tmp_path / "walk.sd2"
    process = _started(out)
    process.send_signal(signal.SIGKILL)
    process.wait()
    expected = load_capture(SWIPES)
    found = open_recording(out).load_capture()
    killed_at = found.frame_count
    np.testing.assert_array_equal(found.read(0, killed_at), expected.read(0, killed_at))
    process = _started(out, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.send_signal(signal.SIGINT)
    text, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (0, "")
    assert "(continued)" in text
    found = open_recording(out).load_capture()
    again = found.frame_count - killed_at
    assert re.search(rf"recorded +{again} frames", text)
    np.testing.assert_array_equal(found.read(killed_at, found.frame_count), expected.read(0, again))
    steps_s = np.diff(found.timebase.times_s)
    assert steps_s.argmax() == killed_at - 1  # the pause is a gap
    assert "continued once" in " ".join(found.notes)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_q_stops_on_a_terminal(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    try:
        process = _started(tmp_path / "walk.sd2", stdin=theirs, stdout=theirs, stderr=theirs)
        time.sleep(0.3)
        os.write(ours, b"q")
        assert process.wait(timeout=20) == 0
        shown = os.read(ours, 1 << 16).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert "Ctrl-C or q stops" in shown
    assert "\r " in shown
    assert "▁" in shown or "█" in shown
    assert "recorded" in shown


def test_columns_are_those_of_the_map(sd2: Sd2, tmp_path: Path) -> None:
    path = write_ti(tmp_path / "ti", TI)
    out = tmp_path / "walk.sd2"
    told = []
    for _ in range(2):
        outcome = sd2("listen", "--replay", path, "--out", out, "--json", "--columns")
        first, *rest = _events(outcome.out)
        assert (first["bins"], first["v_max_mps"]) == (32, 2.0)
        told += [one for one in rest if one["event"] == "column"]
    capture = open_recording(out).load_capture()
    expected = doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER)
    found = np.array([one["values"] for one in told], np.float32).T
    np.testing.assert_array_equal(found, expected.values)
    # Times are those of the recording, also of what was continued.
    assert [one["time_s"] for one in told] == expected.times_s.tolist()
    assert [one["recorded"] for one in told][-1] in (9, 10)  # it may be about to be stored
    assert all(one["received_unix_s"] <= time.time() for one in told)
    outcome = sd2("listen", "--replay", path, "--out", out, "--columns")
    assert (outcome.code, "without --json" in outcome.err) == (1, True)


def _stopped(process: subprocess.Popen, out: Path) -> None:
    """A process has stored what it received, and said so."""
    text, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (0, "")
    assert re.search(rf"recorded +{_frames(out)} frames", text)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM")
def test_a_request_to_end_stores_what_was_received(tmp_path: Path) -> None:
    out = tmp_path / "walk.sd2"
    process = _started(out, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.terminate()
    _stopped(process, out)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no keys by a pipe")
def test_a_program_presses_q(tmp_path: Path) -> None:
    out, pipe = tmp_path / "walk.sd2", subprocess.PIPE
    process = _started(out, stdin=pipe, stdout=pipe, stderr=pipe)
    assert process.stdin is not None
    process.stdin.write("q")
    process.stdin.flush()
    _stopped(process, out)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no keys by a pipe")
def test_nobody_to_press_keys_is_no_reason_to_stop(tmp_path: Path) -> None:
    out, pipe = tmp_path / "walk.sd2", subprocess.PIPE
    process = _started(out, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe)
    frames = _frames(out)
    time.sleep(0.3)
    assert process.poll() is None
    process.terminate()
    _stopped(process, out)
    assert _frames(out) > frames
