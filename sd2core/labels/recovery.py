"""Recovery of label edits after a crash, and the lock that lets one window edit a recording.

Every recording has a folder of its own below a folder of the caller's choice::

    NAME-1234567890ab/         name of the recording, and a hash of its path
        lock                   held by the editing process for as long as it lives
        holder.json            user, host and process that hold the lock
        000003-000001.journal  session 3, part 1
        000002-000004.declined parts of a session that the user discarded
        000001-000001.damaged  unreadable, and reported once

Only the user may read them. Unreadable files are kept, and unsaved edits are deleted only when
the user asks for it. A part that cannot be read costs that part: the one before it is offered,
with a note.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Container, Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from pydantic import ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.atomic import remove_leftovers
from sd2core.files.edit_lock import EditLock, Holder
from sd2core.files.lock import is_locked
from sd2core.files.paths import user_data
from sd2core.files.texts import first_fault, read_content
from sd2core.labels.journal import SUFFIX, Journal, Kept, replay, unpacked
from sd2core.labels.spans import Labels

DECLINED = ".declined"
"""Suffix of the journal of a session that the user discarded."""
DAMAGED = ".damaged"
"""Suffix of a journal that cannot be read, or holds only half an edit beyond the user's file."""


class _NoHeadError(ValueError):
    """Error for a part of which nothing can be read."""


@dataclass(frozen=True, kw_only=True)
class Recoverable(Kept):
    """Unsaved labels of a session, and the parts that they were read from.

    ``declined`` is True if the user discarded them.
    """

    declined: bool
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Recoveries:
    """Offers, the newest of a recording first, and notes on what could not be read.

    ``settled`` parts hold nothing but what the user's file holds as well; ``damaged`` ones are
    subject of a note, and no version of this program could offer them.
    """

    offers: tuple[Recoverable, ...] = ()
    notes: tuple[str, ...] = ()
    settled: tuple[Path, ...] = field(default=(), compare=False)
    damaged: tuple[Path, ...] = field(default=(), compare=False)


def search(folder: Path, *, declined: bool = False, without: Container[int] = ()) -> Recoveries:
    """Read what sessions, except ``without``, left in a recording's folder, the newest first.

    ``declined`` ones only when asked for.
    """
    suffixes = (SUFFIX, DECLINED) if declined else (SUFFIX,)
    _make_private(folder, *(path for path in listed(folder) if path.is_file()))
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
            if replayed.edits:
                discarded = parts[0].suffix == DECLINED
                offers.append(Recoverable(**vars(replayed), declined=discarded, files=tuple(parts)))
            else:
                (damaged if note else settled).extend(parts)
            break
    return Recoveries(tuple(offers), tuple(notes), tuple(settled), tuple(damaged))


def _make_private(*paths: Path) -> None:
    """Take the permissions of other users away from files and folders, where that is possible."""
    for path in paths:
        with suppress(OSError):
            path.chmod(path.stat().st_mode & 0o700)


def _replayed(path: Path) -> tuple[Kept, str]:
    content = read_content(path, "a journal of label edits")
    records, end = unpacked(content)
    if not records:
        raise _NoHeadError("it does not begin with a whole record")
    left = len(content) - end
    note = f"{path} ends within an edit: {left} bytes are left out" if left else ""
    return replay(records), note


def journals(folder: Path, suffixes: Iterable[str]) -> list[Path]:
    """List parts by their names, newest session first, and its newest part first."""
    named = [path for path in listed(folder) if path.suffix in suffixes and _numbers(path)]
    return sorted(named, key=_numbers, reverse=True)


def _numbers(path: Path) -> tuple[int, ...]:
    parts = path.stem.split("-")
    return tuple(map(int, parts)) if len(parts) == 2 and all(map(str.isdecimal, parts)) else ()


def session_of(path: Path) -> int:
    """Return the number of the session of a part."""
    return _numbers(path)[0]


def listed(folder: Path) -> list[Path]:
    """List a folder; empty where there is none."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _words(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return first_fault(error)
    return str(error)


_LOCK_NAME = "lock"
_HOLDER_NAME = "holder.json"


def recovery_folder() -> Path:
    """Return the user's recovery folder, which may not exist yet."""
    return user_data("recovery")


