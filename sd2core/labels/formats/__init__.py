"""Label files of this and other programs, read and written.

:func:`read_labels` and :func:`write_labels` find the format by the file's suffix, and by its
content where several programs share one. :data:`FORMATS` says what each of them can hold. Spans
are half-open here and in every file: an end is the first instant after the span. See
``docs/formats.md`` and ``docs/decisions/0031-label-formats.md``.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, read_text
from sd2core.labels import files
from sd2core.labels.formats import (
    audacity,
    boris,
    csv_table,
    elan,
    elan_reading,
    mne_annotations,
    textgrid,
)
from sd2core.labels.formats.losses import (
    ASPECTS,
    Aspect,
    LabelFormat,
    Loss,
    losses_by_format,
    sentences,
)
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

__all__ = [
    "ASPECTS",
    "FORMATS",
    "Aspect",
    "LabelFormat",
    "Loss",
    "format_for",
    "read_labels",
    "sentences",
    "would_lose",
    "write_labels",
]


@dataclass(frozen=True)
class _Program:
    """Reader and writer of a format; the writer returns losses that depend on more than it."""

    about: LabelFormat
    read: Callable[[Path, Timebase | None, str | None], Labels]
    write: Callable[[Path, Labels, Timebase, Path | None], list[Loss]]


OWN = LabelFormat(
    name="sd2",
    title="SD² Studio",
    suffixes=(".json",),
    made_for="SD² Studio",
    keeps=frozenset(ASPECTS),
)

_TIME = r"\s*[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?\s*"
_AUDACITY = re.compile(rf"{_TIME}\t{_TIME}(?:\t.*)?")
_MNE = re.compile(rf"{_TIME},{_TIME},[^,]*(?:,[^,]*)?")
_EXPECTED_TEXT = "labels of Audacity, MNE, Praat, or a table with a heading"


def _write_own(
    path: Path, labels: Labels, timebase: Timebase, media: Path | None = None
) -> list[Loss]:
    files.write_labels(path, labels, timebase=timebase, video=media)
    return []


def _read_own(path: Path, timebase: Timebase | None, observation: str | None) -> Labels:
    return files.read_labels(path).labels


_PROGRAMS = {
    program.about.name: program
    for program in (
        _Program(OWN, _read_own, _write_own),
        _Program(csv_table.FORMAT, csv_table.read, csv_table.write),
        _Program(audacity.FORMAT, audacity.read, audacity.write),
        _Program(elan.FORMAT, elan_reading.read, elan.write),
        _Program(textgrid.FORMAT, textgrid.read, textgrid.write),
        _Program(boris.FORMAT, boris.read, boris.write),
        _Program(mne_annotations.FORMAT, mne_annotations.read, mne_annotations.write),
    )
}

FORMATS: tuple[LabelFormat, ...] = tuple(program.about for program in _PROGRAMS.values())
"""All formats, in the order in which they are offered."""


def read_labels(
    path: Path | str,
    timebase: Timebase | None = None,
    format: str | None = None,
    *,
    observation: str | None = None,
) -> Labels:
    """Read the labels of a file.

    Parameters
    ----------
    timebase : Timebase, optional
        Of the recording: for tables that have frames only, and for marks without a duration,
        which become the frame that is shown then.
    format : str, optional
        Name of one of :data:`FORMATS`; otherwise found by suffix and content.
    observation : str, optional
        Id of the observation, where the file has those of several videos (BORIS).

    Returns
    -------
    Labels
        Of origin ``"import"`` where the file does not say who made them.

    Raises
    ------
    Sd2Error
        Naming the file, what was found in it and what to do.
    """
    path = Path(path)
    chosen = format_for(path, writing=False) if format is None else _named(format)
    with errors_in(path):
        return _PROGRAMS[chosen.name].read(path, timebase, observation)


def write_labels(
    path: Path | str,
    labels: Labels,
    timebase: Timebase,
    format: str | None = None,
    *,
    media: Path | str | None = None,
) -> list[Loss]:
    """Write labels in one step: after an interruption the old file is there.

    Parameters
    ----------
    timebase : Timebase
        Of the recording's video: for frame numbers and the length of the recording.
    format : str, optional
        Name of one of :data:`FORMATS`; otherwise by suffix.
    media : Path or str, optional
        The video, for formats that link to it (ELAN, BORIS).

    Returns
    -------
    list of Loss
        Losses: what the file does not hold unchanged; ``str(loss)`` is a sentence.

    Raises
    ------
    Sd2Error
        When the suffix leaves open which format is meant, or a format cannot hold the times.
    OSError
        When the file cannot be written.
    """
    path = Path(path)
    chosen = format_for(path, writing=True) if format is None else _named(format)
    linked = None if media is None else Path(media)
    unheld = _PROGRAMS[chosen.name].write(path, labels, timebase, linked)
    return losses_by_format(labels, chosen) + unheld


def would_lose(
    labels: Labels, timebase: Timebase, format: str, *, media: Path | str | None = None
) -> list[Loss]:
    """Return what a file of a format would not hold, without leaving a file.

    Parameters
    ----------
    labels, timebase, media
        As for :func:`write_labels`.
    format : str
        Name of one of :data:`FORMATS`.

    Raises
    ------
    Sd2Error
        When the format cannot hold the times.
    """
    with tempfile.TemporaryDirectory(prefix="sd2-") as folder:
        path = Path(folder) / f"labels{_named(format).suffixes[0]}"
        return write_labels(path, labels, timebase, format, media=media)


def format_for(path: Path, *, writing: bool) -> LabelFormat:
    """Find the format of a file by its name, or by its content when it is read.

    Raises Sd2Error when that is not certain.
    """
    suffix = path.suffix.lower()
    fitting = [one for one in FORMATS if suffix in one.suffixes]
    if not fitting:
        known = ", ".join(dict.fromkeys(suffix for one in FORMATS for suffix in one.suffixes))
        raise Sd2Error(
            f"{path} has the suffix {suffix!r}",
            f"one of {known}",
            "Rename the file, or name its format",
        )
    if len(fitting) == 1:
        return fitting[0]
    if not writing:
        return _named(_format_of_text(path))
    titles = " or ".join(one.title for one in fitting)
    raise Sd2Error(
        f"{path} could be a file for {titles}", "a format that is certain", "Name the format"
    )


def _named(name: str) -> LabelFormat:
    if name not in _PROGRAMS:
        raise Sd2Error(f"A label format {name!r} is not known", f"one of {', '.join(_PROGRAMS)}")
    return _PROGRAMS[name].about


def _format_of_text(path: Path) -> str:
    """Name of the format that a text file has by its first line."""
    lines = (line for line in read_text(path, _EXPECTED_TEXT).splitlines() if line.strip())
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
        f"{path} begins with {first[:100]!r}", _EXPECTED_TEXT, "Check the file, or name its format"
    )
