"""Tables as text, for a terminal, Markdown and spreadsheets; the first row is the heading."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence


def text_table(rows: Sequence[Sequence[str]], right: Collection[int]) -> list[str]:
    """Lines of a table with aligned columns; those numbered in ``right`` are of numbers."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            text.rjust(width) if column in right else text.ljust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def numbers_table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table with names in the first column and numbers in the others."""
    return text_table(rows, range(1, len(rows[0])))


def markdown_table(rows: Sequence[Sequence[str]], names: int = 1) -> list[str]:
    """Rows as a Markdown table; the first ``names`` columns are of words."""
    rule = [*["---"] * names, *["---:"] * (len(rows[0]) - names)]
    head, *lines = (f"| {' | '.join(row)} |" for row in rows)
    return [head, f"|{'|'.join(rule)}|", *lines]


def capitalised(text: str) -> str:
    """Begin a text with a capital, and leave the rest as it is."""
    return f"{text[:1].upper()}{text[1:]}"


def counted(number: int, what: str, several: str = "") -> str:
    """``1 map``, ``2,000 maps``; ``several`` is a plural without a plain ``s``."""
    return f"{number:,} {what if number == 1 else several or what + 's'}"


def bytes_text(count: float) -> str:
    """Size in bytes with a suitable unit, as ``1.2 GB``."""
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            value = count / size
            return f"{value:.0f} {unit}" if value >= 10 else f"{value:.2g} {unit}"
    return f"{count:.0f} bytes"


# With wide signs, which some spreadsheets compute as well. Apostrophes count, so that a text with
# one of its own comes back.
_FORMULA = re.compile(r"'*\s*[=+\-@＝＋－＠]")


def as_cell(text: str) -> str:
    """Put an apostrophe before a text that a spreadsheet would compute."""
    return f"'{text}" if _FORMULA.match(text) else text


def of_cell(text: str) -> str:
    """Undo :func:`as_cell`."""
    return text[1:] if text.startswith("'") and _FORMULA.match(text) else text
