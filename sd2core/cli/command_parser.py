"""Parser of ``sd2`` and its subcommands, which says in one line what was typed wrong."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, TypeVar

from sd2core.errors import Sd2Error

if TYPE_CHECKING:  # records take as long to load as all that `sd2 --help` needs
    from sd2core.cli.output import Report
    from sd2core.options.records import Group, Option, OptionRecord

Record = TypeVar("Record", bound="OptionRecord")
Handler = TypeVar("Handler", bound="Callable[[Any], int | Report | None]")

HELP = ("-h", "--help")

_DECLARED: dict[str, list[Callable[[Subcommands], object]]] = {}
"""What adds the commands of each module."""


class UsageError(Sd2Error):
    """A command line that cannot be understood."""


class Subcommands(argparse._SubParsersAction):
    """Group of a parser to which commands are added.

    Of the commands only the one that is typed here gets its options; where nothing is, all do.
    """

    typed: Sequence[str] = ()

    @property
    def first(self) -> str:
        """The command that is typed here; empty where nothing is."""
        return self.typed[0] if self.typed else ""


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Help as wide as the terminal, which is found without what argparse loads for it."""

    def __init__(self, prog: str) -> None:
        try:
            asked = int(os.environ.get("COLUMNS", "0"))
            columns = asked or os.get_terminal_size().columns
        except (ValueError, OSError):  # no number; no terminal
            columns = 0
        super().__init__(prog, width=(columns or 80) - 2)


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


def subcommands_of(parser: argparse.ArgumentParser, typed: Sequence[str] = ()) -> Subcommands:
    """Make the place for the commands of a parser, of which one may be typed with its words."""
    commands = parser.add_subparsers(
        title="commands", metavar="COMMAND", required=True, action=Subcommands
    )
    assert isinstance(commands, Subcommands)
    commands.typed = typed
    if commands.first.startswith("-") and commands.first not in HELP:
        commands.typed = ()  # an option before the command: which that is, argparse finds
    return commands


def add_options(parser: argparse._ActionsContainer, kind: type[OptionRecord]) -> None:
    """Add the options of a record to a parser, under their headings."""
    from sd2core.options.records import typed_options

    groups: dict[Group | None, argparse._ActionsContainer] = {None: parser}
    exclusive: dict[str, argparse._ActionsContainer] = {}
    for option in typed_options(kind):
        group = option.group
        if group is not None and group not in groups:
            groups[group] = parser.add_argument_group(group.title, group.text)
        holder = groups[group]
        if name := option.place.one_of:
            if name not in exclusive:
                needed = option.place.needed
                exclusive[name] = holder.add_mutually_exclusive_group(required=needed)
            holder = exclusive[name]
        holder.add_argument(*_names(option), **_keywords(option))
        if option.place.endings:
            parser.set_defaults(**{f"{option.name}_endings": option.place.endings})


def _names(option: Option) -> tuple[str, ...]:
    return (option.dest,) if option.place.argument else option.flags


def _keywords(option: Option) -> dict[str, Any]:
    """How argparse wants to know an option; in a section what is not typed is None."""
    from dataclasses import MISSING

    place, required = option.place, option.default is MISSING
    about: dict[str, Any] = {"help": option.words.replace("%", "%%")}
    if not place.argument:
        about["dest"] = option.dest
    default = None if option.section or required else option.default
    if option.kind is bool:
        return about | {"action": "store_true", "default": default}
    about |= {"type": option.read, "metavar": option.called, "default": default}
    about["choices"] = option.choices or None
    if place.many == "again":
        about |= {"action": "append", "default": None}
    elif place.many:
        about["nargs"] = "+" if required or not place.argument else "*"
    elif place.bare is not None:
        about |= {"nargs": "?", "const": place.bare}
    elif place.argument:
        about["nargs"] = None if required else "?"
    if required and not place.argument:
        about["required"] = True
    return about


class AddedCommand:
    """A command of ``sd2`` that another package adds.

    Parameters
    ----------
    options : type of OptionRecord
        Its options; the docstring has a word on each.
    run : callable
        Takes a record of them, and may return an exit code; its docstring is the help.
    """

    def __init__(self, options: type[OptionRecord], run: Callable[[Any], int | None]) -> None:
        from sd2core.options.records import OptionRecord

        if not (isinstance(options, type) and issubclass(options, OptionRecord)):
            raise Sd2Error(f"The options of a command are {options!r}", "an OptionRecord")
        add_options(CommandParser(), options)  # fails here, and not where all are listed
        self.options, self.run = options, run


