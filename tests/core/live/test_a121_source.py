"""Acconeer's A121: its tool's simulated client, and tools that are not there or fail."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io.radar import load_capture
from sd2core.live import a121_client
from sd2core.live.a121 import PYTHON, A121Source
from sd2core.live.sources import Frame

HAS_TOOL = not subprocess.run(
    [os.environ.get(PYTHON, sys.executable), "-c", "import acconeer.exptool"], capture_output=True
).returncode
POINTS = [{"start_point": 200, "num_points": 30, "step_length": 24, "profile": "PROFILE_3"}]


@pytest.mark.skipif(not HAS_TOOL, reason=f"acconeer-exptool is not in the Python of {PYTHON}")
def test_the_tools_simulated_client(tmp_path: Path) -> None:
    session = tmp_path / "session.json"
    sensor = {"sweeps_per_frame": 16, "sweep_rate": 2000.0, "frame_rate": 20.0, "subsweeps": POINTS}
    session.write_text(json.dumps({"groups": [{"1": sensor}]}))
    out = tmp_path / "take.sd2"
    command = [sys.executable, "-m", "sd2core.cli", "listen", "--radar", "a121:mock"]
    words = ["--setup", str(session), "--out", str(out), "--seconds", "2", "--json"]
    done = subprocess.run([*command, *words], capture_output=True, text=True, check=True)
    (end,) = (one for one in map(json.loads, done.stdout.splitlines()) if one["event"] == "end")
    assert 30 <= end["recorded"] <= 50
    capture = load_capture(out / "radar")
    assert capture.config.ranges_m[0] == pytest.approx(0.5)
    assert capture.config.v_max_mps == pytest.approx(0.00495 / 4 * 2000, rel=0.01)
    # The simulated reflector is 0.5 m away, of 10,000 counts.
    first = np.abs(capture.read(0, 1)[0, 0])
    assert first.mean(axis=0).argmax() == 0
    assert first[:, 0].mean() * 32768 == pytest.approx(10_000, rel=0.05)


def source_by(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> A121Source:
    """Source whose process is a program of this text."""
    program = tmp_path / "client.py"
    program.write_text(text)
    monkeypatch.setenv(PYTHON, sys.executable)
    monkeypatch.setattr(a121_client, "__file__", str(program))
    return A121Source()


ABOUT = {"ranges_m": [0.5, 0.6], "profiles": [3], "sweeps": 2, "sweep_s": 1e-3, "frame_rate_hz": 50}
FRAMES = f"""
import json, struct, sys
sys.stdin.readline()
out = sys.stdout.buffer
out.write(json.dumps({ABOUT!r}).encode() + b"\\n")
for k in range(3):
    out.write(struct.pack("<B?dd", 0, k == 1, 5 + 0.02 * k, 100.0 + k))
    out.write(struct.pack("<8h", *range(8 * k, 8 * k + 8)))
out.flush()
"""


def received(source: A121Source, frames: list[Frame]) -> None:
    try:
        source.run(frames.append, threading.Event())
    finally:
        source.close()


def test_frames_are_as_they_were_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames: list[Frame] = []
    wait = FRAMES + "sys.stdin.read()"
    source = source_by(wait, tmp_path, monkeypatch)
    stop = threading.Event()
    source.run(lambda one: (frames.append(one), len(frames) == 3 and stop.set()), stop)
    source.close()
    assert [one.time_s for one in frames] == pytest.approx([0.0, 0.02, 0.04])
    assert [one.received_s for one in frames] == [100.0, 101.0, 102.0]
    words = source.words(frames[2])
    assert words.shape == source.head(0.0).frame_shape == (1, 2, 2, 2)
    assert words.ravel().tolist() == list(range(16, 24))
    assert "saturated in 1 frames" in source.doubts(at_end=True)[0]
    assert source.delay_s == pytest.approx(1e-3)


def test_a_tool_that_ends_or_fails_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames: list[Frame] = []
    with pytest.raises(Sd2Error, match="The exploration tool has ended"):
        received(source_by(FRAMES, tmp_path, monkeypatch), frames)
    failing = FRAMES + (
        'out.write(struct.pack("<B?dd", 1, False, 0, 0) + b\'{"failed": "unplugged"}\\n\')'
    )
    with pytest.raises(Sd2Error, match="cannot measure \\(unplugged\\)"):
        received(source_by(failing, tmp_path, monkeypatch), frames)
    assert len(frames) == 6
    with pytest.raises(Sd2Error, match="it ended at once"):
        source_by("", tmp_path, monkeypatch)


def test_without_the_tool_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    if HAS_TOOL and PYTHON not in os.environ:
        pytest.skip("the tool is in this environment")
    monkeypatch.setenv(PYTHON, sys.executable)
    with pytest.raises(Sd2Error, match=r"No module named 'acconeer'.*Install acconeer-exptool"):
        A121Source()
