"""``labels.json``, the file of the labels of one recording, and files of label sets.

See ``docs/formats.md``. Formats of other programs: :mod:`sd2core.labels.formats`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, TypeVar

from sd2core.files.atomic import atomic_write_text, to_json
from sd2core.files.paths import located_path, plain_path, stored_path
from sd2core.files.recording_json import Span as InlineSpan
from sd2core.files.texts import (
    EXPECTED_JSON,
    check_version,
    errors_in,
    faults_in,
    parse_json,
    read_text,
)
from sd2core.labels.entries import Entry, LabelsEntry, label_set_entry, labels_entry
from sd2core.labels.label_set import LONGEST_NAME, Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FILE_NAME = "labels.json"
FORMAT: Literal["sd2-labels"] = "sd2-labels"
SET_FORMAT: Literal["sd2-label-set"] = "sd2-label-set"
VERSION = 1

NO_LABEL = "no label"
"""Label of a span of a recording that names none."""


class _LabelsDocument(LabelsEntry):
    format: Literal["sd2-labels"]
    version: int
    recording: str | None = None
    video: str | None = None


class _LabelSetDocument(Entry):
    format: Literal["sd2-label-set"]
    version: int
    name: str
    labels: tuple[Label, ...]


_Document = TypeVar("_Document", bound=Entry)


@dataclass(frozen=True)
class LabelFile:
    """Content of a ``labels.json``; paths are absolute and need not exist."""

    labels: Labels
    recording: Path | None = None
    video: Path | None = None


def write_labels(
    path: Path,
    labels: Labels,
    *,
    timebase: Timebase | None = None,
    recording: Path | None = None,
    video: Path | None = None,
) -> None:
    """Write labels in one step: after an interrupted write the old file is there.

    Parameters
    ----------
    path : Path
        Usually ``labels.json`` in the folder of the recording.
    timebase : Timebase, optional
        Frames of the recording, to write the frames of every span as well, for readers.
    recording, video : Path, optional
        Source of the labels; stored relative to the file's folder.

    Raises
    ------
    OSError
        When the file cannot be written.
    """
    folder = plain_path(path).parent
    head = {
        "format": FORMAT,
        "version": VERSION,
        "recording": None if recording is None else stored_path(plain_path(recording), folder),
        "video": None if video is None else stored_path(plain_path(video), folder),
    }
    atomic_write_text(path, _text(head | labels_entry(labels, timebase)))


def read_labels(path: Path) -> LabelFile:
    """Read a ``labels.json``.

    Raises
    ------
    Sd2Error
        When it is missing, damaged, of a later version, or holds unknown keys or invalid spans;
        the message names file and place.
    """
    path = Path(path)
    document = _read(path, _LabelsDocument, FORMAT)
    with errors_in(path):
        labels = document.made()
    folder = plain_path(path).parent
    return LabelFile(
        labels, located_path(document.recording, folder), located_path(document.video, folder)
    )


def write_label_set(path: Path, label_set: LabelSet) -> None:
    """Write a label set to a file of its own, to share it between projects."""
    head = {"format": SET_FORMAT, "version": VERSION}
    atomic_write_text(path, _text(head | label_set_entry(label_set)))


def read_label_set(path: Path) -> LabelSet:
    """Read a label set; errors are those of :func:`read_labels`."""
    path = Path(path)
    document = _read(path, _LabelSetDocument, SET_FORMAT)
    with errors_in(path):
        return LabelSet(document.name, document.labels)


def labels_of(spans: Iterable[InlineSpan], track: str = "Gestures") -> Labels:
    """Make labels from the spans in a ``recording.json``, with ids in the order of time.

    The track allows overlaps where there are some. A label that no file can hold is put on one
    line and shortened.
    """
    ordered = sorted(spans, key=lambda one: (one.start_s, one.end_s))
    apart = all(one.end_s <= after.start_s for one, after in pairwise(ordered))
    made = [
        Span(k, track, one.start_s, one.end_s, _one_line(one.label), origin="import")
        for k, one in enumerate(ordered, start=1)
    ]
    return Labels((LabelTrack(track, "exclusive" if apart else "free"),), tuple(made))


def _one_line(label: str) -> str:
    kept = "".join(one if one.isprintable() else " " for one in label)
    return " ".join(kept.split())[:LONGEST_NAME].strip() or NO_LABEL


def _read(path: Path, document: type[_Document], expected: str) -> _Document:
    text = read_text(path, f"a file of the format {expected!r}")
    check_version(parse_json(text, path, EXPECTED_JSON), path, expected, VERSION)
    allowed = "what docs/formats.md says of labels"
    with faults_in(path, allowed, "Correct that entry with a text editor"), errors_in(path):
        return document.model_validate_json(text)


def _text(content: dict[str, Any]) -> str:
    """JSON with one line for every span, track and label, so that people can read and compare."""
    return _lines(content, "") + "\n"


def _lines(value: Any, indent: str) -> str:
    deeper = indent + "  "
    if isinstance(value, dict) and any(isinstance(one, list | dict) for one in value.values()):
        inner = [f"{json.dumps(key)}: {_lines(one, deeper)}" for key, one in value.items()]
        brackets = "{}"
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        inner, brackets = [to_json(one) for one in value], "[]"
    else:
        return to_json(value)
    return f"{brackets[0]}\n{deeper}" + f",\n{deeper}".join(inner) + f"\n{indent}{brackets[1]}"
