"""What the README and the help texts tell one to type works."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from guide_pages import REPOSITORY, Page, sd2_arguments

from sd2app.command_line import full_parser
from sd2core.cli.running import attach_negative_values
from tools.documentation.command_pages import commands_of

COMMAND_PAGES = REPOSITORY / "docs" / "commands"
DOCUMENTS = [
    REPOSITORY / name
    for name in ("README.md", "CONTRIBUTING.md", "resources/README.md", "tools/README.md")
] + [path for path in sorted((REPOSITORY / "docs").rglob("*.md")) if path.parent != COMMAND_PAGES]


PARSER = full_parser()


def command_lines() -> Iterator[str]:
    for document in DOCUMENTS:
        yield from Page(document).sd2_lines()
    parsers = [PARSER]
    while parsers:
        parser = parsers.pop()
        yield from re.findall(r"^  (sd2 .*?)(?:   .*)?$", parser.epilog or "", re.MULTILINE)
        for action in parser._actions:
            if isinstance(action.choices, dict):
                parsers.extend(action.choices.values())


@pytest.mark.parametrize("line", sorted(set(command_lines())))
def test_commands_are_understood(line: str) -> None:
    options = PARSER.parse_args(attach_negative_values(sd2_arguments(line)))
    assert callable(options.handler)


@pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: path.relative_to(REPOSITORY).as_posix()
)
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", document.read_text("utf-8")):
        if "://" in target:
            continue
        path = document.parent / target
        if path.resolve().parent == COMMAND_PAGES:  # written by `make docs`
            assert path.stem in {"index", *commands_of(PARSER)}, target
        else:
            assert path.exists(), target


def test_the_site_fetches_nothing(built_guide: Path) -> None:
    pages = sorted(built_guide.rglob("*.html"))
    assert len(pages) > 100
    for page in pages:
        text = page.read_text("utf-8")
        loaded = re.findall(r"<(?:script|img|iframe|link|source)\b[^>]*>", text)
        assert loaded
        for tag in loaded:
            assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", tag), (page, tag)
    for sheet in built_guide.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", sheet.read_text("utf-8"))
