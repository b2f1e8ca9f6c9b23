"""A guided session: which take is next, what is shown now, and what is missing.

It has neither a window nor a clock: whoever runs it says what time it is, records while it is
:attr:`Session.records`, and gives it the keys.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal

from sd2core.live.protocol import Protocol, Take

Phase = Literal["consent", "ready", "pause", "opening", "countdown", "prompt", "storing", "over"]
"""consent: a person is to come, to read and to agree; ready: to come; pause: to rest; opening:
camera and radar begin; countdown: to stand still; prompt: to move; storing: the take is put
away."""


class Session:
    """Takes of a protocol, one after the other; times are those of any clock, in seconds.

    Parameters
    ----------
    protocol : Protocol
    done : iterable of str
        Names of the takes that are there already.
    agreed : iterable of str
        People who have agreed to the protocol's consent already.
    """

    def __init__(
        self, protocol: Protocol, done: Iterable[str] = (), agreed: Iterable[str] = ()
    ) -> None:
        self.protocol = protocol
        self.takes = protocol.takes
        self.prompt_s = math.nan  # when the person was told to begin
        self._done = {*done}.intersection(take.name for take in self.takes)
        self._skipped: set[Take] = set()
        self._agreed = set(agreed)
        self._last: Take | None = None  # that was stored
        self._until_s = math.inf
        self.take = self._next()
        self.phase: Phase = "over" if self.take is None else self._waiting

    @property
    def number(self) -> int:
        """Place of the take among all, from 1; their number where there is none."""
        return len(self.takes) if self.take is None else self.takes.index(self.take) + 1

    @property
    def missing(self) -> tuple[Take, ...]:
        """Takes that are not there."""
        return tuple(take for take in self.takes if take.name not in self._done)

    @property
    def records(self) -> bool:
        """True while camera and radar are to run."""
        return self.phase in ("opening", "countdown", "prompt", "storing")

    def left_s(self, now_s: float) -> float | None:
        """Time left of the phase; None where it waits for something else than time."""
        return max(self._until_s - now_s, 0.0) if math.isfinite(self._until_s) else None

    def advance(self, now_s: float) -> None:
        """Let time pass."""
        if now_s < self._until_s:
            return
        if self.phase == "pause":
            self._begin("over" if self.take is None else "opening")
        elif self.phase == "countdown":
            self.prompt_s = now_s
            self._begin("prompt", now_s + self.protocol.take_s)
        elif self.phase == "prompt":
            self._begin("storing")

    def opened(self, now_s: float) -> None:
        """Camera and radar have begun to give frames."""
        if self.phase == "opening":
            self._begin("countdown", now_s + self.protocol.countdown_s)

    def stored(self, now_s: float) -> None:
        """The take is there."""
        if self.phase == "storing" and self.take is not None:
            self._last = self.take
            self._done.add(self.take.name)
            self._go_to(self._next(), now_s)

    def agree(self) -> None:
        """Key: the person agrees to be recorded."""
        if self.phase == "consent" and self.take is not None:
            self._agreed.add(self.take.person)
            self._begin("ready")

    def decline(self, now_s: float) -> None:
        """Key: the person does not agree; their takes are left out."""
        if self.phase == "consent" and self.take is not None:
            person = self.take.person
            self._skipped.update(one for one in self.takes if one.person == person)
            self._go_to(self._next(), now_s)

    def go_on(self) -> None:
        """Key: begin the take, without waiting for the end of the pause."""
        if self.phase in ("ready", "pause"):
            self._begin("over" if self.take is None else "opening")

    def again(self, now_s: float) -> None:
        """Key: make the take that is being made, otherwise the last one, once more."""
        if self.phase in ("opening", "countdown", "prompt"):
            self._go_to(self.take, now_s)
        elif self.phase in ("consent", "ready", "pause") and self._last is not None:
            self._begin("pause", now_s + self.protocol.pause_s)
            self.take = self._last

    def skip(self, now_s: float) -> None:
        """Key: leave out the take that is being made, or would be next."""
        if self.take is not None and self.phase not in ("storing", "over"):
            self._skipped.add(self.take)
            self._go_to(self._next(), now_s)

    def _next(self) -> Take | None:
        return next((one for one in self.missing if one not in self._skipped), None)

    @property
    def _waiting(self) -> Phase:
        """How a person who comes is waited for."""
        if self.take is None or self.take.person in self._agreed:
            return "ready"
        return "consent" if self.protocol.consent_text else "ready"

    def _go_to(self, take: Take | None, now_s: float) -> None:
        """Wait for a take, or, after the last one, whether it is to be made again."""
        stays = take is None or (self.take is not None and take.person == self.take.person)
        waits = not stays or self.phase in ("consent", "ready")
        self.take = take
        if take is None and self._last is None:
            self._begin("over")
        elif waits and take is not None:
            self._begin(self._waiting)
        else:
            self._begin("pause", now_s + self.protocol.pause_s)

    def _begin(self, phase: Phase, until_s: float = math.inf) -> None:
        self.phase, self._until_s = phase, until_s
