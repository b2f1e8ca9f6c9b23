"""Mutants of the code are of lines that are there, and tests that are there."""

from __future__ import annotations

import pytest

from tools.code_mutants import Mutant, mutants
from tools.documentation.measured import REPOSITORY


@pytest.mark.parametrize("mutant", mutants(), ids=lambda one: f"{one.file}: {one.becomes.strip()}")
def test_a_mutant_can_be_made_and_tested(mutant: Mutant) -> None:
    text = (REPOSITORY / mutant.file).read_text("utf-8")
    assert mutant.applied(text) != text
    assert mutant.tests
    assert all((REPOSITORY / name).exists() for name in mutant.tests)


def test_a_line_that_is_not_there_is_no_mutant() -> None:
    mutant = Mutant("a.py", "x = 1", "x = 2", ("tests",))
    assert mutant.applied("x = 1\n") == "x = 2\n"
    with pytest.raises(ValueError, match="holds 0 times"):
        mutant.applied("y = 1\n")
