"""Pages of commands: each argument is found, and what several commands share is told once."""

from __future__ import annotations

import argparse
import re

import pytest
from named_commands import PARSER
from parsers import arguments_of

from sd2app.manual.pages import commands_of
from tools.documentation.command_pages import _sections, write_command_pages


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("commands")
    write_command_pages(folder)
    return {path.name: path.read_text("utf-8") for path in folder.iterdir()}


def section(pages: dict[str, str], page: str, anchor: str) -> str:
    """Text below the heading that an anchor names, up to the next one."""
    _, *parts = re.split(r"^#+ (.+)$", pages[page], flags=re.MULTILINE)
    texts = dict(zip(parts[::2], parts[1::2], strict=True))
    return texts[next(name for name in texts if name.replace(" ", "-") == anchor)]


def test_every_option_is_named_below_its_command(pages: dict[str, str]) -> None:
    stack = list(commands_of(PARSER).values())
    while stack:
        parser = stack.pop()
        stack += commands_of(parser).values()
        page = f"{parser.prog.split()[1]}.md"
        text = section(pages, page, parser.prog.replace(" ", "-"))
        for action in arguments_of(parser):
            if action.option_strings and not isinstance(action, argparse._HelpAction):
                assert re.search(rf"^.*`{action.option_strings[0]}\b", text, re.MULTILINE), action


def test_what_is_told_elsewhere_is_told_there(pages: dict[str, str]) -> None:
    links = [
        found
        for text in pages.values()
        for found in re.findall(r"^(`--.*`): as of \[`.*`\]\((.*)#(.*)\)$", text, re.MULTILINE)
    ]
    assert len(links) > 10
    for options, page, anchor in links:
        text = section(pages, page, anchor)
        for option in re.findall(r"`(--[^`]+)`", options):
            assert re.search(rf"^`{option}\b.*`\n: ", text, re.MULTILINE), (option, anchor)


def test_groups_that_differ_are_each_told() -> None:
    told: dict[tuple[str, ...], str] = {}
    texts = []
    for name, said in (("one", "a length"), ("two", "a length"), ("three", "a weight")):
        parser = argparse.ArgumentParser(prog=f"sd2 {name}")
        parser.add_argument("FILE", help="what is read")
        parser.add_argument("--out", required=True, help="what is written")
        parser.add_argument("--quick", action="store_true", help="what may be left out")
        either = parser.add_mutually_exclusive_group()
        either.add_argument("--red", action="store_true", help="a colour")
        either.add_argument("--blue", action="store_true", help="a colour")
        parser.add_argument_group("sizes").add_argument("--size", metavar="N", help=said)
        texts.append("\n".join(_sections(parser, 1, told)))
    assert "\nsd2 one [options] --out OUT [--red | --blue] FILE\n" in texts[0]
    assert "`--size N`\n: a length\n" in texts[0]
    assert "**Sizes**\n\n`--size`: as of [`sd2 one`](one.md#sd2-one)\n" in texts[1]
    assert "`--size N`\n: a weight\n" in texts[2]
    assert all("`FILE`\n: what is read\n" in text for text in texts)
