"""Statures of several people of one video, who stand on one floor.

One camera cannot tell a child from an adult farther away. But who stands on the floor of the
others, seen by a camera that does not move, is as far away as their feet say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.body.evidence import evidence_of, sight_of
from sd2core.body.lifter import FEET, Lifter
from sd2core.body.rotations import Floats
from sd2core.body.shape import DEFAULT_STATURE_M
from sd2core.body.track import LANDMARK, LandmarkTrack, parts

_STANDING = 0.8
_SEEN = 0.5
_MIN_FEET = 8
"""Looks at standing feet from which on they say where the floor is."""
_DEPTH_SD = 0.05
"""Error of a person's depth in statures, as a share."""
_TILT_SD_DEG = 2.5
"""Error of the vertical as upright bodies show it."""
_TILTS_DEG = np.linspace(-15.0, 15.0, 31)
_ADULT_SD_M = 0.10
_CHILDREN = 0.1
"""Share of people who may be of any height between those below."""
_CHILD_M = (0.8, 1.6)
_STATURES_M = np.arange(0.8, 2.16, 0.01)
_LEAST_M = 0.05
"""Feet are so far below the camera at least, for each metre of stature."""
_UP = [[LANDMARK[f"{part}.{side}"] for side in "LR"] for part in ("shoulder", "ankle")]


@dataclass(frozen=True, eq=False)
class StandingFeet:
    """Places of a person's feet, in the camera frame, if the person were 1 m tall."""

    points: Floats  # (N, 3)
    down: Floats  # (3,) from shoulders to ankles, while they stand; of length 1


def standing_feet(track: LandmarkTrack, camera: PinholeCamera) -> StandingFeet | None:
    """Places of the feet on the floor; None where they are hardly seen."""
    lifted = Lifter.load().lift(track, camera)
    points, downs = [], []
    for start, stop in parts(len(track)):
        part, depths = track.part(start, stop), lifted.part(start, stop)
        places = evidence_of(part, depths, camera, 1.0).points_m
        seen = sight_of(part)
        stands = (depths.standing > _STANDING) & (seen[:, FEET] > _SEEN)
        stands &= (part.present & ~part.bridged)[:, None]
        points.append(places[:, FEET][stands])
        shoulders, ankles = (places[:, rows].mean(axis=1) for rows in _UP)
        downs.append((ankles - shoulders)[stands.any(axis=1)])
    feet, down = np.concatenate(points), np.concatenate(downs)
    if len(feet) < _MIN_FEET:
        return None
    mean = np.median(down, axis=0)
    return StandingFeet(feet, mean / np.linalg.norm(mean))


def statures_on_one_floor(
    people: Sequence[StandingFeet | None], first_m: float | None = None
) -> list[float | None]:
    """Most likely statures of people on one floor; None of those whose feet say nothing.

    Parameters
    ----------
    people : sequence of StandingFeet or None
        Feet of each person.
    first_m : float, optional
        Stature of the first person, where it is known.
    """
    known = [each for each in people if each is not None]
    if len(known) < 2:
        return [None] * len(people)
    mean = np.mean([each.down for each in known], axis=0)
    mean /= np.linalg.norm(mean)
    # Over the tilt of the floor and the height of the camera above it.
    best, best_m = np.inf, np.full(len(known), DEFAULT_STATURE_M)
    cost = np.stack([_unlikely(_STATURES_M)] * len(known))  # (people, statures)
    if first_m is not None and people[0] is not None:
        cost[0] = np.where(np.abs(_STATURES_M - first_m) < 0.006, 0.0, np.inf)
    for tilt_deg in _TILTS_DEG:
        turn = np.radians(tilt_deg)
        c, s = np.cos(turn), np.sin(turn)
        normal = np.array([mean[0], c * mean[1] - s * mean[2], s * mean[1] + c * mean[2]])
        logs = [np.log(np.maximum(each.points @ normal, _LEAST_M)) for each in known]
        middle = np.array([np.median(each) for each in logs])
        within = sum(
            float(np.minimum(np.abs(each - level) / _DEPTH_SD, 3.0).mean()) ** 2
            for each, level in zip(logs, middle, strict=True)
        )
        own = 0.5 * (tilt_deg / _TILT_SD_DEG) ** 2 + 2.0 * within
        # Height of the camera over the floor by each person at each stature, (people, statures).
        camera = middle[:, None] + np.log(_STATURES_M)
        for level in np.linspace(camera.min(), camera.max(), 200):
            total = cost + 0.5 * ((camera - level) / _DEPTH_SD) ** 2
            here = own + float(total.min(axis=1).sum())
            if here < best:
                best, best_m = here, _STATURES_M[total.argmin(axis=1)]
    statures_m = iter(best_m.tolist())
    return [None if each is None else round(next(statures_m), 2) for each in people]


def _unlikely(stature_m: Floats) -> Floats:
    """Negative logarithm of how likely a stature is."""
    adult = np.exp(-0.5 * ((stature_m - DEFAULT_STATURE_M) / _ADULT_SD_M) ** 2)
    adult *= (1.0 - _CHILDREN) / (_ADULT_SD_M * np.sqrt(2.0 * np.pi))
    child = (stature_m >= _CHILD_M[0]) & (stature_m <= _CHILD_M[1])
    return np.asarray(-np.log(adult + child * _CHILDREN / (_CHILD_M[1] - _CHILD_M[0]) + 1e-9))
