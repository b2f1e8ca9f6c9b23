"""First pass over a video: one person followed from picture to picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Detection, Pose, PoseDetector, PoseLandmarker
from sd2core.body.person_selection import FOUND, Start
from sd2core.body.roi import CROP_PX, Floats, Pixels, Roi, Sightings, roi_numbers
from sd2core.body.track import LANDMARKS
from sd2core.io.video import VideoReader

Signature = NDArray[np.float32]
"""Histograms of colour of torso and thighs, shape (2, 512); each adds up to 1, or is 0."""

_STEP_S = 1.0 / 15.0
"""Time between frames that are searched; the path in between is smooth."""
_LOOK_ROUND_S = 0.5
_MAX_CANDIDATES = 4
_SMALL = 0.6
_BLOCK_BYTES = 192 * 2**20
_SMALL_PX = 64
_BINS = 8
_SHOULDERS, _HIPS, _KNEES = (
    [LANDMARKS.index(f"{name}.L"), LANDMARKS.index(f"{name}.R")]
    for name in ("shoulder", "hip", "knee")
)


def signature(crop: Pixels, pose: Pose) -> Signature:
    """Colours of a person in a crop of :data:`CROP_PX` pixels."""
    import cv2

    size = (_SMALL_PX, _SMALL_PX)
    small = cv2.cvtColor(cv2.resize(crop, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2LAB)
    person = cv2.resize(pose.mask, size, interpolation=cv2.INTER_AREA) > 0.5
    heights = _in_crop(pose)[:, 1] * (_SMALL_PX / CROP_PX)
    top, middle, end = (float(heights[rows].mean()) for rows in (_SHOULDERS, _HIPS, _KNEES))
    rows = np.arange(_SMALL_PX)[:, None]
    cells = (small // (256 // _BINS)).astype(np.intp)
    numbers = (cells[..., 0] * _BINS + cells[..., 1]) * _BINS + cells[..., 2]
    return np.stack(
        [
            _histogram(numbers[person & (rows >= upper) & (rows < lower)])
            for upper, lower in ((top, middle), (middle, end))
        ]
    )


def similarity(one: Signature, two: Signature) -> float:
    """Similarity of colours, from 0 (nothing in common) to 1 (the same)."""
    both = (one.any(axis=1)) & (two.any(axis=1))
    if not both.any():
        return 0.0
    return float(np.sqrt(one[both] * two[both]).sum(axis=1).mean())


def _histogram(numbers: NDArray[np.intp]) -> NDArray[np.float32]:
    counts = np.bincount(numbers, minlength=_BINS**3).astype(np.float32)
    cube = counts.reshape(_BINS, _BINS, _BINS)
    # Spread over neighbouring bins: a little more light must not change everything.
    for axis in range(3):
        padded = np.pad(cube, [(1, 1) if each == axis else (0, 0) for each in range(3)], "edge")
        ahead, behind = (np.take(padded, np.arange(_BINS) + step, axis) for step in (2, 0))
        cube = 0.5 * cube + 0.25 * (ahead + behind)
    total = cube.sum()
    return (cube / total if total > 0 else cube).ravel()


def _in_crop(pose: Pose) -> Floats:
    matrix = pose.roi.matrix()
    return np.asarray((pose.image_px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T)


Seen = Callable[[int, Pose | None], None]
"""``seen(frame, pose)``, None where the person was not found; may raise ``Cancelled``."""


@dataclass(eq=False)
class PersonTracker:
    """Follows one person from picture to picture; times only ever increase."""

    detector: PoseDetector
    landmarker: PoseLandmarker
    roi: Roi | None = None
    time_s: float = 0.0
    lost: bool = False
    velocity: Floats = field(default_factory=lambda: np.zeros(2))
    own: Signature | None = None
    others: list[Signature] = field(default_factory=list)
    looked_round_s: float = -np.inf

    def begin(self, roi: Roi, time_s: float) -> None:
        """Start at a square with the person, whose colours are still to be learnt."""
        self.roi, self.time_s, self.lost = roi, time_s, False
        self.velocity = np.zeros(2)
        self.looked_round_s = -np.inf

    def step(self, picture: Pixels, time_s: float) -> Pose | None:
        """Find the person in the next picture."""
        pose = None if self.lost else self._look(picture, self._predicted(time_s))
        if pose is not None and (self._jumped(pose) or self._is_other(picture, pose)):
            pose = None
        if pose is None:
            pose = self._search(picture, time_s)
        if pose is None:
            self.lost = True
            return None
        self._accept(picture, pose, time_s)
        if time_s - self.looked_round_s >= _LOOK_ROUND_S:
            self.looked_round_s = time_s
            self._look_round(picture, pose)
        return pose

    def _look(self, picture: Pixels, roi: Roi) -> Pose | None:
        pose = self.landmarker.in_picture(picture, roi)
        return pose if pose.confidence >= FOUND else None

    def _predicted(self, time_s: float) -> Roi:
        assert self.roi is not None
        move = self.velocity * min(time_s - self.time_s, 0.5)
        limit = 0.25 * self.roi.size_px
        move = np.clip(move, -limit, limit)
        roi = self.roi
        return Roi(roi.centre_x_px + move[0], roi.centre_y_px + move[1], roi.size_px, roi.angle_rad)

    def _away(self, roi: Roi, time_s: float) -> float:
        """Distance of a square from the predicted one, in squares."""
        predicted = self._predicted(time_s)
        return _apart(predicted, roi) / predicted.size_px

    def _jumped(self, pose: Pose) -> bool:
        """True if another person in the square, or none, was taken for the person."""
        ratio = pose.next_roi.size_px / pose.roi.size_px
        return _apart(pose.roi, pose.next_roi) > 0.35 * pose.roi.size_px or not 0.4 < ratio < 2.0

    def _is_other(self, picture: Pixels, pose: Pose) -> bool:
        """True if the colours are rather those of another person seen before."""
        if self.own is None or not self.others:
            return False
        mine, theirs = self._likeness(signature(pose.roi.cut(picture), pose))
        return theirs > mine + 0.05

    def _likeness(self, looks: Signature) -> tuple[float, float]:
        assert self.own is not None
        theirs = max((similarity(looks, other) for other in self.others), default=0.0)
        return similarity(looks, self.own), theirs

    def _search(self, picture: Pixels, time_s: float) -> Pose | None:
        """Look for the person in the whole picture."""
        gap_s = time_s - self.time_s
        best, best_rank = None, -np.inf
        for found in self._people(picture, self._predicted(time_s))[:_MAX_CANDIDATES]:
            away = self._away(found.roi, time_s)
            # A person far away this soon is another one.
            if away > 0.5 + 1.5 * gap_s:
                continue
            pose = self._look(picture, found.roi)
            if pose is None or self._is_other(picture, pose):
                continue
            mine = 1.0
            if self.own is not None:
                mine = similarity(signature(pose.roi.cut(picture), pose), self.own)
            rank = mine - 0.3 * min(away, 2.0)
            if rank > best_rank:
                best, best_rank = pose, rank
        return best

    def _people(self, picture: Pixels, near: Roi) -> list[Detection]:
        """People in the picture; if the person is small, also those around a place."""
        if near.size_px > _SMALL * max(picture.shape[:2]):
            return self.detector.people(picture)
        around = Roi(near.centre_x_px, near.centre_y_px, 1.5 * near.size_px)
        return self.detector.look(picture, around)[0] + self.detector.people(picture)

    def _accept(self, picture: Pixels, pose: Pose, time_s: float) -> None:
        roi, gap_s = pose.next_roi, time_s - self.time_s
        if self.roi is not None and not self.lost and 0.0 < gap_s < 0.5:
            moved = [roi.centre_x_px - self.roi.centre_x_px, roi.centre_y_px - self.roi.centre_y_px]
            share = 1.0 - np.exp(-gap_s / 0.15)
            self.velocity = self.velocity + share * (np.array(moved) / gap_s - self.velocity)
        else:
            self.velocity = np.zeros(2)
        self.roi, self.time_s, self.lost = roi, time_s, False
        looks = signature(pose.roi.cut(picture), pose)
        if self.own is None:
            self.own = looks
            return
        mine, theirs = self._likeness(looks)
        # While another person covers them, the colours are not the person's own.
        if mine > theirs + 0.1:
            self.own = self.own + np.float32(0.05) * (looks - self.own)

    def _look_round(self, picture: Pixels, pose: Pose) -> None:
        """Learn the colours of others while they stand apart."""
        for found in self._people(picture, pose.next_roi)[: _MAX_CANDIDATES + 1]:
            if _apart(found.roi, pose.next_roi) < 0.2 * pose.next_roi.size_px:
                continue
            other = self._look(picture, found.roi)
            if other is None or _apart(other.next_roi, pose.next_roi) < 0.2 * pose.roi.size_px:
                continue
            looks = signature(other.roi.cut(picture), other)
            known = [similarity(looks, each) for each in self.others]
            if known and max(known) > 0.85:
                continue
            self.others = [*self.others, looks][-_MAX_CANDIDATES:]

    def state(self) -> dict[str, NDArray[np.generic]]:
        """State that the next step depends on, as arrays."""
        assert self.roi is not None
        assert self.own is not None
        return {
            "roi": roi_numbers(self.roi),
            "velocity": self.velocity,
            "clock": np.array([self.time_s, self.looked_round_s, float(self.lost)]),
            "own": self.own,
            "others": np.array(self.others, np.float32).reshape(-1, *self.own.shape),
        }

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Go on from :meth:`state`."""
        x, y, size, angle = (float(value) for value in state["roi"])
        self.roi = Roi(x, y, size, angle)
        self.velocity = np.asarray(state["velocity"], np.float64)
        time_s, looked_round_s, lost = (float(value) for value in state["clock"])
        self.time_s, self.looked_round_s, self.lost = time_s, looked_round_s, bool(lost)
        self.own = np.asarray(state["own"], np.float32)
        self.others = list(np.asarray(state["others"], np.float32))


