"""What ``sd2 fit --progress-json`` says, line by line; see ``docs/formats.md``."""

from __future__ import annotations

import json
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
    """Landmarks of one frame.

    Parameters
    ----------
    frame : int
    points : float32 array, shape (33, 3)
        x and y in pixels of the upright picture, and visibility from 0 to 1; NaN
        where there is nobody.
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
    """A sentence on what is wrong; the process ends."""

    text: str


Message = Started | Progressed | Found | Noted | Done | Refused


def message_of(line: str) -> Message | None:
    """Read one line; None for what this version does not know or cannot read."""
    try:
        content = json.loads(line)
    except ValueError:
        return None
    reader = _READERS.get(str(content.get("event"))) if isinstance(content, dict) else None
    if reader is None:
        return None
    try:
        return reader(content)
    except (KeyError, TypeError, ValueError):
        return None


def _started(content: dict[str, Any]) -> Message | None:
    if content["format"] != FORMAT or content["version"] > VERSION:
        return None
    return Started(
        int(content["frames"]),
        int(content["width"]),
        int(content["height"]),
        tuple(map(str, content["stages"])),
        bool(content.get("resumed", False)),
    )


def _progressed(content: dict[str, Any]) -> Message:
    return Progressed(
        str(content["stage"]),
        int(content["done"]),
        int(content["total"]),
        str(content.get("unit", "")),
    )


def _found(content: dict[str, Any]) -> Message | None:
    image_px = np.array(content["image_px"], np.float32)  # null becomes NaN
    visibility = np.array(content["visibility"], np.float32)
    if image_px.shape != (len(LANDMARKS), 2) or visibility.shape != (len(LANDMARKS),):
        return None
    points = np.concatenate([image_px, visibility[:, None]], axis=1)
    return Found(int(content["frame"]), points)


def _done(content: dict[str, Any]) -> Message:
    return Done(int(content["frames"]), int(content["present"]), float(content["seconds"]))


_READERS: dict[str, Any] = {
    "start": _started,
    "progress": _progressed,
    "landmarks": _found,
    "note": lambda content: Noted(str(content["text"])),
    "done": _done,
    "error": lambda content: Refused(str(content["text"])),
}
