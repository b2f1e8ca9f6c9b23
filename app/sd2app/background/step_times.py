"""Time of a training step on this machine, from runs or timed for the purpose."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.line_process import Ending, LineProcess
from sd2app.background.step_timer import CLASSIFIER
from sd2app.settings import Settings

COMMAND = (sys.executable, "-u", "-m", "sd2app.background.step_timer")
_STORED = "training/step_times"
_MOST = 40
_PATIENCE_MS = 500


@dataclass(frozen=True)
class StepKey:
    """Settings that determine the time of a step, in the form of its command's arguments."""

    words: tuple[str, ...]

    @classmethod
    def of_denoiser(cls, model: str, batch_size: int) -> StepKey:
        """Key for training a denoiser."""
        return cls((model, str(batch_size)))

    @classmethod
    def of_classifier(cls, model: str, features: str, width: int) -> StepKey:
        """Key for training a classifier."""
        return cls((CLASSIFIER, model, features, str(width)))

    @property
    def text(self) -> str:
        """Text under which the time is stored."""
        return "/".join(self.words)


@dataclass(frozen=True)
class StepTime:
    """Seconds per step, measured in a run or timed on purpose, and the time of measurement."""

    seconds: float
    source: Literal["run", "timed"]
    unix_s: float


class StepTimes(QObject):
    """Remembers times of steps; times a few steps in a separate process on demand."""

    changed = Signal()  # a time is known, or timing began or ended

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._command = tuple(command)
        self._times = _read(settings)
        self._process: LineProcess | None = None
        self._timing: StepKey | None = None
        self._refused: dict[StepKey, str] = {}

    @property
    def timing(self) -> StepKey | None:
        """Key that is being timed."""
        return self._timing

    def of(self, key: StepKey) -> StepTime | None:
        """Known time of a step; None where there is none."""
        return self._times.get(key.text)

    def why_not(self, key: StepKey) -> str:
        """Reason why timing failed; empty where it did not."""
        return self._refused.get(key, "")

    def learn(self, key: StepKey, seconds: float) -> None:
        """Store the time of a step that a run has measured."""
        known = self.of(key)
        if (
            known is None
            or known.source == "timed"
            or abs(known.seconds - seconds) > 0.02 * seconds
        ):
            self._keep(key, StepTime(seconds, "run", time.time()))

    def measure(self, key: StepKey) -> None:
        """Time a few steps, where it is not known; one kind at a time, the newest wins."""
        if self.of(key) is not None or self._timing == key or key in self._refused:
            return
        self.stop()
        self._timing = key
        self._process = LineProcess(self)
        self._process.line.connect(self._read_line)
        self._process.ended.connect(self._end)
        self._process.start([*self._command, *key.words])
        self.changed.emit()

    def stop(self) -> None:
        """Stop timing."""
        if self._process is not None:
            self._process.close()
            self._process.deleteLater()
            self._process = None
        if self._timing is not None:
            self._timing = None
            self.changed.emit()

    def _read_line(self, line: str) -> None:
        key = self._timing
        try:
            seconds = float(json.loads(line)["step_s"])
        except (ValueError, KeyError, TypeError):
            return
        if key is not None and seconds > 0:
            self._keep(key, StepTime(seconds, "timed", time.time()))

    def _end(self, ending: Ending) -> None:
        key, self._timing = self._timing, None
        if key is not None and self.of(key) is None:
            # Of a traceback, what it ends with.
            said = ending.errors.splitlines()[-1:]
            self._refused[key] = said[0] if said else "the process ended without a word."
        self.changed.emit()

    def _keep(self, key: StepKey, found: StepTime) -> None:
        self._times.pop(key.text, None)
        self._times[key.text] = found
        while len(self._times) > _MOST:
            del self._times[next(iter(self._times))]
        content = {name: [one.seconds, one.source, one.unix_s] for name, one in self._times.items()}
        self._settings.set_value(_STORED, json.dumps(content))
        self.changed.emit()


class PatientTiming(QObject):
    """Starts the timing of a step after a delay, so that it waits while the user changes numbers.

    ``wanted`` gives the step to time; None while the estimate is hidden or no run can start.
    """

    def __init__(
        self,
        times: StepTimes,
        wanted: Callable[[], StepKey | None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._times, self._wanted = times, wanted
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_PATIENCE_MS)
        self._timer.timeout.connect(self.look)

    def wait(self) -> None:
        """Restart the delay: something else was chosen."""
        self._timer.start()

    def look(self) -> None:
        """Start the timing at once, if one is wanted."""
        key = self._wanted()
        if key is not None:
            self._times.measure(key)

    def stop(self) -> None:
        """Stop timing."""
        self._timer.stop()
        self._times.stop()


def _read(settings: Settings) -> dict[str, StepTime]:
    try:
        content = json.loads(settings.stored(_STORED, "{}"))
        return {
            str(name): StepTime(float(seconds), "run" if source == "run" else "timed", float(unix))
            for name, (seconds, source, unix) in content.items()
        }
    except (ValueError, TypeError, AttributeError):
        return {}
