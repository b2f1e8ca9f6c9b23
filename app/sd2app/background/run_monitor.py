"""One command in a folder of its own, whoever started it, followed by that folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.detached import is_alive
from sd2app.background.poller import RepeatedLook
from sd2app.background.run_folder import CommandFolder

Phase = Literal[
    "starting", "running", "stopping", "cancelling", "finished", "stopped", "failed", "died", "gone"
]
"""``gone`` is one that was cancelled, or deleted by somebody else."""
UNDER_WAY: tuple[Phase, ...] = ("starting", "running", "stopping", "cancelling")

POLL_MS = 250
SLOW_POLL_MS = 2000
"""Of a run that has ended; somebody may delete it."""
_INTERRUPTED = 130


class _Look(NamedTuple):
    exists: bool
    live: bool
    launching: bool
    code: int | None
    stopping: bool
    events: list[dict[str, Any]]
    words: str
    has_result: bool


class CommandRun(QObject):
    """What a run told, how it stands, and how to stop it.

    Who inherits reads its lines, and says whether its result is there.

    Parameters
    ----------
    path : Path
    pid : int, optional
        Of the process that was just started for it.

    Signals
    -------
    changed
        Something was told, or it stands otherwise.
    ended
        It came to its end while it was looked at.
    """

    changed = Signal()
    ended = Signal()

    def __init__(
        self, path: Path, parent: QObject | None = None, *, pid: int | None = None
    ) -> None:
        super().__init__(parent)
        self.folder = CommandFolder(path)
        self.about = self.folder.about
        self._pid = pid
        self._lines = self.folder.lines()
        self._phase: Phase = "starting"
        self._known = False
        self._cancelled = self._stopped = False
        self._text = ""
        self._has_result = False
        self._looking = RepeatedLook("command run", self._look, POLL_MS, self)
        self._looking.found.connect(self._take)

    # --- what it is about -----------------------------------------------------------------

    def hear(self, events: Sequence[dict[str, Any]]) -> bool:
        """Take new lines; whether any of them was of use."""
        return bool(events)

    @property
    def begun(self) -> bool:
        """Whether it has said that it is at it."""
        return True

    @property
    def keeping(self) -> bool:
        """Whether it writes what would be lost if it were stopped now."""
        return False

    def has_made(self) -> bool:
        """Whether its result is there; asked in the background."""
        return False

    # --- what is known --------------------------------------------------------------------

    @property
    def known(self) -> bool:
        """Whether the folder has been looked at."""
        return self._known

    @property
    def phase(self) -> Phase:
        """How it stands; what was just asked for counts at once."""
        if self._phase in UNDER_WAY:
            if self._cancelled:
                return "cancelling"
            if self._stopped:
                return "stopping"
        return self._phase

    @property
    def under_way(self) -> bool:
        """Whether a process is at it."""
        return self._phase in UNDER_WAY

    @property
    def has_result(self) -> bool:
        """Whether its result was there at the last look."""
        return self._has_result

    @property
    def text(self) -> str:
        """Why it failed."""
        return self._text

    # --- steering -------------------------------------------------------------------------

    def stop(self) -> None:
        """End it now and keep what there is."""
        if self.under_way and not self.keeping:
            self._stopped = True
            self.folder.stop()
            self.changed.emit()

    def cancel(self) -> None:
        """End it now and delete what it made."""
        if self.under_way:
            self._cancelled = True
            self.folder.stop()
            self.changed.emit()

    def close(self) -> None:
        """Look no more; the process goes on."""
        self._looking.close()

    # --- looking --------------------------------------------------------------------------

    def _look(self) -> _Look:
        folder = self.folder
        launching = self._pid is not None and is_alive(self._pid)
        live = folder.live
        # After that: when it is gone, all that it wrote is there to be read.
        return _Look(
            folder.exists, live, launching, folder.code, folder.stop_wanted,
            self._lines.new(), folder.words, self.has_made(),
        )  # fmt: skip

    def _take(self, look: _Look) -> None:
        told = self.hear(look.events)
        before, self._phase = self._phase, self._phase_of(look)
        if self._phase == "gone" and look.exists:
            self.folder.delete()
        self._stopped |= look.stopping
        another = before != self._phase or not self._known or look.has_result != self._has_result
        self._known, self._has_result = True, look.has_result
        if self._phase not in UNDER_WAY:
            self._looking.set_interval(SLOW_POLL_MS)
            self._text = _reason(look) if self._phase in ("failed", "died") else ""
        if told or another:
            self.changed.emit()
        if before in UNDER_WAY and self._phase not in UNDER_WAY:
            self.ended.emit()

    def _phase_of(self, look: _Look) -> Phase:
        if not look.exists:
            return "gone"
        if look.live:
            return "running" if self.begun else "starting"
        if look.code is None:
            if look.launching:
                return "starting"
            return "gone" if self._cancelled else "died"
        if self._cancelled:
            return "gone"
        if look.code == _INTERRUPTED:
            return "stopped"
        return "finished" if look.code == 0 else "failed"


def _reason(look: _Look) -> str:
    said = look.words.strip()
    return said.removeprefix("sd2: ") if said else "It ended without a word."
