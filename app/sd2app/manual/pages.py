"""Pages of the manual: the Markdown of docs/, the commands and the library, to read and search."""

from __future__ import annotations

import argparse
import json
import posixpath
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from pathlib import Path

from sd2app.manual.library import described

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


INDEX, FIRST_FIVE_MINUTES, SEARCH = "index.md", "first-five-minutes.md", "search"
MEASURED = "how-good-is-it.md"
"""Page above those of measurements, which no search finds."""
_COMMANDS, _IMAGES = "commands/", "images/"
_FENCE = r"^(?P<indent> *)```(?P<kind>\S*)[^\n]*\n(?P<body>.*?)^(?P=indent)``` *$"
_MARKUP = re.compile(
    rf"{_FENCE}|(?P<comment><!--.*?-->\n?)|\{{(?P<role>[\w:]+)\}}`(?P<content>[^`]+)`|`[^`]+`"
    r"|!?\[(?P<words>(?:(?!\n\n)[^\]])*)\]\((?P<target>[^)\s]+)\)",
    re.MULTILINE | re.DOTALL,
)
_HEADING = re.compile(rf"{_FENCE}|^(?P<level>#+) +(?P<text>[^\n]+)$", re.MULTILINE | re.DOTALL)
_WORD = r"[^\W_]+"
_SNIPPET = 110  # characters


@dataclass(frozen=True)
class Entry:
    """Page in the contents by its path in docs/, with those below it."""

    name: str
    title: str
    below: tuple[Entry, ...] = ()

    def __iter__(self) -> Iterator[Entry]:
        """Iterate over this one and all below it."""
        yield self
        for entry in self.below:
            yield from entry


@dataclass(frozen=True)
class Section:
    """Heading of a page, and what is below it in plain words."""

    heading: str
    anchor: str
    text: str


@dataclass(frozen=True)
class Hit:
    """Page that a search found, with the section that says most and a few of its words."""

    name: str
    title: str
    section: Section
    snippet: str

    @property
    def place(self) -> str:
        """Page, and anchor below its title."""
        is_title = self.section.heading == self.title
        return self.name if is_title else f"{self.name}#{self.section.anchor}"


def manual_folder() -> Path:
    """Folder of the pages: beside the program where it was installed, or in the checkout."""
    package = Path(__file__).resolve().parents[1]
    return package / "docs" if (package / "docs").is_dir() else package.parents[1] / "docs"


