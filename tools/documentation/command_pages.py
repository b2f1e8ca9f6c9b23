"""Pages of the guide about ``sd2``, written from its parser: one per command."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from sd2app.command_line import full_parser
from sd2app.manual.markup import commands_of

WIDTH = 74  # columns of a usage line


def write_command_pages(folder: Path) -> None:
    """Make ``folder`` hold a page per command and ``index.md``, and nothing else."""
    parser = full_parser()
    pages = {"index.md": _index(parser)}
    pages |= {f"{name}.md": _page(command) for name, command in commands_of(parser).items()}
    folder.mkdir(exist_ok=True)
    for path in folder.glob("*.md"):
        if path.name not in pages:
            path.unlink()
    for name, text in pages.items():
        path = folder / name
        # Pages that are as they were are not built again.
        if not path.is_file() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def _index(parser: argparse.ArgumentParser) -> str:
    rows = [
        f"| [`sd2 {row.dest}`]({row.dest}.md) | {_escaped(row.help or '')} |"
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for row in action._choices_actions
    ]
    return "\n".join(
        [
            "# Command line",
            "",
            "Commands do what the window does, by the same library. These pages are"
            " what `sd2 COMMAND --help` prints, of this version.",
            "",
            "Exit codes are 0, 1 (explained in a sentence) and 2 (usage).",
            "",
            "| command | what it does |",
            "|---|---|",
            *rows,
            "",
            "```{toctree}",
            ":hidden:",
            "",
            *commands_of(parser),
            "```",
            "",
        ]
    )


def _page(parser: argparse.ArgumentParser) -> str:
    return "\n".join(_sections(parser, 1)) + "\n"


def _sections(parser: argparse.ArgumentParser, level: int) -> Iterator[str]:
    """Heading, description, examples, usage and arguments of a command and of those in it."""
    yield from (f"{'#' * level} {parser.prog}", "", *_paragraphs(parser.description or ""))
    examples = (parser.epilog or "").removeprefix("examples:\n")
    if examples:
        yield from ("```sh", *_example_lines(examples), "```", "")
    # Which options exclude each other is only said here.
    yield from ("**Usage**", "", "```text", _usage(parser), "```", "")
    for group in parser._action_groups:
        actions = [one for one in group._group_actions if one.help != argparse.SUPPRESS]
        actions = [
            one
            for one in actions
            if not isinstance(one, argparse._HelpAction | argparse._SubParsersAction)
        ]
        if actions:
            # Not a heading: names of groups come again in every command of a page.
            yield from (f"**{_escaped(_sentence_case(group.title or ''))}**", "")
            yield from _paragraphs(group.description or "")
            for action in actions:
                yield from (_term(action), f": {_explanation(action)}", "")
    for command in commands_of(parser).values():
        yield from _sections(command, level + 1)


def _usage(parser: argparse.ArgumentParser) -> str:
    formatter = argparse.HelpFormatter(parser.prog, width=WIDTH)
    formatter.add_usage(parser.usage, parser._actions, parser._mutually_exclusive_groups, prefix="")
    return formatter.format_help().strip()


def _term(action: argparse.Action) -> str:
    formatter = argparse.HelpFormatter("")
    return f"`{formatter._format_action_invocation(action)}`"


def _explanation(action: argparse.Action) -> str:
    help_text = argparse.HelpFormatter("")._expand_help(action)
    needed = bool(action.option_strings) and action.required
    return _escaped(help_text) + (" (*required*)" if needed else "")


def _example_lines(text: str) -> Iterator[str]:
    """Commands as one types them; what is said of one becomes a comment."""
    for line in text.splitlines():
        command, _, said = re.sub(r"\s{3,}", "\0", line.strip(), count=1).partition("\0")
        said = re.sub(r"^\((.*)\)$", r"\1", said)
        yield f"{command}    # {said}" if said else command


def _paragraphs(text: str) -> Iterator[str]:
    """Paragraphs of a help text; indented lines stay as they are."""
    for block in re.split(r"\n\s*\n", text.strip()):
        if not block:
            continue
        if block.startswith("  "):
            yield from ("```text", block, "```", "")
        else:
            yield from (_escaped(block), "")


def _sentence_case(text: str) -> str:
    return text[:1].upper() + text[1:]


def _escaped(text: str) -> str:
    """Text in which Markdown sees no mark-up but `code`; pages of the guide become links."""
    text = re.sub(r"(?<![\w`-])--[a-z][\w-]*(?![\w`-])", r"`\g<0>`", text)
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(part if part.startswith("`") else _escaped_prose(part) for part in parts)


def _escaped_prose(text: str) -> str:
    escaped = re.sub(r"([\\*_<>\[\]|#$~])", r"\\\1", text)
    return re.sub(r"docs/([\w/-]+\.md)", r"[\1](../\1)", escaped)
