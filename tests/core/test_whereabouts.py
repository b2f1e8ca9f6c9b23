from __future__ import annotations

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.mesh import MeshSequence
from sd2core.placements import PlacementGrid
from sd2core.timebase import Timebase
from sd2core.whereabouts import Whereabouts


def cube_walking_right(present=None):
    """A cube of edge 1 m, 3 m from the camera, whose middle goes from x = 0 to x = 9 m."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    middles = np.stack([np.arange(10.0), np.zeros(10), np.full(10, 3.0)], axis=1)
    vertices = (middles[:, None] + corners).astype(np.float32)
    return MeshSequence(
        vertices, None, Timebase(np.arange(10) / 10), source="cube", present=present
    )


def test_the_target_is_the_mean_over_time_of_where_the_body_is():
    np.testing.assert_allclose(Whereabouts.of(cube_walking_right()).target_m, (4.5, 0.0, 3.0))


def test_frames_without_a_person_do_not_count():
    body = Whereabouts.of(cube_walking_right(present=np.arange(10) < 2))
    np.testing.assert_allclose(body.target_m, (0.5, 0.0, 3.0))
    assert body.low_m.shape == (2, 3)


def test_a_sensor_is_in_the_body_when_it_is_there_at_some_time():
    body = Whereabouts.of(cube_walking_right())
    # 0.6 m in front of where the cube passes, and 4.2 m beside the middle, in its way.
    in_front, in_its_way = PlacementGrid((0.6,)), PlacementGrid((4.2,), (90.0,))
    assert not body.inside(body.sensors(in_front)).any()
    assert body.inside(in_its_way.sensors(body.target_m)).all()
    with pytest.raises(Sd2Error, match=r"1 of 1 placements .* 4\.2 m, azimuth 90"):
        body.sensors(in_its_way)


def test_a_clip_without_anybody_is_refused():
    with pytest.raises(Sd2Error, match="cube has a person in no frame"):
        Whereabouts.of(cube_walking_right(present=np.zeros(10, bool)))
