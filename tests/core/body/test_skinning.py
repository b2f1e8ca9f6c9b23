from __future__ import annotations

import numpy as np
import pytest

from sd2core.body import skinning
from sd2core.body.model import Body
from sd2core.body.rotations import about
from tools.build_sample.swipes import posed


def random_transforms(body: Body, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Wild poses three metres away: transforms, and the vertices of ``Body.pose``."""
    rng = np.random.default_rng(5)
    turns = np.tile(np.eye(3), (frames, len(body.skeleton), 1, 1))
    for bone in range(len(body.skeleton)):
        axis = rng.normal(size=3)
        turns[:, bone] = about(axis / np.linalg.norm(axis), rng.uniform(-60, 60, frames))
    place = rng.normal([0.0, 1.0, 3.0], 0.3, (frames, 3))
    return body.skeleton.transforms(turns, place), posed(body, turns, place)


@pytest.mark.parametrize(("resolution", "frames"), [("low", 19), ("high", 3)])
def test_it_is_the_body_s_own_pose(resolution: str, frames: int) -> None:
    body = Body.load(resolution)  # type: ignore[arg-type]
    transforms, expected = random_transforms(body, frames)
    vertices = skinning.pose_vertices(body, transforms)
    assert vertices.dtype == np.float32
    np.testing.assert_allclose(vertices, expected, rtol=0, atol=1e-6)


def test_it_takes_what_may_not_be_written_and_no_frame_at_all() -> None:
    body = Body.load("low")
    transforms, expected = random_transforms(body, 9)
    every = np.asfortranarray(transforms)[::2]
    every.setflags(write=False)
    np.testing.assert_allclose(skinning.pose_vertices(body, every), expected[::2], atol=1e-6)
    assert skinning.pose_vertices(body, transforms[:0]).shape == (0, len(body.vertices_m), 3)
