from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.body_extent import BodyExtent, notes_on
from sd2core.placements.placements import PlacementGrid
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase


def cube_walking_right(present=None, interval_s=0.1):
    """A cube of edge 1 m, 3 m from the camera, whose middle goes from x = 0 to x = 9 m."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    middles = np.stack([np.arange(10.0), np.zeros(10), np.full(10, 3.0)], axis=1)
    vertices = (middles[:, None] + corners).astype(np.float32)
    return MeshSequence(
        vertices, None, Timebase(interval_s * np.arange(10)), source="cube", present=present
    )


def test_the_target_is_the_mean_over_time_of_where_the_body_is():
    np.testing.assert_allclose(BodyExtent.of(cube_walking_right()).target_m, (4.5, 0.0, 3.0))


def test_frames_without_a_person_do_not_count():
    body = BodyExtent.of(cube_walking_right(present=np.arange(10) < 2))
    np.testing.assert_allclose(body.target_m, (0.5, 0.0, 3.0))
    assert body.low_m.shape == (2, 3)


def test_a_sensor_is_in_the_body_when_it_is_there_at_some_time():
    body = BodyExtent.of(cube_walking_right())
    # 0.6 m in front of where the cube passes, and 4.2 m beside the middle, in its way.
    in_front, in_its_way = PlacementGrid((0.6,)), PlacementGrid((4.2,), (90.0,))
    assert not body.coverage(in_front.sensors(body.target_m)).inside.any()
    assert body.coverage(in_its_way.sensors(body.target_m)).inside.all()


def test_radial_velocity_is_that_of_the_walk_seen_from_its_end_and_none_from_above():
    body = BodyExtent.of(cube_walking_right())  # 1 m in 0.1 s
    # So far away that all lines of sight are parallel.
    ahead, above = PlacementGrid((1000.0,), (90.0, 0.0), (0.0, 90.0)).sensors(body.target_m)[:2]
    coverage = body.coverage([ahead, above])
    np.testing.assert_allclose(coverage.fastest_mps, (10.0, 0.0), atol=0.06)


def test_a_short_swipe_of_a_long_clip_is_as_fast_as_it_is():
    """An arm of 5 % of the vertices swings there and back at 13 m/s within 0.4 s of 3 minutes."""
    times_s = np.arange(5400) / 30.0
    phase = np.clip((times_s - 71.3) / 0.4, 0.0, 1.0)
    vertices = np.zeros((5400, 100, 3), np.float32)
    vertices[:] = np.random.default_rng(0).normal((0.0, 0.0, 3.0), 0.1, (100, 3))
    vertices[:, :5, 0] += (13.0 * 0.4 / np.pi * np.sin(np.pi * phase))[:, None]
    body = BodyExtent.of(MeshSequence(vertices, None, Timebase(times_s)))
    seen = body.coverage([VirtualSensor((1000.0, 0.0, 3.0))])
    np.testing.assert_allclose(seen.fastest_mps, 13.0, rtol=0.02)


@given(
    st.tuples(*[st.floats(-20, 20)] * 3),
)
def test_range_is_that_of_the_farthest_vertex(position):
    mesh = cube_walking_right()
    coverage = BodyExtent.of(mesh).coverage([VirtualSensor(position)])
    away = np.linalg.norm(np.asarray(mesh.vertices, float) - position, axis=2)
    # The vertices of the cube are the corners of its box.
    assert coverage.farthest_m[0] == pytest.approx(away.max())


def test_what_folds_in_range_or_velocity_is_beyond_a_radar():
    body = BodyExtent.of(cube_walking_right())
    # Beside the walk, in line with it behind its end, and far away.
    beside, in_line, far = PlacementGrid((4.8, 30.0), (0.0, 90.0)).sensors(body.target_m)[:3]
    slow = BodyExtent.of(cube_walking_right(interval_s=10.0)).coverage([beside, in_line, far])
    assert PAPER_RADAR.range_max_m == pytest.approx(9.6, abs=0.01)
    assert slow.problems(PAPER_RADAR)["out_of_range"].tolist() == [False, True, True]
    assert not slow.problems(PAPER_RADAR)["aliasing"].any()
    assert body.coverage([in_line]).problems(PAPER_RADAR)["aliasing"].all()


def test_a_clip_without_anybody_is_refused():
    with pytest.raises(Sd2Error, match="cube has a person in no frame"):
        BodyExtent.of(cube_walking_right(present=np.zeros(10, bool)))


@pytest.mark.parametrize(
    ("position_m", "interval_s", "radar", "words"),
    [
        ((4.5, 0.0, 0.0), 10.0, PAPER_RADAR, ()),
        ((4.2, 0.0, 3.0), 10.0, None, ("stands in the box around the body",)),
        ((0.0, 0.0, -3.0), 10.0, None, ()),  # nothing folds in a histogram
        ((0.0, 0.0, -3.0), 10.0, PAPER_RADAR, ("11.5 m away: beyond 9.6 m", "the wrong sign")),
        ((4.5, 0.0, 0.0), 0.1, PAPER_RADAR, ("beyond 3.2 m/s",)),
    ],
)
def test_what_is_wrong_with_a_sensor_is_said(position_m, interval_s, radar, words):
    mesh, sensor = cube_walking_right(interval_s=interval_s), VirtualSensor(position_m)
    notes = " ".join(notes_on(mesh, sensor, radar))
    assert all(word in notes for word in words)
    assert bool(notes) == bool(words)
    assert notes_on(cube_walking_right(present=np.zeros(10, bool)), sensor, radar) == ()


def test_what_folds_of_another_body_is_said_with_its_name():
    near = replace(cube_walking_right(interval_s=10.0), faces=np.array([[0, 1, 2]], np.int32))
    far = replace(near, vertices=near.vertices[:] + np.float32([0.0, 0.0, 9.0]), person="anna")
    alone, both = near, replace(near, others=(far,))
    sensor = VirtualSensor((4.5, 0.0, 0.0))
    assert notes_on(alone, sensor, PAPER_RADAR) == ()
    (note,) = notes_on(both, sensor, PAPER_RADAR)
    assert note.startswith("The body of anna is up to 13.5 m away: beyond 9.6 m")
