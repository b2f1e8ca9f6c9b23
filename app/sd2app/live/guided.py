"""A guided session in a process beside the window: what a person is told, and the keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from PySide6.QtCore import QObject

from sd2app.live.process import COMMAND, SteeredCommand
from sd2app.live.setup import ListenRequest
from sd2core.files.tables import counted
from sd2core.live.session import Phase


@dataclass(frozen=True)
class Step:
    """Step of a session that is to be done now."""

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
        self.consent = ""
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
                self.consent = event["consent"]
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


KEYS_OF_CONSENT = "Y: I agree    N: I do not agree    ↑ ↓: read on    Esc: stop    F11: full screen"
KEYS = "Space: go on    A: again    S: skip    Esc: stop    F11: full screen"
KEYS_AT_END = "Esc: close    F11: full screen"


def keys_text(model: GuidedModel) -> str:
    """Keys that do something now."""
    if not model.busy:
        return KEYS_AT_END
    return KEYS_OF_CONSENT if asks_consent(model) else KEYS


def asks_consent(model: GuidedModel) -> bool:
    """True while a person is to read what they agree to."""
    return model.state == "running" and model.step is not None and model.step.phase == "consent"


def headline(model: GuidedModel) -> str:
    """Headline: what to do, in few words."""
    step = model.step
    if model.state == "failed":
        return "The session has failed"
    if model.state == "stopped":
        return "Thank you" if not model.missing else "Stopped"
    if model.state == "stopping" or step is None:
        return "One moment…"
    if step.phase == "consent":
        return f"{step.person}, do you agree?"
    if step.phase == "ready":
        return f"{step.person}, please"
    if not step.instruction:
        return "That was the last take"
    return step.instruction


def count_text(model: GuidedModel) -> str:
    """Seconds that are left, where somebody waits for their end."""
    step = model.step
    counts = step is not None and step.phase in ("countdown", "prompt", "pause")
    return "" if not counts or not model.busy or step is None else str(step.left_s)


def detail(model: GuidedModel) -> str:
    """Line below the headline."""
    step = model.step
    if model.state == "failed":
        return model.text
    if model.state == "stopped":
        if not model.missing:
            return "Nothing is missing."
        lacking = f"{counted(len(model.missing), 'take')} missing: {', '.join(model.missing)}"
        without = f"Not agreed: {', '.join(model.not_agreed)}" if model.not_agreed else ""
        return "\n".join(filter(None, (lacking, without)))
    if step is None or not model.busy:
        return ""
    match step.phase:
        case "ready":
            return "Space begins."
        case "pause" if not step.instruction:
            return "A makes it once more."
        case "pause":
            return "Next. Rest until then."
        case "opening" | "countdown":
            return "Stand still"
        case "prompt":
            return "Now"
    return ""


def progress_text(model: GuidedModel) -> str:
    """Place of the take among all."""
    step = model.step
    return "" if step is None else f"Take {step.number} of {step.takes}"
