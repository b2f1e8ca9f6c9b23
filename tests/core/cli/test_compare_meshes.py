from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.body.model import Body


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """The coarse body coming nearer at 0.3 m/s, and the same 2 cm aside."""
    body = Body.load("low")
    times_s = np.arange(8) / 30.0
    vertices = body.vertices_m + np.array([0.0, 1.0, 2.5])
    vertices = vertices - times_s[:, None, None] * np.array([0.0, 0.0, 0.3])
    paths = tmp_path / "ours.npz", tmp_path / "theirs.npz"
    for path, aside_m in zip(paths, (0.0, 0.02), strict=True):
        moved = (vertices + np.array([aside_m, 0.0, 0.0])).astype(np.float32)
        np.savez(path, vertices=moved, faces=body.faces, times_s=times_s)
    return paths


def test_the_table_and_the_figure(sd2: Sd2, pair: tuple[Path, Path], tmp_path: Path) -> None:
    outcome = sd2("compare-meshes", *pair, "--figure", tmp_path / "pair.png")
    assert outcome.code == 0
    (theirs,) = (line for line in outcome.out.splitlines() if line.startswith("theirs"))
    assert theirs.split()[1] == "2.0"
    assert "ours    reference" in outcome.out
    assert (tmp_path / "pair.png").stat().st_size > 10_000


def test_json_with_labels_and_another_reference(sd2: Sd2, pair: tuple[Path, Path]) -> None:
    outcome = sd2(
        "compare-meshes", *pair, "--names", "A,B", "--reference", "B", "--json", "--align", "root"
    )
    found = json.loads(outcome.out)
    assert (found["reference"], found["alignment"], found["frames"]) == ("B", "root", 8)
    first, second = found["meshes"]
    assert (first["label"], second["label"]) == ("A", "B")
    assert max(first["joint_distance_m"]) < 1e-6
    assert second["map_l1"] == 0.0


def test_a_mesh_that_does_not_say_its_rate(
    sd2: Sd2, pair: tuple[Path, Path], tmp_path: Path
) -> None:
    """--fps holds for the surface that is not ours, and leaves ours alone."""
    with np.load(pair[0]) as data:
        vertices, faces = data["vertices"], data["faces"]
    np.savez(tmp_path / "slow.npz", vertices=vertices, faces=faces[::-1])
    outcome = sd2("compare-meshes", pair[0], tmp_path / "slow.npz", "--fps", "20", "--json")
    found = json.loads(outcome.out)
    assert found["frames"] == 8
    assert found["end_s"] == pytest.approx(7 / 30)
    assert max(found["meshes"][1]["velocity_rms_mps"]) == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize(
    ("change", "options"),
    [
        (1000.0, ("--scale", "0.001")),
        (np.array([1.0, -1.0, -1.0]), ("--turn", "x180")),
        (1.0, ("--distance-m", "-0.5")),
    ],
)
def test_what_a_mesh_does_not_say_holds_for_the_one_that_is_not_ours(
    sd2: Sd2,
    pair: tuple[Path, Path],
    tmp_path: Path,
    change: float | np.ndarray,
    options: tuple[str, str],
) -> None:
    """Unit, axes and place are as told, and what the file itself leaves open is said."""
    with np.load(pair[0]) as data:
        vertices, faces = data["vertices"], data["faces"]
    if options[0] == "--distance-m":
        vertices = vertices + np.array([0.0, 0.0, 0.5])
    np.savez(tmp_path / "other.npz", vertices=vertices * change, faces=faces[::-1])
    found = json.loads(
        sd2("compare-meshes", pair[0], tmp_path / "other.npz", *options, "--json").out
    )
    assert max(found["meshes"][1]["joint_distance_m"]) < 1e-4
    assert any(note.startswith("other: The file holds no times") for note in found["notes"])


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (("--names", "one"), "1 name for 2 meshes"),
        (("--names", "one,one"), "one, one"),
        (("--reference", "third"), "'third'"),
        (("--figure", "pair.bmp"), "pair.bmp"),
    ],
)
def test_what_cannot_be_done_is_explained(
    sd2: Sd2, pair: tuple[Path, Path], arguments: tuple[str, ...], found: str
) -> None:
    outcome = sd2("compare-meshes", *pair, *arguments)
    assert outcome.code == 1
    assert found in outcome.err
