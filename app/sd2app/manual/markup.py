"""Markdown of GitHub's dialect out of notebooks and parsers, and plain words out of Markdown."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator
from functools import partial

_COLUMNS = 82  # of what `sd2 COMMAND --help` prints


def notebook_text(stored: str) -> str:
    """Cells of a notebook, without what they printed."""
    cells = ((one["cell_type"], "".join(one["source"])) for one in json.loads(stored)["cells"])
    return "\n\n".join(
        f"```python\n{text}\n```" if kind == "code" else text for kind, text in cells
    )


def command_text(parser: argparse.ArgumentParser, name: str) -> str:
    """Page of a command, of which it tells what ``--help`` prints; of all for ``index``."""
    commands = commands_of(parser)
    if name != "index":
        return "\n".join(_helps(commands[name], 1))
    rows = [
        f"| [`sd2 {row.dest}`]({row.dest}.md) | {(row.help or '').replace('|', '¦')} |"
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for row in action._choices_actions
    ]
    head = "# Command line\n\nCommands do what the window does, by the same library."
    codes = "Exit codes are 0, 1 (explained in a sentence) and 2 (usage)."
    table = "\n".join(("| command | what it does |", "|---|---|", *rows))
    below = "\n".join(("```{toctree}", ":hidden:", "", *commands, "```"))
    return f"{head} {codes}\n\n{table}\n\n{below}\n"


def commands_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Subcommands of a parser by name."""
    subparsers = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    return {name: command for one in subparsers for name, command in one.choices.items()}


def _helps(parser: argparse.ArgumentParser, level: int) -> Iterator[str]:
    # Not as wide as a terminal, and without the colours of one (Python 3.14).
    parser.formatter_class = partial(argparse.RawDescriptionHelpFormatter, width=_COLUMNS)
    parser.color = False  # type: ignore[attr-defined, unused-ignore]
    yield f"{'#' * level} {parser.prog}\n\n```text\n{parser.format_help()}```\n"
    for command in commands_of(parser).values():
        yield from _helps(command, level + 1)


def plain_words(text: str) -> str:
    """Text of Markdown in one line, without mark-up."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"^ *```.*$|^[|: -]+$|^ *- ", "", text, flags=re.MULTILINE)
    text = re.sub(r"^\|.*", lambda row: row[0].replace("|", " "), text, flags=re.MULTILINE)
    return " ".join(re.sub(r"[`*]", "", text).split())
