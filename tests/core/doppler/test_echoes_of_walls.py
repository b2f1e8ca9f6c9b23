"""Echoes by way of walls: against segments that are followed one by one, and by what must hold."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, moving, options, sensor_at, wobbling
from hypothesis import assume, given, settings
from hypothesis import strategies as some
from mirrored_echoes import echoes_by_way_of
from oracles.plain_maps import plainly

from sd2core.body.parts import body_parts
from sd2core.doppler import (
    PRESETS,
    Synthesizer,
)
from sd2core.doppler.reference import reference_stretch
from sd2core.io.things import with_things, with_walls
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mesh.walls import Wall
from sd2core.recording.recording import open_sample
from sd2core.sensor import Beam

TIMES_S = np.arange(6) / 30
SENSOR = sensor_at(0.3, -0.2, -0.5)
RIGHT, FLOOR = Wall.named("right", 1.6, 3.0), Wall.named("floor", 1.2, 6.0)


def dot(velocity_mps: tuple[float, float, float], at_m: tuple[float, float, float]) -> MeshSequence:
    path = np.asarray(at_m) + np.outer(TIMES_S, velocity_mps)
    return moving(np.zeros((1, 3)), None, path, TIMES_S)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("beam", [None, Beam(70.0, 50.0)])
def test_each_vertex_comes_as_its_segments_say(
    compiled: bool, beam: Beam | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled:
        plainly(monkeypatch)
    mesh = wobbling(5, divisions=1)
    table = Thing("screen", (0.75, 0.9, 1.2), 20.0, (0.5, 1.0, 0.05))
    scene = with_walls(with_things(mesh, [table]), [RIGHT, FLOOR])
    sensor = replace(SENSOR, azimuth_deg=20.0, beam=beam)
    wide = options(range_exponent=4.0, reference_range_m=1.0, beyond="clip")
    direct = Synthesizer(with_things(mesh, [table]), wide).stretch(sensor, 1, 4, "exact").raw
    made = Synthesizer(scene, wide).stretch(sensor, 1, 4, "exact").raw - direct
    edges_mps = wide.axis.edges_mps
    for column, frame in enumerate((1, 2, 3)):
        total = np.zeros(wide.axis.bins)
        largest = 0.0
        for wall in (RIGHT, FLOOR):
            velocity, power = echoes_by_way_of(wall, scene, sensor, frame, 4.0).T
            assert 0 < np.count_nonzero(power) < len(power)
            counted, _ = np.histogram(
                velocity.clip(*edges_mps[[0, -1]]), edges_mps, weights=power / len(power)
            )
            total += counted
            largest = max(largest, power.max() / len(power))
        # One vertex may lie on the edge between two bins, in single precision.
        assert np.abs(made[:, column] - total).sum() < 2.1 * largest
        assert np.abs(made[:, column] - total).sum() < 0.05 * total.sum()


@given(
    speed=some.floats(-1.9, 1.9),
    away=some.floats(1.0, 6.0),
    aside=some.floats(0.3, 5.0),
    loss_db=some.floats(0.0, 30.0),
)
def test_a_point_has_its_closed_form(
    speed: float, away: float, aside: float, loss_db: float
) -> None:
    """It comes straight to the sensor; the image is twice as far aside as the wall."""
    mesh = dot((0.0, 0.0, -speed), (0.0, 0.0, away + 0.2 + 2 * abs(speed) / 30))
    fine = options(visibility="none", range_exponent=4.0, reference_range_m=1.0)
    alone = Synthesizer(mesh, fine).map(CAMERA).values[:, 2]
    scene = with_walls(mesh, [Wall.named("right", aside, loss_db)])
    ghost = Synthesizer(scene, fine).map(CAMERA).values[:, 2] - alone
    depth = mesh.frame(2)[0, 2]
    image = math.hypot(depth, 2 * aside)
    velocity = 0.5 * speed * (1 + depth / image)
    share = 2 * 10 ** (-loss_db / 10) / (depth * image) ** 2
    width = fine.axis.bin_width_mps
    # Central differences of the longer way bend by this much.
    assume(abs((velocity + 2.0) / width - round((velocity + 2.0) / width)) > 0.02)
    assert ghost[fine.axis.bin_of(velocity)] == pytest.approx(share, rel=1e-3, abs=1e-6)
    assert ghost.sum() == pytest.approx(share, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact", "frozen"])
def test_the_greatest_loss_leaves_the_map_and_less_adds_in_proportion(visibility: Any) -> None:
    mesh = wobbling(8)

    def map_with(*walls: Wall) -> np.ndarray[Any, np.dtype[np.float32]]:
        return Synthesizer(with_walls(mesh, walls), "paper").map(SENSOR, visibility=visibility)

    alone = map_with()
    deaf = map_with(replace(RIGHT, loss_db=100.0))
    np.testing.assert_allclose(deaf.values, alone.values, atol=1e-8)
    assert deaf.meta["visible_share"] == pytest.approx(alone.meta["visible_share"], abs=0.1)
    added = [
        map_with(replace(RIGHT, loss_db=loss_db)).values - alone.values for loss_db in (0.0, 10.0)
    ]
    assert added[0].sum() > 0
    np.testing.assert_allclose(added[1], 0.1 * added[0], atol=1e-6)
    both = map_with(RIGHT, FLOOR).values - alone.values
    each = [map_with(wall).values - alone.values for wall in (RIGHT, FLOOR)]
    np.testing.assert_allclose(both, each[0] + each[1], atol=1e-6)


def test_left_is_right_in_a_mirrored_scene() -> None:
    mesh = wobbling(8)
    flip = np.array([-1.0, 1.0, 1.0], np.float32)
    assert mesh.faces is not None
    mirrored = replace(mesh, vertices=mesh.vertices[:] * flip, faces=mesh.faces[:, ::-1].copy())
    x, y, z = SENSOR.position_m
    wide = options(beyond="clip")
    one = Synthesizer(with_walls(mesh, [RIGHT]), wide).map(SENSOR).values
    left = Wall.named("left", RIGHT.distance_m, RIGHT.loss_db)
    other = Synthesizer(with_walls(mirrored, [left]), wide).map(sensor_at(-x, y, z)).values
    # Vertices on the edge of a bin may fall to either side.
    assert np.abs(one - other).sum(axis=0).max() < 0.01


def test_nothing_comes_by_a_wall_that_the_sensor_or_the_body_is_behind() -> None:
    mesh = wobbling(8)
    alone = Synthesizer(mesh, "paper").map(SENSOR).values
    behind_sensor, behind_body = Wall.named("right", 0.2), Wall.named("ahead", 0.5)
    for wall, sensor in ((behind_sensor, SENSOR), (behind_body, SENSOR)):
        for visibility in ("none", "facing", "exact"):
            maps = [
                Synthesizer(scene, "paper").map(sensor, visibility=visibility).values
                for scene in (mesh, with_walls(mesh, [wall]))
            ]
            np.testing.assert_array_equal(*maps)
    assert alone.any()


@given(
    distance=some.floats(0.5, 4.0),
    azimuth=some.floats(-180, 180),
    elevation=some.floats(-90, 90),
    weight=some.sampled_from(["count", "area", "projected"]),
    law=some.sampled_from(["vertex", "frame"]),
    velocity=some.sampled_from(["central", "vid2doppler"]),
    visibility=some.sampled_from(["none", "facing", "exact"]),
)
@settings(max_examples=25, deadline=None)
def test_compiled_and_plain_agree(
    distance: float, azimuth: float, elevation: float, weight: Any, law: Any, velocity: Any,
    visibility: Any,
) -> None:  # fmt: skip
    wall = Wall(distance, azimuth, elevation)
    mesh = with_walls(wobbling(5, divisions=1), [wall])
    chosen = options(
        weight=weight, range_law=law, velocity=velocity, range_exponent=3.0, beyond="clip"
    )
    sensor = replace(SENSOR, beam=Beam(60.0, 40.0))
    made = Synthesizer(mesh, chosen).stretch(sensor, 0, 5, visibility).raw
    with pytest.MonkeyPatch.context() as monkeypatch:
        plainly(monkeypatch)
        slow = Synthesizer(mesh, chosen).stretch(sensor, 0, 5, visibility).raw
    # Beams are looked up in tables, and a vertex may lie between two bins.
    np.testing.assert_allclose(made.sum(axis=0), slow.sum(axis=0), rtol=2e-3, atol=1e-9)
    assert np.abs(made - slow).sum() < 0.03 * slow.sum() + 1e-9


@pytest.mark.parametrize("changes", [{}, {"weight": "projected"}, {"range_law": "frame"}])
def test_the_reference_counts_them_too(changes: Any) -> None:
    mesh = with_things(wobbling(6), [Thing("table", (0.4, 0.9, 1.0), turn_deg=25)])
    wide = options(beyond="clip", range_exponent=4.0, **changes)
    scene = with_walls(mesh, [RIGHT, FLOOR])
    made = Synthesizer(scene, wide).stretch(SENSOR, 0, 6, "exact").raw
    reference = reference_stretch(scene, SENSOR, wide, 0, 6)
    np.testing.assert_allclose(made.sum(axis=0), reference.sum(axis=0), rtol=5e-3)
    assert np.abs(made - reference).sum() < 0.02 * reference.sum()
    assert reference.sum() > 1.02 * reference_stretch(mesh, SENSOR, wide, 0, 6).sum()


def test_other_bodies_hide_on_either_leg_as_the_reference_says() -> None:
    first = wobbling(6)
    other = replace(first, vertices=first.vertices[:] + np.array([0.5, 0.0, -0.8], np.float32))
    both = replace(first, others=(other,))
    wide = options(beyond="clip", range_exponent=4.0)
    scene = with_walls(both, [RIGHT])
    made = Synthesizer(scene, wide).stretch(SENSOR, 0, 6, "exact").raw
    reference = reference_stretch(scene, SENSOR, wide, 0, 6)
    np.testing.assert_allclose(made.sum(axis=0), reference.sum(axis=0), rtol=5e-3)
    ghosts = [
        (reference_stretch(with_walls(one, [RIGHT]), SENSOR, wide, 0, 6)
         - reference_stretch(one, SENSOR, wide, 0, 6)).sum()
        for one in (first, other, both)
    ]  # fmt: skip
    assert 0 < ghosts[2] < 0.98 * (ghosts[0] + ghosts[1])


@pytest.mark.parametrize("compiled", [True, False])
def test_expected_maps_and_uncertain_cells_have_them(
    compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled:
        plainly(monkeypatch)
    mesh = wobbling(5, divisions=1)
    alike = np.full((5, 1), 0.2, np.float32)
    known = VelocityUncertainty(("body",), np.zeros(mesh.vertex_count, np.uint8), alike, alike)
    scene = with_walls(replace(mesh, uncertainty=known), [RIGHT])
    chosen = options(count="expected", range_exponent=4.0, beyond="clip")
    maker = Synthesizer(scene, chosen)
    made = maker.stretch(SENSOR, 0, 5, "exact").raw
    reference = reference_stretch(scene, SENSOR, chosen, 0, 5)
    assert np.abs(made - reference).sum() < 5e-3 * reference.sum()
    cells = maker.uncertainty(SENSOR, visibility="exact")
    np.testing.assert_allclose(cells.expected.sum(axis=0), made.sum(axis=0), rtol=2e-3)


def test_limbs_have_them_and_add_up() -> None:
    mesh = open_sample().load_mesh().between(30, 38)
    scene = with_walls(mesh, [Wall.named("left", 1.0, 0.0)])
    parts = body_parts(mesh)
    maker, alone = Synthesizer(scene), Synthesizer(mesh)
    of_limbs = maker.limb_maps(SENSOR, parts)
    assert of_limbs.limbs is not None
    np.testing.assert_allclose(of_limbs.limbs.values.sum(axis=0), of_limbs.values, atol=1e-5)
    assert of_limbs.values.sum() > 1.05 * alone.map(SENSOR).values.sum()


def test_a_velocity_by_way_of_a_wall_is_as_badly_known_as_the_mean_of_both() -> None:
    known = VelocityUncertainty(
        ("body",), np.zeros(1, np.uint8), np.full((1, 1), 0.3, "f4"), np.full((1, 1), 0.1, "f4")
    )
    limb = np.array([[[0.0, 0.0, 2.0]]])
    # The image sees the body at a right angle to the camera's line.
    sensors = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 2.0]])
    found = known.towards(sensors, limb)[0, 0]
    assert found == pytest.approx(math.hypot(0.5 * 0.3, 0.5 * 0.1), rel=1e-6)
    assert known.towards(sensors[[0, 0]], limb)[0, 0] == pytest.approx(0.3, rel=1e-6)


def test_maps_say_which_walls_there_were() -> None:
    made = Synthesizer(with_walls(wobbling(4), [FLOOR]), PRESETS["paper"]).map(SENSOR)
    assert [Wall(**one) for one in made.meta["walls"]] == [FLOOR]
    assert "things" not in made.meta
    assert not made.meta["notes"]
    assert "walls" not in Synthesizer(with_walls(wobbling(4), []), RAW).map(SENSOR).meta
