"""Damaged files are read or refused in words; ``make fuzz`` tries many more of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.mutants import TARGETS
from tests.mutants.running import originals, tried


@pytest.fixture(scope="module")
def files() -> Iterator[Path]:
    with originals() as folder:
        yield folder


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_mutants_are_read_or_refused(files: Path, name: str) -> None:
    tally = tried(name, range(40), files)
    assert not tally.failures
    assert tally.outcomes["read"] + tally.outcomes["refused"] == 40
    assert tally.outcomes["refused"] > 10
