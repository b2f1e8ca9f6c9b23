"""A command."""

from sd2core.cli.command_parser import AddedCommand
from sd2core.options.records import OptionRecord

SD2_PLUGIN_API = 1


class Greet(OptionRecord):
    """Options of the command.

    Parameters
    ----------
    name : NAME
        who is greeted
    """

    name: str = "world"


def greet(options: Greet) -> None:
    """Greet somebody."""
    print(f"Hello, {options.name}.")


GREET = AddedCommand(Greet, greet)
