from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_clip import standing, write_clip

from sd2core.body.model import Body
from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.fitting.__main__ import main


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Tool = Callable[..., Outcome]


@pytest.fixture
def fitting(capsys: pytest.CaptureFixture[str]) -> Tool:
    """``fitting("score", path)`` gives exit code and output of ``python -m tools.fitting``."""

    def call(*arguments: object) -> Outcome:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    """One clip, in which the coarse body stands still."""
    body = Body.load("low")
    vertices = np.repeat((body.vertices_m + np.array([0.0, 1.0, 2.5]))[None], 14, axis=0)
    times = Timebase(np.arange(14) / 30.0)
    mesh = MeshSequence(vertices.astype(np.float32), body.faces, times)
    return write_clip(tmp_path / "truth" / "still", mesh, "still").parent


def test_fitted_meshes_are_measured(fitting: Tool, truth: Path, tmp_path: Path) -> None:
    fits = tmp_path / "fits"
    shutil.copytree(truth / "still" / "mesh.zarr", fits / "still.zarr")
    outcome = fitting("score", truth, "--keep", fits, "--markdown", tmp_path / "table.md")
    assert outcome.code == 0
    assert re.search(r"who stands still: .* \| 0\.000 m/s \| ≤ 0\.015 \|", outcome.out)
    assert (tmp_path / "table.md").read_text("utf-8") == outcome.out
    assert (tmp_path / "table.csv").read_text("utf-8").splitlines()[1].startswith("still,still,")


def test_clips_are_fitted_with_what_is_known(
    fitting: Tool, truth: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[list[str]] = []

    def fit(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        asked.append(command)
        from sd2core.io.mesh import load_mesh

        save_mesh(
            load_mesh(truth / "still" / "mesh.zarr"), Path(command[command.index("--out") + 1])
        )
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(subprocess, "run", fit)
    kept = tmp_path / "kept"
    outcome = fitting("score", truth, "--keep", kept)
    assert outcome.code == 0
    assert "who stands still" in outcome.out
    (command,) = asked
    assert command[:4] == [sys.executable, "-m", "sd2core.cli", "fit"]
    assert command[4] == str(truth / "still" / "video.mp4")
    assert command[command.index("--focal-px") + 1] == "600"
    assert command[command.index("--stature-m") + 1] == "1.76"
    assert (kept / "still.zarr").is_dir()
    again = fitting("score", truth, "--keep", kept)
    assert re.search(r"time for a fit \| – s/frame", again.out)
    assert len(asked) == 1


def test_a_fit_that_fails_says_why_and_ends_all(
    truth: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (truth / "still" / "video.mp4").write_text("no video")
    with pytest.raises(SystemExit, match="1"):
        main(["score", str(truth), "--keep", str(tmp_path / "kept")])
    assert "video.mp4" in capfd.readouterr().err


@pytest.mark.slow
def test_real_videos_are_looked_at_too(
    fitting: Tool, truth: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The landmark model's part is played by the mesh itself."""
    from sd2core.body.camera import PinholeCamera
    from sd2core.body.shaping import silhouette
    from sd2core.body.track import LandmarkTrack
    from sd2core.io.video_writing import write_video

    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for name in ("still", "real-walk"):
        shutil.copytree(truth / "still" / "mesh.zarr", meshes / f"{name}.zarr")
    video = tmp_path / "walk.mp4"
    write_video(video, np.zeros((14, 480, 640, 3), np.uint8), 30, (640, 480))
    body = Body.load("low")
    mask = silhouette(body.vertices_m + np.array([0.0, 1.0, 2.5]), body.faces, PinholeCamera())

    def look(reader: Any, models: Any, *, silhouettes: Any, progress_of: Any) -> LandmarkTrack:
        assert silhouettes is None
        none = np.zeros((14, 33), np.float32)
        masks = np.repeat(255 * mask[None].astype(np.uint8), 14, axis=0)
        return LandmarkTrack(
            timebase=reader.timebase,
            width=640,
            height=480,
            image_px=np.zeros((14, 33, 2), np.float32),
            depth_px=none,
            world_m=np.zeros((14, 33, 3), np.float32),
            visibility=none,
            confidence=none[:, 0] + 1,
            present=np.ones(14, bool),
            bridged=np.zeros(14, bool),
            silhouette_frames=np.arange(14),
            silhouettes=masks,
        )

    monkeypatch.setattr("tools.fitting.scoring.landmark_models", lambda: None)
    monkeypatch.setattr("tools.fitting.scoring.find_landmarks", look)
    outcome = fitting("score", truth, "--keep", meshes, "--real", video)
    assert outcome.code == 0
    assert "| real-walk | 1.000 | – |" in outcome.out


def test_tables_in_another_form_are_refused(fitting: Tool, truth: Path, tmp_path: Path) -> None:
    outcome = fitting("score", truth, "--keep", tmp_path / "kept", "--markdown", "table.txt")
    assert outcome.code == 1
    assert "ends in .md" in outcome.err


def test_fits_that_are_missing_are_named(fitting: Tool, tmp_path: Path) -> None:
    write_clip(tmp_path / "truth" / "walk", standing(), "walk")
    (tmp_path / "fits").mkdir()
    folders = tmp_path / "truth", tmp_path / "fits"
    outcome = fitting("errors", *folders, "--out", tmp_path / "e.json")
    assert outcome.code == 1
    assert "no landmarks of the clip 'walk'" in outcome.err
    assert "tools.fitting score" in outcome.err
    assert not (tmp_path / "e.json").exists()
