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
from dataclasses import dataclass, replace
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
    label_studio,
    mne_annotations,
    subtitles,
    textgrid,
)
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss, losses_by_format
from sd2core.labels.formats.rows import LabelClock, LabelReading, LabelRows, assembled
from sd2core.labels.spans import Labels
from sd2core.plug_ins import Group, PlugIn
from sd2core.timebase import Timebase


@dataclass(frozen=True)
class LabelProgram:
    """Reader and writer of a format.

    Parameters
    ----------
    about : LabelFormat
        The format; a plug-in's has the plug-in's name.
    read : callable
        Takes the path, the recording's frame times and the id of an observation, each of which may
        be None, and returns the labels, or the :class:`~sd2core.labels.formats.rows.LabelRows`.
    write : callable
        Takes the path, the labels, the frame times and the video, which may be None, and returns
        the losses that depend on more than the format.
    """

    about: LabelFormat
    read: Callable[[Path, Timebase | None, str | None], Labels | LabelRows]
    write: Callable[[Path, Labels, Timebase, Path | None], list[Loss]]

    def __post_init__(self) -> None:
        if not isinstance(self.about, LabelFormat):
            raise Sd2Error(f"A label format is {self.about!r}", "a LabelFormat")


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
_LOOKED_AT = 4096
_EXPECTED_TEXT = "labels of Audacity, MNE, Praat, or a table with a heading"


def _write_own(path: Path, labels: Labels, timebase: Timebase, media: Path | None) -> list[Loss]:
    files.write_labels(path, labels, timebase=timebase, video=media)
    return []


_Read = Callable[[Path, Timebase | None, str | None], Labels | LabelRows]
_Write = Callable[[Path, Labels, Timebase, Path | None], list[Loss]]

_PROGRAMS: tuple[tuple[LabelFormat, _Read, _Write | None], ...] = (
    (OWN, lambda path, *_: files.read_labels(path).labels, _write_own),
    (csv_table.FORMAT, csv_table.read, csv_table.write),
    (audacity.FORMAT, audacity.read, audacity.write),
    (elan.FORMAT, elan_reading.read, elan.write),
    (textgrid.FORMAT, textgrid.read, textgrid.write),
    (boris.FORMAT, boris.read, boris.write),
    (mne_annotations.FORMAT, mne_annotations.read, mne_annotations.write),
    (subtitles.FORMAT, subtitles.read, None),
    (label_studio.FORMAT, label_studio.read, None),
)
_KNOWN = {about.name: about for about, _, _ in _PROGRAMS}
_READ = {about.name: read for about, read, _ in _PROGRAMS}
_WRITTEN = {about.name: write for about, _, write in _PROGRAMS if write is not None}
_OBSERVED = {"boris": boris.observations, "label-studio": label_studio.observations}

FORMATS: tuple[LabelFormat, ...] = tuple(_KNOWN[name] for name in _WRITTEN)
"""All formats that the program reads and writes, in the order in which they are offered."""

READ_ONLY: tuple[LabelFormat, ...] = tuple(_KNOWN[name] for name in _KNOWN if name not in _WRITTEN)
"""Formats that it reads only."""

LABEL_PLUG_INS = Group("label_files", LabelProgram, _KNOWN)
"""Formats of other packages."""


def all_formats() -> tuple[LabelFormat, ...]:
    """All formats that are read and written, those of plug-ins last."""
    return (*FORMATS, *_plugged_formats())


def readable_formats() -> tuple[LabelFormat, ...]:
    """All formats that are read, those of plug-ins last."""
    return (*FORMATS, *READ_ONLY, *_plugged_formats())


def _plugged_formats() -> list[LabelFormat]:
    return [
        replace(program.about, name=plug_in.name)
        for plug_in, program in LABEL_PLUG_INS.loaded()
        if isinstance(program, LabelProgram)
    ]


def read_labels(
    path: Path | str,
    timebase: Timebase | None = None,
    format: str | None = None,
    *,
    observation: str | None = None,
) -> Labels:
    """Read the labels of a file; :func:`read_label_file` also says what was left out.

    Parameters, and what is raised, are those of that function.
    """
    return read_label_file(path, timebase, format, observation=observation).labels


