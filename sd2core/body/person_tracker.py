"""One person followed from picture to picture, whoever else is there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import Detection, Pose, PoseDetector, PoseLandmarker
from sd2core.body.identity import (
    ALIKE,
    THE_SAME,
    Appearance,
    Bystander,
    Signature,
    Trail,
    alike,
    signature_of,
    similarity,
)
from sd2core.body.person_selection import FOUND
from sd2core.body.roi import PLACES, Pixels, Roi, apart_px

_LOOK_ROUND_S = 0.15
_GONE_S = 1.0
"""Time after which it is not known where a person has gone."""
_SURE_S, _SURE_HERE_S = 1.0, 0.25
"""Time for which the person has to look the same to be found again, elsewhere or in their place."""
_REPLACED_S = 3.0
"""Time with somebody else after which the person is not known by their looks alone."""
_JUST_NOW_S = 0.25
"""Who was seen elsewhere so long ago or less is not here."""
_SEEN = 0.75
"""Score from which on a detection is a person, not a shadow."""
_MAX_CANDIDATES = 4
_SMALL = 0.6
"""Share of the picture below which a person is searched for around their place too."""
_BESIDE = 0.2
"""Distance in squares within which two may be taken for one another."""
_SAME_OTHER = 0.5
"""Difference in place and size up to which a detection is taken for another person who is known."""
_TELLING = 0.08
"""Difference of sizes, as logarithms, that tells people apart."""
_WHOLE = 0.8
"""Share of the difference of sizes up to which somebody is seen as they were."""
_PARTED_S = 1.5
"""Time within which who was in the person's place comes out beside them."""


