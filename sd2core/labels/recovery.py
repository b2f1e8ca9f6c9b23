"""What a crash left behind is offered again; and one window at a time edits a recording.

Below a folder of the caller's choice every recording has a place of its own::

    NAME-1234567890ab/         name of the recording, and a number made of its path
        lock                   held by who edits it, for as long as that process lives
        holder.json            who that is
        000003-000001.journal  session 3, part 1
        000002-000004.declined parts of a session that the user did not want back
        000001-000001.damaged  what nobody can read, once that was said

Nothing that cannot be read is deleted, and nothing that the user has not saved, unless he
says so.
"""

from __future__ import annotations

import getpass
import hashlib
import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text, remove_leftovers
from sd2core.files.lock import FileLock, is_locked
from sd2core.labels.journal import SUFFIX, Journal
from sd2core.labels.recovery_offers import (
    DAMAGED,
    DECLINED,
    Found,
    Offer,
    journals,
    listed,
    search,
    session_of,
)
from sd2core.labels.spans import Labels

_LOCK_NAME = "lock"
_HOLDER_NAME = "holder.json"


def recovery_folder() -> Path:
    """Recovery folder of the user; it need not be there yet."""
    import platformdirs

    return Path(platformdirs.user_data_dir("sd2-studio", appauthor=False)) / "recovery"


@dataclass(frozen=True)
class Holder:
    """Who edits the labels of a recording; empty or 0 where it is not known.

    Parameters
    ----------
    user, host : str
    pid : int
    since_unix_s : float
    """

    user: str = ""
    host: str = ""
    pid: int = 0
    since_unix_s: float = 0.0

    def __str__(self) -> str:
        who = self.user or "Somebody"
        return f"{who} on {self.host} (process {self.pid})" if self.host else who


class RecoveryPlace:
    """Where the journals of one recording are.

    Parameters
    ----------
    root : Path
        Recovery folder of the program, made when it is needed. Locks hold between those who
        name the same folder: a folder of the user's keeps out his own windows only.
    recording : Path
        The recording, or the video, that is labelled; a link is the same as what it leads to.
    """

    def __init__(self, root: Path, recording: Path) -> None:
        self._recording = Path(recording).resolve()
        number = hashlib.sha256(os.path.normcase(self._recording).encode()).hexdigest()[:12]
        name = "".join(one if one.isalnum() else "-" for one in self._recording.stem[:40])
        self._folder = Path(root) / f"{name}-{number}"
        self._lock: FileLock | None = None
        self._begun: set[int] = set()

    @property
    def recording(self) -> Path:
        """What is labelled, with links followed."""
        return self._recording

    @property
    def held(self) -> bool:
        """Whether the labels are this place's to edit."""
        return self._lock is not None

    def take(self) -> bool:
        """Become the one who edits; False where another is: show the labels read-only then.

        Raises
        ------
        OSError
            When the folder cannot be made or written to.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(self._folder / _LOCK_NAME)
        if self.held or not lock.take():
            return self.held
        self._lock = lock
        holder = Holder(_user(), socket.gethostname(), os.getpid(), time.time())
        with suppress(OSError):  # one can edit without having said who one is
            atomic_write_text(self._folder / _HOLDER_NAME, json.dumps(asdict(holder)) + "\n")
        return True

    def release(self) -> None:
        """Let others edit. Close the journal first."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def holder(self) -> Holder | None:
        """Who edits, of this process or another; None where nobody does."""
        if not is_locked(self._folder / _LOCK_NAME):
            return None
        try:
            content = json.loads((self._folder / _HOLDER_NAME).read_text(encoding="utf-8"))
            return Holder(**content)
        except (OSError, ValueError, TypeError):  # not written yet, or by another version
            return Holder()

    def offers(self, *, declined: bool = False) -> Found:
        """What earlier sessions left here; those that were declined only when asked for."""
        suffixes = (SUFFIX, DECLINED) if declined else (SUFFIX,)
        return search(self._folder, suffixes, without=self._begun).found

    def begin(self, labels: Labels, recovered: Offer | None = None) -> Journal:
        """Begin a session, with the labels of the user's file or of an offer.

        Parameters
        ----------
        labels : Labels
            Those that are edited from now on.
        recovered : Offer, optional
            Where they are from; what it was read from is deleted once they are on disk anew.

        Raises
        ------
        Sd2Error
            When the place is not held.
        OSError
            When the disk does not take it.
        """
        self._check_held()
        remove_leftovers(self._folder)
        earlier = search(self._folder, (SUFFIX,), without=self._begun)
        known = journals(self._folder, (SUFFIX, DECLINED, DAMAGED))
        session = max(map(session_of, known), default=0) + 1
        journal = Journal(
            self._folder,
            session,
            self._recording,
            labels,
            unsaved=recovered.edits if recovered else 0,
            last=recovered.last if recovered else "",
        )
        self._begun.add(session)
        if recovered is not None:
            self.delete(recovered)
        for path in earlier.settled:
            path.unlink(missing_ok=True)
        # It has been said: nobody needs to hear of it again at every start.
        for path in earlier.damaged:
            path.rename(path.with_suffix(DAMAGED))
        return journal

    def decline(self, offer: Offer) -> None:
        """Remember that the user does not want it; it is kept, and not offered again."""
        self._check_held()
        for path in offer.files:
            path.rename(path.with_suffix(DECLINED))

    def delete(self, offer: Offer) -> None:
        """Delete what an offer was read from."""
        self._check_held()
        for path in offer.files:
            path.unlink(missing_ok=True)

    def _check_held(self) -> None:
        if not self.held:
            holder = self.holder()
            raise Sd2Error(
                f"The labels of {self._recording} are edited by {holder or 'nobody yet'}",
                "labels that this window edits",
                "Close the other window, and open the recording here again",
            )


def offers_in(root: Path, *, declined: bool = False) -> Found:
    """What sessions of all recordings left behind that nobody edits now, the newest first.

    Those that were declined only when asked for.
    """
    suffixes = (SUFFIX, DECLINED) if declined else (SUFFIX,)
    found = [
        search(folder, suffixes).found
        for folder in listed(Path(root))
        if folder.is_dir() and not is_locked(folder / _LOCK_NAME)
    ]
    offers = [offer for one in found for offer in one.offers]
    notes = [note for one in found for note in one.notes]
    return Found(tuple(sorted(offers, key=lambda one: -one.time_unix_s)), tuple(notes))


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):  # a number without a name, e.g. in a container
        return ""
