"""Everybody in a video: found and followed through all of it, and told apart."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.array_store import ArrayStore
from sd2core.body.blazepose import PoseDetector, PoseLandmarker
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.people_following import PeopleFollower
from sd2core.body.people_joining import Somebody, cleared, joined
from sd2core.body.roi import PLACES, Floats, Roi, Sightings, roi_numbers, roi_of
from sd2core.body.tracking import SEARCH_STEP_S, looked_at
from sd2core.errors import Sd2Error
from sd2core.files.paths import user_cache
from sd2core.io.video import VideoReader
from sd2core.mesh.presence import runs
from sd2core.numerics.compiled import worker_count
from sd2core.progress import Progress, silent

_VERSION = 5
_SHORTEST_S = 1.0
"""Time for which somebody has to be seen, if the video is longer."""
_SURELY_SEEN = 0.75
"""Best score of the detector below which nobody is there, but a shadow or a coat."""
_GROWN = 0.08
"""Change of size (logarithm) beside a gap from which on a square is around two people."""
_KNOWN_LOOKS = 5
"""Looks farther from the gap that tell the size."""
_THREADS = 2


@dataclass(frozen=True, eq=False)
class SeenPerson:
    """Somebody in a video."""

    number: int  # from 1, in the order in which people appear
    sightings: Sightings
    times_s: Floats  # (N,) of the sightings
    certainty: float  # probability that all of them show one person, as far as meetings tell
    may_be: int | None  # number of a person seen before who may be the same; None: nobody

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Sightings in which the person was found, (N,)."""
        return np.isfinite(self.sightings.rois[:, 0])

    @property
    def alone(self) -> bool:
        """True if nobody else is seen in the video."""
        return not self.sightings.others.any()

    @property
    def from_s(self) -> float:
        """When the person is seen first."""
        return float(self.times_s[self.seen][0])

    @property
    def to_s(self) -> float:
        """When the person is seen last."""
        return float(self.times_s[self.seen][-1])

    @property
    def seen_s(self) -> float:
        """Time for which the person is seen."""
        steps_s = np.diff(self.times_s, append=self.times_s[-1])
        return float(steps_s[self.seen].sum())

    @property
    def portrait(self) -> tuple[int, Roi]:
        """Frame in which the person is seen best, alone if possible, and the square around them."""
        crowd = self.sightings.others.any(axis=1)
        rank = self.sightings.confidence * np.where(crowd, 0.9, 1.0)
        good = np.flatnonzero(rank >= 0.98 * rank.max())
        row = good[len(good) // 2]
        roi = roi_of(self.sightings.rois[row])
        assert roi is not None
        return int(self.sightings.frames[row]), roi


def find_people(
    video: VideoReader, models: LandmarkModels, progress: Progress = silent
) -> list[SeenPerson]:
    """Find everybody in a video and follow them through it.

    People are looked for in whole pictures ten times a second, and small ones in parts of them.
    What was found is kept in the user's cache until the video changes.

    Parameters
    ----------
    video : VideoReader
        Read forwards.
    models : LandmarkModels
        The detector and the full landmark model are used.
    progress : Progress
        Counts frames; may raise ``Cancelled``.

    Raises
    ------
    Sd2Error
        If nobody is found.
    """
    key, name = _key(video)
    store = ArrayStore(user_cache("people"), key)
    kept = store.read(name)
    if kept is None:
        kept = _followed(video, models, progress)
        store.write(name, kept)
    if not len(kept["certainty"]):
        raise Sd2Error(
            f"Nobody was found in {video.path}",
            "a video of people, each of them seen for a second or more",
            "Where there is somebody, mark them in one frame"
            " (--person-box X,Y,WIDTH,HEIGHT --person-frame FRAME)",
        )
    return _people(kept, video.timebase.times_s)


def chosen_people(people: Sequence[SeenPerson], numbers: Sequence[int]) -> list[SeenPerson]:
    """People of some numbers, all of them where there are none; Sd2Error if one is missing."""
    by_number = {each.number: each for each in people}
    for number in numbers:
        if number not in by_number:
            raise Sd2Error(
                f"There is no person {number} in the video",
                f"1 to {len(people)}" if len(people) > 1 else "1, the only person",
                "See who is there with --people list",
            )
    return [by_number[number] for number in numbers] if numbers else list(people)


def _followed(
    video: VideoReader, models: LandmarkModels, progress: Progress
) -> dict[str, NDArray[np.generic]]:
    """Sightings of everybody, as arrays."""
    threads = min(worker_count(), _THREADS)
    follower = PeopleFollower(
        PoseDetector(models.detector, threads), PoseLandmarker(models.follower, threads)
    )
    times_s = video.timebase.times_s
    frames = looked_at(times_s, SEARCH_STEP_S)
    for number, frame in enumerate(frames.tolist()):
        follower.step(video.read(frame), number, float(times_s[frame]))
        progress(frame + 1, len(video))
    shortest_s = min(_SHORTEST_S, 0.5 * float(np.ptp(times_s)))
    people = [
        each
        for each in joined(follower.stretches, video.width)
        if each.seen_s >= shortest_s and each.score >= _SURELY_SEEN
    ]
    rois = np.full((len(people), len(frames), 4), np.nan)
    confidence = np.zeros(rois.shape[:2])
    for row, person in enumerate(people):
        for stretch in person.stretches:
            rois[row, stretch.numbers] = stretch.rois
            confidence[row, stretch.numbers] = stretch.confidence
    for row, number, sight in cleared(follower.doubts, people):
        rois[row, number] = roi_numbers(sight.roi)
        confidence[row, number] = sight.pose.confidence
    for person_rois, sure in zip(rois, confidence, strict=True):
        two = of_two(person_rois[:, 2])
        person_rois[two], sure[two] = np.nan, 0.0
    return {
        "frames": frames,
        "rois": rois,
        "confidence": confidence,
        "doubtful": np.isin(np.arange(len(frames)), [each.number for each in follower.doubts]),
        "certainty": np.array([each.certainty for each in people]),
        "may_be": np.array([_number(each.may_be, people) for each in people], np.intp),
    }


def of_two(sizes_px: Floats) -> NDArray[np.bool_]:
    """Looks (N,) beside a gap that are around two people: somebody hides behind another there.

    ``sizes_px`` (N,) are those of one person's squares, NaN where they are not found.
    """
    two = np.zeros(len(sizes_px), bool)
    sighted = np.isfinite(sizes_px)
    stretches = list(runs(sighted))
    for number, (start, stop) in enumerate(stretches):
        rows = list(range(start, stop))
        if number > 0:
            two[_grown(sizes_px, rows)] = True
        if number + 1 < len(stretches):
            two[_grown(sizes_px, rows[::-1])] = True
    return two


def _grown(sizes_px: Floats, rows: list[int]) -> list[int]:
    """First of the looks, as long as their size is not that of those that follow."""
    for count in range(len(rows) - _KNOWN_LOOKS):
        known = np.median(sizes_px[rows[count + 1 : count + 1 + _KNOWN_LOOKS]])
        if abs(np.log(sizes_px[rows[count]] / known)) < _GROWN:
            return rows[:count]
    return []


def _number(person: Somebody | None, people: list[Somebody]) -> int:
    return next((row + 1 for row, each in enumerate(people) if each is person), 0)


def _people(kept: dict[str, NDArray[np.generic]], times_s: Floats) -> list[SeenPerson]:
    """People of the arrays of :func:`_followed`."""
    frames, rois, confidence = (np.asarray(kept[name]) for name in ("frames", "rois", "confidence"))
    sighted = np.isfinite(rois[..., 0])  # (people, N)
    people = []
    for row in range(len(rois)):
        own = sighted[row]
        others = np.zeros((len(frames), len(PLACES)), bool)
        for other in np.delete(np.arange(len(rois)), row):
            right = rois[other, :, 0] > rois[row, :, 0]
            others[:, 0] |= sighted[other] & own & ~right
            others[:, 1] |= sighted[other] & own & right
            others[:, 2] |= sighted[other] & ~own
        first, last = np.flatnonzero(own)[[0, -1]]
        between = np.arange(len(frames)) - first
        unsure = others[:, 2] | np.asarray(kept["doubtful"])
        hidden = ~own & unsure & (between > 0) & (between < last - first)
        sightings = Sightings(frames, rois[row], confidence[row], hidden, others)
        may_be = int(kept["may_be"][row]) or None
        certainty = float(kept["certainty"][row])
        people.append(SeenPerson(row + 1, sightings, times_s[frames], certainty, may_be))
    return people


def _key(video: VideoReader) -> tuple[str, str]:
    """Key of what was found in a video, and the name under which it is kept."""
    about = os.stat(video.path)
    path = str(video.path.resolve())
    identity = [_VERSION, path, about.st_size, about.st_mtime_ns, len(video)]
    digest = hashlib.sha256(json.dumps(identity).encode()).hexdigest()
    return digest, f"{hashlib.sha256(path.encode()).hexdigest()[:32]}.npz"
