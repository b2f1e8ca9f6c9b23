from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.body.camera import PinholeCamera
from sd2core.body.evidence import Evidence, evidence_of, sight_of, trust_of
from sd2core.body.fit_video import fit_doubts
from sd2core.body.fitted import FittedMotion
from sd2core.body.lifter import LiftedTrack
from sd2core.body.limbs import LIMBS
from sd2core.body.shape import BodyShape
from sd2core.body.solve import _size_error
from sd2core.body.track import LANDMARK, TORSO_CORNERS, LandmarkTrack
from sd2core.timebase import Timebase


def seen(size_sd: float, seed: int) -> Evidence:
    rng = np.random.default_rng(seed)
    ones = np.ones((3, 33))
    return Evidence(
        times_s=np.arange(3) / 30.0,
        slopes=rng.normal(0.0, 0.3, (3, 33, 2)),
        slopes_sd=rng.uniform(0.002, 0.05, (3, 33)),
        size_sd=size_sd,
        trunk=TORSO_CORNERS,
        depth_m=0.0 * ones,
        depth_sd_m=ones,
        trunk_m=ones[:, 0],
        trunk_sd_m=ones[:, 0],
        velocity_mps=0.0 * ones,
        velocity_sd_mps=ones,
        standing_sd_mps=ones[:, :4],
    )


@settings(max_examples=30)
@given(st.floats(0.0, 1.0), st.integers(0, 2**31))
def test_an_error_of_the_size_is_one_of_all_landmarks_together(size_sd: float, seed: int) -> None:
    evidence = seen(size_sd, seed)
    along, share = _size_error(evidence)
    middle = evidence.slopes.mean(axis=1, keepdims=True)
    change = ((evidence.slopes - middle) / evidence.slopes_sd[..., None]).reshape(3, 66, 1)
    covariance = np.eye(66) + size_sd**2 * change @ change.transpose(0, 2, 1)
    root = np.eye(66) - (share * along) @ along.transpose(0, 2, 1)
    np.testing.assert_allclose(root @ covariance @ root, np.tile(np.eye(66), (3, 1, 1)), atol=1e-8)


def track(x_px: float, visibility: float) -> LandmarkTrack:
    points = np.full((1, 33, 2), 100.0, np.float32)
    points[:, LANDMARK["wrist.L"], 0] = x_px
    told = np.full((1, 33), visibility, np.float32)
    return LandmarkTrack(
        timebase=Timebase(np.zeros(1)),
        width=640,
        height=480,
        image_px=points,
        depth_px=0.0 * told,
        world_m=np.zeros((1, 33, 3), np.float32),
        visibility=told,
        confidence=np.ones(1, np.float32),
        present=np.ones(1, bool),
        bridged=np.zeros(1, bool),
        silhouette_frames=np.zeros(0, np.intp),
        silhouettes=np.zeros((0, 2, 2), np.uint8),
    )


def test_what_is_outside_the_picture_was_never_seen() -> None:
    wrist = LANDMARK["wrist.L"]
    inside, edge, outside, hidden = (
        trust_of(track(x_px, visibility))[0, wrist]
        for x_px, visibility in ((320.0, 0.9), (-12.0, 0.9), (680.0, 0.9), (320.0, 0.0))
    )
    np.testing.assert_allclose([inside, edge], [0.9, 0.45], atol=1e-6)
    assert outside == hidden == 0.05


def test_what_is_half_visible_beside_an_edge_was_not_seen() -> None:
    wrist = LANDMARK["wrist.L"]
    middle, clear, drawn_in = (
        (track(x_px, visibility), sight_of(track(x_px, visibility))[0, wrist])
        for x_px, visibility in ((320.0, 0.6), (600.0, 1.0), (600.0, 0.6))
    )
    for of_track, sight in (middle, clear):
        assert sight == trust_of(of_track)[0, wrist]
    assert drawn_in[1] == 0.05 < trust_of(drawn_in[0])[0, wrist]


def test_landmarks_are_where_the_lifter_says_and_as_sure_as_it_says() -> None:
    camera, wrist = PinholeCamera(640, 480, 600.0), LANDMARK["wrist.L"]
    ones = np.ones((1, 33))
    across, across_sigma = np.zeros((1, 33, 2)), 0.004 * ones
    across[0, wrist], across_sigma[0, wrist] = (0.02, -0.01), 0.04
    lifted = LiftedTrack(
        *(2.0 * ones[:, 0], 0.1 * ones[:, 0], 0.0 * ones, 0.01 * ones),
        *(0.0 * ones, ones, across, across_sigma, ones[:, :4]),
    )
    seen = track(320.0, 1.0)
    evidence = evidence_of(seen, lifted, camera, 1.7)
    plain = camera.slopes(seen.image_px.astype(np.float64))
    np.testing.assert_allclose(evidence.slopes[0, wrist] - plain[0, wrist], [0.02, -0.01])
    ratio = evidence.slopes_sd / evidence.slopes_sd[0, 0]
    np.testing.assert_allclose(ratio[0, wrist], 10.0)
    np.testing.assert_allclose(np.delete(ratio, wrist), 1.0)
    np.testing.assert_allclose(evidence.depth_sd_m, 0.017)


def fitted(residual_m: float, **share: float) -> FittedMotion:
    shares = np.ones(33)
    for name, value in share.items():
        shares[[LANDMARK[f"{name}.L"], LANDMARK[f"{name}.R"]]] = value
    none = np.zeros((1, len(LIMBS)), np.float32)
    return FittedMotion(
        Timebase(np.zeros(1)),
        BodyShape(np.zeros(8), 1.7),
        lambda rows: None,  # type: ignore[arg-type, return-value]
        np.ones(1, bool),
        none,
        none,
        shares,
        residual_m,
        0.5,
    )


def test_a_good_fit_says_nothing() -> None:
    assert fit_doubts(fitted(0.05)) == ()


def test_limbs_that_were_never_seen_and_a_fit_not_to_be_believed_are_said() -> None:
    never, doubtful = fit_doubts(fitted(0.093, ankle=0.01, foot_index=0.0))
    assert never.startswith("Never seen: left shank, right shank, left foot, right foot.")
    assert "not to be believed: the body is 9.3 cm" in doubtful