def read_label_file(
    path: Path | str,
    timebase: Timebase | None = None,
    format: str | None = None,
    *,
    observation: str | None = None,
    frames_per_s: float | None = None,
    mark_s: float | None = None,
) -> LabelReading:
    """Read the labels of a file, and say what was not taken of it.

    An odd entry is left out and listed; spans beyond the recording keep their times.

    Parameters
    ----------
    timebase : Timebase, optional
        Of the recording: for files that have frames only, and for marks without a duration,
        which become the frame that is shown then.
    format : str, optional
        Name of one of :func:`readable_formats`; otherwise found by suffix and content.
    observation : str, optional
        Id of the observation, where the file has those of several videos (BORIS, Label Studio).
    frames_per_s : float, optional
        Rate of the frames from 0 s on, where there is no timebase.
    mark_s : float, optional
        Length of marks without a duration, in place of a frame.

    Returns
    -------
    LabelReading
        Labels, of origin ``"import"`` where the file does not say who made them, and a sentence.

    Raises
    ------
    Sd2Error
        Naming the file, what was found in it and what to do; also when nothing could be taken.
    """
    path = Path(path)
    clock = LabelClock(timebase, frames_per_s, mark_s)
    chosen = format_for(path, writing=False) if format is None else _named(format)
    with errors_in(path):
        if chosen.name in _READ:
            content = _READ[chosen.name](path, timebase, observation)
        else:
            content = _plug_in(chosen.name).use(
                lambda program: program.read(path, timebase, observation), (Labels, LabelRows)
            )
        if isinstance(content, LabelRows):
            for odd in content.odd:  # said of the file anyway
                odd.found = odd.found.removeprefix(f"{path}, ")
            return assembled(content, clock).beside(timebase)
        return LabelReading(content).beside(timebase)


def observations(path: Path, format: str | None = None) -> tuple[str, ...]:
    """Ids of the observations of a file, one per video; empty for formats that have none."""
    chosen = format_for(path, writing=False) if format is None else _named(format)
    return _OBSERVED[chosen.name](path) if chosen.name in _OBSERVED else ()


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
    if chosen.name in _WRITTEN:
        unheld = _WRITTEN[chosen.name](path, labels, timebase, linked)
    elif chosen in READ_ONLY:
        raise Sd2Error(
            f"{path} would be a file of {chosen.title}, which is only read",
            f"one of {', '.join(one.name for one in all_formats())}",
        )
    else:
        unheld = _plug_in(chosen.name).use(
            lambda program: program.write(path, labels, timebase, linked), list
        )
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
    suffix, by_name = path.suffix.lower(), writing
    built_in = FORMATS if writing else (*FORMATS, *READ_ONLY)
    fitting = [one for one in built_in if suffix in one.suffixes]
    if not fitting:
        fitting = [one for one in _plugged_formats() if suffix in one.suffixes]
        by_name = True  # There is no looking into a file for them.
    if not fitting and path.is_dir():
        raise Sd2Error(f"{path} is a folder", "a recording, or a file with labels")
    if not fitting:
        usable = all_formats() if writing else readable_formats()
        known = ", ".join(dict.fromkeys(end for one in usable for end in one.suffixes))
        raise Sd2Error(
            f"{path} has the suffix {suffix!r}",
            f"one of {known}",
            "Rename the file, or name its format",
        )
    if len(fitting) == 1:
        return fitting[0]
    if not by_name:
        return _named(_format_of_json(path) if suffix == ".json" else _format_of_text(path))
    titles = " or ".join(one.title for one in fitting)
    raise Sd2Error(
        f"{path} could be a file for {titles}", "a format that is certain", "Name the format"
    )


def is_own(path: Path) -> bool:
    """True if a file of labels is this program's, and so may name its recording."""
    return format_for(path, writing=False) == OWN


def _named(name: str) -> LabelFormat:
    if name in _KNOWN:
        return _KNOWN[name]
    return replace(_plug_in(name).load().about, name=name)


def _plug_in(name: str) -> PlugIn[LabelProgram]:
    plug_in = LABEL_PLUG_INS.find(name)
    if plug_in is None:
        known = ", ".join([*_KNOWN, *LABEL_PLUG_INS.names()])
        raise Sd2Error(f"A label format {name!r} is not known", f"one of {known}")
    return plug_in


def _format_of_json(path: Path) -> str:
    """Name of the format of a JSON file: tasks of Label Studio come as a list, or one alone."""
    try:
        begins = read_text(path, OWN.title)[:_LOOKED_AT].lstrip()
    except Sd2Error:
        return OWN.name  # Whose reader says what is wrong.
    return label_studio.FORMAT.name if label_studio.begins_so(begins) else OWN.name


def _format_of_text(path: Path) -> str:
    """Name of the format that a text file has by its first line."""
    lines = (line for line in read_text(path, _EXPECTED_TEXT).splitlines() if line.strip())
    first = next(lines)
    if "ooTextFile" in first or "ooBinaryFile" in first:
        return "textgrid"
    if first.startswith("#"):
        return "mne"
    if first.startswith("WEBVTT"):
        return "subtitles"
    if _AUDACITY.fullmatch(first):
        return "audacity"
    if _MNE.fullmatch(first):
        return "mne"
    if any(separator in first for separator in ",;\t|"):
        return "csv"
    raise Sd2Error(
        f"{path} begins with {first[:100]!r}", _EXPECTED_TEXT, "Check the file, or name its format"
    )
