"""Parser of ``sd2`` and its subcommands, which says in one line what was typed wrong."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any, NoReturn

from sd2core.errors import Sd2Error


class UsageError(Sd2Error):
    """A command line that cannot be understood."""


class CommandParser(argparse.ArgumentParser):
    """Parser that raises :class:`UsageError`; argparse makes those of subcommands of its kind."""

    def error(self, message: str) -> NoReturn:
        """Refuse what was typed."""
        raise UsageError(message, remedy=f"`{self.prog} --help` explains it")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Refuse what is left over here, where its command is known."""
        options, left = super().parse_known_args(args, namespace)
        if left:
            name = left[0].partition("=")[0]
            if not name.startswith("-"):
                self.error(f"{name!r} is one argument too many")
            self._refuse(f"There is no option {name}", name, self._option_string_actions, "{}")
        return options, left

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action, argparse._SubParsersAction) and value not in action.choices:
            wording = f"`{self.prog} {{}}`"
            self._refuse(f"There is no command {value!r}", value, action.choices, wording)
        super()._check_value(action, value)

    def _refuse(self, found: str, typed: str, names: Iterable[str], wording: str) -> NoReturn:
        """Refuse a name, and say the one that was meant, if one is like it."""
        from difflib import get_close_matches

        near = get_close_matches(typed, names, 1)
        meant = f"Did you mean {wording.format(near[0])}? " if near else ""
        raise UsageError(found, remedy=f"{meant}`{self.prog} --help` lists all")
