"""Everybody in a video, followed picture by picture as far as it is sure who is who.

The result are stretches: runs of looks that surely show one person. Whoever meets somebody they
could be taken for begins another; :mod:`sd2core.body.people_joining` says whose the stretches are.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Pose, PoseDetector, PoseLandmarker
from sd2core.body.identity import Appearance, Signature, Trail, signature_of
from sd2core.body.person_selection import FOUND, parts_of_picture
from sd2core.body.person_tracker import jumped
from sd2core.body.roi import Floats, Pixels, Roi, apart_px, roi_numbers

_SMALL_EVERY_S = 0.5
"""Time between looks at parts of the picture, for small people."""
_UNSEEN_S, _HIDDEN_S = 0.35, 1.5
"""Time for which somebody who is not seen is looked for where they should be, and known at once."""
_AWAY, _AWAY_PER_S = 0.03, 0.2
_GREW, _GREW_PER_S = 0.06, 0.15
UNLIKE = 0.04
"""Deviation of a person's place (squares) and size (logarithm) from those expected, and what is
added each second; deviation of the similarity of their looks from 1."""
_KNOWN_S = 1.5
"""Time after which place and size are no less known."""
_MAX_AGAINST = 8.0
"""Most that one of place, size and looks can speak against somebody."""
_SURELY = 3.0
"""How much worse every other order of people has to be (logarithm of odds)."""
_NOBODY = 6.0
"""What has to speak against somebody for another person to be there, or nobody."""
_BESIDE = 0.35
"""Distance in squares within which colours of two are mixed up."""
MIN_LOOKS = 3
"""Looks from which on a stretch is somebody, and no slip."""
_BACK_BYTES = 64 * 2**20
"""Memory of the last pictures, in which people are looked for once it is clear who they are."""
_TRAIL = 6
"""Looks that make a trail."""
_MAP_PX = 96
"""Longer side of the small pictures in which bodies are compared."""
_ONE_BODY = 0.6
"""Share of the smaller of two bodies in the picture from which on they are one."""


@dataclass(frozen=True, eq=False)
class Sight:
    """One body in one picture."""

    pose: Pose
    signature: Signature
    body: NDArray[np.bool_]  # pixels of the picture made smaller
    score: float  # best of the detections there; 0: none

    @property
    def roi(self) -> Roi:
        """Square around the body."""
        return self.pose.next_roi


@dataclass(eq=False)
class Stretch:
    """Run of looks at one person."""

    trail: Trail
    appearance: Appearance
    numbers: list[int] = field(default_factory=list)  # of the pictures
    times_s: list[float] = field(default_factory=list)
    rois: list[Floats] = field(default_factory=list)
    confidence: list[float] = field(default_factory=list)
    score: float = 0.0  # best of the detections

    def add(self, number: int, time_s: float, sight: Sight, *, learn: bool = False) -> None:
        """Take in the next look, and learn how the person looks unless others are too near."""
        if self.numbers:
            self.trail = self.trail.followed(sight.roi, time_s)
        if learn:
            self.appearance.learn(sight.signature)
        self.numbers.append(number)
        self.times_s.append(time_s)
        self.rois.append(roi_numbers(sight.roi))
        self.confidence.append(sight.pose.confidence)
        self.score = max(self.score, sight.score)

    def insert(self, row: int, past: Past, sight: Sight) -> None:
        """Take in a look at an earlier picture."""
        self.numbers.insert(row, past.number)
        self.times_s.insert(row, past.time_s)
        self.rois.insert(row, roi_numbers(sight.roi))
        self.confidence.insert(row, sight.pose.confidence)

    def unlikeness(self, sight: Sight, time_s: float, trail: Trail | None = None) -> float:
        """How much speaks against a body being this person, as the logarithm of odds."""
        likeness = self.appearance.likeness(sight.signature)
        return against(trail or self.trail, sight.roi, time_s, likeness)

    def trail_from(self, row: int) -> Trail:
        """Trail of a look and some after it, played backwards, with times below 0."""
        return self._trail(range(min(row + _TRAIL, len(self.numbers)) - 1, row - 1, -1), -1.0)

    def trail_to(self, row: int) -> Trail:
        """Trail of a look and some before it."""
        return self._trail(range(max(row + 1 - _TRAIL, 0), row + 1), 1.0)

    def _trail(self, rows: range, sense: float) -> Trail:
        times = [sense * self.times_s[row] for row in rows]
        rois = [Roi(*self.rois[row].tolist()) for row in rows]
        trail = Trail(rois[0], times[0], -np.inf)
        for roi, time_s in zip(rois[1:], times[1:], strict=True):
            trail = trail.followed(roi, time_s)
        return trail


@dataclass(frozen=True, eq=False)
class Past:
    """A picture that was looked at."""

    number: int
    time_s: float
    picture: Pixels
    bodies: list[NDArray[np.bool_]]  # found in it
    unseen: list[tuple[Stretch, Trail]]  # who were not found, and where they were before


def against(trail: Trail, roi: Roi, time_s: float, likeness: float) -> float:
    """How much speaks against somebody on a trail being in a square, as logarithm of odds."""
    gap_s = min(time_s - trail.time_s, _KNOWN_S)
    away = trail.away(roi, time_s) / (_AWAY + _AWAY_PER_S * gap_s)
    grew = trail.growth(roi) / (_GREW + _GREW_PER_S * gap_s)
    unlike = (1.0 - likeness) / UNLIKE
    return float(sum(min(each, _MAX_AGAINST) for each in (0.5 * away**2, 0.5 * grew**2, unlike)))


@dataclass(frozen=True, eq=False)
class Doubt:
    """Bodies of a picture of which it is not sure whom they show."""

    number: int
    time_s: float
    sights: list[Sight]


class PeopleFollower:
    """Follows everybody from picture to picture; times only ever increase."""

    def __init__(self, detector: PoseDetector, landmarker: PoseLandmarker) -> None:
        self._detector, self._landmarker = detector, landmarker
        self._active: list[Stretch] = []
        self._doubted: list[Roi] = []
        self._searched_s = -np.inf
        self._past: deque[Past] = deque()
        self.stretches: list[Stretch] = []
        self.doubts: list[Doubt] = []

    def step(self, picture: Pixels, number: int, time_s: float) -> None:
        """Find everybody in the next picture."""
        self._active = [
            each
            for each in self._active
            if time_s - each.trail.time_s
            <= (_HIDDEN_S if len(each.numbers) >= MIN_LOOKS else _UNSEEN_S)
        ]
        sights = self._sights(picture, time_s)
        costs = np.array(
            [[each.unlikeness(sight, time_s) for sight in sights] for each in self._active]
        ).reshape(len(self._active), len(sights))
        order, doubtful = assigned(costs)
        self._doubted = [sights[order[row]].roi for row in doubtful]
        sure = {row: column for row, column in order.items() if row not in doubtful}
        unseen = [(each, each.trail) for row, each in enumerate(self._active) if row not in sure]
        bodies = [each.body for each in sights]
        self._past.append(Past(number, time_s, picture, bodies, unseen))
        while len(self._past) * picture.nbytes > max(_BACK_BYTES, picture.nbytes):
            self._past.popleft()
        for row, column in sure.items():
            alone = self._is_alone(sights[column], self._active[row])
            self._active[row].add(number, time_s, sights[column], learn=alone)
            self._look_back(self._active[row])
        # A body that may be of one of several is not somebody new.
        left = [each for column, each in enumerate(sights) if column not in sure.values()]
        if doubtful:
            self.doubts.append(Doubt(number, time_s, left))
            return
        for sight in left:
            new = Stretch(Trail(sight.roi, time_s, time_s), Appearance(sight.signature))
            new.add(number, time_s, sight)
            self.stretches.append(new)
            self._active.append(new)

    def _look_back(self, stretch: Stretch) -> None:
        """Follow backwards who came into view: where they were half hidden nobody found them."""
        row = len(stretch.numbers) - MIN_LOOKS
        before = stretch.numbers[row - 1] if row > 0 else -1
        if row < 0 or stretch.numbers[-1] - stretch.numbers[row] >= MIN_LOOKS:
            return
        trail = stretch.trail_from(row)
        for past in reversed(self._past):
            if past.number >= stretch.numbers[row]:
                continue
            if past.number <= before:
                return
            pose = self._landmarker.in_picture(past.picture, trail.predicted(-past.time_s))
            body = _small_mask(pose, *past.picture.shape[1::-1])
            if (
                jumped(pose)
                or pose.confidence < FOUND
                or any(_one_body(body, each) for each in past.bodies)
            ):
                return
            sight = Sight(pose, signature_of(pose.roi.cut(past.picture), pose), body, 0.0)
            own = stretch.unlikeness(sight, -past.time_s, trail)
            others = [
                each.unlikeness(sight, past.time_s, last_trail)
                for each, last_trail in past.unseen
                if each is not stretch
            ]
            if own > _NOBODY or own + _SURELY > min(others, default=np.inf):
                return
            stretch.insert(row, past, sight)
            past.bodies.append(body)
            trail = trail.followed(sight.roi, -past.time_s)

    def _is_alone(self, sight: Sight, stretch: Stretch) -> bool:
        """True unless somebody else is so near that colours may be theirs."""
        return all(
            apart_px(each.trail.roi, sight.roi) > _BESIDE * sight.roi.size_px
            for each in self._active
            if each is not stretch
        )

    def _sights(self, picture: Pixels, time_s: float) -> list[Sight]:
        """Every body in the picture, once."""
        height, width = picture.shape[:2]
        squares: list[Roi | None] = [None]
        if time_s - self._searched_s >= _SMALL_EVERY_S - 1e-6:
            self._searched_s = time_s
            squares += parts_of_picture(width, height, 0.5)
        people = [each for square in squares for each in self._detector.look(picture, square)[0]]
        people.sort(key=lambda each: -each.score)
        here = [each for each in self._active if time_s - each.trail.time_s <= _UNSEEN_S]
        expected = [*self._doubted, *(each.trail.predicted(time_s) for each in here)]
        poses = [self._landmarker.in_picture(picture, roi) for roi in expected]
        poses = [each for each in poses if not jumped(each)]
        looked = [each.next_roi for each in poses]
        for person in people:
            if not any(_same_square(person.roi, roi) for roi in looked):
                looked.append(person.roi)
                poses.append(self._landmarker.in_picture(picture, person.roi))
        sights: list[Sight] = []
        for pose in sorted(poses, key=lambda each: -each.confidence):
            body = _small_mask(pose, width, height)
            if pose.confidence < FOUND or any(_one_body(body, each.body) for each in sights):
                continue
            scores = [each.score for each in people if _same_square(each.roi, pose.next_roi)]
            signature = signature_of(pose.roi.cut(picture), pose)
            sights.append(Sight(pose, signature, body, max(scores, default=0.0)))
        return sights


def _small_mask(pose: Pose, width: int, height: int) -> NDArray[np.bool_]:
    """Pixels of a body in the whole picture made smaller."""
    import cv2

    scale = _MAP_PX / max(width, height)
    matrix = scale * pose.roi.matrix(len(pose.mask))
    size = (round(scale * width), round(scale * height))
    return np.asarray(cv2.warpAffine(pose.mask, matrix, size) > 0.5)


def _one_body(one: NDArray[np.bool_], two: NDArray[np.bool_]) -> bool:
    """True if two masks show one body; one that shows nothing is any."""
    return bool((one & two).sum() >= _ONE_BODY * min(one.sum(), two.sum()))


def assigned(costs: Floats) -> tuple[dict[int, int], set[int]]:
    """Body of each stretch, and stretches of which it is not sure.

    ``costs`` (stretches, bodies) is how much speaks against each body being of each stretch.
    """
    from scipy.optimize import linear_sum_assignment

    rows, columns = costs.shape
    # One column more for each stretch that may not be seen.
    padded = np.hstack([costs, np.full((rows, rows), _NOBODY)])
    order = linear_sum_assignment(padded)[1]
    taken = {row: int(column) for row, column in enumerate(order) if column < columns}
    free = [column for column in range(columns) if column not in taken.values()]
    doubtful = set()
    for one in taken:
        own = padded[one, order[one]]
        worse = [padded[one, column] - own for column in free]  # it is a body of nobody's
        for other in set(range(rows)) - {one}:  # the other one has this body, this one theirs
            exchanged = padded[other, order[one]] + min(padded[one, order[other]], _NOBODY)
            worse.append(exchanged - own - padded[other, order[other]])
        if min(worse, default=np.inf) < _SURELY:
            doubtful.add(one)
    return taken, doubtful


def _same_square(one: Roi, two: Roi) -> bool:
    """True if two squares surely show the same body."""
    ratio = one.size_px / two.size_px
    return apart_px(one, two) < 0.12 * two.size_px and 0.75 < ratio < 1.33
