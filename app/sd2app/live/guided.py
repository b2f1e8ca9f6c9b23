"""A guided session in a process beside the window: what a person is told, and the keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from PySide6.QtCore import QObject

from sd2app.live.process import COMMAND, SteeredCommand
from sd2app.live.setup import ListenRequest
from sd2core.live.session import Phase


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


class GuidedModel(SteeredCommand):
    """``sd2 record --protocol`` beside the window."""

    first_event = "session"

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent, command)
        self.step: Step | None = None
        self.title = self.consent = ""
        self.missing: tuple[str, ...] = ()  # names of takes, once it has ended
        self.not_agreed: tuple[str, ...] = ()  # people of whom takes are missing, likewise

    def start(self, request: ListenRequest) -> None:
        """Begin a session, or go on with one."""
        if self.busy:
            return
        self.request, self.step = request, None
        self.missing = self.not_agreed = ()
        self._launch(request.words())

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "session":
                self.title, self.consent = event["title"], event["consent"]
            case "step":
                self.step = Step(**{name: event[name] for name in _STEP if name in event})
            case "stored":
                for doubt in event["doubts"]:
                    self.warned.emit(f"{event['take']}: {doubt}")
            case "missing":
                self.missing = tuple(event["takes"])
                self.not_agreed = tuple(event["not_agreed"])

    def _end(self, code: int, error_text: str) -> None:
        super()._end(code, error_text)
        if code:
            self.warned.emit(self.text)


_STEP = tuple(one.name for one in fields(Step))
