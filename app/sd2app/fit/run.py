"""Monitor of one fit in a background process, and what its lines of progress tell.

The lines are those of ``sd2 fit --progress-json``; see ``docs/formats.md``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sd2app.background.run_monitor import CommandRun, History
from sd2core.body.track import LANDMARKS

FORMAT, VERSION = "sd2-fit-progress", 1

WORDS = {
    "models": "fetching the landmark models",
    "people": "following everybody",
    "find": "finding the person",
    "refine": "looking again",
    "fit": "fitting the body",
    "write": "writing the mesh",
}
_WEIGHTS = {"models": 0.0, "find": 1.0, "refine": 4.0, "fit": 3.0, "write": 0.3}
"""Time of a frame in each stage, relative to the others."""
_UNKNOWN_WEIGHT = 0.5
_SETTLING_S = 2.0
"""Shortest time from which the rest is estimated."""
_POLL_MS = 100
_PATIENCE_S = 3.0


class FitProgress(History):
    """Progress of one fit by its lines: stages, landmarks, and notes for the user.

    What is done counts in the stage under way.

    Landmarks stand by their frame, each of shape (33, 3): x and y in pixels of the upright
    picture, NaN where there is no person, and visibility from 0 to 1.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self.landmarks: dict[int, NDArray[np.float32]] = {}
        self._clock_s = clock_s
        self._stages: tuple[str, ...] = ()
        self._began: list[tuple[float, float]] = []  # time and share at a stage's first report
        self.size: tuple[int, int] | None = None  # of the upright picture, once the video is open
        self.resumed = False
        self.stage = self.unit = ""
        self.newest: int | None = None  # frame of the landmarks that came last
        self.notes: list[str] = []

    def _start(self, event: dict[str, Any]) -> None:
        if event["format"] != FORMAT or event["version"] > VERSION:
            raise ValueError("lines of another program, or of a later version")
        self.size = int(event["width"]), int(event["height"])
        self._stages = tuple(map(str, event["stages"]))
        self.resumed = bool(event.get("resumed", False))

    def _report(self, event: dict[str, Any]) -> None:
        stage, done, total = str(event["stage"]), int(event["done"]), int(event["total"])
        another = stage != self.stage
        self.stage, self.done, self.total = stage, done, total
        self.unit = str(event.get("unit", ""))
        share = self.share
        if share is not None and (another or not self._began):
            self._began.append((self._clock_s(), share))

    def _find(self, event: dict[str, Any]) -> None:
        image_px = np.array(event["image_px"], np.float32)  # null becomes NaN
        visibility = np.array(event["visibility"], np.float32)
        if image_px.shape != (len(LANDMARKS), 2) or visibility.shape != (len(LANDMARKS),):
            raise ValueError("another number of landmarks")
        self.newest = int(event["frame"])
        self.landmarks[self.newest] = np.concatenate([image_px, visibility[:, None]], axis=1)

    def _note(self, event: dict[str, Any]) -> None:
        if (text := str(event["text"])) not in self.notes:
            self.notes.append(text)

    @property
    def share(self) -> float | None:
        """Share of the whole work that is done, None while it is not known."""
        if self.stage not in self._stages:
            return None
        kinds = [stage.partition(" ")[0] for stage in self._stages]  # "fit 2": of person 2
        weights = [_WEIGHTS.get(kind, _UNKNOWN_WEIGHT) for kind in kinds]
        here = self._stages.index(self.stage)
        within = min(self.done / self.total, 1.0) if self.total else 0.0
        total = math.fsum(weights)
        done = math.fsum([*weights[:here], within * weights[here]])
        return min(done / total, 1.0) if total else None

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
        kind, _, person = self.stage.partition(" ")
        words = WORDS.get(kind, self.stage) + (f", person {person}" if person else "")
        if not words:
            return "starting"
        if self.unit == "byte":
            megabytes = f"{self.done / 1e6:.1f}"
            return f"{words}, {megabytes} of {self.total / 1e6:.1f} MB" if self.total else words
        if not self.total:
            return words
        unit = {"frame": "frame ", "step": "step "}.get(self.unit, "")
        return f"{words}, {unit}{self.done} of {self.total}"

    readers: ClassVar = {
        **History.readers,
        "start": _start,
        "progress": _report,
        "landmarks": _find,
        "note": _note,
    }


class FitRun(CommandRun):
    """A fit with its progress."""

    histories = FitProgress
    history: FitProgress
    poll_ms = _POLL_MS
    stop_patience_s = _PATIENCE_S