def _apart(one: Roi, two: Roi) -> float:
    return float(np.hypot(one.centre_x_px - two.centre_x_px, one.centre_y_px - two.centre_y_px))


class Search:
    """First pass: the person in every fifteenth of a second, from the start both ways."""

    def __init__(self, video: VideoReader, start: Start, follower: PersonTracker) -> None:
        self._video = video
        self._follower = follower
        self._start = start
        times = video.timebase.times_s
        ahead = _looked_at(times[start.frame :]) + start.frame
        behind = start.frame - _looked_at(times[start.frame] - times[start.frame :: -1])
        self._order = np.concatenate([ahead, behind[1:]])
        self._turn = len(ahead)
        self._rois = np.full((len(self._order), 4), np.nan)
        self._confidence = np.zeros(len(self._order))
        self._done = 0

    @property
    def done(self) -> tuple[int, int]:
        """Number of frames searched, and of all to be searched."""
        return self._done, len(self._order)

    def run(self, seen: Seen) -> Sightings:
        """Search the frames that are left."""
        times = self._video.timebase.times_s
        first = self._start.frame
        for picture in self._pictures():
            number = self._done
            frame = int(self._order[number])
            if number in (0, self._turn):
                self._follower.begin(self._start.roi, 0.0)
            # The second half runs backwards in time.
            pose = self._follower.step(picture, abs(float(times[frame] - times[first])))
            if pose is not None:
                self._rois[number] = roi_numbers(pose.next_roi)
                self._confidence[number] = pose.confidence
            self._done += 1
            seen(frame, pose)
        rank = np.argsort(self._order, kind="stable")
        return Sightings(self._order[rank], self._rois[rank], self._confidence[rank])

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
        }

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Go on from :meth:`state` of the same search."""
        self._follower.restore(state)
        self._done = len(state["confidence"])
        self._rois[: self._done] = state["rois"]
        self._confidence[: self._done] = state["confidence"]


def _looked_at(times_s: Floats) -> NDArray[np.intp]:
    """Numbers of frames a fifteenth of a second apart or a little less, the last included."""
    chosen = [0]
    for number in range(1, len(times_s)):
        nearly = number + 1 == len(times_s) or times_s[number + 1] - times_s[chosen[-1]] > 1.05 * (
            _STEP_S
        )
        if nearly:
            chosen.append(number)
    return np.array(chosen, np.intp)
