"""Who is who in a video: how people look, and where they can have got to."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Pose
from sd2core.body.roi import CROP_PX, Floats, Pixels, Roi, apart_px, roi_numbers
from sd2core.body.track import LANDMARK

Signature = NDArray[np.float32]
"""Histograms of colour of parts of the body, shape (6, 512); each adds up to 1, or is 0: unseen."""

ALIKE, THE_SAME = 0.85, 0.9
"""Similarities from which on a part may be, and is, the same person's (docs/decisions/0048)."""

_SMALL_PX = 64
_BINS = 8
_STEPS, _GREY = (32, 8, 8), (0, 4, 4)
"""Width of a bin of lightness and of both colours, and the bins of grey."""
_VISIBLE = 0.5
_MIN_PARTS = 4
"""Parts that have to be alike, unless fewer are known."""
_PARTS = (
    (5, (("ear.L", "ear.R"),)),
    (5, (("shoulder.L", "hip.L"), ("shoulder.R", "hip.R"))),
    (3, (("shoulder.L", "elbow.L"), ("shoulder.R", "elbow.R"))),
    (3, (("elbow.L", "wrist.L"), ("elbow.R", "wrist.R"))),
    (4, (("hip.L", "knee.L"), ("hip.R", "knee.R"))),
    (3, (("knee.L", "ankle.L"), ("knee.R", "ankle.R"))),
)
"""Crown of the head, torso, upper arms, forearms, thighs, shins: lines, and how wide in pixels."""
_EARS, _SHOULDERS = ([LANDMARK[f"{name}.L"], LANDMARK[f"{name}.R"]] for name in ("ear", "shoulder"))
_CROWN = 0.4
"""Height of the crown above the ears, as a share of theirs above the shoulders."""
_MAX_LOOKS = 6
_ANOTHER_LOOK = 0.93

# Squares, and logarithms of their size: what people do from one look to the next, how much
# farther they get per second squared (4 m/s²), and how fast they come nearer.
_SIDEWAYS, _SIDEWAYS_PER_S2 = 0.06, 0.85
_GROWTH, _GROWTH_PER_S = 0.16, 0.5
_AWAY, _AWAY_PER_S = 0.5, 1.5
# The same for one who goes on as before.
_STEADY, _STEADY_PER_S = 0.1, 0.15


