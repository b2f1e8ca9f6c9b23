"""A radar and a camera watched for a while, for the check of the place; nothing is kept."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.live.cameras import Camera, shrunk
from sd2core.live.checking import PICTURE_WIDTH_PX, Moved, Seen, moved_between, seen_in
from sd2core.live.reception import Reception
from sd2core.live.sources import Frame

_WAITING = 64
"""Frames that may wait; for the check, some may be left out."""
_PICTURE_S = 0.09
"""At most ten pictures in a second are compared: in less time a person hardly moves."""
_WAIT_S, _END_S = 0.05, 5.0


@dataclass
class Looked:
    """Movements that camera and radar have seen so far."""

    seen: list[Seen] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)
    picture: NDArray[np.uint8] | None = None  # the newest one, RGB
    error: Exception | None = None  # that has stopped the camera


def look(
    reception: Reception,
    camera: Camera,
    delays_s: tuple[float, float],
    seconds: float,
    stop: threading.Event,
    follow: Callable[[Looked], object],
) -> Looked:
    """Watch both for a while.

    Parameters
    ----------
    reception : Reception
    camera : Camera
    delays_s : (float, float)
        From what happened to the arrival of its picture, and of its frame.
    seconds : float
        How long.
    stop : Event
        Set to end earlier; is set at the end.
    follow : callable
        Called some twenty times a second with what was seen so far.
    """
    camera_delay_s, radar_delay_s = delays_s
    frames: queue.Queue[Frame] = queue.Queue(_WAITING)
    looked = Looked()

    def take(frame: Frame) -> None:
        with contextlib.suppress(queue.Full):
            frames.put_nowait(frame)

    filmed = (camera, camera_delay_s, looked, stop)
    filming = threading.Thread(target=_watch_pictures, args=filmed, daemon=True)
    filming.start()
    reception.begin(take)
    source = reception.source
    head = source.head(0.0)
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s and not (stop.is_set() or looked.error or reception.error):
        follow(looked)
        try:
            frame = frames.get(timeout=_WAIT_S)
        except queue.Empty:
            if reception.is_over and not filming.is_alive():
                break
            continue
        alone = head.as_capture(source.words(frame))
        looked.seen.append(seen_in(alone, frame.received_s - radar_delay_s))
    stop.set()
    filming.join(_END_S)
    if (error := looked.error or reception.error) is not None:
        raise error
    return looked


def _watch_pictures(camera: Camera, delay_s: float, looked: Looked, stop: threading.Event) -> None:
    before: NDArray[np.uint8] | None = None
    before_s = 0.0
    try:
        while not stop.is_set() and (taken := camera.read()) is not None:
            picture, taken_s = taken
            if taken_s - before_s < _PICTURE_S:
                continue
            looked.picture = picture
            grey = _small_grey(picture)
            if before is not None:
                middle_s = 0.5 * (before_s + taken_s) - delay_s
                looked.moved.append(moved_between(before, grey, middle_s, taken_s - before_s))
            before, before_s = grey, taken_s
    except (Sd2Error, OSError) as error:  # raised again where it is seen
        looked.error = error


def _small_grey(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    small = shrunk(picture, PICTURE_WIDTH_PX)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