class Manual:
    """Pages by their names: those that the tables of contents in ``index.md`` and below lead to.

    Those of commands are made of the parser. Raises OSError where a page is not in the folder.
    """

    def __init__(self, folder: Path, parser: Callable[[], argparse.ArgumentParser]) -> None:
        self.folder, self._parser = folder, cache(parser)
        self.sought = ""  # what the page of the search is about
        self._sources: dict[str, str] = {}
        self.contents = self._entry(INDEX, "")
        self.titles = {entry.name: entry.title for entry in self.contents}

    def _entry(self, name: str, title: str) -> Entry:
        source = self._source(name)
        named = re.search(r"^# (.+)$", source, re.MULTILINE)
        below = [
            self._entry(*one)
            for fence in re.finditer(_FENCE, source, re.MULTILINE | re.DOTALL)
            if fence["kind"] == "{toctree}"
            for one in self._listed(name, fence["body"])
        ]
        return Entry(name, title or plain_words(named[1] if named else name), tuple(below))

    def _listed(self, name: str, toctree: str) -> Iterator[tuple[str, str]]:
        """Names of the pages that a table of contents lists, and titles where it has its own."""
        folder, listed = posixpath.dirname(name), {name}
        for line in filter(None, (line.strip() for line in toctree.splitlines())):
            own = re.fullmatch(r"(.+) <(.+)>", line)
            title, target = own.groups() if own else ("", line)
            names = [posixpath.normpath(posixpath.join(folder, target))]
            if "*" in target:
                files = sorted(self.folder.glob(f"{names[0]}.*"))
                names = [file.relative_to(self.folder).with_suffix("").as_posix() for file in files]
            for one in names if not line.startswith(":") else ():
                is_notebook = (self.folder / f"{one}.ipynb").is_file()
                page = f"{one}.ipynb" if is_notebook else f"{one}.md"
                if page not in listed:
                    listed.add(page)
                    yield page, title

    def files(self) -> set[str]:
        """Paths in the folder of all that the manual consists of: pages and pictures."""
        pages = {name for name in self.titles if not name.startswith(_COMMANDS)}
        pictures = {
            self.place(name, one["target"])
            for name in pages
            for one in _MARKUP.finditer(self._source(name))
            if one["target"]
        }
        return pages | {one for one in pictures if one.startswith(_IMAGES)}

    # --- what is on a page ----------------------------------------------------------------

    @staticmethod
    def place(name: str, target: str) -> str:
        """Page or picture that a link on a page leads to; the page itself for one within it."""
        path = target.partition("#")[0]
        return posixpath.normpath(posixpath.join(posixpath.dirname(name), path)) if path else name

    def text(self, name: str) -> str:
        """Markdown in GitHub's dialect, with links to pages of the manual and to the web only."""
        return _MARKUP.sub(partial(self._plain, name), self._source(name))

    def sections(self, name: str) -> tuple[Section, ...]:
        """Headings of a page in their order, with anchors as GitHub gives them."""
        text = self.text(name)
        headings = [one for one in _HEADING.finditer(text) if one["level"]]
        ends = [one.start() for one in headings[1:]] + [len(text)]
        sections: list[Section] = []
        for one, end in zip(headings, ends, strict=True):
            heading = plain_words(one["text"])
            slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            same = sum(re.fullmatch(rf"{slug}(-\d+)?", one.anchor) is not None for one in sections)
            anchor = f"{slug}-{same}" if same else slug
            sections.append(Section(heading, anchor, plain_words(text[one.end() : end])))
        return tuple(sections)

    def _source(self, name: str) -> str:
        if name == SEARCH:
            return hits_text(self.search(self.sought))
        if name not in self._sources:
            if name.startswith(_COMMANDS):
                text = command_text(self._parser(), name[len(_COMMANDS) :].removesuffix(".md"))
            else:
                text = (self.folder / name).read_text("utf-8")
            self._sources[name] = notebook_text(text) if name.endswith(".ipynb") else text
        return self._sources[name]

    def _plain(self, name: str, match: re.Match[str]) -> str:
        """Say in GitHub's dialect what MyST has of its own; unlink what is not in the manual."""
        if match["comment"]:
            return ""
        if match["kind"] == "{toctree}":
            return self._shown_list(name, match["body"])
        if match["kind"] == "{eval-rst}":
            return described(match["body"])
        words, target = match["words"], match["target"]
        if match["role"]:
            link = re.fullmatch(r"(.+?) <(.+)>", match["content"], re.DOTALL)
            if link is None:
                return f"`{re.sub(r'^~.*[.]', '', match['content'])}`"
            words, target = link.groups()
        if not target:
            return match[0]
        if "://" in target or self.place(name, target) in self.titles:
            return f"[{words}]({target})"
        return match[0] if self.place(name, target).startswith(_IMAGES) else words

    def _shown_list(self, name: str, toctree: str) -> str:
        """Links to the pages of a table of contents, unless it is hidden."""
        if ":hidden:" in toctree:
            return ""
        caption = re.search(r"^:caption: (.+)$", toctree, re.MULTILINE)
        lines = [f"**{caption[1]}**\n"] if caption else []
        for page, title in self._listed(name, toctree):
            target = posixpath.relpath(page, posixpath.dirname(name) or ".")
            lines.append(f"- [{title or self.titles[page]}]({target})")
        return "\n".join(lines)

    # --- search ---------------------------------------------------------------------------

    @cached_property
    def _index(self) -> list[tuple[str, tuple[Section, ...], list[str], str]]:
        """Pages that a search looks at, with the words of headings, the title first, and of all."""
        measured = {
            below.name for entry in self.contents if entry.name == MEASURED for below in entry.below
        }
        index = []
        for name, title in self.titles.items():
            if name not in measured:
                sections = self.sections(name)
                headings = [title, *(one.heading for one in sections[1:])]
                text = _spaced(" ".join([*headings, *(one.text for one in sections)]))
                index.append((name, sections, [_spaced(one) for one in headings], text))
        return index

    def search(self, text: str) -> list[Hit]:
        """Pages that have all words of a text, or words that begin so, the best first.

        Those with all words in the title come before those with all in one heading; then words in
        the title count more than those in headings, and these more than others.
        """
        words = [f" {word}" for word in re.findall(_WORD, text.lower())]
        ranked = []
        for name, sections, headings, all_text in self._index:
            if words and all(word in all_text for word in words):
                counts = [sum(word in one for word in words) for one in headings]
                best = max(counts)
                # Of pages that are equal so far, those come first that do so in the contents.
                often = 0 if best else sum(all_text.count(word) for word in words)
                whole = (counts[0] == len(words), best == len(words))
                ranked.append(((*whole, counts[0], best, often), name, sections))
        ranked.sort(key=lambda one: one[0], reverse=True)
        return [self._hit(name, sections, words) for _, name, sections in ranked]

    def _hit(self, name: str, sections: tuple[Section, ...], words: list[str]) -> Hit:
        def fits(one: Section) -> tuple[int, int]:
            heading, all_of_it = _spaced(one.heading), _spaced(f"{one.heading} {one.text}")
            return sum(word in all_of_it for word in words), sum(word in heading for word in words)

        best = max(sections, key=fits)
        first = "|".join(re.escape(word.strip()) for word in words)
        match = re.search(rf"(?<![^\W_])({first})", best.text, re.IGNORECASE)
        start = max(match.start() - 30, 0) if match else 0
        start = best.text.rfind(" ", 0, start) + 1
        words_on = best.text[start:]
        cut = words_on if len(words_on) < _SNIPPET else words_on[:_SNIPPET].rpartition(" ")[0] + "…"
        return Hit(name, self.titles[name], best, f"…{cut}" if start else cut)


def hits_text(hits: Sequence[Hit]) -> str:
    """Markdown of what a search found."""
    lines = ["# Search", *([] if hits else ["No page has all these words."])]
    for one in hits:
        where = f"*{_escaped(one.section.heading)}*: " if "#" in one.place else ""
        lines += [f"### [{_escaped(one.title)}]({one.place})", where + _escaped(one.snippet)]
    return "\n\n".join(lines)


def _escaped(text: str) -> str:
    return re.sub(r"([\\`*_<>\[\]|#~{}])", r"\\\1", text)


def _spaced(text: str) -> str:
    """Words in small letters, with a space before each."""
    return " ".join(["", *re.findall(_WORD, text.lower())])
