"""Parser of ``sd2`` and its subcommands, which says in one line what was typed wrong."""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, TypeVar

from sd2core.cli.options import (
    add_json,
    finite_float,
    image_size,
    name_list,
    position,
    positive_float,
    positive_int,
)
from sd2core.errors import Sd2Error
from sd2core.files.figure_files import SUFFIXES as FIGURES
from sd2core.options.records import Group, Option, OptionRecord, typed_options
from sd2core.options.shared import ReplacesMaps

Record = TypeVar("Record", bound=OptionRecord)


class UsageError(Sd2Error):
    """A command line that cannot be understood."""


class Options(argparse._ActionsContainer):
    """What options are added to: a command's parser, or a group of its options."""

    def add_argument_group(self, *args: Any, **kwargs: Any) -> OptionGroup:
        """Add options under a heading of their own."""
        group = OptionGroup(self, *args, **kwargs)
        self._action_groups.append(group)
        return group

    def add_mutually_exclusive_group(self, *, required: bool = False) -> ExclusiveOptions:
        """Add options of which one may be given."""
        group = ExclusiveOptions(self, required=required)
        self._mutually_exclusive_groups.append(group)
        return group

    def add_value(
        self,
        name: str,
        kind: Callable[[str], Any],
        metavar: str,
        text: str,
        default: Any = None,
        **more: Any,
    ) -> None:
        """Add an option or an argument with a value.

        A number as default is said after the text, unless the text speaks of a default. ``more``
        is for argparse.
        """
        if isinstance(default, int | float) and "(default" not in text:
            text = f"{text} (default: {default:g})"
        self.add_argument(name, type=kind, metavar=metavar, default=default, help=text, **more)

    def add_choice(
        self, name: str, choices: Iterable[Any], text: str, default: str | None = None
    ) -> None:
        """Add an option with one of some values; a default is said as by :meth:`add_value`."""
        if default is not None and "default)" not in text:
            text = f"{text} (default: {default})"
        self.add_argument(name, choices=choices, default=default, help=text)

    def add_flag(self, name: str, text: str) -> None:
        """Add an option without a value."""
        self.add_argument(name, action="store_true", help=text)

    def add_json(self) -> None:
        """Add ``--json``."""
        add_json(self)

    def add_json_and_progress(self) -> None:
        """Add ``--json`` and ``--progress-json``, of which one may be given."""
        group = self.add_mutually_exclusive_group()
        group.add_json()
        group.add_flag(
            "--progress-json", "print progress as JSON lines, for other programs (docs/formats.md)"
        )

    def add_axis(self) -> None:
        """Add the velocity axis."""
        self.add_value("--bins", positive_int, "N", "velocity bins (default: 32)")
        text = "end of the velocity axis in m/s (default: 2)"
        self.add_value("--v-max", positive_float, "MPS", text, dest="v_max_mps")

    def add_mesh_and_sensor(self) -> None:
        """Add what is looked at, and from where."""
        self.add_value("mesh", Path, "MESH", "a mesh, or a recording")
        self.add_sensor()

    def add_output(
        self,
        metavar: str,
        text: str,
        *endings: str,
        required: bool = True,
        goes_on: bool = False,
    ) -> None:
        """Add ``--out``, and ``--overwrite`` unless the command goes on with what is there."""
        self.add_file("--out", metavar, text, *endings, required=required)
        if not goes_on:
            self.add_overwrite()

    def add_file(
        self, name: str, metavar: str, text: str, *endings: str, required: bool = False
    ) -> None:
        """Add a file to write.

        That it can be, and that its name has one of the endings, is seen to before the command
        begins (:func:`~sd2core.cli.output_folders.output_folders`).
        """
        file = self.add_argument(name, type=Path, required=required, metavar=metavar, help=text)
        self.set_defaults(**{f"{file.dest}_endings": endings})

    def add_figure_output(self, drawn: str) -> None:
        """Add ``--figure``."""
        text = f"draw {drawn}, as .png, .svg or .pdf"
        self.add_file("--figure", "FILE", text, *FIGURES)
        self.add_overwrite()

    def add_overwrite(self) -> None:
        """Add ``--overwrite``, without which outputs that exist are refused."""
        if "--overwrite" not in self._option_string_actions:
            text = "replace outputs that exist"
            # It was called --replace where labels are written.
            self.add_argument("--overwrite", "--replace", action="store_true", help=text)

    def add_map_output(self, *, required: bool = True) -> None:
        """Add ``--out`` for a Doppler map, which replaces nothing but another one."""
        self.add_output("FILE.npz", "the map to write", ".npz", required=required)
        self.set_defaults(writes_map=True)

    def add_sensor(self) -> None:
        """Add ``--sensor``."""
        text = "where the radar is, in metres (default: the recording's sensor, or the camera)"
        self.add_value("--sensor", position, "X,Y,Z", text)

    def add_mesh_reading(self) -> None:
        """Add what a mesh file may not say about itself."""
        group = self.add_argument_group("mesh file", "what it may not say about itself")
        for name, kind, metavar, text in _MESH_READING:
            group.add_value(name, kind, metavar, text)

    def add_channel(self) -> None:
        """Add ``--receiver`` and ``--transmitter``."""
        text = "take this receiver, counted from 1 (default: the mean power of all)"
        self.add_value("--receiver", positive_int, "N", text)
        self.add_value("--transmitter", positive_int, "N", "take this transmitter, likewise")

    def add_method(self, text: str) -> None:
        """Add ``--method``: counting vertices, or the signal of a radar."""
        self.add_choice("--method", ("histogram", "fmcw"), text, "histogram")

    def add_placements_used(self, what: str, usual: str) -> None:
        """Add ``--placements``: which places of the sensor are used of data that has several."""
        text = f"{what} all places of the sensor, or the first only"
        self.add_choice("--placements", ("all", "first"), text, usual)

    def add_count(self) -> None:
        """Add ``--count``."""
        text = "count a vertex as badly known as its mesh says its velocity to be, or in one bin"
        text += " (default: expected)"
        self.add_choice("--count", ("expected", "plain"), text)

    def add_texture(self) -> None:
        """Add ``--texture``."""
        text = "draw denoised maps as a radar would show them, with its speckle and gaps, instead"
        text += " of the mean (SEED of the random numbers: 0)"
        self.add_value("--texture", int, "SEED", text, nargs="?", const=0)

    def add_limbs(self) -> None:
        """Add ``--limbs``."""
        text = "also keep the synthetic map of each part of the body (trunk, upper arms, forearms,"
        text += " thighs, lower legs)"
        self.add_flag("--limbs", text)

    def add_people_kept_out(self, validation: str, test: str) -> None:
        """Add ``--validation-subjects`` and ``--test-subjects``; the texts say who else it is."""
        self.add_value("--validation-subjects", name_list, "LIST", validation)
        self.add_value("--test-subjects", name_list, "LIST", test)


