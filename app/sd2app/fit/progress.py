"""Lines of ``sd2 fit --progress-json`` (see ``docs/formats.md``) and the progress they tell."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.track import LANDMARKS

FORMAT, VERSION = "sd2-fit-progress", 1


@dataclass(frozen=True)
class Started:
    """The video is open."""

    frames: int
    width: int
    height: int
    stages: tuple[str, ...]
    resumed: bool


@dataclass(frozen=True)
class Progressed:
    """``done`` of ``total`` (0: not known) of one stage."""

    stage: str
    done: int
    total: int
    unit: str


@dataclass(frozen=True, eq=False)
class Found:
    """Landmarks of one frame: shape (33, 3), x and y in pixels of the upright picture, visibility.

    Visibility is from 0 to 1; NaN where there is no person.
    """

    frame: int
    points: NDArray[np.float32]


@dataclass(frozen=True)
class Noted:
    """A sentence the user should read."""

    text: str


@dataclass(frozen=True)
class Done:
    """The mesh is written."""

    frames: int
    present: int
    seconds: float


@dataclass(frozen=True)
class Refused:
    """Reason of a failure in a sentence; the process ends."""

    text: str


Message = Started | Progressed | Found | Noted | Done | Refused


def message_of(content: Mapping[str, Any]) -> Message | None:
    """Read one line; None for what this version does not know or cannot read."""
    reader = _READERS.get(str(content.get("event")))
    if reader is None:
        return None
    try:
        return reader(content)
    except (KeyError, TypeError, ValueError):
        return None


def _started(content: Mapping[str, Any]) -> Message | None:
    if content["format"] != FORMAT or content["version"] > VERSION:
        return None
    return Started(
        int(content["frames"]),
        int(content["width"]),
        int(content["height"]),
        tuple(map(str, content["stages"])),
        bool(content.get("resumed", False)),
    )


def _progressed(content: Mapping[str, Any]) -> Message:
    return Progressed(
        str(content["stage"]),
        int(content["done"]),
        int(content["total"]),
        str(content.get("unit", "")),
    )


def _found(content: Mapping[str, Any]) -> Message | None:
    image_px = np.array(content["image_px"], np.float32)  # null becomes NaN
    visibility = np.array(content["visibility"], np.float32)
    if image_px.shape != (len(LANDMARKS), 2) or visibility.shape != (len(LANDMARKS),):
        return None
    points = np.concatenate([image_px, visibility[:, None]], axis=1)
    return Found(int(content["frame"]), points)


def _done(content: Mapping[str, Any]) -> Message:
    return Done(int(content["frames"]), int(content["present"]), float(content["seconds"]))


_READERS: dict[str, Any] = {
    "start": _started,
    "progress": _progressed,
    "landmarks": _found,
    "note": lambda content: Noted(str(content["text"])),
    "done": _done,
    "error": lambda content: Refused(str(content["text"])),
}


WORDS = {
    "models": "fetching the landmark models",
    "find": "finding the person",
    "refine": "looking again",
    "lift": "estimating depth",
    "fit": "fitting the body",
    "write": "writing the mesh",
}
_WEIGHTS = {"models": 0.0, "find": 1.0, "refine": 4.0, "lift": 0.1, "fit": 3.0, "write": 0.3}
"""Time of a frame in each stage, relative to the others."""
_UNKNOWN_WEIGHT = 0.5
_SETTLING_S = 2.0
"""Shortest time from which the rest is estimated."""


class FitProgress:
    """Progress of one fit over all of its stages, and its time left."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._stages: tuple[str, ...] = ()
        self._began: list[tuple[float, float]] = []  # time and share at a stage's first report
        self.stage = ""
        self.done = 0
        self.total = 0
        self.unit = ""

    def start(self, message: Started) -> None:
        """Take the stages that are to come."""
        self._stages = message.stages

    def report(self, message: Progressed) -> None:
        """Take a report."""
        another = message.stage != self.stage
        self.stage, self.done = message.stage, message.done
        self.total, self.unit = message.total, message.unit
        share = self.share
        if share is not None and (another or not self._began):
            self._began.append((self._clock_s(), share))

    @property
    def share(self) -> float | None:
        """Share of the whole work that is done, None while it is not known."""
        if self.stage not in self._stages:
            return None
        weights = [_WEIGHTS.get(stage, _UNKNOWN_WEIGHT) for stage in self._stages]
        here = self._stages.index(self.stage)
        within = min(self.done / self.total, 1.0) if self.total else 0.0
        total = math.fsum(weights)
        return (math.fsum(weights[:here]) + within * weights[here]) / total if total else None

    @property
    def left_s(self) -> float | None:
        """Seconds to the end at the speed of this stage, None while it is not known.

        At the beginning of a stage the speed is that since the one before, or before that.
        """
        share = self.share
        if share is None:
            return None
        for began_s, began_share in reversed(self._began):
            elapsed_s, gained = self._clock_s() - began_s, share - began_share
            if elapsed_s >= _SETTLING_S and gained > 0:
                return elapsed_s * (1.0 - share) / gained
        return None

    @property
    def text(self) -> str:
        """Stage and count in words."""
        words = WORDS.get(self.stage, self.stage)
        if not words:
            return "starting"
        if self.unit == "byte":
            megabytes = f"{self.done / 1e6:.1f}"
            return f"{words}, {megabytes} of {self.total / 1e6:.1f} MB" if self.total else words
        if not self.total:
            return words
        unit = {"frame": "frame ", "step": "step "}.get(self.unit, "")
        return f"{words}, {unit}{self.done} of {self.total}"


def left_in_words(left_s: float | None) -> str:
    """Time left, rounded as an estimate deserves."""
    if left_s is None:
        return ""
    if left_s < 10:
        return "a few seconds left"
    if left_s < 60:
        return f"about {5 * round(left_s / 5)} s left"
    if left_s < 3600:
        return f"about {max(round(left_s / 60), 1)} min left"
    hours, minutes = divmod(round(left_s / 60), 60)
    return f"about {hours} h {minutes} min left"
