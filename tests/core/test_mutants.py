"""Damaged files are read or refused in words; ``make fuzz`` tries many more of them."""

from __future__ import annotations

import pytest

from tests.mutants import TARGETS
from tests.mutants.running import originals, tried

EACH = 5


@pytest.mark.slow
def test_mutants_are_read_or_refused() -> None:
    with originals() as folder:
        tallies = tried([(name, seed) for name in TARGETS for seed in range(EACH)], folder)
    assert [one for tally in tallies.values() for one in tally.failures] == []
    for name, tally in tallies.items():
        assert tally.outcomes["read"] + tally.outcomes["refused"] == EACH, name
    assert sum(tally.outcomes["refused"] for tally in tallies.values()) > EACH * len(tallies) // 2
