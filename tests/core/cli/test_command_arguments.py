"""No argument of a command changes unseen."""

from __future__ import annotations

from command_arguments import STORED, listing


def test_every_argument_is_as_it_is_stored() -> None:
    """Where a change is meant: ``python tests/core/cli/command_arguments.py`` stores it."""
    assert listing().splitlines() == STORED.read_text("utf-8").splitlines()
