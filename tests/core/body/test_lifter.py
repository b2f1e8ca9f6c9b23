"""The lifter's network on NumPy, and what it makes of tracks."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter import OUTPUTS, Lifter
from sd2core.body.lifter_features import Seen, features
from sd2core.body.network import Network
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARKS, MIRRORED, TORSO_CORNERS, LandmarkTrack
from sd2core.errors import Sd2Error
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion
from sd2core.timebase import Timebase

CAMERA = PinholeCamera(640, 480, 600.0)
DISTANCE_M = 2.3


@pytest.fixture(scope="module")
def lifter() -> Lifter:
    return Lifter.load()


def _network(channels: int, rng: np.random.Generator) -> Network:
    width, blocks = 12, 3
    shapes = {
        "mean": (channels,),
        "enter": (channels, width),
        "enter_bias": (width,),
        "wide": (blocks, 3, width, width),
        "wide_bias": (blocks, width),
        "flat": (blocks, width, width),
        "flat_bias": (blocks, width),
        "leave": (width, OUTPUTS),
        "leave_bias": (OUTPUTS,),
    }
    arrays = {name: 0.3 * rng.standard_normal(shape) for name, shape in shapes.items()}
    arrays |= {"spread": np.full(channels, 2.0), "gain": np.ones((blocks, width))}
    arrays["last_gain"] = np.ones(width)
    return Network((1, 4, 2), {name: value.astype(np.float32) for name, value in arrays.items()})


def _moving(
    seed: int, seconds: float, *, still: bool, style: str = "strokes", natural: bool = False
) -> tuple[np.ndarray, float]:
    """Keypoints of someone who moves the right arm, in metres, and the stature."""
    rng = np.random.default_rng(seed)
    space = ShapeSpace()
    shape, times = space.random(rng), np.arange(0.0, seconds, 1.0 / 30.0)
    skeleton = space.skeleton(shape)
    deed = Deed("stand", (STYLES["rest"], STYLES[style]), still, natural)
    motion = random_motion(rng, skeleton, shape.stature_m, times, deed)
    places = KeypointSpace(space).of(shape).positions(skeleton.transforms(*motion))
    return places + np.array([0.0, 1.1, DISTANCE_M]), shape.stature_m


def _track(places_m: np.ndarray, rate_hz: float = 30.0) -> LandmarkTrack:
    """What a perfect landmark model would say, its depth apart, which is that of a board."""
    hips = places_m[:, TORSO_CORNERS[2:]].mean(axis=1, keepdims=True)
    world = places_m - hips
    depth = world[..., 2] * CAMERA.focal_px / hips[..., 2]
    count = len(places_m)
    return LandmarkTrack(
        timebase=Timebase.regular(count, rate_hz),
        width=CAMERA.width,
        height=CAMERA.height,
        image_px=CAMERA.project(places_m).astype(np.float32),
        depth_px=depth.astype(np.float32),
        world_m=world.astype(np.float32),
        visibility=np.ones((count, 33), np.float32),
        confidence=np.ones(count, np.float32),
        present=np.ones(count, bool),
        bridged=np.zeros(count, bool),
        silhouette_frames=np.zeros(0, np.intp),
        silhouettes=np.zeros((0, 8, 8), np.uint8),
    )


def test_windows_give_what_the_whole_gives() -> None:
    rng = np.random.default_rng(3)
    network = _network(7, rng)
    told = rng.standard_normal((1500, 7)).astype(np.float32)
    np.testing.assert_allclose(network(told), network.whole(told), atol=2e-5)


def test_nothing_matters_beyond_the_reach() -> None:
    rng = np.random.default_rng(4)
    network = _network(5, rng)
    told = rng.standard_normal((80, 5)).astype(np.float32)
    other = told.copy()
    other[40] += 3.0
    changed = np.flatnonzero(np.abs(network(other) - network(told)).max(axis=1) > 1e-6)
    assert changed.min() == 40 - network.reach
    assert changed.max() == 40 + network.reach


def test_where_and_how_large_a_person_is_drawn_changes_only_what_it_should() -> None:
    places, _ = _moving(2, 1.0, still=False)
    track = _track(places)
    slopes = CAMERA.slopes(track.image_px.astype(np.float64))
    seen = Seen(slopes, track.depth_px / 600.0, track.world_m, track.visibility, track.confidence)
    larger = seen._replace(slopes=slopes * 1.5, depth=seen.depth * 1.5, world_m=seen.world_m * 2.0)
    one, other = features(seen), features(larger)
    differs = np.flatnonzero(np.abs(one - other).max(axis=0) > 1e-4)
    assert len(differs) <= 3  # the direction of the body, and its size


def test_a_still_person_is_still(lifter: Lifter) -> None:
    places, stature_m = _moving(5, 2.0, still=True)
    noisy = _track(places)
    rng = np.random.default_rng(0)
    jitter = 0.15 * rng.standard_normal(noisy.image_px.shape)
    lifted = lifter.lift(
        replace(noisy, image_px=noisy.image_px + jitter.astype(np.float32)), CAMERA
    )
    assert np.sqrt(np.mean((stature_m * lifted.velocity) ** 2)) < 0.06


def test_unseen_motion_is_followed_along_the_line_of_sight(lifter: Lifter) -> None:
    found, wanted, within = [], [], []
    elbow = LANDMARKS.index("elbow.R")
    for seed in range(20, 26):
        places, stature_m = _moving(seed, 2.0, still=False, style="quick", natural=True)
        lifted = lifter.lift(_track(places), CAMERA)
        wanted.append(np.gradient(places[:, elbow, 2], 1.0 / 30.0))
        found.append(stature_m * lifted.velocity[:, elbow])
        sigma_mps = stature_m * lifted.velocity_sigma[:, elbow]
        within.append(np.abs(found[-1] - wanted[-1]) < sigma_mps)
        centre = places[:, TORSO_CORNERS, 2].mean(axis=1)
        np.testing.assert_allclose(stature_m * lifted.centre_depth, centre, rtol=0.15)
    v, w = np.concatenate(found), np.concatenate(wanted)
    assert np.corrcoef(v, w)[0, 1] > 0.6
    assert np.sqrt(np.mean((v - w) ** 2)) < 0.9 * w.std()
    assert 0.5 < np.mean(np.concatenate(within)) < 0.95


def test_sides_and_directions_of_time_are_treated_alike(lifter: Lifter) -> None:
    places, _ = _moving(3, 1.5, still=False)
    track = _track(places)
    plain = lifter.lift(track, CAMERA)
    sides = list(MIRRORED)
    mirror = lifter.lift(_track(places[:, sides] * [-1.0, 1.0, 1.0]), CAMERA)
    np.testing.assert_allclose(mirror.velocity[:, sides], plain.velocity, atol=2e-3)
    np.testing.assert_allclose(mirror.centre_depth, plain.centre_depth, rtol=1e-3)
    np.testing.assert_allclose(mirror.across[:, sides], plain.across * [-1.0, 1.0], atol=1e-4)
    backwards = lifter.lift(_track(places[::-1]), CAMERA)
    np.testing.assert_allclose(-backwards.velocity[::-1], plain.velocity, atol=2e-3)
    np.testing.assert_allclose(backwards.depth_sigma[::-1], plain.depth_sigma, rtol=1e-2)


def test_empty_frames_stay_empty_and_part_the_clip(lifter: Lifter) -> None:
    places, _ = _moving(6, 2.0, still=False)
    track = _track(places)
    present = np.ones(60, bool)
    present[25:31] = False
    image = track.image_px.copy()
    image[25:31] = np.nan
    lifted = lifter.lift(replace(track, present=present, image_px=image), CAMERA)
    assert np.isnan(lifted.velocity[25:31]).all()
    assert np.isfinite(lifted.velocity[present]).all()


def test_the_frame_rate_does_not_matter(lifter: Lifter) -> None:
    places, _ = _moving(7, 2.0, still=False)
    plain = lifter.lift(_track(places), CAMERA)
    often = np.repeat(places, 2, axis=0)[:-1].copy()
    often[1::2] = 0.5 * (places[1:] + places[:-1])
    twice = lifter.lift(_track(often, 60.0), CAMERA)
    inner = slice(5, -5)
    difference = twice.velocity[::2][inner] - plain.velocity[inner]
    assert np.sqrt(np.mean(difference**2)) < 0.25 * plain.velocity[inner].std()


@given(
    st.lists(st.floats(0.0, 2.0), min_size=2, max_size=2),
    st.floats(0.0, 3.0),
    st.floats(0.0, 8.0),
    st.floats(-3.0, 1.0),
)
def test_deviations_of_a_fit_are_a_product_of_powers(
    lifter: Lifter, powers: list[float], lifted_mps: float, speed_mps: float, factor: float
) -> None:
    law = replace(lifter, fit_law=np.array([*powers, *[factor] * 33]))
    ones = np.ones((1, 33))
    sigma = law.fit_sigma_mps(lifted_mps * ones, speed_mps * ones)
    wanted = np.exp(factor) * (lifted_mps + 0.01) ** powers[0] * (speed_mps + 0.03) ** powers[1]
    np.testing.assert_allclose(sigma, wanted, rtol=1e-9)


def test_a_limb_that_is_not_seen_is_known_less_well(lifter: Lifter) -> None:
    wrist = LANDMARKS.index("wrist.R")
    places, _ = _moving(4, 2.0, still=False)
    track = _track(places)
    hidden = track.visibility.copy()
    hidden[:, wrist] = 0.02
    seen, unseen = (
        lifter.lift(replace(track, visibility=one), CAMERA) for one in (track.visibility, hidden)
    )
    for name in ("velocity_sigma", "across_sigma"):
        known, guessed = (np.median(getattr(one, name)[:, wrist]) for one in (seen, unseen))
        assert guessed > 1.05 * known


def test_who_moves_fast_is_known_less_well(lifter: Lifter) -> None:
    assert (lifter.fit_law[:2] > 0.0).all()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_clips_of_few_frames(lifter: Lifter, frames: int) -> None:
    places, _ = _moving(8, 0.5, still=False)
    for rate_hz in (10.0, 30.0):
        lifted = lifter.lift(_track(places[:frames], rate_hz), CAMERA)
        assert np.isfinite(lifted.depth).all()


def test_the_picture_must_be_the_camera_s(lifter: Lifter) -> None:
    places, _ = _moving(9, 0.2, still=True)
    with pytest.raises(Sd2Error, match="640"):
        lifter.lift(_track(places), PinholeCamera(320, 240, 300.0))


def test_a_damaged_later_or_older_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "lifter.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(Sd2Error, match="lifter"):
        Lifter.load(path)
    np.savez(path, meta=json.dumps({"format": "sd2-lifter", "version": 99}))
    with pytest.raises(Sd2Error, match="version"):
        Lifter.load(path)
    np.savez(path, meta=json.dumps({"format": "sd2-lifter", "version": 1}))
    with pytest.raises(Sd2Error, match="version 1") as refused:
        Lifter.load(path)
    assert "tools.train_lifter train" in str(refused.value)
