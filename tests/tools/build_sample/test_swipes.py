from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from sd2core.body.model import Body
from sd2core.files.recording_json import Span
from tools.build_sample.swipes import DURATION_S, SPANS, posed, swipes

PLACE = np.array([0.05, 1.1, 2.2])
RATE = 100.0


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load("low")


@pytest.fixture(scope="module")
def times_s() -> np.ndarray:
    return np.arange(int(DURATION_S * RATE)) / RATE


@pytest.fixture(scope="module")
def hand(body: Body, times_s: np.ndarray) -> np.ndarray:
    """Centre of the right hand in the camera frame, (T, 3)."""
    names = body.skeleton.names
    bones = [
        number
        for number, name in enumerate(names)
        if name.endswith(".R") and name.startswith(("wrist", "finger", "metacarpal"))
    ]
    vertices = (body.weights * np.isin(body.bones, bones)).sum(axis=1) > 0.9
    motion = swipes(body.skeleton, times_s)
    return (posed(body, motion.rotations, motion.translation_m) + PLACE)[:, vertices].mean(axis=1)


def radial_velocity(hand: np.ndarray) -> np.ndarray:
    """Positive approaching the camera, (T,)."""
    return -np.gradient(np.linalg.norm(hand, axis=1), 1.0 / RATE)


def during(span: Span, times_s: np.ndarray) -> np.ndarray:
    return (times_s >= span.start_s) & (times_s < span.end_s)


def test_two_of_each_gesture_apart_and_in_order() -> None:
    labels = [span.label for span in SPANS]
    for label in ("left-to-right", "right-to-left", "up-to-down", "down-to-up"):
        assert labels.count(label) == 2
    for before, after in pairwise(SPANS):
        assert before.end_s + 0.2 < after.start_s
    assert SPANS[0].start_s > 0
    assert SPANS[-1].end_s < DURATION_S


@pytest.mark.one_in(3)
@pytest.mark.parametrize("span", SPANS)
def test_the_hand_goes_where_the_label_says(
    span: Span, hand: np.ndarray, times_s: np.ndarray
) -> None:
    path = hand[during(span, times_s)]
    right, down, _ = path[-1] - path[0]
    along, aside = {
        "left-to-right": (right, down),
        "right-to-left": (-right, down),
        "up-to-down": (down, right),
        "down-to-up": (-down, right),
    }[span.label]
    assert along > 0.5
    assert abs(aside) < 0.15


@pytest.mark.parametrize("span", SPANS)
def test_each_direction_has_its_own_doppler(
    span: Span, hand: np.ndarray, times_s: np.ndarray
) -> None:
    velocity = radial_velocity(hand)[during(span, times_s)]
    approach, recede = velocity.max(), -velocity.min()
    first, second = np.split(velocity, [len(velocity) // 2])
    if span.label == "left-to-right":  # comes round the shoulder, then goes away a little
        assert approach > 0.7
        assert 0.4 < recede < approach - 0.2
        assert first.mean() > 0 > second.mean()
    elif span.label == "right-to-left":
        assert recede > 0.7
        assert 0.4 < approach < recede - 0.2
        assert first.mean() > 0 > second.mean()
    elif span.label == "up-to-down":  # pushed forward and down
        assert approach > 0.5 > 0.3 > recede
    else:
        assert recede > 0.5 > 0.3 > approach


def test_speeds_are_those_of_a_person(hand: np.ndarray, times_s: np.ndarray) -> None:
    speed = np.linalg.norm(np.gradient(hand, 1.0 / RATE, axis=0), axis=1)
    for span in SPANS:
        assert 1.0 < speed[during(span, times_s)].max() < 1.6
    assert speed.max() < 1.8


def test_every_vertex_stays_within_the_velocity_axis(body: Body, times_s: np.ndarray) -> None:
    times = times_s[::3]
    motion = swipes(body.skeleton, times)
    distance = np.linalg.norm(posed(body, motion.rotations, motion.translation_m) + PLACE, axis=2)
    assert np.abs(np.gradient(distance, times[1], axis=0)).max() < 1.5


def test_motion_has_no_jumps(hand: np.ndarray) -> None:
    acceleration = np.diff(hand, 2, axis=0) * RATE**2
    assert np.linalg.norm(acceleration, axis=1).max() < 15.0


def test_the_feet_stand_still(body: Body) -> None:
    motion = swipes(body.skeleton, [0.0, 2.2, 5.0, 9.7])
    below_hip = body.vertices_m[:, 1] > -0.5
    found = posed(body, motion.rotations, motion.translation_m)[:, below_hip]
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-12)


def test_rotations_are_rotations(body: Body) -> None:
    turns = swipes(body.skeleton, np.linspace(0.0, DURATION_S, 40)).rotations
    square = np.swapaxes(turns, -1, -2) @ turns
    np.testing.assert_allclose(square, np.broadcast_to(np.eye(3), square.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=1e-12)


def test_any_time_alone_gives_the_same_pose(body: Body) -> None:
    together = swipes(body.skeleton, [1.0, 5.7, 12.0]).rotations
    alone = swipes(body.skeleton, [5.7]).rotations
    np.testing.assert_allclose(alone[0], together[1], atol=1e-12)


def test_the_wrist_is_where_the_pose_says(body: Body) -> None:
    """Between the moves the wrist stands at its azimuth, elevation and reach."""
    skeleton = body.skeleton
    motion = swipes(skeleton, [1.5])
    transforms = skeleton.transforms(motion.rotations)

    def place(name: str) -> np.ndarray:
        bone = skeleton.index[name]
        return transforms[0, bone, :, :3] @ skeleton.heads_m[bone] + transforms[0, bone, :, 3]

    away = place("wrist.R") - place("upperarm01.R")
    assert np.linalg.norm(away) == pytest.approx(0.46, abs=1e-9)
    assert np.degrees(np.arctan2(away[0], -away[2])) == pytest.approx(-64.0, abs=1e-6)
    assert np.degrees(np.arcsin(-away[1] / 0.46)) == pytest.approx(-13.0, abs=1e-6)
