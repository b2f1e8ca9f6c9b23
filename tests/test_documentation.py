"""What the README and the help texts tell one to type works."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from sd2app.command_line import full_parser
from sd2core.cli.running import attach_negative_values

REPOSITORY = Path(__file__).resolve().parent.parent
DOCUMENTS = [
    REPOSITORY / name
    for name in ("README.md", "CONTRIBUTING.md", "resources/README.md", "tools/README.md")
] + sorted((REPOSITORY / "docs").rglob("*.md"))


PARSER = full_parser()


def command_lines() -> Iterator[str]:
    for document in DOCUMENTS:
        for block in re.findall(r"```sh\n(.*?)```", document.read_text("utf-8"), re.DOTALL):
            yield from (line for line in block.splitlines() if line.startswith("sd2 "))
    parsers = [PARSER]
    while parsers:
        parser = parsers.pop()
        yield from re.findall(r"^  (sd2 .*?)(?:   .*)?$", parser.epilog or "", re.MULTILINE)
        for action in parser._actions:
            if isinstance(action.choices, dict):
                parsers.extend(action.choices.values())


@pytest.mark.parametrize("line", sorted(set(command_lines())))
def test_commands_are_understood(line: str) -> None:
    arguments = shlex.split(line, comments=True)[1:]
    options = PARSER.parse_args(attach_negative_values(arguments))
    assert callable(options.handler)


@pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: path.relative_to(REPOSITORY).as_posix()
)
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", document.read_text("utf-8")):
        if "://" not in target:
            assert (document.parent / target).exists(), target
