"""Follows one training run, whoever started it, by looking at its folder."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.detached import is_alive, last_words
from sd2app.background.poller import RepeatedLook
from sd2app.training.command import output_of
from sd2app.training.history import TrainingHistory
from sd2app.training.phase import UNDER_WAY, Look, Phase, look_at, phase_of
from sd2core.errors import Sd2Error
from sd2core.runs.control import Word, write_control
from sd2core.runs.progress import ProgressTail
from sd2core.train.config import TrainConfig, read_config
from sd2core.train.folder import TrainingFolder

POLL_MS = 250
SLOW_POLL_MS = 1000
"""Of a run that rests."""
_ASK_AGAIN_S = 15.0
_GIVE_UP_S = 30.0
"""After that a run that was to be cancelled and does not react is ended."""


class _Found(NamedTuple):
    look: Look
    launching: bool
    config: TrainConfig | None
    has_model: bool
    resumable: bool


class TrainingFollower(QObject):
    """One run: what it told, how it stands, and how to steer it.

    Parameters
    ----------
    path : Path
        Folder of the run; may not be there yet.
    pid : int, optional
        Of the process that was just started for it.

    Signals
    -------
    changed
        Something was told.
    phase_changed
    """

    changed = Signal()
    phase_changed = Signal()

    def __init__(
        self,
        path: Path,
        parent: QObject | None = None,
        *,
        pid: int | None = None,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        self.folder = TrainingFolder(path)
        self.history = TrainingHistory()
        self._pid, self._output = pid, output_of(path)
        self._clock_s = clock_s
        self._tail = ProgressTail(self.folder.progress)
        self._phase: Phase = "starting"
        self._known = False
        self._seen_live = False
        self._text = ""
        self._config: TrainConfig | None = None
        self._has_model = self._resumable = False
        self._wish: Word | None = None
        self._cancelled_s: float | None = None
        self._looking = RepeatedLook("training", self._look, POLL_MS, self)
        self._looking.found.connect(self._take)
        self._looking.failed.connect(self._fail)

    # --- what is known --------------------------------------------------------------------

    @property
    def known(self) -> bool:
        """Whether the folder has been looked at."""
        return self._known

    @property
    def phase(self) -> Phase:
        """How it stands; what was just asked for counts at once."""
        if self._phase not in UNDER_WAY or self._wish is None:
            return self._phase
        if self._wish == "cancel":
            return "cancelling"
        if self._wish == "stop":
            return "stopping"
        if self._wish == "pause":
            return self._phase if self._phase == "paused" else "pausing"
        return "resuming" if self._phase in ("paused", "pausing") else self._phase

    @property
    def under_way(self) -> bool:
        """Whether a process is at it."""
        return self._phase in UNDER_WAY

    @property
    def config(self) -> TrainConfig | None:
        """What it was told; None until that can be read."""
        return self._config

    @property
    def text(self) -> str:
        """Why it failed."""
        return self._text

    @property
    def has_model(self) -> bool:
        """Whether there is a model to use."""
        return self._has_model

    @property
    def resumable(self) -> bool:
        """Whether one can go on with it."""
        return self._resumable and self.phase in ("stopped", "failed", "died")

    # --- steering -------------------------------------------------------------------------

    def tell(self, word: Word) -> None:
        """Tell the process what to do; what it was told last counts."""
        if not self.under_way or (self._wish in ("stop", "cancel") and word != "cancel"):
            return
        self._wish = word
        if word == "cancel" and self._cancelled_s is None:
            self._cancelled_s = self._clock_s()
        if self.folder.path.is_dir():
            write_control(self.folder.control, word)
        elif word in ("stop", "cancel") and self._pid is not None:
            # Not as far as its folder: there is nothing to keep.
            _signal(self._pid, signal.SIGTERM)
        self.phase_changed.emit()
        self.changed.emit()

    def delete(self) -> None:
        """Delete what it made; only after its end."""
        if not self.under_way:
            self.folder.discard()
            self._output.unlink(missing_ok=True)

    def close(self) -> None:
        """Look no more; the process goes on."""
        self._looking.close()

    # --- looking --------------------------------------------------------------------------

    def look(self) -> None:
        """Look at the folder now, in the background."""
        self._looking.look()

    def _look(self) -> _Found:
        launching = self._pid is not None and is_alive(self._pid)
        look, config = look_at(self.folder, self._tail), self._config
        if config is None and look.exists:
            with suppress(Sd2Error):  # not written yet
                config = read_config(self.folder.config)
        folder = self.folder
        return _Found(look, launching, config, folder.best.exists(), folder.last.exists())

    def _take(self, found: _Found) -> None:
        look, launching = found.look, found.launching
        self._config, self._has_model, self._resumable = (
            found.config, found.has_model, found.resumable,
        )  # fmt: skip
        told = self.history.take(look.events)
        if look.exists and self._wish is not None and look.word != self._wish and look.live:
            # It had no folder when this was asked for, and may have cleared up meanwhile.
            with suppress(FileNotFoundError):
                write_control(self.folder.control, self._wish)
        self._seen_live |= look.live
        # Once it has been at the folder, a process that still ends is of no interest.
        phase = phase_of(look, self.history, launching and not self._seen_live)
        if phase == "gone" and self._pid is not None and self._wish not in ("stop", "cancel"):
            phase = "failed"
        if phase == "died" and self._wish == "cancel":
            # Ended before it could clear up.
            self.folder.discard()
            phase = "gone"
        if (
            phase in ("running", "paused")
            and {"run": "running", "pause": "paused"}.get(self._wish or "") == phase
        ):
            self._wish = None
        another = phase != self._phase or not self._known
        self._phase, self._known = phase, True
        if another:
            self._settle()
        self._hurry()
        if another:
            self.phase_changed.emit()
        if told or another:
            self.changed.emit()

    def _settle(self) -> None:
        """The phase is another one."""
        ended = self._phase not in UNDER_WAY
        self._looking.set_interval(SLOW_POLL_MS if ended or self._phase == "paused" else POLL_MS)
        if not ended:
            return
        self._wish = None
        said = last_words(self._output)
        if self._phase == "failed":
            self._text = self.history.error or said.removeprefix("sd2: ") or _SILENT
        elif self._phase == "died":
            self._text = said.splitlines()[-1] if said else ""
        if self._phase in ("finished", "stopped", "gone"):
            self._output.unlink(missing_ok=True)
        self._pid = None

    def _hurry(self) -> None:
        """A run that does not hear that it is cancelled is ended."""
        if self._cancelled_s is None or not self.under_way:
            return
        waited_s = self._clock_s() - self._cancelled_s
        if waited_s < _ASK_AGAIN_S:
            return
        try:
            pid = self.folder.status().pid or self._pid
        except Sd2Error:
            pid = self._pid
        if pid is not None:
            kill = getattr(signal, "SIGKILL", signal.SIGTERM)
            _signal(pid, kill if waited_s > _GIVE_UP_S else signal.SIGTERM)

    def _fail(self, error: Exception) -> None:
        # The disk is away for a moment; it is looked at again.
        if self._text != str(error):
            self._text = str(error)
            self.changed.emit()


_SILENT = "The training ended without a word."


def _signal(pid: int, number: signal.Signals) -> None:
    # It may have ended meanwhile.
    with suppress(OSError):
        os.kill(pid, number)
