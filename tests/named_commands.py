"""What a text names of ``sd2`` and of ``make``, held against the parser and the Makefile.

A name in prose is often no whole command: what it says must be right, what it leaves out may be
missing. Words in CAPITALS and … stand for anything.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from functools import cache
from itertools import chain

from guide_pages import REPOSITORY, sd2_arguments
from parsers import arguments_of, options_of

from sd2app.command_line import full_parser
from sd2app.manual.pages import commands_of
from sd2core.cli.running import attach_negative_values
from sd2core.errors import Sd2Error
from sd2core.options.records import flag

PARSER = full_parser()

_OF_OTHER_PROGRAMS = frozenset(
    {"--no-deps", "--only-binary", "--platform", "--python-version"}  # pip
)
_STANDS_FOR_ANYTHING = re.compile(r"[A-Z][A-Z_]*(?![a-z])|.*…|[{<\[]")


def parsers_of(parser: argparse.ArgumentParser = PARSER) -> Iterator[argparse.ArgumentParser]:
    """A parser and those of all its commands."""
    yield parser
    for command in commands_of(parser).values():
        yield from parsers_of(command)


def fault_of(code: str, tool_options: bool) -> str | None:
    """What is wrong with a piece of inline code, if it names a command, an option or a target.

    Parameters
    ----------
    code : str
        As it stands between backticks.
    tool_options : bool
        True where bare options may also be those of the programs in ``tools``.
    """
    program = code.split(" ")[0]
    if program == "make":
        return _fault_of_target(code.split()[1:])
    if program == "sd2":
        return _fault_of_command(_arguments(code))
    if re.match(r"--[a-z]", code) and program not in _OF_OTHER_PROGRAMS:
        return _fault_of_options(_arguments(f"sd2 {code}"), tool_options)
    if code.startswith("python -m tools."):
        return _fault_of_tool(code.split()[2:])
    return None


def _arguments(line: str) -> list[str]:
    return attach_negative_values(sd2_arguments(line))


def _fault_of_command(words: list[str]) -> str | None:
    parser = PARSER
    while words and (commands := commands_of(parser)):
        if _STANDS_FOR_ANYTHING.match(words[0]):
            return _fault_of_options(words[1:], tool_options=False)
        if words[0].startswith("-"):
            break
        if words[0] not in commands:
            return f"{parser.prog} has no command {words[0]}"
        parser, words = commands[words[0]], words[1:]
    return _fault_of_arguments(parser, words)


def _fault_of_arguments(parser: argparse.ArgumentParser, words: list[str]) -> str | None:
    """First of the words that this command does not understand."""
    takes_words = any(not action.option_strings for action in arguments_of(parser))
    words = list(words)
    while words:
        name, attached, value = words.pop(0).partition("=")
        if not name.startswith("--"):
            if not (takes_words or _STANDS_FOR_ANYTHING.match(name)):
                return f"{parser.prog} takes no word such as {name}"
            continue
        action = options_of(parser).get(name)
        if action is None:
            return f"{parser.prog} has no {name}"
        if attached:
            values = [value]
        elif action.nargs in ("*", "+"):
            values = []
            while words and not words[0].startswith("--"):
                values.append(words.pop(0))
        else:
            takes_value = action.nargs != 0 and words and not words[0].startswith("--")
            values = [words.pop(0)] if takes_value else []
        for value in values:
            if fault := _fault_of_value(action, value):
                return f"{parser.prog} {name}: {fault}"
    return None


def _fault_of_value(action: argparse.Action, value: str) -> str | None:
    if value == "N" and action.metavar != "N":
        return "it takes no number N"
    if value == action.metavar or _STANDS_FOR_ANYTHING.match(value):
        return None
    try:
        read = action.type(value) if callable(action.type) else value
    except (argparse.ArgumentTypeError, Sd2Error, ValueError, TypeError) as error:
        return str(error)
    if action.choices is not None and read not in action.choices:
        return f"{value} is none of {', '.join(map(str, action.choices))}"
    return None


def _fault_of_options(words: list[str], tool_options: bool) -> str | None:
    """What keeps every command from having these options with these values."""
    faults = [_fault_of_arguments(parser, words) for parser in parsers_of()]
    if None in faults or (tool_options and not _unknown_options(words, _tool_options())):
        return None
    if unknown := _unknown_options(words, _sd2_options()):
        return f"no command has {unknown[0]}"
    telling = [one for one in faults if one is not None and " has no " not in one]
    return telling[0] if telling else "no command has all of them"


def _unknown_options(words: list[str], known: frozenset[str]) -> list[str]:
    names = (word.partition("=")[0] for word in words if word.startswith("--"))
    return [name for name in names if name not in known]


def _fault_of_tool(words: list[str]) -> str | None:
    path = REPOSITORY / words[0].replace(".", "/")
    if not (path.is_dir() or path.with_suffix(".py").is_file()):
        return f"there is no {words[0]}"
    unknown = _unknown_options(words, _tool_options())
    return f"no tool has {unknown[0]}" if unknown else None


@cache
def _sd2_options() -> frozenset[str]:
    return frozenset(name for one in parsers_of() for name in options_of(one))


@cache
def _tool_options() -> frozenset[str]:
    """Options of the tools: those that they add, and fields of their records."""
    texts = [path.read_text("utf-8") for path in sorted((REPOSITORY / "tools").rglob("*.py"))]
    added = [re.findall(r'add_argument\(\s*"(--[a-z][\w-]*)"', one) for one in texts]
    records = [
        re.findall(r"^    (\w+): .*$", one, re.MULTILINE) for one in texts if "OptionRecord" in one
    ]
    return frozenset(chain(*added, map(flag, chain(*records))))


def _fault_of_target(words: list[str]) -> str | None:
    rules = (REPOSITORY / "Makefile").read_text("utf-8")
    for word in words:
        name, attached, _ = word.partition("=")
        if _STANDS_FOR_ANYTHING.match(name) and not attached:
            continue
        if attached and f"$({name})" not in rules and f"export {name}" not in rules:
            return f"the Makefile has no variable {name}"
        rule = rf"^(?:[\w-]+ )*{re.escape(name)}(?: [\w-]+)*:(?!=)"
        if not attached and not re.search(rule, rules, re.MULTILINE):
            return f"the Makefile has no target {name}"
    return None
