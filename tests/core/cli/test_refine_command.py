"""``sd2 refine``."""

from __future__ import annotations

import json
from pathlib import Path

import joblib
import numpy as np
import pytest
from cli_outcome import Sd2
from numbered_videos import write_video

from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh


def jittering(path: Path, frames: int = 30) -> Path:
    generator = np.random.default_rng(0)
    rest = generator.uniform(-0.5, 0.5, (40, 3)) + np.array([0.0, 0.0, 3.0])
    vertices = rest + generator.normal(0, 0.01, (frames, 1, 3))
    np.savez(path, vertices=vertices.astype(np.float32), fps=25.0)
    return path


def test_a_mesh_is_written_smooth_and_with_its_uncertainty(sd2: Sd2, tmp_path: Path) -> None:
    given, out = jittering(tmp_path / "given.npz"), tmp_path / "smooth.zarr"
    outcome = sd2("refine", given, "--out", out, "--json")
    assert outcome.code == 0, outcome.err
    said = json.loads(outcome.out)
    assert said["frames"] == 30
    assert 0 < said["velocity_sigma"]["along_mps"] < 0.2
    smooth = load_mesh(out)
    assert smooth.uncertainty is not None
    assert smooth.timebase.frames_per_s == pytest.approx(25)

    def speed(path: Path) -> float:
        return float(np.abs(np.diff(load_mesh(path).read(0, 30), axis=0)).mean())

    assert speed(out) < 0.3 * speed(given)
    assert sd2("refine", given, "--out", out).code == 1  # it exists
    assert sd2("refine", given, "--out", out, "--overwrite").code == 0
    again = sd2("refine", out, "--out", tmp_path / "twice.npz")
    assert again.code == 1
    assert "smooth already" in again.err


def test_the_video_says_size_and_rate(sd2: Sd2, tmp_path: Path) -> None:
    video = resource_path("swipes.sd2") / "video.mp4"
    generator = np.random.default_rng(0)
    content = {
        "verts": generator.uniform(-0.4, 0.4, (1, 50, 3)) + np.zeros((12, 1, 1)),
        "pred_cam": np.tile([1.0, 0.0, 0.0], (12, 1)),
        "bboxes": np.tile([300.0, 200.0, 250.0, 250.0], (12, 1)),
        "frame_ids": np.arange(12),
    }
    joblib.dump({1: content}, tmp_path / "vibe_output.pkl")
    out = tmp_path / "smooth.npz"
    outcome = sd2("refine", tmp_path / "vibe_output.pkl", "--video", video, "--out", out)
    assert outcome.code == 0, outcome.err
    assert "weak-perspective camera" in outcome.out
    assert load_mesh(out).frame(0)[:, 2].mean() > 1.0


def test_the_video_times_only_a_mesh_that_has_no_times(sd2: Sd2, tmp_path: Path) -> None:
    """Of uneven frames each stays at its own time, the file's before the video's."""
    times_ms = np.cumsum(np.random.default_rng(1).choice([33, 71], 40))
    video = write_video(tmp_path / "uneven.mkv", 40, times_ms=times_ms.tolist())
    given, out = jittering(tmp_path / "given.npz", 40), tmp_path / "smooth.npz"
    vertices, own_s = np.load(given)["vertices"], np.arange(40) / 25.0
    of_the_video_s = (times_ms - times_ms[0]) / 1000.0
    for content, times_s in (({"times_s": own_s}, own_s), ({}, of_the_video_s)):
        np.savez(given, vertices=vertices, **content)
        outcome = sd2("refine", given, "--video", video, "--out", out, "--overwrite")
        assert outcome.code == 0, outcome.err
        assert load_mesh(out).times_s == pytest.approx(times_s)
