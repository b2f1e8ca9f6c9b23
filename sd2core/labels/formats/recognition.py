"""Which program a label file with a common suffix is of."""

from __future__ import annotations

import re
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.labels.formats.texts import read_text

_TIME = r"\s*[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?\s*"
_AUDACITY = re.compile(rf"{_TIME}\t{_TIME}(?:\t.*)?")
_MNE = re.compile(rf"{_TIME},{_TIME},[^,]*(?:,[^,]*)?")

_EXPECTED = "labels of Audacity, MNE, Praat, or a table with a heading"


def format_of_text(path: Path) -> str:
    """Name of the format that a text file has by its first line.

    Raises
    ------
    Sd2Error
        When the file is no text, or of none of them.
    """
    lines = (line for line in read_text(path, _EXPECTED).splitlines() if line.strip())
    first = next(lines)
    if "ooTextFile" in first or "ooBinaryFile" in first:
        return "textgrid"
    if first.startswith("#"):
        return "mne"
    if _AUDACITY.fullmatch(first):
        return "audacity"
    if _MNE.fullmatch(first):
        return "mne"
    if any(separator in first for separator in ",;\t|"):
        return "csv"
    raise Sd2Error(
        f"{path} begins with {first[:100]!r}", _EXPECTED, "Check the file, or name its format"
    )