def signature_of(crop: Pixels, pose: Pose) -> Signature:
    """Colours of a person in a crop of :data:`CROP_PX` pixels."""
    import cv2

    size = (_SMALL_PX, _SMALL_PX)
    small = cv2.cvtColor(cv2.resize(crop, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2LAB)
    person = cv2.resize(pose.mask, size, interpolation=cv2.INTER_AREA) > 0.5
    # Skin, hair and cloth are all within a few steps of grey.
    cells = np.clip((small.astype(np.intp) - (0, 128, 128)) // _STEPS + _GREY, 0, _BINS - 1)
    numbers = (cells[..., 0] * _BINS + cells[..., 1]) * _BINS + cells[..., 2]
    places = _in_crop(pose) * (_SMALL_PX / CROP_PX) - 0.5
    places[_EARS] += _CROWN * (places[_EARS].mean(axis=0) - places[_SHOULDERS].mean(axis=0))
    points = np.rint(places).astype(int).tolist()
    seen = pose.visibility * pose.presence > _VISIBLE
    histograms = []
    for wide_px, lines in _PARTS:
        part = np.zeros(size, np.uint8)
        for start, end in ((LANDMARK[one], LANDMARK[two]) for one, two in lines):
            if seen[start] and seen[end]:
                cv2.line(part, points[start], points[end], 1, wide_px)
        histograms.append(_histogram(numbers[person & (part > 0)]))
    return np.stack(histograms)


def similarity(one: Signature, two: Signature) -> float:
    """Similarity of colours, from 0 (nothing in common) to 1 (the same), mean over the parts."""
    parts = _similarities(one, two)
    return float(parts.mean()) if len(parts) else 0.0


def alike(known: Signature, signature: Signature, least: float = ALIKE) -> bool:
    """True if looks are like those of a known person in every part that is seen."""
    parts = _similarities(known, signature)
    enough = len(parts) >= min(_MIN_PARTS, int(known.any(axis=1).sum()))
    return bool(enough and len(parts) and parts.min() >= least)


def _similarities(one: Signature, two: Signature) -> Floats:
    """Similarity of each part that both show."""
    both = one.any(axis=1) & two.any(axis=1)
    return np.sqrt(one[both] * two[both]).sum(axis=1, dtype=np.float64)


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


@dataclass(eq=False)
class Appearance:
    """Looks of one person from all sides, as far as seen."""

    recent: Signature  # mean over the last second or so
    kept: list[Signature] = field(default_factory=list)  # of earlier seconds, unlike one another

    def likeness(self, signature: Signature) -> float:
        """Similarity to the look that is most alike."""
        return max(similarity(signature, each) for each in (self.recent, *self.kept))

    def may_be(self, signature: Signature, least: float = ALIKE) -> bool:
        """True if the person has looked like this, in every part."""
        return any(alike(each, signature, least) for each in (self.recent, *self.kept))

    def learn(self, signature: Signature) -> None:
        """Take in how the person looks now; what lasts for a second is kept."""
        # What is not seen now looks as it did; what was never seen is taken as it is.
        share = np.where(self.recent.any(axis=1), np.float32(0.05), np.float32(1.0))
        share *= signature.any(axis=1)
        self.recent = self.recent + share[:, None] * (signature - self.recent)
        if max((similarity(self.recent, each) for each in self.kept), default=0.0) < _ANOTHER_LOOK:
            self.kept = [*self.kept, self.recent][-_MAX_LOOKS:]


@dataclass(frozen=True, eq=False)
class Trail:
    """Place of a person at a time, and how they moved, in pixels per second (2,)."""

    roi: Roi
    time_s: float
    since_s: float  # when they came into view
    velocity: Floats = field(default_factory=lambda: np.zeros(2))

    def followed(self, roi: Roi, time_s: float, *, steady: bool = True) -> Trail:
        """The trail at its next place; unless it is steady, the velocity is to be learnt anew."""
        gap_s = time_s - self.time_s
        if not steady or not 0.0 < gap_s < 0.5:
            return Trail(roi, time_s, time_s)
        moved = [roi.centre_x_px - self.roi.centre_x_px, roi.centre_y_px - self.roi.centre_y_px]
        share = 1.0 - np.exp(-gap_s / 0.15)
        velocity = self.velocity + share * (np.array(moved) / gap_s - self.velocity)
        return Trail(roi, time_s, self.since_s, velocity)

    def predicted(self, time_s: float) -> Roi:
        """Square in which the person is expected."""
        move = self.velocity * min(time_s - self.time_s, 1.0)
        roi = self.roi
        x, y = np.clip(move, -roi.size_px, roi.size_px)
        return replace(roi, centre_x_px=roi.centre_x_px + x, centre_y_px=roi.centre_y_px + y)

    def away(self, roi: Roi, time_s: float) -> float:
        """Distance of a square from the predicted one, in squares."""
        predicted = self.predicted(time_s)
        return apart_px(predicted, roi) / predicted.size_px

    def unlike(self, roi: Roi, time_s: float) -> float:
        """Distance of a square from the predicted one in place and size."""
        return self.away(roi, time_s) + self.growth(roi)

    def reaches(self, roi: Roi, time_s: float, *, any_size: bool = False) -> bool:
        """True if somebody can have got to a square: sideways and in size nobody jumps."""
        gap_s = time_s - self.time_s
        return (
            self._sideways(roi, time_s) < _SIDEWAYS + _SIDEWAYS_PER_S2 * gap_s**2
            and (any_size or self.growth(roi) < _GROWTH + _GROWTH_PER_S * gap_s)
            and self.is_near(roi, time_s)
        )

    def is_near(self, roi: Roi, time_s: float) -> bool:
        """True unless a square is so far away that it shows somebody else."""
        return self.away(roi, time_s) < _AWAY + _AWAY_PER_S * (time_s - self.time_s)

    def continues(self, roi: Roi, time_s: float) -> bool:
        """True if a square is where somebody is who has not changed their way."""
        limit = _STEADY + _STEADY_PER_S * min(time_s - self.time_s, 1.0)
        return self._sideways(roi, time_s) < limit and self.growth(roi) < _STEADY

    def growth(self, roi: Roi) -> float:
        """Change of size, as the absolute logarithm of the ratio."""
        return abs(float(np.log(roi.size_px / self.roi.size_px)))

    def _sideways(self, roi: Roi, time_s: float) -> float:
        predicted = self.predicted(time_s)
        return abs(roi.centre_x_px - predicted.centre_x_px) / predicted.size_px

    def numbers(self) -> Floats:
        """The trail as a row of eight numbers."""
        return np.array([*roi_numbers(self.roi), self.time_s, self.since_s, *self.velocity])

    @classmethod
    def of(cls, numbers: Floats) -> Trail:
        """The trail of :meth:`numbers`."""
        values = numbers.tolist()
        return cls(Roi(*values[:4]), values[4], values[5], np.array(values[6:]))


@dataclass(eq=False)
class Bystander:
    """Somebody else in the video."""

    signature: Signature
    trail: Trail
