"""Pages for users as a reader follows them: their blocks of commands and of Python, in order."""

from __future__ import annotations

import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\S*)(?P<words>[^\n]*)\n(?P<text>.*?)^(?P=indent)``` *$",
    re.DOTALL | re.MULTILINE,
)
_COMMENT = r"<!-- {}: ((?:(?!-->).)+?) -->"
_OPERATORS = {"|", "||", "&", "&&", ";", ">", ">>", "<"}


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    line: int  # of its first line of code, from 1
    text: str
    not_run: str  # the reason; empty for what is run
    seen: bool  # it shows lines that the block before prints

    @property
    def to_run(self) -> bool:
        """True if a reader is meant to run it, and a test does."""
        return self.language in ("sh", "python") and not self.not_run

    def line_not_printed(self, printed: str) -> str | None:
        """First of its lines that was not printed, or not below the lines above it.

        Other lines may stand between them; "…" is any text, and a run of spaces is one.
        """
        lines = iter([" ".join(line.split()) for line in printed.splitlines()])
        for line in self.text.splitlines():
            pattern = re.escape(" ".join(line.split())).replace("…", ".*")
            if line.strip() != "…" and not any(re.fullmatch(pattern, one) for one in lines):
                return line
        return None


@dataclass(frozen=True)
class Page:
    """A Markdown page."""

    path: Path

    @property
    def name(self) -> str:
        """Path from the root of the checkout."""
        return self.path.relative_to(REPOSITORY).as_posix()

    @cached_property
    def text(self) -> str:
        return self.path.read_text("utf-8")

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """All fenced blocks."""
        found = []
        for fence in _FENCE.finditer(self.text):
            said = re.search(
                _COMMENT.format("not run") + r"\s*\Z", self.text[: fence.start()], re.S
            )
            found.append(
                Block(
                    language=fence["language"],
                    line=self.text.count("\n", 0, fence.start("text")) + 1,
                    text=textwrap.dedent(fence["text"]),
                    not_run=said[1] if said else "",
                    seen=fence["language"] == "text" and "seen" in fence["words"].split(),
                )
            )
        return tuple(found)

    @property
    def to_run(self) -> tuple[Block, ...]:
        """Blocks that a reader is meant to run, in order."""
        return tuple(one for one in self.blocks if one.to_run)

    @property
    def slow(self) -> bool:
        """True if the first line says that the page takes long."""
        return re.match(_COMMENT.format("slow"), self.text) is not None

    @property
    def shared_files(self) -> dict[str, str]:
        """Path in the shared data by the name that the page's commands have for it."""
        told = re.search(_COMMENT.format("needs shared data"), self.text, re.S)
        return dict(one.split("=", 1) for one in told[1].split()) if told else {}

    def inline_code(self) -> Iterator[tuple[int, str]]:
        """Line and text of what stands between backticks in the prose."""

        def blank(found: re.Match[str]) -> str:
            return "\n" * found[0].count("\n")

        prose = re.sub(r"<!--.*?-->", blank, _FENCE.sub(blank, self.text), flags=re.DOTALL)
        for code in re.finditer(r"(`+)((?:(?!\n *\n).)+?)(?<!`)\1(?!`)", prose, re.DOTALL):
            yield prose.count("\n", 0, code.start()) + 1, " ".join(code[2].split())

    def lines_calling(self, program: str) -> Iterator[str]:
        """Every line of a shell's block that calls a program, run or not."""
        for block in self.blocks:
            if block.language == "sh":
                lines = block.text.replace("\\\n", " ").splitlines()
                yield from (line for line in lines if line.startswith(f"{program} "))


def sd2_arguments(line: str) -> list[str]:
    """Arguments of a shell line that calls ``sd2``, up to a pipe and the like."""
    words = shlex.shlex(line, posix=True, punctuation_chars="|&;<>")
    words.whitespace_split = True
    arguments = list(words)[1:]
    ends = [place for place, word in enumerate(arguments) if word in _OPERATORS]
    return arguments[: min(ends, default=len(arguments))]


def pages_to_follow() -> list[Page]:
    """The README and the pages of the guide for users, every block of which a test runs."""
    docs = REPOSITORY / "docs"
    folders = ("tutorials", "how-to", "concepts")
    inner = [path for folder in folders for path in sorted((docs / folder).rglob("*.md"))]
    return [
        Page(path) for path in (REPOSITORY / "README.md", docs / "first-five-minutes.md", *inner)
    ]
