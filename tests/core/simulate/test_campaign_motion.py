"""What people do in a campaign: labels say what hands do, and nobody is like another."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, applied
from sd2core.body.shape import ShapeSpace
from sd2core.simulate.campaign.motion import LABELS, Performance, perform
from sd2core.simulate.campaign.scene import Subject, random_subject

TIMES_S = np.arange(450) / 30.0


@pytest.fixture(scope="module")
def space() -> ShapeSpace:
    return ShapeSpace()


def performed(space: ShapeSpace, number: int, kind: str) -> tuple[Performance, Skeleton, Subject]:
    subject = random_subject(space, 7, number)
    skeleton = space.skeleton(subject.shape)
    rng = np.random.default_rng([7, number])
    return (
        perform(rng, subject, skeleton, space.base_skeleton, TIMES_S, kind),  # type: ignore[arg-type]
        skeleton,
        subject,
    )


def places(performance: Performance, skeleton: Skeleton, bone: str) -> Floats:
    index = skeleton.index[bone]
    moved = skeleton.transforms(*performance.motion)[:, index]
    return applied(moved[..., :3], skeleton.heads_m[index]) + moved[..., 3]


def strokes(label: np.ndarray) -> list[tuple[int, int, str]]:
    edges = np.flatnonzero(np.diff(label)) + 1
    bounds = [0, *edges.tolist(), len(label)]
    return [
        (first, last, LABELS[label[first]])
        for first, last in itertools.pairwise(bounds)
        if label[first]
    ]


@pytest.mark.parametrize("number", range(6))
def test_hands_go_where_the_label_says(space: ShapeSpace, number: int) -> None:
    performance, skeleton, _ = performed(space, number, "gestures")
    hands = [places(performance, skeleton, f"wrist.{side}") for side in "LR"]
    found = strokes(performance.label)
    assert found
    for first, last, name in found:
        if last == len(TIMES_S):
            continue  # the take ends within it
        way = [hand[last - 1] - hand[first] for hand in hands]
        moved = max(way, key=np.linalg.norm)
        axis, sign = {
            "left-to-right": (0, 1),
            "right-to-left": (0, -1),
            "up-to-down": (1, 1),
            "down-to-up": (1, -1),
        }[name]
        assert sign * moved[axis] > 0.12, (name, moved)
        assert abs(moved[axis]) == np.abs(moved[:2]).max()


def test_all_gestures_occur_and_most_of_the_time_is_none(space: ShapeSpace) -> None:
    labels = np.concatenate([performed(space, n, "gestures")[0].label for n in range(6)])
    shares = np.bincount(labels, minlength=len(LABELS)) / len(labels)
    assert (shares[1:] > 0.01).all()
    assert 0.4 < shares[0] < 0.85


def test_feet_stay_on_the_floor(space: ShapeSpace) -> None:
    performance, skeleton, _ = performed(space, 1, "gestures")
    for side in "LR":
        foot = places(performance, skeleton, f"foot.{side}")
        assert np.ptp(foot, axis=0).max() < 0.03


@pytest.mark.one_in(2)
@pytest.mark.parametrize("kind", ["moving", "pacing"])
def test_other_takes_hold_no_gesture_but_motion(space: ShapeSpace, kind: str) -> None:
    performance, skeleton, _ = performed(space, 3, kind)
    assert not performance.label.any()
    head = places(performance, skeleton, "head")
    wrist = places(performance, skeleton, "wrist.R")
    assert max(np.ptp(head[:, 2]), np.ptp(wrist, axis=0).max()) > 0.05
    # Nobody leaves.
    assert np.abs(head[:, [0, 2]]).max() < 1.2


def test_nobody_is_like_another_and_everybody_like_themselves(space: ShapeSpace) -> None:
    one, again, other = (random_subject(space, 7, number) for number in (0, 0, 1))
    np.testing.assert_array_equal(one.shape.coefficients, again.shape.coefficients)
    assert (one.hand, one.tempo, one.shape.stature_m) == (
        again.hand,
        again.tempo,
        again.shape.stature_m,
    )
    assert one.shape.stature_m != other.shape.stature_m
    assert one.tempo != other.tempo
    assert random_subject(space, 8, 0).tempo != one.tempo


@pytest.mark.parametrize("number", range(3))
def test_hands_are_no_faster_than_people_are(space: ShapeSpace, number: int) -> None:
    performance, skeleton, _ = performed(space, number, "gestures")
    for side in "LR":
        steps = np.diff(places(performance, skeleton, f"wrist.{side}"), axis=0) * 30.0
        assert np.linalg.norm(steps, axis=1).max() < 6.0