class RecoveryPlace:
    """Folder of the journals of one recording, and its lock.

    ``root`` is the recovery folder of the program, made when it is needed. Its locks hold between
    processes that name the same folder, as a user's own windows do; ``beside`` is one that others
    see as well. ``recording`` is the labelled recording or video; a link is the same as its target.
    """

    def __init__(self, root: Path, recording: Path, beside: EditLock | None = None) -> None:
        self.recording = Path(recording).resolve()
        number = hashlib.sha256(os.path.normcase(self.recording).encode()).hexdigest()[:12]
        name = "".join(one if one.isalnum() else "-" for one in self.recording.stem[:40])
        self._folder = Path(root) / f"{name}-{number}"
        self._lock = EditLock(self._folder / _LOCK_NAME, self._folder / _HOLDER_NAME)
        self._beside = beside
        self._begun: set[int] = set()

    @property
    def held(self) -> bool:
        """True while this place holds the lock of its folder."""
        return self._lock.held

    def take(self) -> bool:
        """Take the locks; False where another process holds one, and labels are read-only here.

        A lock beside the recording that cannot be written is left out. Raises OSError when the
        folder cannot be made or written to; the lock beside the recording is held then.
        """
        if self._beside is not None:
            with suppress(OSError):
                if not self._beside.take():
                    return False
        self._folder.mkdir(parents=True, exist_ok=True)
        _make_private(self._folder.parent, self._folder)
        if self._lock.take():
            return True
        if self._beside is not None:
            self._beside.release()
        return False

    def heartbeat(self) -> None:
        """Tell others that the locks are still held."""
        for lock in self._locks:
            lock.heartbeat()

    def release(self) -> None:
        """Release the locks. Close the journal first."""
        for lock in self._locks:
            lock.release()

    def holder(self) -> Holder | None:
        """Return the process that holds a lock, this or another one; None where all are free."""
        return next(filter(None, (lock.holder() for lock in self._locks)), None)

    @property
    def _locks(self) -> tuple[EditLock, ...]:
        return (self._lock,) if self._beside is None else (self._beside, self._lock)

    def offers(self, *, declined: bool = False) -> Recoveries:
        """Find labels of earlier sessions; ``declined`` ones only when asked for."""
        return search(self._folder, declined=declined, without=self._begun)

    def begin(self, labels: Labels, recovered: Recoverable | None = None) -> Journal:
        """Begin a session, with the labels of the user's file or of an offer.

        The files of the offer (``recovered``) are deleted once the new journal is on disk. Raises
        Sd2Error when the place is not held; OSError when the journal cannot be written.
        """
        self._check_held()
        remove_leftovers(self._folder)
        earlier = self.offers()
        known = journals(self._folder, (SUFFIX, DECLINED, DAMAGED))
        session = max(map(session_of, known), default=0) + 1
        kept = Kept(self.recording, labels)
        if recovered is not None:
            others = recovered.others
            kept = replace(kept, edits=recovered.edits, last=recovered.last, others=others)
        journal = Journal(self._folder, session, kept)
        self._begun.add(session)
        if recovered is not None:
            self.delete(recovered)
        for path in earlier.settled:
            path.unlink(missing_ok=True)
        # Reported once: not again at every start.
        for path in earlier.damaged:
            path.rename(path.with_suffix(DAMAGED))
        return journal

    def decline(self, offer: Recoverable) -> None:
        """Keep an offer's files, but offer it no more."""
        self._check_held()
        for path in offer.files:
            path.rename(path.with_suffix(DECLINED))

    def delete(self, offer: Recoverable) -> None:
        """Delete the files of an offer."""
        self._check_held()
        for path in offer.files:
            path.unlink(missing_ok=True)

    def _check_held(self) -> None:
        if not self.held:
            holder = self.holder()
            raise Sd2Error(
                f"The labels of {self.recording} are edited by {holder or 'nobody yet'}",
                "labels that this window edits",
                "Close the other window, and open the recording here again",
            )


def offers_in(root: Path, *, declined: bool = False) -> Recoveries:
    """Find unsaved labels of all recordings not being edited, the newest first.

    ``declined`` ones only when asked for.
    """
    searches = [
        search(folder, declined=declined)
        for folder in listed(Path(root))
        if folder.is_dir() and not is_locked(folder / _LOCK_NAME)
    ]
    offers = [offer for one in searches for offer in one.offers]
    notes = [note for one in searches for note in one.notes]
    return Recoveries(tuple(sorted(offers, key=lambda one: -one.time_unix_s)), tuple(notes))