class Command(NamedTuple):
    """A command, or one of a group of commands."""

    name: str  # as it is typed, without "sd2"
    summary: str
    record: type[OptionRecord]


def commands_of(parser: argparse.ArgumentParser) -> Iterator[Command]:
    """Yield the commands of a parser that have a record, in the order of the help."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for row in action._choices_actions:
                command = action.choices[row.dest]
                record = command.get_default("record")
                if record is not None:
                    name = command.prog.partition(" ")[2]
                    yield Command(name, str(row.help), record)
                yield from commands_of(command)


def record_of(typed: argparse.Namespace) -> Any:
    """Make the record of the command that was typed."""
    if "record" not in typed:
        return typed
    from sd2core.options.records import typed_options

    kind: type[OptionRecord] = typed.record
    values: dict[str, Any] = {}
    for option in typed_options(kind):
        value = getattr(typed, option.dest)
        if option.section:
            section = values.setdefault(option.section, {})
            if value is not None:
                section[option.name] = value
        elif value is not None:
            values[option.name] = tuple(value) if option.place.many else value
    return kind(**values)


def command(
    name: str, options: type[OptionRecord], description: str = ""
) -> Callable[[Handler], Handler]:
    """Declare the command that a function runs, as :func:`add_command` adds it."""

    def declare(handler: Handler) -> Handler:
        def add(commands: Subcommands) -> None:
            add_command(commands, name, options=options, handler=handler, description=description)

        _DECLARED.setdefault(handler.__module__, []).append(add)
        return handler

    return declare


def command_group(name: str) -> Callable[[Handler], Handler]:
    """Declare a group of commands, which a function adds; its docstring is the help."""

    def declare(add_commands: Handler) -> Handler:
        def add(commands: Subcommands) -> None:
            parser = add_command(commands, name, about=add_commands)
            add_commands(subcommands_of(parser, commands.typed[1:]))

        _DECLARED.setdefault(add_commands.__module__, []).append(add)
        return add_commands

    return declare


def add_declared(commands: Subcommands, modules: Mapping[str, str]) -> None:
    """Add commands that modules of ``sd2core.cli`` declare: that which is typed, or else all.

    Parameters
    ----------
    commands : Subcommands
        Where they are added.
    modules : mapping of str to str
        Module of each command; they declare them in the order of the help.
    """
    name = commands.first
    if name in commands.choices:
        return
    for module in (modules[name],) if name in modules else dict.fromkeys(modules.values()):
        for add in _DECLARED[import_module(f"sd2core.cli.{module}").__name__]:
            add(commands)


def in_a_list(sentence: str) -> str:
    """A sentence as a list of commands has it: with a small letter, and no full stop."""
    return f"{sentence[0].lower()}{sentence[1:].removesuffix('.')}"


def add_command(
    commands: Subcommands,
    name: str,
    *,
    options: type[Record] | None = None,
    handler: Callable[[Any], int | Report | None] | None = None,
    about: Callable[..., Any] | None = None,
    description: str = "",
) -> CommandParser:
    """Add a subcommand with its help, and the options of a record, which the handler gets.

    The docstring of the handler, or of ``about``, is the help: a summary, a description, and
    examples from the first line on that begins with ``sd2``.

    Parameters
    ----------
    commands : Subcommands
        Where it is added.
    name : str
        As it is typed.
    options : type of OptionRecord, optional
        Fields become options.
    handler : callable, optional
        Called with the record, or what was typed without one; returns the exit code, None for 0, or
        a report that is printed.
    about : callable, optional
        Its docstring is the help in place of the handler's.
    description : str
        Text below the summary; that of the docstring follows it.
    """
    import inspect

    from sd2core.files.tables import capitalised
    from sd2core.options.shared import ReplacesMaps

    text, *lines = re.split(r"\n+ *(?=sd2 )", inspect.getdoc(about or handler) or f"{name}.")
    examples = "\n".join(f"  {line}" for line in lines)
    summary, _, own = text.partition("\n\n")
    summary = in_a_list(summary)
    description = "\n\n".join(filter(None, (description, own)))
    text = f"{capitalised(summary)}."
    parser: CommandParser = commands.add_parser(
        name,
        help=summary,
        description=f"{text}\n\n{description}".strip(),
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=HelpFormatter,
    )
    if options is not None:
        if commands.first in ("", name):
            add_options(parser, options)
        parser.set_defaults(record=options, writes_map=issubclass(options, ReplacesMaps))
    if handler is not None:
        parser.set_defaults(handler=handler)
    return parser
