"""Every argument of every ``sd2`` command, in words: what `command_arguments.txt` stores.

After a change that is meant, write it anew and look at the difference:

    python tests/core/cli/command_arguments.py
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from sd2app.command_line import full_parser
from sd2core.errors import Sd2Error

STORED = Path(__file__).with_suffix(".txt")

_TYPED = (
    *("-1", "0", "1e-9", "0.01", "0.5", "1", "1.5", "2%", "50", "178", "1e6", "1e12", "nan"),
    *("1,2", "1,2,3", "40,60,180,400", "640x480", "none", "channels=64", "left"),
)
"""What is tried on every argument with a type, to see what it takes."""


def listing() -> str:
    """All commands with names, values, defaults, choices and help of their arguments."""
    return "\n".join(_lines(full_parser())) + "\n"


def _lines(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield f"# {parser.prog}"
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for row in action._choices_actions:
                yield f"{row.dest}: {row.help}"
            for command in dict.fromkeys(action.choices.values()):
                yield ""
                yield from _lines(command)
        elif not isinstance(action, argparse._HelpAction):
            yield from _argument(parser, action)


def _argument(parser: argparse.ArgumentParser, action: argparse.Action) -> Iterator[str]:
    group = next(one for one in parser._action_groups if action in one._group_actions)
    instead = [
        other.option_strings[0]
        for exclusive in parser._mutually_exclusive_groups
        if action in exclusive._group_actions
        for other in exclusive._group_actions
        if other is not action
    ]
    about = {
        "is": type(action).__name__.strip("_").removesuffix("Action"),
        "called": action.dest,
        "under": group.title,
        "values": action.nargs,
        "required": action.required or None,
        "default": action.default,
        "choices": action.choices and ", ".join(map(str, action.choices)),
        "without a value": action.const,
        "instead of": ", ".join(instead) or None,
        "takes": _taken(action),
    }
    value = "" if action.metavar is None else f" {action.metavar}"
    yield " | ".join(action.option_strings or [action.dest]) + value
    yield f"    {action.help}"
    yield "    " + "; ".join(f"{name} {fact}" for name, fact in about.items() if fact is not None)


def _taken(action: argparse.Action) -> str | None:
    """Which of the things that are tried its type takes."""
    if not callable(action.type):
        return None
    if action.type in (str, Path):
        return "a text" if action.type is str else "a path"
    taken = []
    for text in _TYPED:
        try:
            action.type(text)
        except (argparse.ArgumentTypeError, ValueError, Sd2Error):
            continue
        taken.append(text)
    return " ".join(taken)


if __name__ == "__main__":
    STORED.write_text(listing(), encoding="utf-8", newline="\n")
