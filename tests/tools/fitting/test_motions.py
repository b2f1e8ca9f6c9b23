from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARKS
from tools.fitting.cast import PEOPLE
from tools.fitting.clips import CLIPS, Clip, Scene, clip_named, scene
from tools.fitting.motions import STROKE_S, Action, duration_s

RATE = 30.0
DIRECTION = {
    "left-to-right": (1.0, 0.0),
    "right-to-left": (-1.0, 0.0),
    "up-to-down": (0.0, 1.0),
    "down-to-up": (0.0, -1.0),
}
SWIPES = [clip for clip in CLIPS if clip.action.kind == "swipes"]


@pytest.fixture(scope="module")
def space() -> ShapeSpace:
    return ShapeSpace()


@pytest.fixture(scope="module")
def keypoint_space(space: ShapeSpace) -> KeypointSpace:
    return KeypointSpace(space)


def landmark(known: Scene, keypoint_space: KeypointSpace, name: str) -> np.ndarray:
    positions = keypoint_space.of(known.shape).positions(known.transforms)
    return positions[:, LANDMARKS.index(name)]


def speed(path: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.gradient(path, 1.0 / RATE, axis=0), axis=1)


def test_gestures_speeds_people_and_distances_are_covered() -> None:
    made = {(swipe, clip.action.speed) for clip in SWIPES for swipe in clip.action.swipes}
    assert made == {(swipe, speed) for swipe in DIRECTION for speed in STROKE_S}
    assert {clip.person for clip in CLIPS} == set(PEOPLE)
    assert {clip.action.kind for clip in CLIPS} == {"swipes", "still", "walk", "turn"}
    assert {clip.action.hand for clip in CLIPS} == {"L", "R"}
    standing = [clip.distance_m for clip in CLIPS if clip.action.kind != "walk"]
    assert (min(standing), max(standing)) == (1.8, 3.5)
    assert len({clip.name for clip in CLIPS}) == len({clip.seed for clip in CLIPS}) == len(CLIPS)


@pytest.mark.parametrize("clip", SWIPES, ids=lambda clip: clip.name)
def test_the_hand_goes_where_the_camera_sees_it_go(
    clip: Clip, space: ShapeSpace, keypoint_space: KeypointSpace
) -> None:
    known = scene(clip, space)
    hand = landmark(known, keypoint_space, f"index.{clip.action.hand}")
    assert tuple(span.label for span in known.spans) == clip.action.swipes
    for span in known.spans:
        during = (known.times_s >= span.start_s) & (known.times_s <= span.end_s)
        right, down, _ = hand[during][-1] - hand[during][0]
        along = np.dot(DIRECTION[span.label], (right, down))
        aside = np.dot(DIRECTION[span.label][::-1], (right, down))
        assert along > 0.4
        assert abs(aside) < 0.5 * along
        assert span.end_s - span.start_s == pytest.approx(STROKE_S[clip.action.speed], rel=0.07)


@pytest.mark.parametrize(
    "clip", [clip for clip in SWIPES if clip.action.speed == "fast"], ids=lambda clip: clip.name
)
def test_a_fast_swipe_is_fast(clip: Clip, space: ShapeSpace, keypoint_space: KeypointSpace) -> None:
    known = scene(clip, space)
    hand = speed(landmark(known, keypoint_space, f"index.{clip.action.hand}"))
    for span in known.spans:
        assert 0.35 <= span.end_s - span.start_s <= 0.45
        during = (known.times_s >= span.start_s) & (known.times_s <= span.end_s)
        assert 2.5 <= hand[during].max() <= 5.0


def test_who_stands_still_does_not_move_at_all(space: ShapeSpace) -> None:
    for name in ("still", "still-hand-up"):
        known = scene(clip_named(name), space)
        assert np.ptp(known.transforms, axis=0).max() == 0.0


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["walk", "walk-aside", "turn", "turn-other"])
def test_feet_stand_on_the_floor_and_do_not_slide(
    name: str, space: ShapeSpace, keypoint_space: KeypointSpace
) -> None:
    clip = clip_named(name)
    known = scene(clip, space)
    mesh = known.mesh(space, "low")
    depth = np.asarray(mesh.vertices)[..., 1].max(axis=1) - clip.camera_m
    assert np.abs(depth).max() < 0.035
    on_the_floor = [
        speed(landmark(known, keypoint_space, f"{part}.{side}")[:, [0, 2]])
        for part in ("heel", "foot_index")
        for side in "LR"
    ]
    assert np.min(on_the_floor, axis=0).max() < 0.15


@pytest.mark.parametrize("name", ["walk", "walk-aside"])
def test_walking_comes_nearer_and_both_legs_and_arms_swing(
    name: str, space: ShapeSpace, keypoint_space: KeypointSpace
) -> None:
    clip = clip_named(name)
    known = scene(clip, space)
    hip = landmark(known, keypoint_space, "hip.L")
    assert hip[0, 2] - hip[-1, 2] == pytest.approx(clip.action.walk_m, abs=0.02)
    for part, least_m in (("ankle", 0.35), ("wrist", 0.15)):
        apart = (
            landmark(known, keypoint_space, f"{part}.L")
            - landmark(known, keypoint_space, f"{part}.R")
        )[:, 2]
        assert apart.max() > least_m
        assert apart.min() < -least_m
    ahead = {
        part: landmark(known, keypoint_space, f"{part}.L")[:, 2]
        - landmark(known, keypoint_space, f"{part}.R")[:, 2]
        for part in ("ankle", "wrist")
    }
    assert np.corrcoef(ahead["ankle"], ahead["wrist"])[0, 1] < -0.7


def test_turning_faces_where_it_says(space: ShapeSpace, keypoint_space: KeypointSpace) -> None:
    clip = clip_named("turn")
    known = scene(clip, space)
    hips = landmark(known, keypoint_space, "hip.L") - landmark(known, keypoint_space, "hip.R")
    yaw_deg = np.degrees(np.arctan2(-hips[:, 2], hips[:, 0]))
    assert yaw_deg.max() == pytest.approx(75.0, abs=3.0)
    assert yaw_deg.min() == pytest.approx(-65.0, abs=3.0)
    assert abs(yaw_deg[-1]) < 2.0


def test_the_seed_alone_decides(space: ShapeSpace) -> None:
    clip = clip_named("all-fast")
    np.testing.assert_array_equal(scene(clip, space).transforms, scene(clip, space).transforms)
    other = Clip(*astuple(clip)[:1], clip.action, *astuple(clip)[2:6], seed=99)
    assert scene(other, space).spans != scene(clip, space).spans


@pytest.mark.slow
def test_no_motion_is_cut_off(space: ShapeSpace, keypoint_space: KeypointSpace) -> None:
    for clip in CLIPS:
        hand = landmark(scene(clip, space), keypoint_space, f"index.{clip.action.hand}")
        assert speed(hand)[[0, -1]].max() < 0.1, clip.name


def test_an_action_lasts_until_its_last_move() -> None:
    assert duration_s(Action("still"), 0) == 4.0
    assert duration_s(Action("swipes", ("left-to-right",), "slow"), 0) > STROKE_S["slow"]
