"""What the README and the help texts tell one to type works."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from guide_pages import REPOSITORY, Page, pages_to_follow, sd2_arguments
from named_commands import PARSER, fault_of, parsers_of
from parsers import arguments_of

from sd2app.manual.pages import commands_of
from sd2core.cli.running import attach_negative_values

COMMAND_PAGES = REPOSITORY / "docs" / "commands"
DOCUMENTS = [
    REPOSITORY / name
    for name in ("README.md", "CONTRIBUTING.md", "resources/README.md", "tools/README.md")
] + [path for path in sorted((REPOSITORY / "docs").rglob("*.md")) if path.parent != COMMAND_PAGES]
FOR_USERS = {page.path for page in pages_to_follow()}


def command_lines() -> Iterator[str]:
    for document in DOCUMENTS:
        yield from Page(document).lines_calling("sd2")
    for parser in parsers_of():
        yield from re.findall(r"^  (sd2 .*?)(?:   .*)?$", parser.epilog or "", re.MULTILINE)


@pytest.mark.parametrize("line", sorted(set(command_lines())))
def test_commands_are_understood(line: str) -> None:
    options = PARSER.parse_args(attach_negative_values(sd2_arguments(line)))
    assert callable(options.handler)


each_document = pytest.mark.parametrize(
    "document", DOCUMENTS, ids=lambda path: path.relative_to(REPOSITORY).as_posix()
)


@each_document
def test_what_prose_names_is_there(document: Path) -> None:
    """Commands, options and choices, and targets of make, between backticks."""
    faults = [
        f"{document.relative_to(REPOSITORY)}:{line}: `{code}`: {fault}"
        for line, code in Page(document).inline_code()
        if (fault := fault_of(code, tool_options=document not in FOR_USERS))
    ]
    faults += [
        f"{document.relative_to(REPOSITORY)}: {line}: {fault}"
        for line in Page(document).lines_calling("make")
        if (fault := fault_of(line.partition("#")[0], tool_options=False))
    ]
    assert not faults, "\n".join(faults)


def test_what_help_texts_name_is_there() -> None:
    faults = []
    for parser in parsers_of():
        own = [action.help or "" for action in arguments_of(parser)]
        groups = [group.description or "" for group in parser._action_groups]
        for text in (parser.description or "", *groups, *own):
            named = [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", text)]
            rest = " ".join(re.sub(r"`[^`]+`", "", text).split())
            named += re.findall(r"(?<![\w.-])(?:--[a-z][\w-]*|sd2 [a-z-]+)", rest)
            faults += [
                f"{parser.prog} --help: {code}: {fault}"
                for code in named
                if (fault := fault_of(code, tool_options=False))
            ]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize(
    ("code", "fault"),
    [
        ("sd2", None),
        ("sd2 fit", None),
        ("sd2 COMMAND --help", None),
        ("sd2 import … --copy", None),
        ("sd2 … --background", None),
        ("sd2 synth --sensor -1,0,2 --visibility exact", None),
        ("sd2 labels convert FILE --out FILE", None),
        ("sd2 simulate campaign --protocol paper|varied", None),
        ("--null-bins none", None),
        ("make soak MINUTES=4", None),
        ("pip install --user", None),
        ("python -m tools.fitting score FOLDER --keep FITS", None),
        ("sd2 fits", "sd2 has no command fits"),
        ("sd2 simulate people", "sd2 simulate has no command people"),
        ("sd2 fit --lens", "sd2 fit has no --lens"),
        ("sd2 radar --clutter most", "sd2 radar --clutter: most is none of"),
        ("sd2 synth --bins many", "sd2 synth --bins:"),
        ("sd2 doctor walk.mp4", "sd2 doctor takes no word such as walk.mp4"),
        ("sd2 … --lens", "no command has --lens"),
        ("--lens", "no command has --lens"),
        ("--clutter most", "most is none of"),
        ("--placements N", "takes no number N"),
        ("python -m tools.fitting score --lens", "no tool has --lens"),
        ("python -m tools.tea", "there is no tools.tea"),
        ("make tea", "the Makefile has no target tea"),
        ("make soak HOURS=1", "the Makefile has no variable HOURS"),
    ],
)
def test_names_are_understood_as_far_as_they_go(code: str, fault: str | None) -> None:
    found = fault_of(code, tool_options=False)
    assert found is None if fault is None else fault in (found or "")


@each_document
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
    assert len(pages) > 80
    for page in pages:
        text = page.read_text("utf-8")
        loaded = re.findall(r"<(?:script|img|iframe|link|source)\b[^>]*>", text)
        assert loaded
        for tag in loaded:
            assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", tag), (page, tag)
    for sheet in built_guide.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", sheet.read_text("utf-8"))
