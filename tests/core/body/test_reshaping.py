"""A body of another shape moves as the one that is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.body.model import Resolution
from sd2core.body.reshaping import coarser, reshaped
from sd2core.body.rig import JOINTS, KeypointSpace, Rig
from sd2core.body.rotations import Floats, from_vector
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

TIMES_S = np.arange(20) / 30.0


def moving(shape: BodyShape, turns: Floats, place_m: Floats, resolution: Resolution = "low"):
    """A mesh of the bundled body, whose joints turn."""
    space = ShapeSpace()
    body = space.load(resolution, shape)
    rig = Rig(body.skeleton, KeypointSpace(space).of(shape))
    transforms = body.skeleton.transforms(rig.body_rotations(turns), place_m)
    return MeshSequence(pose_vertices(body, transforms), body.faces, Timebase(TIMES_S))


def swinging(seed: int) -> Floats:
    """Turns of the joints by up to half a radian, (T, J, 3, 3)."""
    rng = np.random.default_rng(seed)
    size, phase = 0.3 * rng.standard_normal((2, len(JOINTS), 3))
    return from_vector(size * np.sin(6.0 * TIMES_S[:, None, None] + 9.0 * phase))


@pytest.mark.parametrize("resolution", ["low", "medium"])
def test_another_body_moves_as_if_its_own_joints_turned(resolution: Resolution) -> None:
    rng = np.random.default_rng(3)
    space = ShapeSpace()
    one, other = space.random(rng), space.random(rng)
    turns, place_m = swinging(1), np.tile([0.2, 1.0, 2.5], (len(TIMES_S), 1))
    made = reshaped(moving(one, turns, place_m, resolution), other)
    wanted = moving(other, turns, place_m, resolution)

    def velocity(mesh: MeshSequence) -> Floats:
        return np.gradient(np.asarray(mesh.read(0, 20), np.float64), TIMES_S, axis=0)

    moved = velocity(wanted)
    off = np.sqrt(((velocity(made) - moved) ** 2).mean() / (moved**2).mean())
    assert off < 0.06
    assert np.array_equal(made.faces, wanted.faces)
    # Sizes are those of the other person.
    height = [np.ptp(mesh.read(0, 1)[0, :, 1]) for mesh in (made, wanted)]
    assert height[0] == pytest.approx(height[1], rel=0.03)


def test_longer_legs_go_farther_on_the_same_floor() -> None:
    space = ShapeSpace()
    short, tall = (BodyShape(np.zeros(len(space)), stature_m) for stature_m in (1.5, 1.8))
    still = np.tile(np.eye(3), (len(TIMES_S), len(JOINTS), 1, 1))
    place_m = np.stack([TIMES_S, 1.0 + 0.0 * TIMES_S, 2.0 + 0.0 * TIMES_S], axis=1)
    seen = moving(short, still, place_m)
    made = np.asarray(reshaped(seen, tall).read(0, 20), np.float64)
    assert np.ptp(made[:, 0, 0]) == pytest.approx(1.2 * np.ptp(TIMES_S), rel=0.01)
    assert np.ptp(made[0, :, 1]) == pytest.approx(1.8, rel=0.01)
    assert made[..., 1].max() == pytest.approx(float(seen.read(0, 20)[..., 1].max()), abs=0.01)


def test_bones_of_another_surface_are_not_known() -> None:
    shape = BodyShape(np.zeros(len(ShapeSpace())), 1.7)
    mesh = moving(shape, swinging(0), np.zeros((20, 3)))
    with pytest.raises(Sd2Error, match="another surface"):
        reshaped(replace(mesh, faces=mesh.faces[:-1]), shape)


def test_a_coarser_surface_lies_on_the_finer_one() -> None:
    shape = ShapeSpace().random(np.random.default_rng(5))
    fine = moving(shape, swinging(2), np.zeros((20, 3)), "medium")
    made, wanted = coarser(fine), moving(shape, swinging(2), np.zeros((20, 3)))
    assert np.array_equal(made.faces, wanted.faces)
    off_m = np.linalg.norm(made.read(0, 20) - wanted.read(0, 20), axis=2)
    assert np.median(off_m) < 0.01
    assert coarser(wanted) is wanted
