from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.body.limbs import LIMB_LANDMARKS, LIMBS, bone_limbs, vertex_limbs
from sd2core.body.model import Body
from sd2core.body.rotations import about
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from tools.build_sample.swipes import posed


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load("medium")


def mirrored(name: str) -> str:
    return name[:-1] + {"L": "R", "R": "L"}[name[-1]] if name[-2:] in (".L", ".R") else name


def test_every_landmark_lies_on_a_limb_and_nothing_else_does() -> None:
    assert set(LIMB_LANDMARKS) == set(LIMBS)
    assert {one for found in LIMB_LANDMARKS.values() for one in found} == set(LANDMARKS)


def test_left_and_right_correspond() -> None:
    for limb, landmarks in LIMB_LANDMARKS.items():
        other = LIMB_LANDMARKS[mirrored(limb)]
        assert {mirrored(name) for name in landmarks} == set(other)


def test_limbs_that_meet_share_a_landmark() -> None:
    for upper, lower, joint in (
        ("torso", "upper_arm.L", "shoulder.L"),
        ("upper_arm.R", "forearm.R", "elbow.R"),
        ("forearm.L", "hand.L", "wrist.L"),
        ("torso", "thigh.R", "hip.R"),
        ("thigh.L", "shank.L", "knee.L"),
        ("shank.R", "foot.R", "ankle.R"),
    ):
        assert set(LIMB_LANDMARKS[upper]) & set(LIMB_LANDMARKS[lower]) == {joint}


def test_every_limb_has_bones_that_hang_together(body: Body) -> None:
    skeleton = body.skeleton
    limbs = bone_limbs(skeleton)
    assert set(limbs) == set(range(len(LIMBS)))
    for limb in range(len(LIMBS)):
        entries = [
            bone
            for bone in np.flatnonzero(limbs == limb)
            if skeleton.parents[bone] < 0 or limbs[skeleton.parents[bone]] != limb
        ]
        assert len(entries) == 1  # one bone by which the limb hangs on the rest


def test_bending_one_joint_moves_the_limbs_beyond_it_and_no_other(body: Body) -> None:
    turns = np.tile(np.eye(3), (1, len(body.skeleton), 1, 1))
    turns[0, body.skeleton.index["lowerarm01.R"]] = about(
        np.array([0.0, 0.0, 1.0]), np.array([40.0])
    )[0]
    moved = np.linalg.norm(posed(body, turns)[0] - body.vertices_m, axis=1)
    limbs = vertex_limbs(body)
    typical = {name: np.median(moved[limbs == n]) for n, name in enumerate(LIMBS)}
    beyond = {"forearm.R", "hand.R"}
    assert all((typical[name] > 0.03) == (name in beyond) for name in LIMBS), typical
    unmoved = ~np.isin(limbs, [LIMBS.index(n) for n in (*beyond, "upper_arm.R")])
    assert moved[unmoved].max() < 1e-9


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_the_sides_are_the_persons_own_and_alike(resolution: str) -> None:
    body = Body.load(resolution)  # type: ignore[arg-type]
    limbs = vertex_limbs(body)
    x = body.vertices_m[:, 0]
    for number, name in enumerate(LIMBS):
        count = (limbs == number).sum()
        assert count > 5
        if name.endswith(".L"):
            assert x[limbs == number].min() > 0.0
            opposite = (limbs == LIMBS.index(mirrored(name))).sum()
            assert abs(int(count) - int(opposite)) <= 0.2 * count + 4


def test_an_unknown_bone_is_named(body: Body) -> None:
    strange = replace(body.skeleton, names=("tail", *body.skeleton.names[1:]))
    with pytest.raises(Sd2Error, match="'tail'"):
        bone_limbs(strange)