class OptionGroup(Options, argparse._ArgumentGroup):
    """Options under a heading of their own."""


class ExclusiveOptions(Options, argparse._MutuallyExclusiveGroup):
    """Options of which one may be given."""


_MESH_READING: tuple[tuple[str, Callable[[str], Any], str, str], ...] = (
    ("--faces", Path, "FILE", "triangles (.npy or .obj) for a mesh that has none of its own"),
    ("--fps", positive_float, "FPS", "frames per second of a mesh that does not say"),
    ("--scale", positive_float, "M",
     "metres per unit of the mesh, e.g. 0.001 for millimetres (default: 1)"),
    ("--person", str, "ID", "which person of a file of several (default: seen longest)"),
    ("--distance-m", finite_float, "M",
     "move a mesh that is centred on the body's root this far forward"),
    ("--image-size", image_size, "WxH",
     "size of the video in pixels, to place the output of VIBE (default: that of the recording's"
     " video)"),
    ("--focal-px", positive_float, "PX",
     "focal length of the video in pixels, likewise (default: the diagonal)"),
)  # fmt: skip


class CommandParser(Options, argparse.ArgumentParser):
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


def add_options(parser: argparse._ActionsContainer, kind: type[OptionRecord]) -> None:
    """Add the options of a record to a parser, under their headings."""
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
    from sd2core.radar_profiles import RADARS

    place, required = option.place, option.default is MISSING
    words = option.words.replace("{radars}", ", ".join(RADARS)).replace("%", "%%")
    about: dict[str, Any] = {"help": words}
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


@dataclass(frozen=True)
class AddedCommand:
    """A command of ``sd2`` that another package adds.

    Parameters
    ----------
    options : type of OptionRecord
        Its options; the docstring has a word on each.
    run : callable
        Takes a record of them, and may return an exit code; its docstring is the help.
    """

    options: type[OptionRecord]
    run: Callable[[Any], int | None]

    def __post_init__(self) -> None:
        if not (isinstance(self.options, type) and issubclass(self.options, OptionRecord)):
            raise Sd2Error(f"The options of a command are {self.options!r}", "an OptionRecord")
        add_options(CommandParser(), self.options)  # fails here, and not where all are listed


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


def add_command(
    commands: argparse._SubParsersAction,
    name: str,
    summary: str = "",
    *,
    options: type[Record] | None = None,
    handler: Callable[[Any], int | None] | None = None,
    about: Callable[..., Any] | None = None,
    description: str = "",
    examples: str = "",
) -> CommandParser:
    """Add a subcommand with its help, and the options of a record, which the handler gets.

    Without a summary the docstring of the handler, or of what is given in its place (``about``),
    is the help: a summary, a description, and examples from the first line on that begins with
    ``sd2``.
    """
    if not summary:
        text, *lines = re.split(r"\n+ *(?=sd2 )", inspect.getdoc(about or handler) or f"{name}.")
        examples = "\n".join(f"  {line}" for line in lines)
        summary, _, own = text.partition("\n\n")
        summary = f"{summary[0].lower()}{summary[1:].removesuffix('.')}"
        description = "\n\n".join(filter(None, (description, own)))
    text = f"{summary[0].upper()}{summary[1:]}."
    parser: CommandParser = commands.add_parser(
        name,
        help=summary,
        description=f"{text}\n\n{description}".strip(),
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    if options is not None:
        add_options(parser, options)
        parser.set_defaults(record=options, writes_map=issubclass(options, ReplacesMaps))
    if handler is not None:
        parser.set_defaults(handler=handler)
    return parser
