"""The tour: steps that point at a thing and wait until the hand has done it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import delayed
from sd2app.feature import always
from sd2app.settings import Settings

_LOOK_MS = 150
_PRAISE_MS = 900
"""Time for which a step is seen to be done before the next."""
_STEP = "tour/step"


@dataclass(frozen=True)
class Step:
    """Step of the tour, in words and as a question to the models.

    ``targets`` are accessible names of what to point at, the first that is on screen.
    ``reached`` compares ``state`` as it was at the start of the step with what it is now.
    Names of actions in braces stand for their keys. Without what it ``needs``, the step before
    is to be done again.
    """

    title: str
    words: str
    targets: tuple[str, ...]
    state: Callable[[], Any]
    reached: Callable[[Any, Any], bool]
    needs: Callable[[], bool] = always


class TourModel(QObject):
    """Place in the tour, kept in the settings, so that it goes on where it was left.

    ``can_show`` tells if the sample is open, ``open_sample`` opens it; without it the tour rests.
    """

    changed = Signal()

    def __init__(
        self,
        steps: Sequence[Step],
        settings: Settings,
        can_show: Callable[[], bool],
        open_sample: Callable[[], object],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.steps = tuple(steps)
        self._settings, self._can_show, self._open_sample = settings, can_show, open_sample
        self.wanted = False  # the user takes the tour now
        self.done = False  # the step on screen was just done
        self.over = False  # the last one was
        self._before: Any = None
        self._looking = QTimer(self, interval=_LOOK_MS)
        self._looking.timeout.connect(self.look)
        self._praise = delayed(self.skip, _PRAISE_MS, self)

    @property
    def kept(self) -> int:
        """Number of the step to go on with, from 0."""
        stored = self._settings.stored(_STEP, 0)
        return stored if 0 <= stored < len(self.steps) else 0

    @property
    def step(self) -> Step | None:
        """Step on screen; None while the tour rests."""
        return self.steps[self.kept] if self.wanted and not self.over and self._can_show() else None

    def begin(self) -> None:
        """Take the tour, or go on with it, on the sample."""
        self.wanted, self.over = True, False
        if self._can_show():
            self._enter()
        else:
            self._open_sample()

    def follow_document(self) -> None:
        """Go on where the sample has been opened; rest where something else was."""
        if self.wanted and self._can_show():
            self._enter()
        elif self.wanted:
            self.leave()

    def leave(self) -> None:
        """Let the tour rest, for later."""
        self.wanted = self.over = self.done = False
        self._looking.stop()
        self._praise.stop()
        self.changed.emit()

    def skip(self) -> None:
        """Go to the next step that has what it needs, or end the tour."""
        if not self.wanted:
            return
        later = range(self.kept + 1, len(self.steps))
        number = next((one for one in later if self.steps[one].needs()), None)
        self.over = number is None
        self._settings.set_value(_STEP, number or 0)
        self._enter()

    def back(self) -> None:
        """Go to the step before."""
        self._settings.set_value(_STEP, max(self.kept - 1, 0))
        self._enter()

    def look(self) -> None:
        """Find out if the step was done."""
        step = self.step
        if step is not None and not self.done and step.reached(self._before, step.state()):
            self.done = True
            self._praise.start()
            self.changed.emit()

    def _enter(self) -> None:
        while self.kept and not self.steps[self.kept].needs():
            self._settings.set_value(_STEP, self.kept - 1)
        self.done = False
        self._praise.stop()
        step = self.step
        if step is None:
            self._looking.stop()
        else:
            self._before = step.state()
            self._looking.start()
        self.changed.emit()
