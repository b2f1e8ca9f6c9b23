"""A guided session in a process beside the window: what a person is told, and the keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

from PySide6.QtCore import QObject, Signal

from sd2app.live.model import COMMAND
from sd2app.live.process import LiveProcess, why_it_ended
from sd2app.live.setup import ListenRequest
from sd2core.live.session import Phase

State = Literal["idle", "starting", "running", "stopping", "ended", "failed"]


@dataclass(frozen=True)
class Step:
    """What is to be done now."""

    phase: Phase
    number: int  # of the take, from 1
    takes: int
    left_s: int | None = None
    person: str = ""
    gesture: str = ""
    instruction: str = ""


class GuidedModel(QObject):
    """``sd2 record --protocol`` beside the window."""

    changed = Signal()
    state_changed = Signal()
    warned = Signal(str)

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: LiveProcess | None = None
        self.state: State = "idle"
        self.request: ListenRequest | None = None
        self.step: Step | None = None
        self.title = self.consent = ""
        self.missing: tuple[str, ...] = ()  # names of takes, once it has ended
        self.not_agreed: tuple[str, ...] = ()  # people of whom takes are missing, likewise
        self.text = ""  # why it failed

    @property
    def busy(self) -> bool:
        """True while the session goes on."""
        return self.state in ("starting", "running", "stopping")

    def start(self, request: ListenRequest) -> None:
        """Begin a session, or go on with one."""
        if self.busy:
            return
        self.request, self.step, self.text = request, None, ""
        self.missing = self.not_agreed = ()
        command = [*self._command, *request.words()]
        self._process = LiveProcess(command, self, self._take, self.changed.emit, self._end)
        self._set_state("starting")
        self._process.start()

    def agree(self) -> None:
        """The person agrees to be recorded."""
        self._press("y")

    def decline(self) -> None:
        """The person does not agree to be recorded."""
        self._press("n")

    def go_on(self) -> None:
        """Begin the take without waiting any longer."""
        self._press(" ")

    def again(self) -> None:
        """Make the take that is being made, otherwise the last one, once more."""
        self._press("a")

    def skip(self) -> None:
        """Leave out the take that is being made, or would be next."""
        self._press("s")

    def stop(self) -> None:
        """End the session; what is stored is kept."""
        if self._process is not None and self.state != "stopping":
            self._process.stop()
            self._set_state("stopping")

    def close(self) -> None:
        """End the session with the window."""
        if self._process is not None:
            self._process.close()
            self._process, self.state = None, "ended"

    def _press(self, key: str) -> None:
        if self._process is not None and self.state == "running":
            self._process.press(key)

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "session":
                self.title, self.consent = event["title"], event["consent"]
                if self.state == "starting":
                    self._set_state("running")
            case "step":
                self.step = Step(**{name: event[name] for name in _STEP if name in event})
            case "stored":
                for doubt in event["doubts"]:
                    self.warned.emit(f"{event['take']}: {doubt}")
            case "missing":
                self.missing = tuple(event["takes"])
                self.not_agreed = tuple(event["not_agreed"])

    def _end(self, code: int, said: str) -> None:
        self._process = None
        if code:
            self.text = why_it_ended(said)
            self.warned.emit(self.text)
        self._set_state("failed" if code else "ended")

    def _set_state(self, state: State) -> None:
        self.state = state
        self.state_changed.emit()
        self.changed.emit()


_STEP = tuple(one.name for one in fields(Step))
