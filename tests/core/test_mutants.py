"""Damaged files are read or refused in words; ``make fuzz`` tries many more of them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import pytest

from tests.mutants import TARGETS, texts
from tests.mutants.damage import mutate
from tests.mutants.running import originals, outcome_of, tried

EACH = 5
TEXTS = [target.name for target in texts.TARGETS]


@pytest.mark.slow
def test_mutants_are_read_or_refused() -> None:
    with originals() as folder:
        tallies = tried([(name, seed) for name in TARGETS for seed in range(EACH)], folder)
    assert [one for tally in tallies.values() for one in tally.failures] == []
    for name, tally in tallies.items():
        assert tally.outcomes["read"] + tally.outcomes["refused"] == EACH, name
    assert sum(tally.outcomes["refused"] for tally in tallies.values()) > EACH * len(tallies) // 2


def _copies(name: str, folder: Path) -> Iterator[Path]:
    """Copies of an original without end, each in a folder of its own."""
    with originals([name]) as made:
        for number in count():
            copy = folder / str(number) / name
            copy.parent.mkdir()
            whole = made / name
            shutil.copytree(whole, copy) if whole.is_dir() else shutil.copy(whole, copy)
            yield copy


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", TEXTS)
def test_some_mutants_of_texts(tmp_path: Path, name: str) -> None:
    for seed, path in zip(range(6), _copies(name, tmp_path), strict=False):
        how = mutate(path, seed)
        assert (seed, how, outcome_of(name, path))[2] in ("read", "refused")


def _pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def _huge(file: Path) -> None:
    file.write_bytes(b"")
    os.truncate(file, 2 * 10**9)


_IN_FOLDERS = {
    "recording.sd2": ("recording.json", "labels.json"),
    "infineon": ("config.json", "radar_timestamp.csv"),
    "mars": ("kinect_data_test.csv",),
    "run": ("run.json",),
    "batch": ("batch.json",),
}


@pytest.mark.one_in(7)
@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("spoil", [_pipe, _huge])
def test_pipes_and_huge_texts_are_refused_unread(
    tmp_path: Path, name: str, spoil: Callable[[Path], None]
) -> None:
    """A pipe would be waited for without end, and what is huge take all memory."""
    for file, path in zip(_IN_FOLDERS.get(name, ("",)), _copies(name, tmp_path), strict=False):
        spoil(path / file)
        assert outcome_of(name, path) == "refused"