@dataclass(eq=False)
class PersonTracker:
    """Follows one person from picture to picture; times only ever increase."""

    detector: PoseDetector
    landmarker: PoseLandmarker
    trail: Trail | None = None
    lost: bool = False
    unclear: bool = False
    """True if whom the last picture shows may be another person."""
    own: Appearance | None = None
    people: list[Detection] | None = None
    """Who was detected in the last picture, None if nobody was looked for."""
    others: list[Bystander] = field(default_factory=list)
    looked_round_s: float = -np.inf
    stranger_s: float = np.inf
    """Since when somebody else has been in view instead of the person; -inf: for too long."""
    hopes: list[tuple[Trail, Pose]] = field(default_factory=list)
    """Looks at one who may be the person that had gone; they count once that is sure."""
    lately: list[Trail] = field(default_factory=list)
    """Where the person was at the looks of the last :data:`_PARTED_S`."""
    mistaken_s: float = np.inf
    """Up to when the person was followed, and then somebody else; inf: nobody else was."""

    def begin(self, roi: Roi, time_s: float) -> None:
        """Start at a square with the person, whose colours are still to be learnt."""
        self.trail, self.lost, self.unclear = Trail(roi, time_s, time_s), False, False
        self.looked_round_s, self.stranger_s, self.hopes = -np.inf, np.inf, []
        self.lately = [self.trail]
        for other in self.others:
            other.trail = replace(other.trail, time_s=-np.inf, since_s=-np.inf)

    def step(self, picture: Pixels, time_s: float) -> Pose | None:
        """Find the person in the next picture."""
        assert self.trail is not None
        self.unclear, self.mistaken_s = False, np.inf
        self.people = self._watched(picture, time_s)
        pose = signature = None
        if not self.lost:
            pose = self._look(picture, self.trail.predicted(time_s))
        if pose is not None:
            signature = None if jumped(pose) else self._recognised(picture, pose, time_s)
        followed = signature is not None
        if not followed:
            people = self._seen(picture, self.trail.predicted(time_s))
            pose, signature = self._search(picture, people, time_s)
        if pose is None or signature is None:
            self.lost, self.hopes = True, []
            self._meet(time_s)
            return None
        if followed or not self._doubtful(time_s):
            self.hopes = []
        elif not self._sure(pose, signature, time_s):
            self.lost = True
            return None
        self._accept(pose, signature, time_s)
        grown = max(past.growth(pose.next_roi) for past in self.lately)
        if time_s - self.looked_round_s >= _LOOK_ROUND_S or grown > 2.0 * _TELLING:
            self.looked_round_s = time_s
            self._look_round(picture, self._seen(picture, pose.next_roi), pose, time_s)
        return pose if self.mistaken_s == np.inf else None

    def _meet(self, time_s: float) -> None:
        """Somebody else, or nobody, is in view instead of the person."""
        if time_s - self.stranger_s > _REPLACED_S:
            self.stranger_s = -np.inf
        elif self.beside(None).any():
            self.stranger_s = min(self.stranger_s, time_s)
        else:
            self.stranger_s = np.inf

    def _seen(self, picture: Pixels, near: Roi) -> list[Detection]:
        """People in the picture, detected only once."""
        if self.people is None:
            self.people = self._people(picture, near)
        return self.people

    def _doubtful(self, time_s: float) -> bool:
        """True if one look does not tell whether somebody is the person who was lost."""
        assert self.trail is not None
        lost_s = self.trail.time_s
        last_s = max((each.trail.time_s for each in self.others), default=-np.inf)
        return time_s - lost_s > _GONE_S or lost_s - last_s < _GONE_S

    def _sure(self, pose: Pose, signature: Signature, time_s: float) -> bool:
        """True if somebody has looked the same as the person who had gone for long enough.

        At a glance others in like clothes do too, the more so while they come into the picture.
        """
        assert self.trail is not None
        assert self.own is not None
        roi = pose.next_roi
        near = self.hopes and self.hopes[-1][0].is_near(roi, time_s)
        if not near or self.stranger_s == -np.inf:  # others have come: who is alike may be one
            self.hopes = []
        same = self.own.may_be(signature, THE_SAME)
        self.hopes = [*self.hopes, (Trail(roi, time_s, time_s), pose)] if same else []
        here = self.trail.continues(roi, time_s)
        least_s = _SURE_HERE_S if here else _SURE_S
        sure = same and time_s - self.hopes[0][0].time_s > least_s - 1e-9
        self.unclear = not (sure and here)
        return sure

    def _look(self, picture: Pixels, roi: Roi) -> Pose | None:
        pose = self.landmarker.in_picture(picture, roi)
        return pose if pose.confidence >= FOUND else None

    def _recognised(
        self, picture: Pixels, pose: Pose, time_s: float, *, followed: bool = True
    ) -> Signature | None:
        """Looks of the person, if this is them; who is followed may change their looks."""
        assert self.trail is not None
        roi, signature = pose.next_roi, signature_of(pose.roi.cut(picture), pose)
        if self.own is None:
            return signature
        mine, theirs = self._likeness(signature)
        near = [each for each in self.others if time_s - each.trail.time_s < _GONE_S]
        least = THE_SAME if near and not followed else ALIKE
        twins = [each for each in self.others if self.own.may_be(each.signature, THE_SAME)]
        # Who comes back from behind the edge of the picture was seen in part, and in a wrong size.
        any_size = not followed and not twins and not near
        if (
            self.trail.reaches(roi, time_s, any_size=any_size)
            and theirs <= mine + 0.05
            and (not near or not followed or self.trail.continues(roi, time_s))
            and ((followed and not near) or self.own.may_be(signature, least))
            and not any(self._may_be(twin, roi, time_s, followed) for twin in twins)
        ):
            return signature
        self.unclear = True
        return None

    def _may_be(self, twin: Bystander, roi: Roi, time_s: float, followed: bool) -> bool:
        """True if a square may show another person who looks like the one that is followed."""
        assert self.trail is not None
        if self.trail.growth(roi) + _TELLING < twin.trail.growth(roi):
            return False
        unseen_s = time_s - twin.trail.time_s
        if unseen_s < _GONE_S and twin.trail.away(roi, time_s) < _BESIDE:
            return True
        # Who was about when the person was lost, and is not seen elsewhere now, may be here.
        about = self.trail.time_s - twin.trail.time_s < _GONE_S
        if followed or not about or unseen_s < _JUST_NOW_S:
            return False
        return not self.trail.continues(roi, time_s)

    def _likeness(self, signature: Signature) -> tuple[float, float]:
        assert self.own is not None
        theirs = max((similarity(signature, other.signature) for other in self.others), default=0.0)
        return self.own.likeness(signature), theirs

    def _search(
        self, picture: Pixels, people: list[Detection], time_s: float
    ) -> tuple[Pose | None, Signature | None]:
        """Look for the person among all who are seen."""
        assert self.trail is not None
        best: tuple[Pose | None, Signature | None] = None, None
        best_rank = -np.inf
        for person in people[:_MAX_CANDIDATES]:
            if not self.trail.is_near(person.roi, time_s):
                self.unclear = True
                continue
            pose = self._look(picture, person.roi)
            if pose is None:
                continue
            signature = self._recognised(picture, pose, time_s, followed=False)
            if signature is None:
                continue
            mine = 1.0 if self.own is None else self.own.likeness(signature)
            rank = mine - 0.3 * min(self.trail.unlike(pose.next_roi, time_s), 2.0)
            if rank > best_rank:
                best, best_rank = (pose, signature), rank
        return best

    def _people(self, picture: Pixels, near: Roi) -> list[Detection]:
        """People in the picture; if the person is small, also those around a place."""
        if near.size_px > _SMALL * max(picture.shape[:2]):
            return self.detector.people(picture)
        around = Roi(near.centre_x_px, near.centre_y_px, 1.5 * near.size_px)
        return self.detector.look(picture, around)[0] + self.detector.people(picture)

    def _accept(self, pose: Pose, signature: Signature, time_s: float) -> None:
        assert self.trail is not None
        self.trail = self.trail.followed(pose.next_roi, time_s, steady=not self.lost)
        since_s = time_s - _PARTED_S
        self.lately = [*(each for each in self.lately if each.time_s > since_s), self.trail]
        self.lost, self.stranger_s = False, np.inf
        if self.own is None:
            self.own = Appearance(signature)
            return
        mine, theirs = self._likeness(signature)
        # While another person covers them, the colours are not the person's own.
        if mine > theirs + 0.1:
            self.own.learn(signature)

    def _watched(self, picture: Pixels, time_s: float) -> list[Detection] | None:
        """People in the picture, if others may be near; these are followed."""
        assert self.trail is not None
        since_s = min((time_s - each.trail.time_s for each in self.others), default=np.inf)
        if since_s > _GONE_S and not self.lost:
            return None
        people = self._people(picture, self.trail.predicted(time_s))
        if not people:
            return people
        rois = [each.roi for each in people]
        if len(rois) > 1 and not self.lost:  # one of them is the person
            unlike = [self.trail.unlike(roi, time_s) for roi in rois]
            rois.pop(int(np.argmin(unlike)))
        for other in self.others:
            unlike = [other.trail.unlike(roi, time_s) for roi in rois]
            roi = rois[int(np.argmin(unlike))]
            if min(unlike) < min(_SAME_OTHER, self.trail.unlike(roi, time_s)):
                other.trail = other.trail.followed(roi, time_s)
        return people

    def _look_round(
        self, picture: Pixels, people: list[Detection], pose: Pose, time_s: float
    ) -> None:
        """Learn the colours of others while they stand apart."""
        for person in people[: _MAX_CANDIDATES + 1]:
            if _beside(person.roi, pose.next_roi):
                continue
            other = self._look(picture, person.roi)
            if other is None or _beside(other.next_roi, pose.next_roi):
                continue
            signature = signature_of(other.roi.cut(picture), other)
            known = max(
                self.others, key=lambda each: similarity(signature, each.signature), default=None
            )
            if known is None or not alike(known.signature, signature):
                known = Bystander(signature, Trail(other.next_roi, time_s, time_s))
                self.others = [*self.others, known][-_MAX_CANDIDATES:]
            elif known.trail.time_s < time_s:
                known.trail = known.trail.followed(other.next_roi, time_s)
            self.mistaken_s = self._was_until_s(known)
            if self.mistaken_s < np.inf:
                self.unclear = True
                known.signature = signature_of(pose.roi.cut(picture), pose)
                self.trail, known.trail, self.lately = known.trail, self.lately[-1], []
                return

    def _was_until_s(self, other: Bystander) -> float:
        """Time up to which one who is now seen beside the person was the person; inf: never.

        While one covers another in like clothes only their sizes tell them apart.
        """
        assert self.own is not None
        if not self.own.may_be(other.signature):
            return np.inf
        here, there = self.lately[-1], other.trail
        grown = {
            past.time_s: past.growth(here.roi)
            for past in self.lately
            if past.time_s < there.since_s
            and past.growth(there.roi) + _TELLING < past.growth(here.roi)
            and past.is_near(there.roi, there.time_s)
        }
        # While one comes out from behind the other, landmarks are of both.
        whole = _WHOLE * max(grown.values(), default=0.0)
        return max((time_s for time_s, by in grown.items() if by >= whole), default=np.inf)

    def beside(self, pose: Pose | None) -> NDArray[np.bool_]:
        """True for each of :data:`PLACES` where others are in the last picture."""
        # Who may turn out to be the person is not yet somebody else.
        known = pose or (self.hopes[-1][1] if self.hopes else None)
        places = np.zeros(len(PLACES), bool)
        places[3] = pose is None and known is not None
        seen = [each.roi for each in self.people or [] if each.score >= _SEEN]
        if pose is not None and self.trail is not None:
            # Others who are known are hardly overlooked.
            now_s = self.trail.time_s
            seen += [each.trail.roi for each in self.others if each.trail.time_s == now_s]
        for roi in seen:
            if known is None or not _beside(roi, known.next_roi):
                right = int(pose is not None and roi.centre_x_px > pose.next_roi.centre_x_px)
                places[2 if pose is None else right] = True
        return places

    def state(self) -> dict[str, NDArray[np.generic]]:
        """State that the next step depends on, as arrays."""
        assert self.trail is not None
        assert self.own is not None
        signatures = [each.signature for each in self.others]
        trails = [each.trail.numbers() for each in self.others]
        lately = [each.numbers() for each in self.lately]
        return {
            "trail": self.trail.numbers(),
            "clock": np.array([self.looked_round_s, self.stranger_s, float(self.lost)]),
            "own": np.array([self.own.recent, *self.own.kept]),
            "others": np.array(signatures, np.float32).reshape(-1, *self.own.recent.shape),
            "trails": np.array(trails, np.float64).reshape(-1, 8),
            "lately": np.array(lately, np.float64).reshape(-1, 8),
        }

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Go on from :meth:`state`."""
        self.trail = Trail.of(np.asarray(state["trail"], np.float64))
        self.looked_round_s, self.stranger_s, lost = (float(value) for value in state["clock"])
        self.lost = bool(lost)
        self.lately = [Trail.of(each) for each in np.asarray(state["lately"], np.float64)]
        recent, *kept = np.asarray(state["own"], np.float32)
        self.own = Appearance(recent, kept)
        self.others = [
            Bystander(signature, Trail.of(numbers))
            for signature, numbers in zip(
                np.asarray(state["others"], np.float32),
                np.asarray(state["trails"], np.float64),
                strict=True,
            )
        ]


def _beside(one: Roi, two: Roi) -> bool:
    """True if two squares are so near that they may show the same person."""
    return apart_px(one, two) < _BESIDE * two.size_px


def jumped(pose: Pose) -> bool:
    """True if another person in the square, or none, was taken for the person."""
    ratio = pose.next_roi.size_px / pose.roi.size_px
    away_px = apart_px(pose.roi, pose.next_roi)
    return away_px > 0.35 * pose.roi.size_px or not 0.4 < ratio < 2.0
