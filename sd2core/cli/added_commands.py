"""Commands of ``sd2`` that other packages add."""

from __future__ import annotations

import argparse

from sd2core.cli.command_names import COMMANDS, WINDOW_COMMANDS
from sd2core.cli.command_parser import AddedCommand, Subcommands, add_command
from sd2core.errors import Sd2Error
from sd2core.options.records import OptionRecord
from sd2core.plug_ins import Group, PlugIn

COMMAND_PLUG_INS = Group("commands", AddedCommand, (*COMMANDS, *WINDOW_COMMANDS))
"""Commands of other packages."""


def add_usable(commands: Subcommands) -> None:
    """Add those that can be used; `sd2 doctor` names the others."""
    for usable, added in COMMAND_PLUG_INS.loaded():
        if isinstance(added, AddedCommand):
            _add(commands, usable, added)


def add_named(commands: Subcommands, name: str) -> bool:
    """Add the command that is typed, if there is one: false otherwise.

    One that cannot be used says why, whatever follows it.
    """
    plug_in = COMMAND_PLUG_INS.find(name)
    if plug_in is None:
        return False
    try:
        _add(commands, plug_in, plug_in.load())
    except Sd2Error as error:
        refusal = error

        def refuse(options: argparse.Namespace) -> int:
            raise refusal

        # No word that follows begins with this, so that none is an option.
        refused = commands.add_parser(plug_in.name, prefix_chars="\0", add_help=False)
        refused.add_argument("words", nargs="*")
        refused.set_defaults(handler=refuse)
    return True


def _add(commands: Subcommands, plug_in: PlugIn[AddedCommand], command: AddedCommand) -> None:
    def handler(options: OptionRecord) -> int | None:
        return plug_in.use(lambda made: made.run(options), int | None)

    add_command(commands, plug_in.name, options=command.options, handler=handler, about=command.run)
