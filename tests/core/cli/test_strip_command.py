"""``sd2 strip``."""

from __future__ import annotations

import json
from pathlib import Path

from cli_outcome import Sd2
from PIL import Image

from sd2core.recording.recording import Recording


def frames_of(path: Path) -> list[int]:
    return json.loads(Image.open(path).text["Description"])["frames"]


def test_a_mesh_alone(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "strip.png"
    outcome = sd2("strip", plate, "--out", out, "--frames", "0:12:5,11", "--dots")
    assert outcome.code == 0, outcome.err
    assert frames_of(out) == [0, 5, 10, 11]


def test_a_recording_with_its_sensor(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    Recording.create(tmp_path / "plate.sd2", mesh=plate, simulated=True)
    out = tmp_path / "strip.svg"
    outcome = sd2(
        "strip", tmp_path / "plate.sd2", "--out", out, "--count", "3", "--sensor", "1,0,0"
    )
    assert outcome.code == 0, outcome.err
    assert "Mesh (simulated)" in out.read_text()
    assert "[1.0, 0.0, 0.0]" in out.read_text()


def test_what_cannot_be_drawn_is_explained(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "strip.png"
    for arguments, words in (
        ((plate, "--out", tmp_path / "strip.gif"), ".png"),
        ((plate, "--out", out, "--rows", "video"), "no video"),
        ((plate, "--out", out, "--frames", "99"), "frame 99"),
        ((plate, plate, "--out", out), "one of each"),
        ((plate, "--out", plate / "strip.png"), "is a file"),
    ):
        outcome = sd2("strip", *arguments)
        assert outcome.code == 1
        assert words in outcome.err
    assert not out.exists()
