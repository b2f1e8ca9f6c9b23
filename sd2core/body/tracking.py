"""First pass over a video: the person is searched for ten times a second."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Pose
from sd2core.body.person_selection import Start
from sd2core.body.person_tracker import PersonTracker
from sd2core.body.roi import PLACES, Floats, Pixels, Sightings, roi_numbers
from sd2core.io.video import VideoReader

SEARCH_STEP_S = 1.0 / 10.0
"""Time between frames that are searched; the path in between is smooth."""
_BLOCK_BYTES = 192 * 2**20


Seen = Callable[[int, Pose | None], None]
"""``seen(frame, pose)``, None where the person was not found; may raise ``Cancelled``."""


class Search:
    """First pass: the person ten times a second, from the start both ways."""

    def __init__(self, video: VideoReader, start: Start, follower: PersonTracker) -> None:
        self._video = video
        self._follower = follower
        self._start = start
        times = video.timebase.times_s
        ahead = looked_at(times[start.frame :], SEARCH_STEP_S) + start.frame
        behind = start.frame - looked_at(
            times[start.frame] - times[start.frame :: -1], SEARCH_STEP_S
        )
        self._order = np.concatenate([ahead, behind[1:]])
        self._turn = len(ahead)
        # The second half runs backwards in time.
        self._times_s = np.abs(times[self._order] - times[start.frame])
        self._rois = np.full((len(self._order), 4), np.nan)
        self._confidence = np.zeros(len(self._order))
        self._unclear = np.zeros(len(self._order), bool)
        self._others = np.zeros((len(self._order), len(PLACES)), bool)
        self._done = 0

    @property
    def done(self) -> tuple[int, int]:
        """Number of frames searched, and of all to be searched."""
        return self._done, len(self._order)

    @property
    def settled(self) -> bool:
        """True unless it is still in doubt who was seen last."""
        return not (self._follower.lost and self._follower.hopes)

    def run(self, seen: Seen) -> Sightings:
        """Search the frames that are left."""
        for picture in self._pictures():
            number = self._done
            frame = int(self._order[number])
            if number in (0, self._turn):
                self._follower.begin(self._start.roi, 0.0)
            pose = self._follower.step(picture, float(self._times_s[number]))
            self._unclear[number] = self._follower.unclear
            self._others[number] = self._follower.beside(pose)
            self._forget(number, self._follower.mistaken_s)
            if pose is not None:
                # With those that were in doubt until now.
                detections = [each for _, each in self._follower.hopes] or [pose]
                rows = slice(number + 1 - len(detections), number + 1)
                self._rois[rows] = [roi_numbers(each.next_roi) for each in detections]
                self._confidence[rows] = [each.confidence for each in detections]
                self._unclear[rows] = self._follower.unclear
                self._others[rows, 3] = False
            self._done += 1
            seen(frame, pose)
        rank = np.argsort(self._order, kind="stable")
        return Sightings(
            self._order[rank],
            self._rois[rank],
            self._confidence[rank],
            self._unclear[rank],
            self._others[rank],
        )

    def _forget(self, number: int, since_s: float) -> None:
        """Take back what was detected after a time and up to a number: that was somebody else.

        The other half, and the start, stay as they are.
        """
        half = slice(self._turn if number >= self._turn else 1, number + 1)
        later = self._times_s[half] > since_s
        self._rois[half][later], self._confidence[half][later] = np.nan, 0.0
        self._unclear[half][later] = True

    def _pictures(self) -> Iterator[Pixels]:
        """Pictures still to be searched, in that order."""
        for number in range(self._done, self._turn):
            yield self._video.read(int(self._order[number]))
        # Backwards in blocks: a video decodes forwards only.
        size = 3 * self._video.width * self._video.height
        block = max(_BLOCK_BYTES // size, 1)
        for number in range(max(self._done, self._turn), len(self._order), block):
            frames = self._order[number : number + block]
            pictures = [self._video.read(int(frame)) for frame in frames[::-1]]
            while pictures:
                yield pictures.pop()

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Results so far, and the state that the next step depends on."""
        return self._follower.state() | {
            "rois": self._rois[: self._done],
            "confidence": self._confidence[: self._done],
            "unclear": self._unclear[: self._done],
            "beside": self._others[: self._done],
        }

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Go on from :meth:`state` of the same search."""
        self._follower.restore(state)
        self._done = len(state["confidence"])
        self._rois[: self._done] = state["rois"]
        self._confidence[: self._done] = state["confidence"]
        self._unclear[: self._done] = state["unclear"]
        self._others[: self._done] = state["beside"]


def looked_at(times_s: Floats, step_s: float) -> NDArray[np.intp]:
    """Numbers of frames that are a step apart or a little less, the last included."""
    chosen = [0]
    for number in range(1, len(times_s)):
        last = number + 1 == len(times_s)
        if last or times_s[number + 1] - times_s[chosen[-1]] > 1.05 * step_s:
            chosen.append(number)
    return np.array(chosen, np.intp)
