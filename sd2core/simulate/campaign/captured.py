"""Motion of one take from recorded motion of real people."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import Floats
from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, Role, load_motions
from sd2core.mocap.driving import resample_pose
from sd2core.simulate.campaign.motion import Performance
from sd2core.simulate.campaign.scene import Subject
from sd2core.simulate.limbs import Motion

_SHORTEST_S = 2.5
_PACE = 0.22
"""Greatest logarithm of how much faster or slower than recorded a motion is."""


class CapturedMotions:
    """Recorded motions of a folder; every subject of a campaign moves as one of its people.

    Those of the same number modulo the number of people move as the same person: as many subjects
    as there are people are divided as they are. Raises Sd2Error if the folder holds no motion
    for that use of 3.1 s or more.
    """

    def __init__(self, folder: Path, role: Role, space: ShapeSpace) -> None:
        motions = [
            motion
            for motion in load_motions(folder, role)
            if len(motion) >= _SHORTEST_S * RATE_HZ * math.exp(_PACE)
        ]
        if not motions:
            least_s = _SHORTEST_S * math.exp(_PACE)
            raise Sd2Error(
                f"{folder} holds no recorded motion to {role} of {least_s:.1f} s or more",
                "a folder that `python -m tools.motion_capture drive` made of motion capture",
                "Say where it is with --motions",
            )
        self._space, self._keypoints = space, KeypointSpace(space)
        self._people = [
            [motion for motion in motions if motion.person == person]
            for person in sorted({motion.person for motion in motions})
        ]
        names = "".join(f"{motion.trial} {len(motion)}\n" for motion in motions)
        self.provenance: dict[str, Any] = {
            "role": role,
            "people": len(self._people),
            "recordings": len(motions),
            "sha256": hashlib.sha256(names.encode()).hexdigest(),
        }

    def perform(
        self,
        rng: np.random.Generator,
        subject: Subject,
        number: int,
        skeleton: Skeleton,
        times_s: Floats,
    ) -> Performance:
        """A part of a recording on one subject's body, about the floor's origin.

        Half of the motions are reversed in time.

        Parameters
        ----------
        rng : Generator
        subject : Subject
        number : int
            Of the subject: it chooses the recorded person.
        skeleton : Skeleton
            The subject's.
        times_s : float64 array, shape (T,)
            Evenly spaced from 0 on.

        Returns
        -------
        Performance
            At most as long as the recording: the times are then those from the first on.
        """
        motion = _drawn(rng, self._people[number % len(self._people)])
        pace = float(np.exp(rng.uniform(-_PACE, _PACE)))
        frames = min(len(times_s), math.floor((len(motion) - 1) / RATE_HZ / pace / times_s[1]))
        needed = min(math.ceil(times_s[frames - 1] * pace * RATE_HZ) + 1, len(motion))
        start = int(rng.integers(0, len(motion) - needed + 1))
        own = self._space.skeleton(motion.shape)
        pose = motion.pose_on(skeleton, own, slice(start, start + needed))
        pose = resample_pose(pose, np.arange(needed) / RATE_HZ, times_s[:frames] * pace)
        if rng.random() < 0.5:
            pose = pose.at(slice(None, None, -1))
        rig = self._keypoints.rig(subject.shape)
        place = pose.translation_m.copy()
        middle = place.min(axis=0) + 0.5 * np.ptp(place, axis=0)
        place[:, [0, 2]] -= middle[[0, 2]]
        turned = Motion(rig.body_rotations(pose.turns), place)
        return Performance(turned, np.zeros(frames, np.int8), "captured")


def _drawn(rng: np.random.Generator, motions: Sequence[BodyMotion]) -> BodyMotion:
    """One of a person's motions, long ones more often."""
    lengths = np.array([len(motion) for motion in motions], float)
    return motions[int(rng.choice(len(motions), p=lengths / lengths.sum()))]
