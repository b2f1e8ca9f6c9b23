from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.body.model import Body
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import about
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import LANDMARKS, MIRRORED
from sd2core.errors import Sd2Error

SPACE = ShapeSpace()
NEUTRAL = BodyShape(np.zeros(len(SPACE)), SPACE.base_stature_m)
seeds = st.integers(0, 2**31)


@pytest.mark.parametrize("resolution", ["high", "medium", "low"])
def test_neutral_shape_is_the_bundled_body(resolution) -> None:
    body, bundled = SPACE.load(resolution, NEUTRAL), Body.load(resolution)
    np.testing.assert_allclose(body.vertices_m, bundled.vertices_m, atol=1e-12)
    np.testing.assert_allclose(body.skeleton.heads_m, bundled.skeleton.heads_m, atol=1e-12)


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_random_bodies_stand_on_the_floor_at_their_stature_and_stay_closed(seed: int) -> None:
    shape = SPACE.random(np.random.default_rng(seed))
    body = SPACE.load("low", shape)
    assert body.stature_m == pytest.approx(shape.stature_m, abs=0.015)
    assert abs(body.vertices_m[:, 1].max()) < 0.01
    surface = trimesh.Trimesh(body.vertices_m, body.faces, process=False)
    assert surface.is_watertight
    assert surface.volume > 0.02  # outward faces


@pytest.mark.parametrize("resolution", ["high", "low"])
def test_surface_is_one_closed_component_facing_outwards(resolution) -> None:
    body = SPACE.load(resolution, SPACE.random(np.random.default_rng(1)))
    surface = trimesh.Trimesh(body.vertices_m, body.faces, process=False)
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.body_count == 1
    # A human of water's density.
    assert 30.0 < 1000.0 * surface.volume < 160.0


def test_phenotypes_do_what_they_are_called() -> None:
    def volume(**phenotypes: float) -> float:
        shape = BodyShape(SPACE.coefficients(**phenotypes), 1.75)
        body = SPACE.load("low", shape)
        return float(trimesh.Trimesh(body.vertices_m, body.faces, process=False).volume)

    assert volume(weight=0.9) > 1.15 * volume(weight=0.1)
    assert volume() == pytest.approx(volume(weight=0.5), rel=1e-12)


def test_unknown_phenotype_is_named() -> None:
    with pytest.raises(Sd2Error, match="phenotype colour = 1"):
        SPACE.coefficients(colour=1)
    with pytest.raises(Sd2Error, match=r"weight = 1\.5"):
        SPACE.coefficients(weight=1.5)


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_keypoints_of_a_shaped_body_are_on_its_bones_and_surface(seed: int) -> None:
    shape = SPACE.random(np.random.default_rng(seed))
    body = SPACE.load("high", shape)
    points = KeypointSpace(SPACE).of(shape)
    for name in ("shoulder", "elbow", "wrist", "knee", "ankle"):
        for side in "LR":
            row = LANDMARKS.index(f"{name}.{side}")
            assert np.allclose(points.rest_m[row], body.skeleton.heads_m[points.bones[row]])
    for name in ("nose", "ear.L", "mouth.R", "heel.L", "foot_index.R"):
        away = np.linalg.norm(body.vertices_m - points.rest_m[LANDMARKS.index(name)], axis=1)
        assert away.min() < 1e-6


def test_keypoints_are_mirrored() -> None:
    rest = KeypointSpace(SPACE).of(NEUTRAL).rest_m
    mirrored = rest[list(MIRRORED)] * np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(rest, mirrored, atol=2e-3)
    assert (rest[[n.endswith(".L") for n in LANDMARKS], 0] > 0).all()


def test_keypoints_follow_their_bones() -> None:
    body = SPACE.load("low", NEUTRAL)
    points = KeypointSpace(SPACE).of(NEUTRAL)
    turns = np.tile(np.eye(3), (1, len(body.skeleton), 1, 1))
    turns[:, body.skeleton.index["lowerarm01.L"]] = about(
        np.array([0.0, 0.0, 1.0]), np.array([90.0])
    )
    there = points.positions(body.skeleton.transforms(turns))[0]
    elbow, wrist = LANDMARKS.index("elbow.L"), LANDMARKS.index("wrist.L")
    np.testing.assert_allclose(there[elbow], points.rest_m[elbow], atol=1e-12)
    x, y, z = points.rest_m[wrist] - points.rest_m[elbow]
    np.testing.assert_allclose(there[wrist] - there[elbow], [-y, x, z], atol=1e-12)
