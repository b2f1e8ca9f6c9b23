"""Keys are the same everywhere, and different where anything is."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import Inspection, MeshInput, Origin
from sd2core.batch.plan import STEPS
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.task_graph import TaskGraph
from sd2core.files import keys
from sd2core.files.digests import file_digest
from sd2core.files.keys import all_code_digest, code_digest, key_of
from sd2core.sensor import VirtualSensor

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip
contents = st.dictionaries(st.text(max_size=4), values, max_size=4)


def _turned(value: Any) -> Any:
    """The same with the keys of all tables in the opposite order."""
    if isinstance(value, dict):
        return {key: _turned(value[key]) for key in reversed(value)}
    if isinstance(value, list):
        return [_turned(one) for one in value]
    return value


@given(contents)
def test_the_order_of_keys_does_not_matter_and_json_changes_nothing(content: Any) -> None:
    key = key_of("synthesise", content)
    assert len(key) == 32
    assert key_of("synthesise", _turned(content)) == key
    assert key_of("synthesise", json.loads(json.dumps(content))) == key


@pytest.mark.slow
@given(contents, contents)
def test_different_contents_have_different_keys(one: Any, other: Any) -> None:
    same = json.dumps(one, sort_keys=True) == json.dumps(other, sort_keys=True)
    assert (key_of("denoise", one) == key_of("denoise", other)) == same


def test_keys_are_those_of_another_process() -> None:
    content = {"b": [0.1, 1e-300, "ä"], "a": {"y": None, "x": True}}
    code = (
        "import json, sys\n"
        "from sd2core.files.keys import key_of\n"
        "print(key_of('fit', json.loads(sys.argv[1])))"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, json.dumps(content)],
        capture_output=True,
        check=True,
        text=True,
    )
    assert told.stdout.strip() == key_of("fit", content)


@pytest.mark.parametrize("more", ["limbs = true", 'left_out = ["walls"]', "vertices_kept = 0.5"])
def test_maps_that_are_asked_for_otherwise_have_other_keys(more: str, tmp_path: Path) -> None:
    mesh = MeshInput("anna.npz", "its content", 10, 6, (0.0, 0.0, 2.0))

    def key(words: str) -> str:
        text = f'out = "made"\n[recordings]\nfiles = ["*.npz"]\n[synthesise]\n{words}\n'
        graph = TaskGraph(plan_from_text(text, tmp_path), BatchFolder(tmp_path), [])
        found = Inspection(VirtualSensor(), mesh)
        (planned,) = graph.maps_of(Origin("anna.npz", "anna", "anna"), found, mesh)
        return planned.synthesis.key

    assert key(more) != key("")


def test_every_step_has_code_of_its_own() -> None:
    digests = {code_digest(step) for step in STEPS}
    assert len(digests) == len(STEPS)
    assert all_code_digest() not in digests


@pytest.mark.parametrize(
    ("step", "source"),
    [
        ("fit", "body/solve.py"),
        ("inspect", "timebase.py"),  # rates of frames
        ("synthesise", "maps.py"),
        ("export", "fmcw/chain.py"),  # of a real radar's map, which is in data sets
        ("export", "mocap/recording_pairs.py"),
    ],
)
def test_changed_code_makes_results_anew(step: Any, source: str, tmp_path, monkeypatch) -> None:
    copy = tmp_path / "sd2core"
    package = Path(keys.__file__).parent.parent
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(keys, "__file__", str(copy / "files" / "keys.py"))
    unkept = code_digest.__wrapped__
    assert unkept(step) == code_digest(step)
    with (copy / source).open("a") as stream:
        stream.write("\nX = 1\n")
    assert unkept(step) != code_digest(step)
    assert unkept("denoise") == code_digest("denoise") or source == "maps.py"


@given(st.binary(max_size=50), st.binary(max_size=50))
def test_digests_are_of_the_content(tmp_path_factory: Any, one: bytes, other: bytes) -> None:
    folder: Path = tmp_path_factory.mktemp("files")
    (folder / "a").write_bytes(one)
    (folder / "b").write_bytes(other)
    assert (file_digest(folder / "a") == file_digest(folder / "b")) == (one == other)


def test_digests_of_folders_are_of_names_and_contents(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name / "c").mkdir(parents=True)
        (tmp_path / name / "c" / "0").write_bytes(b"abc")
    first = file_digest(tmp_path / "one")
    assert file_digest(tmp_path / "other") == first
    (tmp_path / "other" / "c" / "0").rename(tmp_path / "other" / "c" / "1")
    assert file_digest(tmp_path / "other") != first
