"""Things before a body hide what a segment to the sensor says, and nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, moving, options, plate, sensor_at, wobbling
from hypothesis import given
from hypothesis import strategies as some
from numpy.typing import NDArray
from oracles.plain_maps import plainly

from sd2core.accuracy.cache import scene_fingerprint
from sd2core.doppler import PRESETS, Synthesizer, masks
from sd2core.doppler.reference import reference_stretch
from sd2core.errors import Sd2Error
from sd2core.io.things import with_things
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing

OCCLUSION = pytest.mark.parametrize("visibility", ["depth", "exact"])
SENSOR = sensor_at(0.3, -0.2, -1.5)
TIMES_S = np.arange(6) / 30
WALL = Thing("screen", (0.0, 20.0, 0.3), size_m=(40.0, 40.0, 0.03))


def approaching(depth_m: float = 3.0) -> MeshSequence:
    """A plate of 1 m that comes nearer at 1 m/s."""
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, depth_m - TIMES_S], axis=1)
    return moving(*plate(1.0, 20), path, TIMES_S)


def crossed(
    box: Thing, points_m: NDArray[Any], sensor_m: NDArray[Any], wider_m: float
) -> NDArray[np.bool_]:
    """Points whose segment to the sensor meets a box, larger by some metres on all sides.

    In the box's own frame a segment lies between each two planes for an interval of its length.
    """
    assert box.size_m is not None
    angle = np.radians(box.turn_deg)
    turn = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    middle = np.array(box.position_m) - [0, box.size_m[1] / 2, 0]
    start, end = (points_m - middle) @ turn.T, turn @ (sensor_m - middle)
    half = np.array(box.size_m) / 2 + wider_m
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(side * half - start) / (end - start) for side in (-1, 1)])
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    return np.maximum(enter, 0) <= np.minimum(leave, 1)


@pytest.mark.parametrize("compiled", [True, False])
@OCCLUSION
def test_a_wall_between_leaves_nothing(
    visibility: Any, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled:
        plainly(monkeypatch)
    mesh = approaching()
    seen = Synthesizer(mesh, RAW).map(SENSOR, visibility=visibility)
    hidden = Synthesizer(with_things(mesh, [WALL]), RAW).map(SENSOR, visibility=visibility)
    assert seen.values.sum() == pytest.approx(6)
    assert not hidden.values.any()
    assert hidden.meta["visible_share"] == [0] * 6
    assert hidden.meta["things"][0]["shape"] == "screen"
    assert "things" not in seen.meta


@OCCLUSION
def test_a_thing_behind_or_beside_changes_no_number(visibility: Any) -> None:
    mesh = wobbling(20)
    others = [
        Thing("screen", (0, 3, 9), size_m=(5, 6, 0.1)),
        Thing("table", (0.3, 1, -3.5), turn_deg=40),
        Thing("box", (6, 1, 2)),
    ]
    plain = Synthesizer(mesh, PRESETS["paper"]).map(SENSOR, visibility=visibility)
    among = Synthesizer(with_things(mesh, others), "paper").map(SENSOR, visibility=visibility)
    np.testing.assert_array_equal(among.values, plain.values)
    assert among.meta["visible_share"] == plain.meta["visible_share"]


@given(
    x=some.floats(-0.6, 0.6),
    z=some.floats(0.3, 1.6),
    turn=some.floats(-180, 180),
    width=some.floats(0.1, 1.5),
    high=some.floats(0.1, 1.5),
    depth=some.floats(0.005, 0.4),
    visibility=some.sampled_from(["depth", "exact"]),
)
def test_those_vertices_whose_segment_it_crosses(
    x: float, z: float, turn: float, width: float, high: float, depth: float, visibility: Any
) -> None:
    """Between sensor and body, partly over it, turned in any way, also around the sensor."""
    mesh = wobbling(3)
    box = Thing("box", (x, 0.4, z), turn, (width, high, depth))
    before = Synthesizer(mesh, RAW).frame(SENSOR, 1, visibility).visible
    after = Synthesizer(with_things(mesh, [box]), RAW).frame(SENSOR, 1, visibility).visible
    points = mesh.frame(1).astype(np.float64)
    place = np.array(SENSOR.position_m)
    surely, perhaps = (crossed(box, points, place, wider) for wider in (-1e-5, 1e-5))
    np.testing.assert_array_equal(after[surely], False)
    np.testing.assert_array_equal(after[~perhaps], before[~perhaps])


def test_a_screen_over_one_half() -> None:
    """Of a plate from -0.5 to 0.5 m at 3 m, seen past a screen at 1 m that ends at x = 0."""
    half = Thing("screen", (-1.0, 1.0, 1.0), size_m=(2.0, 2.0, 1e-3))
    scattering = Synthesizer(with_things(approaching(), [half]), RAW).frame(CAMERA, 0)
    x = approaching().frame(0)[:, 0]
    np.testing.assert_array_equal(scattering.visible[np.abs(x) > 1e-3], x[np.abs(x) > 1e-3] > 0)


def test_as_much_is_seen_through_a_doorway_as_it_is_wide() -> None:
    """0.896 m at 1.5 m shows 1.792 m at 3 m, of a plate of 4 m in small cells."""
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 3.0 - TIMES_S], axis=1)
    wide = moving(*plate(4.0, 100), path, TIMES_S)
    door = Thing("doorway", (0.0, 1.0, 1.5), size_m=(1.4, 2.2, 1e-3))
    beside = [Thing("screen", (x, 1.0, 1.5), size_m=(3.0, 2.2, 1e-3)) for x in (-2.2, 2.2)]
    seen = Synthesizer(with_things(wide, [door, *beside]), RAW).frame(CAMERA, 0).visible
    x, y = wide.frame(0)[:, 0], wide.frame(0)[:, 1]
    across = np.abs(y) < 1.5
    np.testing.assert_array_equal(seen[across], np.abs(x[across]) < 0.896)


@OCCLUSION
def test_the_reference_sees_the_same(visibility: Any) -> None:
    mesh = with_things(
        wobbling(12), [Thing("table", (0.1, 0.7, 0.6), turn_deg=25), Thing("box", (0.5, 0.3, 1.0))]
    )
    wide = options(beyond="clip")  # every vertex that is seen is in the map
    made = Synthesizer(mesh, wide).stretch(SENSOR, 0, 12, visibility).raw
    reference = reference_stretch(mesh, SENSOR, wide, 0, 12)
    np.testing.assert_allclose(made.sum(axis=0), reference.sum(axis=0), atol=2e-3)
    assert np.abs(made - reference).sum() < 0.02 * reference.sum()
    alone = reference_stretch(wobbling(12), SENSOR, wide, 0, 12)
    assert reference.sum() < 0.9 * alone.sum()


def test_previews_do_not_look_at_things_and_say_so() -> None:
    mesh = approaching()
    for visibility in ("none", "facing"):
        made = Synthesizer(with_things(mesh, [WALL]), RAW).map(SENSOR, visibility=visibility)
        plain = Synthesizer(mesh, RAW).map(SENSOR, visibility=visibility)
        np.testing.assert_array_equal(made.values, plain.values)
        assert made.meta["notes"] == [
            f"Things in the scene hide nothing in visibility {visibility}."
        ]
        assert not plain.meta["notes"]


def test_they_stay_around_what_is_made_of_the_mesh() -> None:
    mesh = with_things(wobbling(20), [WALL])
    for made in (mesh.between(2, 9), decimate(mesh, 0.5)):
        assert made.surroundings is mesh.surroundings
    assert with_things(mesh, []).surroundings is None
    prints = {
        scene_fingerprint(one, SENSOR, RAW, "histogram")
        for one in (mesh, with_things(mesh, []), with_things(mesh, [Thing("box", (0, 0, 0))]))
    }
    assert len(prints) == 3


def test_far_from_the_origin_it_hides_the_same() -> None:
    """Coordinates in the kilometres are kept around each body; things follow them."""
    away = np.array([900.0, 0.0, 900.0])
    mesh = wobbling(4)
    vertices = mesh.vertices[:].astype(np.float64)
    box = Thing("box", (0.1, 0.2, 0.8), 30.0, (0.3, 0.5, 0.2))
    far_box = Thing("box", (900.1, 0.2, 900.8), 30.0, (0.3, 0.5, 0.2))
    near = MeshSequence(vertices, mesh.faces, mesh.timebase)
    far = MeshSequence(vertices + away, mesh.faces, mesh.timebase)
    x, y, z = SENSOR.position_m
    here = Synthesizer(with_things(near, [box]), RAW).frame(SENSOR, 1, "exact").visible
    there = Synthesizer(with_things(far, [far_box]), RAW)
    found = there.frame(sensor_at(x + 900, y, z + 900), 1, "exact").visible
    assert (found != here).mean() < 2e-3
    assert here.mean() < Synthesizer(near, RAW).frame(SENSOR, 1, "exact").visible.mean()


@OCCLUSION
@pytest.mark.parametrize("stride", [1, 3])
def test_of_things_that_move_only_what_they_hide_is_found_again(
    visibility: Any, stride: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kept mask of the body serves: the preview from the same place is the map itself."""
    wanted = options(visibility=visibility, mask_stride=stride)
    mesh = approaching()
    screens = [Thing("screen", (x, 1.0, 0.5), size_m=(0.2, 2.0, 0.03)) for x in (-0.1, 0.1)]
    before, after = (with_things(mesh, [screen]) for screen in screens)
    first = Synthesizer(before, wanted)
    first.map(SENSOR)
    expected = Synthesizer(after, wanted).map(SENSOR).values
    moved = Synthesizer(after, wanted, blocks_of=first)

    def refuse(*_: Any) -> None:
        raise AssertionError("the body was looked at again")

    monkeypatch.setattr(masks.VisibilityMasks, "_test_body", refuse)
    made = moved.map(SENSOR, visibility="frozen")
    assert made.meta["visibility"] == "frozen"
    np.testing.assert_array_equal(made.values, expected)
    assert not np.array_equal(expected, first.map(SENSOR).values)


@pytest.mark.parametrize("parts", ["beam", ("wall",)])
def test_a_part_of_the_scene_that_is_none_is_refused(parts: Any) -> None:
    with pytest.raises(Sd2Error, match="beam, things, walls"):
        Synthesizer(approaching(), left_out=parts)
