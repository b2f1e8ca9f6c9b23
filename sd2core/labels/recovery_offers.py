"""What sessions left behind, read from the folder of a recording's journals.

A part that cannot be read costs that part: the one before it is offered, and a note says so.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from pydantic import ValidationError

from sd2core.errors import Sd2Error
from sd2core.labels.entries import first_fault
from sd2core.labels.journal_records import Replayed, replay, unpacked
from sd2core.labels.spans import Labels

DECLINED = ".declined"
"""Instead of the suffix of a journal: the user did not want it back."""
DAMAGED = ".damaged"
"""Likewise: no version could read it, or it holds but half an edit beyond the user's file."""


class _NoHeadError(ValueError):
    """Nothing of a part can be read."""


@dataclass(frozen=True)
class Offer:
    """Labels that a session left behind, with edits that the user's file does not hold.

    Parameters
    ----------
    recording : Path
        Absolute path of what was labelled.
    labels : Labels
        After the last whole edit.
    edits : int
        How many were not saved.
    last : str
        Name of the last one, such as "Move span".
    time_unix_s : float
        When it was made.
    declined : bool
        Whether the user did not want it.
    files : tuple of Path
        Where it is.
    """

    recording: Path
    labels: Labels
    edits: int
    last: str
    time_unix_s: float
    declined: bool
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Found:
    """What is in a recovery folder.

    Parameters
    ----------
    offers : tuple of Offer
        The newest of a recording first.
    notes : tuple of str
        What could not be read, or only in part.
    """

    offers: tuple[Offer, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Search:
    """What is in the folder of one recording.

    Parameters
    ----------
    found : Found
    settled : tuple of Path
        Parts of sessions that hold nothing but what the user's file holds as well.
    damaged : tuple of Path
        Parts that a note is about and that no version of this program could offer.
    """

    found: Found
    settled: tuple[Path, ...]
    damaged: tuple[Path, ...]


def search(folder: Path, suffixes: Iterable[str], without: Container[int] = ()) -> Search:
    """Read what sessions, but for some, left in a recording's folder, the newest first."""
    offers, notes = [], []
    settled: list[Path] = []
    damaged: list[Path] = []
    for session, group in groupby(journals(folder, suffixes), key=session_of):
        parts = [] if session in without else list(group)
        while parts:  # the newest first; one before it only where that cannot be read
            path = parts[0]
            try:
                replayed, note = _replayed(path)
            except (OSError, ValueError, Sd2Error) as error:
                notes.append(f"{path} cannot be read and is kept ({_words(error)})")
                if isinstance(error, _NoHeadError):
                    damaged.append(path)
                parts = parts[1:]
                continue
            if note:
                notes.append(note)
            if replayed.unsaved:
                offers.append(_offer(replayed, tuple(parts)))
            else:
                (damaged if note else settled).extend(parts)
            break
    return Search(Found(tuple(offers), tuple(notes)), tuple(settled), tuple(damaged))


def _offer(replayed: Replayed, files: tuple[Path, ...]) -> Offer:
    return Offer(
        Path(replayed.recording),
        replayed.labels,
        replayed.unsaved,
        replayed.last,
        replayed.time_unix_s,
        files[0].suffix == DECLINED,
        files,
    )


def _replayed(path: Path) -> tuple[Replayed, str]:
    content = path.read_bytes()
    records, end = unpacked(content)
    if not records:
        raise _NoHeadError("it does not begin with a whole record")
    left = len(content) - end
    note = f"{path} ends within an edit: {left} bytes are left out" if left else ""
    return replay(records), note


def journals(folder: Path, suffixes: Iterable[str]) -> list[Path]:
    """Parts by their names, newest session first, and its newest part first."""
    named = [path for path in listed(folder) if path.suffix in suffixes and _numbers(path)]
    return sorted(named, key=_numbers, reverse=True)


def _numbers(path: Path) -> tuple[int, ...]:
    parts = path.stem.split("-")
    return tuple(map(int, parts)) if len(parts) == 2 and all(map(str.isdecimal, parts)) else ()


def session_of(path: Path) -> int:
    """Number of the session that a part is of."""
    return _numbers(path)[0]


def listed(folder: Path) -> list[Path]:
    """What is in a folder; nothing where there is none."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _words(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return first_fault(error)
    return str(error)
