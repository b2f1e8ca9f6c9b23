"""A fitted mesh has one map, whichever command makes it, and one that is counted plainly."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2
from swinging_recordings import FRAMES, recording

from sd2core.batch import run as batch_run
from sd2core.batch.folder import BatchFolder
from sd2core.datasets.reading import open_dataset
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.pairs.store import read_pairs
from tests.core.batch.pools import in_this_process

PLAN = """
out = "made"
[recordings]
files = ["anna.sd2"]
[synthesise]
"""


@pytest.fixture(autouse=True)
def batches_here(monkeypatch: pytest.MonkeyPatch, without_sheet: None) -> None:
    """Have batches work in this process; ``test_batch_command.py`` has them start their own."""
    monkeypatch.setattr(batch_run, "opened_pool", lambda folder, *_: in_this_process(folder.path))


@pytest.fixture
def fitted(tmp_path: Path) -> Path:
    """A recording of which the mesh says that its velocity is known to ±0.2 m/s."""
    folder = recording(tmp_path / "anna.sd2").folder
    mesh, sigma = load_mesh(folder / "mesh.npz"), np.full((FRAMES, 1), 0.2)
    known = VelocityUncertainty(("all",), np.zeros(mesh.vertex_count, int), sigma, sigma)
    save_mesh(replace(mesh, uncertainty=known), folder / "mesh.npz")
    return folder


@pytest.mark.parametrize("count", [None, "plain"])
def test_every_command_makes_the_same_map(
    sd2: Sd2, fitted: Path, tmp_path: Path, count: str | None
) -> None:
    wish = () if count is None else ("--count", count)
    assert sd2("synth", fitted, "--out", tmp_path / "map.npz", *wish).code == 0
    made = DopplerMap.load(tmp_path / "map.npz")
    assert made.meta["count"] == (count or "expected")
    _made_elsewhere(sd2, fitted, tmp_path, made, count)


@pytest.mark.slow
def test_everywhere_the_same_things_stand_before_it(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    """A screen from x = 0.1 m on hides a corner of the octahedron."""
    assert sd2("synth", fitted, "--out", tmp_path / "free.npz").code == 0
    corner = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n"
    (tmp_path / "wall.obj").write_text(corner)
    assert sd2("set", fitted, "--thing", f"{tmp_path / 'wall.obj'}@1.1,1,1").code == 0
    assert sd2("synth", fitted, "--out", tmp_path / "map.npz").code == 0
    free, made = (DopplerMap.load(tmp_path / name) for name in ("free.npz", "map.npz"))
    hidden = 1 - np.divide(made.meta["visible_share"], free.meta["visible_share"])
    np.testing.assert_allclose(hidden, 1 / 5, atol=1e-4)
    _made_elsewhere(sd2, fitted, tmp_path, made)
    # What a batch keeps is of the file as it was: now the screen begins beside the line of sight.
    (tmp_path / "wall.obj").write_text(corner.replace("v 2", "v 1.7"))
    assert sd2("synth", fitted, "--out", tmp_path / "narrow.npz").code == 0
    narrow = DopplerMap.load(tmp_path / "narrow.npz")
    np.testing.assert_array_equal(narrow.values, free.values)
    _made_by_a_batch(sd2, tmp_path, narrow)


@pytest.mark.slow
def test_everywhere_the_same_people_are_in_it(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    """Somebody beside who does the same counts as much, but for the law of range."""
    assert sd2("synth", fitted, "--out", tmp_path / "alone.npz").code == 0
    mesh_file = Path(shutil.copy2(fitted / "mesh.npz", tmp_path / "other.npz"))
    assert sd2("set", fitted, "--body", f"anna={mesh_file}@1.2,0,0").code == 0
    assert sd2("synth", fitted, "--out", tmp_path / "map.npz").code == 0
    alone, made = (DopplerMap.load(tmp_path / name) for name in ("alone.npz", "map.npz"))
    assert [body["person"] for body in made.meta["bodies"]][1:] == ["anna"]
    assert made.values.sum() > 1.1 * alone.values.sum()
    _made_elsewhere(sd2, fitted, tmp_path, made)
    # What a batch keeps is of the file as it was.
    mesh_file.unlink()
    assert sd2("set", fitted, "--without", "bodies").code == 0
    _made_by_a_batch(sd2, tmp_path, alone)


def _made_elsewhere(
    sd2: Sd2, fitted: Path, tmp_path: Path, made: DopplerMap, count: str | None = None
) -> None:
    """Pairs, data set and batch hold a map that ``sd2 synth`` made."""
    wish = () if count is None else ("--count", count)
    said = sd2("pairs", "recordings", fitted, "--out", tmp_path / "pairs.zarr", *wish)
    assert said.code == 0, said.err
    pairs = read_pairs(tmp_path / "pairs.zarr")
    np.testing.assert_array_equal(pairs.takes[0].synthetic, made.values.T)
    assert pairs.provenance["synthesis"]["count"] == made.meta["count"]

    cut = "--segment-frames", FRAMES, "--overlap-frames", 0, "--kinds", "synthetic"
    said = sd2("export", fitted, "--out", tmp_path / "set.zarr", *cut, *wish)
    assert said.code == 0, said.err
    with open_dataset(tmp_path / "set.zarr") as dataset:
        np.testing.assert_array_equal(dataset["synthetic"][0].T, made.values)
    card = (tmp_path / "set.card.md").read_text("utf-8")
    assert f"counted from a mesh: {made.meta['count']}, visibility exact" in card
    assert f"off the truth by {made.accuracy} (relative L1)" in card

    _made_by_a_batch(sd2, tmp_path, made, count)


def _made_by_a_batch(sd2: Sd2, tmp_path: Path, made: DopplerMap, count: str | None = None) -> None:
    words = "" if count is None else f'count = "{count}"\n'
    (tmp_path / "plan.toml").write_text(PLAN + words)
    said = sd2("batch", tmp_path / "plan.toml", "--workers", 1)
    assert said.code == 0, said.err
    row = json.loads(BatchFolder(tmp_path / "made").results.read_text())
    batched = DopplerMap.load(tmp_path / "made" / row["synthetic"])
    np.testing.assert_array_equal(batched.values, made.values)
    assert batched.accuracy == made.accuracy
