"""The bundled protocol from its first key to a data set: ten minutes, in real time."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sd2core.datasets.reading import open_dataset
from sd2core.io.video import open_video
from sd2core.live.protocol import PAPER, read_protocol
from sd2core.recording.recording import open_recording

if sys.platform == "win32":
    pytest.skip("keys are typed into a pseudo-terminal", allow_module_level=True)

_KEYS = {"consent": b"y", "ready": b" "}
SD2 = [sys.executable, "-m", "sd2core.cli"]


def _typed_session(folder: Path) -> tuple[list[dict[str, Any]], float]:
    """Run the paper's session at a terminal: each person agrees, Space begins; what it told."""
    import os
    import pty

    ours, terminal = pty.openpty()
    words = ["record", "--camera", "test", "--radar", "test", "--protocol", PAPER, "--json"]
    begin_s = time.monotonic()
    process = subprocess.Popen(
        [*SD2, *words, "--out", str(folder)], stdin=terminal, stdout=subprocess.PIPE, text=True
    )
    os.close(terminal)
    assert process.stdout is not None
    told, lines = [], []
    for line in process.stdout:
        lines.append(line)
        if line.startswith('{"event"'):
            told.append({"at_s": time.monotonic(), **json.loads(line)})
            os.write(ours, _KEYS.get(told[-1].get("phase"), b""))
    process.stdout.close()
    assert process.wait() == 0, "".join(lines[-20:])
    os.close(ours)
    return told, time.monotonic() - begin_s


def _openings_s(told: list[dict[str, Any]]) -> list[float]:
    """How long each take waited for camera and radar."""
    begun_s, waits_s = 0.0, []
    for before, after in pairwise(one for one in told if one["event"] == "step"):
        if after["phase"] == "opening":
            begun_s = after["at_s"]
        elif before["phase"] == "opening":
            waits_s.append(after["at_s"] - begun_s)
    return waits_s


def _made_set(folder: Path, out: Path) -> list[tuple[str, str]]:
    """Person and label of each segment of a data set of a session: one of each take."""
    words = ["export", str(folder), "--segments", "spans", "--span-length", "resampled"]
    subprocess.run([*SD2, *words, "--out", str(out)], check=True, capture_output=True)
    with open_dataset(out) as made:
        people, labels = made.header.subjects, made.header.labels
        assert {made.header.classes[label] for label in labels} > {"horizontal", "vertical"}
        pairs = zip(made["subject"][:].tolist(), made["segment_label"][:].tolist(), strict=True)
        return [(people[person], labels[label]) for person, label in pairs]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_papers_protocol_ends_in_a_data_set_of_its_labels(tmp_path: Path) -> None:
    protocol, folder = read_protocol(PAPER), tmp_path / "session"
    told, seconds = _typed_session(folder)
    stored = [one for one in told if one["event"] == "stored"]
    assert [one["take"] for one in stored] == [take.name for take in protocol.takes]
    assert [one["doubts"] for one in stored] == [[]] * 24
    assert (told[-1]["event"], told[-1]["takes"]) == ("missing", [])

    frames = pictures = 0
    for take in protocol.takes:
        recording = open_recording(folder / f"{take.name}.sd2")
        (span,) = recording.labelled.spans
        assert (span.label, recording.subject) == (take.gesture, take.person)
        capture = recording.load_capture()
        assert capture.frames_missing == 0
        # One frame after the other: times are the radar's, but for a drift that was believed.
        np.testing.assert_allclose(np.diff(capture.timebase.times_s), 1 / 30, rtol=1e-3)
        assert capture.frame_count >= 30 * (protocol.countdown_s + protocol.take_s) - 1
        with open_video(recording.folder / "video.mp4") as video:
            assert len(video) >= 30 * (protocol.countdown_s + protocol.take_s) - 1
            pictures += len(video)
        frames += capture.frame_count

    made = _made_set(folder, tmp_path / "set.npz")
    assert Counter(made) == Counter((take.person, take.gesture) for take in protocol.takes)
    waits_s = _openings_s(told)
    takes_s = 24 * (protocol.countdown_s + protocol.take_s)
    print(f"\n{seconds:.0f} s for {takes_s:g} s of takes; {frames:,} frames, {pictures:,} pictures")
    print(
        f"opening took {waits_s[0]:.2f} s, then {min(waits_s[1:]):.2f} to {max(waits_s[1:]):.2f} s"
    )
