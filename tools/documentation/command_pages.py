"""Pages of the guide about ``sd2``, written from its parser: one per command."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from sd2app.command_line import full_parser
from sd2app.manual.pages import commands_of

WIDTH = 74  # columns of a usage line


def write_command_pages(folder: Path) -> None:
    """Make ``folder`` hold a page per command and ``index.md``, and nothing else."""
    parser = full_parser()
    pages = {"index.md": _index(parser)}
    links: dict[tuple[str, ...], str] = {}
    for name, command in commands_of(parser).items():
        pages[f"{name}.md"] = "\n".join(_sections(command, 1, links)) + "\n"
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
            "Commands do what the window does, by the same library. `sd2 COMMAND --help` prints"
            " the same as these pages.",
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


def _sections(
    parser: argparse.ArgumentParser, level: int, links: dict[tuple[str, ...], str]
) -> Iterator[str]:
    """Heading, description, examples, usage and arguments of a command and of those in it.

    ``links`` lead, by its lines, to each titled group of options that stands on the pages so far.
    """
    yield from (f"{'#' * level} {parser.prog}", "", *_paragraphs(parser.description or ""))
    examples = (parser.epilog or "").removeprefix("examples:\n")
    if examples:
        yield from ("```sh", *_example_lines(examples), "```", "")
    yield from ("**Usage**", "", "```text", _usage(parser), "```", "")
    for group in parser._action_groups:
        actions = [one for one in group._group_actions if _is_shown(one)]
        if not actions:
            continue
        # Not a heading: names of groups come again in every command of a page.
        yield from (f"**{_escaped(_sentence_case(group.title or ''))}**", "")
        lines = (*_paragraphs(group.description or ""), *_explained(actions))
        if group in (parser._positionals, parser._optionals):
            yield from lines
        elif lines in links:
            options = ", ".join(f"`{action.option_strings[0]}`" for action in actions)
            yield from (f"{options}: as of {links[lines]}", "")
        else:
            page, anchor = parser.prog.split()[1], parser.prog.replace(" ", "-")
            links[lines] = f"[`{parser.prog}`]({page}.md#{anchor})"
            yield from lines
    for command in commands_of(parser).values():
        yield from _sections(command, level + 1, links)


def _is_shown(action: argparse.Action) -> bool:
    own = isinstance(action, argparse._HelpAction | argparse._SubParsersAction)
    return action.help != argparse.SUPPRESS and not own


def _usage(parser: argparse.ArgumentParser) -> str:
    """Usage with what is needed and what excludes each other: the rest is listed below it."""
    exclusive = [
        group
        for group in parser._mutually_exclusive_groups
        if sum(map(_is_shown, group._group_actions)) > 1
    ]
    excluding = [action for group in exclusive for action in group._group_actions]
    named = [
        action
        for action in parser._actions
        if not action.option_strings or action.required or action in excluding
    ]
    more = any(_is_shown(action) for action in parser._actions if action not in named)
    name = f"{parser.prog} [options]" if more else parser.prog
    formatter = argparse.HelpFormatter(name, width=WIDTH)
    formatter.add_usage(None, named, exclusive, prefix="")
    return formatter.format_help().strip()


def _explained(actions: Iterable[argparse.Action]) -> Iterator[str]:
    for action in actions:
        yield from (_term(action), f": {_explanation(action)}", "")


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
        command, _, comment = re.sub(r"\s{3,}", "\0", line.strip(), count=1).partition("\0")
        comment = re.sub(r"^\((.*)\)$", r"\1", comment)
        yield f"{command}    # {comment}" if comment else command


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
