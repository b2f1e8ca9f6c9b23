"""Folders above what a command writes are made, and go again where nothing was written."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.batch.folder import BatchFolder
from sd2core.cli import run
from sd2core.cli.output_folders import OUTPUTS
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path

SAMPLE = resource_path("swipes.sd2")
PLATE = Path("plate.npz")
"""Stands for the mesh of a plate, of which costs are soon measured."""


def parser_of(
    handler: Callable[[argparse.Namespace], None], **outputs: Path | None
) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="sd2")
    parser.set_defaults(handler=handler, **outputs)
    return parser


@pytest.mark.parametrize("name", OUTPUTS)
def test_they_are_made_before_the_work(tmp_path: Path, name: str) -> None:
    output = tmp_path / "a" / "b" / "made.txt"
    parser = parser_of(lambda options: getattr(options, name).touch(), **{name: output})
    assert run(parser, []) == 0
    assert output.exists()


@pytest.mark.parametrize("name", OUTPUTS)
def test_what_exists_is_replaced_only_where_it_is_said(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "inside").touch()
    (tmp_path / "file").write_text("mine")
    (tmp_path / "empty").touch()  # as `mktemp` leaves it
    done = []
    for output, overwrite, code in (
        ("folder", False, 1), ("file", False, 1), ("empty", False, 0), ("new", False, 0),
        ("folder", True, 0), ("file", True, 0), ("file", None, 0),
    ):  # fmt: skip
        parser = parser_of(lambda options: done.append(options), **{name: tmp_path / output})
        if overwrite is not None:
            parser.set_defaults(overwrite=overwrite)
        assert run(parser, []) == code, (output, overwrite)
    assert len(done) == 5
    assert (tmp_path / "file").read_text() == "mine"


def test_where_nothing_is_written_none_is_left(tmp_path: Path) -> None:
    def write_one_and_fail(options: argparse.Namespace) -> None:
        assert options.out.parent.is_dir()
        options.figure.touch()
        raise Sd2Error("Something is wrong")

    (tmp_path / "there").mkdir()
    outputs = {
        "out": tmp_path / "a" / "b" / "made.txt",
        "figure": tmp_path / "a" / "c" / "made.png",
        "markdown": tmp_path / "there" / "made.md",
        "landmarks": None,
    }
    assert run(parser_of(write_one_and_fail, **outputs), []) == 1
    assert not (tmp_path / "a" / "b").exists()
    assert (tmp_path / "a" / "c" / "made.png").exists()
    assert (tmp_path / "there").exists()


def test_what_lies_in_a_file_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes").touch()
    parser = parser_of(lambda _: pytest.fail("it worked"), out=tmp_path / "notes" / "b" / "made")
    assert run(parser, []) == 1
    assert "notes is a file" in " ".join(capsys.readouterr().err.split())


def test_a_batch_makes_its_folder_with_those_above(tmp_path: Path) -> None:
    folder = BatchFolder(tmp_path / "results" / "today")
    folder.prepare()
    folder.prepare()  # its own may be there
    assert folder.path.is_dir()
    (tmp_path / "notes").touch()
    with pytest.raises(Sd2Error, match="notes is a file"):
        BatchFolder(tmp_path / "notes" / "today").prepare()


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    "words",
    [
        ("synth", SAMPLE, "--out", "map.npz"),
        ("radar", SAMPLE, "--out", "map.npz"),
        ("import", "--radar", SAMPLE / "radar", "--out", "walk.sd2"),
        ("labels", "convert", SAMPLE, "--out", "walk.eaf"),
        ("labels", "set", SAMPLE, "--export", "set.json"),
        ("labels", "suggest", SAMPLE, "--of", "radar", "--out", "found.json"),
        ("placements", PLATE, "--ranges", "1,2", "--out", "grid.json"),
        ("strip", SAMPLE, "--count", "1", "--rows", "video", "--out", "strip.png"),
        ("export", SAMPLE, "--kinds", "simulated", "--out", "set.npz"),
        ("pairs", "recordings", SAMPLE, "--out", "pairs.zarr"),
    ],
    ids=lambda words: " ".join(word for word in words if isinstance(word, str)),
)
def test_commands_write_into_folders_that_are_not_there_yet(
    sd2: Sd2, plate: Path, tmp_path: Path, words: tuple[object, ...]
) -> None:
    *before, name = (plate if word == PLATE else word for word in words)
    outcome = sd2(*before, tmp_path / "results" / "today" / str(name))
    assert outcome.code == 0, outcome.err
    assert (tmp_path / "results" / "today" / str(name)).exists()
