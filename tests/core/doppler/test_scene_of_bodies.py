"""Several bodies in one scene: their shares add up, and each hides what is behind it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import RAW, moving, plate, sensor_at, wobbling
from hypothesis import given, settings
from hypothesis import strategies as some
from oracles.plain_maps import plainly

from sd2core.accuracy.cache import scene_fingerprint
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.reference import reference_stretch
from sd2core.errors import Sd2Error
from sd2core.io.things import with_things, with_walls
from sd2core.mesh.decimation import decimate
from sd2core.mesh.made_vertices import MadeVertices
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.mesh.walls import Wall
from sd2core.scattering import behind_things
from sd2core.scattering.behind_things import Hiding, may_hide
from sd2core.sensor import VirtualSensor

OCCLUSION = pytest.mark.parametrize("visibility", ["depth", "exact"])
SENSOR = sensor_at(0.3, -0.2, -1.5)
TIMES_S = np.arange(6) / 30


def approaching(depth_m: float, speed_mps: float = 1.0, side_m: float = 1.0, x_m: float = 0.0):
    """A plate that comes nearer, around the line of sight."""
    path = np.stack([0 * TIMES_S + x_m, 0 * TIMES_S, depth_m - speed_mps * TIMES_S], axis=1)
    return moving(*plate(side_m, 20), path, TIMES_S)


def beside(mesh: MeshSequence, *by_m: float) -> MeshSequence:
    """The same body elsewhere."""
    return replace(mesh, vertices=np.asarray(mesh.vertices) + np.array(by_m))


def together(*bodies: MeshSequence) -> MeshSequence:
    return replace(bodies[0], others=bodies[1:])


def raw(mesh: MeshSequence, visibility: Any, sensor: VirtualSensor = SENSOR) -> Any:
    return Synthesizer(mesh, RAW).stretch(sensor, 0, mesh.frame_count, visibility).raw


@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
def test_those_apart_add_up_to_the_last_bit(visibility: Any) -> None:
    one = wobbling(20)
    other = beside(wobbling(20, seed=3), 3.0, 0.1, 0.5)
    alone = [raw(mesh, visibility) for mesh in (one, other)]
    np.testing.assert_array_equal(raw(together(one, other), visibility), alone[0] + alone[1])


@pytest.mark.one_in(3)
@pytest.mark.parametrize("compiled", [True, False])
@OCCLUSION
def test_who_stands_behind_somebody_is_not_seen(
    visibility: Any, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not compiled:
        plainly(monkeypatch)
    before, behind = approaching(2.0, 0.5), approaching(3.0, -1.0, 0.5)
    seen = raw(together(before, behind), visibility, VirtualSensor())
    np.testing.assert_array_equal(seen, raw(before, visibility, VirtualSensor()))
    # Once it stands beside, it is seen as it is alone; nobody's order matters.
    aside = beside(behind, 2.0, 0.0, 0.0)
    seen = raw(together(aside, before), visibility, VirtualSensor())
    np.testing.assert_array_equal(seen, raw(together(before, aside), visibility, VirtualSensor()))
    assert seen.sum() == pytest.approx(2 * 6)


def test_nobody_is_hidden_by_who_is_away() -> None:
    before, behind = approaching(2.0, 0.5), approaching(3.0, -1.0, 0.5)
    there = np.array([True, True, True, False, False, False])
    seen = Synthesizer(together(behind, replace(before, present=there)), RAW)
    shares = seen.map(VirtualSensor(), visibility="exact").values.sum(axis=0)
    np.testing.assert_allclose(shares, 1, rtol=1e-6)
    parts = seen.limb_maps(
        VirtualSensor(),
        VertexParts(
            ("all",),
            np.zeros(behind.vertex_count),
            (VertexParts(("all",), np.zeros(before.vertex_count)),),
        ),
        visibility="exact",
    ).limbs
    assert parts is not None
    assert parts.persons == ("person 1", "person 2")
    np.testing.assert_allclose(parts.shown("person 1").sum(axis=0), ~there, rtol=1e-6)


@pytest.mark.slow
@given(
    x=some.floats(-0.9, 0.9),
    z=some.floats(-1.4, 1.4),
    visibility=some.sampled_from(["exact", "depth"]),
    changes=some.sampled_from([{}, {"weight": "projected"}, {"oversampling": 3}]),
)
@settings(max_examples=25, deadline=None)
def test_as_one_surface_in_double_precision(x: float, z: float, visibility: Any, changes: Any):
    """Wherever the other one is: before, behind, beside, within, around the sensor."""
    scene = together(wobbling(4), beside(wobbling(4, seed=2), x, 0.05, z), wobbling(4, seed=9))
    chosen = replace(RAW, **changes)
    made = Synthesizer(scene, chosen).stretch(SENSOR, 0, 4, visibility).raw
    expected = reference_stretch(scene, SENSOR, chosen, 0, 4)
    moved = np.abs(made - expected).sum() / max(expected.sum(), 1e-9)
    assert moved < (0.01 if visibility == "exact" else 0.03)


def test_the_cheap_test_of_boxes_lets_no_hiding_pass() -> None:
    """Whatever it calls apart, the exact test finds nothing hidden."""
    random = np.random.default_rng(4)
    points, faces = plate(0.6, 6)
    calls = 0
    for _ in range(300):
        spots = random.normal(size=(2, 3)) * [1.0, 0.5, 1.5] + [0, 0, 2]
        hiding, hidden = (points + spot for spot in spots)
        ends = [np.stack([one.min(axis=0), one.max(axis=0)]) for one in (hiding, hidden)]
        if may_hide(*ends, np.zeros(3)):
            continue
        calls += 1
        # In a box around all, it is looked at whatever the cheap test says.
        everywhere = np.array([[[-9.0] * 3, [9.0] * 3]])
        seen = np.ones((1, len(points)), np.uint8)
        single = np.ascontiguousarray(hidden.T[None], np.float32)
        none = np.zeros((1, 3))
        behind_things.hide_behind(
            Hiding.still(hiding, faces, everywhere), single, none, none, seen.copy(), seen
        )
        assert seen.all()
    assert calls > 100


def test_a_moved_body_among_shared_blocks_hides_anew() -> None:
    before, behind = approaching(2.0, 0.5), approaching(3.0, -1.0, 0.5)
    first = Synthesizer(together(behind, before), RAW)
    assert first.map(VirtualSensor(), visibility="exact").values.sum() == pytest.approx(6)
    scene = together(behind, beside(before, 2.0, 0.0, 0.0))
    again = Synthesizer(scene, RAW, blocks_of=first)
    assert again.prepared.budget is first.prepared.budget
    assert again.map(VirtualSensor(), visibility="exact").values.sum() == pytest.approx(12)
    frozen = again.map(VirtualSensor((0.01, 0, 0)), visibility="frozen")
    assert frozen.meta["visibility"] == "frozen"
    assert frozen.values.sum() == pytest.approx(12)


def test_a_thing_hides_every_body() -> None:
    scene = together(approaching(3.0), approaching(4.0, x_m=2.0))
    wall = Thing("screen", (0.0, 20.0, 0.3), size_m=(40.0, 40.0, 0.03))
    made = Synthesizer(with_things(scene, [wall]), RAW).map(SENSOR, visibility="exact")
    assert not made.values.any()
    assert made.meta["visible_share"] == [0] * 6


def test_who_is_taken_alone_stays_in_the_same_room() -> None:
    people = together(wobbling(20), beside(wobbling(20, seed=3), 3.0, 0.1, 0.5))
    scene = with_walls(people, [Wall(3.0, elevation_deg=90.0, loss_db=0.0)])
    alone = sum(raw(scene.body(person), "exact") for person in scene.persons)
    np.testing.assert_allclose(raw(scene, "exact"), alone)
    assert raw(scene, "exact").sum() > 1.01 * raw(people, "exact").sum()


def test_what_a_map_says_of_a_scene() -> None:
    one, other = approaching(2.0), replace(approaching(3.0, x_m=2), person="anna")
    scene = replace(together(one, other, other), source="one.npz")
    made = Synthesizer(scene, "paper").map(SENSOR, visibility="facing")
    assert [body["person"] for body in made.meta["bodies"]] == ["person 1", "anna", "anna (3)"]
    assert made.meta["bodies"][0]["source"] == "one.npz"
    assert made.meta["notes"] == ["Nobody hides anybody else in visibility facing."]
    assert "bodies" not in Synthesizer(one, "paper").map(SENSOR).meta
    moved = together(one, beside(other, 0.1, 0, 0))
    prints = {
        scene_fingerprint(mesh, SENSOR, PRESETS["paper"], "histogram")
        for mesh in (one, together(one, other), moved)
    }
    assert len(prints) == 3


def test_columns_without_one_of_several_are_not_called_empty() -> None:
    one, away = approaching(3.0), np.array([True, True, True, False, False, False])
    other = replace(beside(one, 2.0, 0.0, 0.0), present=away, person="anna")
    notes = Synthesizer(together(one, other), RAW).map(SENSOR).meta["notes"]
    assert notes == ["anna: Not there in 3 of 6 frames (0.10 s)."]


def test_progress_is_counted_in_frames_of_the_clip() -> None:
    told: list[tuple[int, int]] = []
    scene = together(approaching(2.0), approaching(3.0), approaching(4.0))
    Synthesizer(scene, RAW).map(SENSOR, progress=lambda *one: told.append(one))
    assert {total for _, total in told} == {6}
    assert sorted(told) == told
    assert told[-1] == (6, 6)


def test_parts_of_each_person_add_up() -> None:
    scene = together(wobbling(8), beside(wobbling(8, seed=2), 0.2, 0, 0.8))
    count = scene.vertex_count
    halves = VertexParts(("near", "far"), np.arange(count) % 2)
    made = Synthesizer(scene, "paper").limb_maps(
        SENSOR, replace(halves, others=(halves,)), visibility="exact"
    )
    assert made.limbs is not None
    assert made.limbs.parts == tuple(
        f"person {who}: {part}" for who in (1, 2) for part in ("near", "far")
    )
    np.testing.assert_allclose(made.limbs.values.sum(axis=0), made.values, atol=1e-6)
    inputs = made.limbs.inputs(("near",))
    np.testing.assert_array_equal(inputs.T, np.concatenate(made.limbs.values[[0, 2]]))
    with pytest.raises(Sd2Error, match="vertices"):
        Synthesizer(scene, "paper").limb_maps(SENSOR, halves)


def test_uncertainties_of_people_add_up() -> None:
    def doubtful(mesh: MeshSequence, sigma_mps: float) -> MeshSequence:
        shape = mesh.frame_count, 1
        known = VelocityUncertainty(
            ("all",), np.zeros(mesh.vertex_count, int), *np.full((2, *shape), sigma_mps)
        )
        return replace(mesh, uncertainty=known)

    plain = SynthesisOptions(visibility="exact")
    one, far = doubtful(wobbling(8), 0.2), beside(wobbling(8, seed=2), 3, 0, 0)
    other = doubtful(far, 0.1)
    each = [Synthesizer(mesh, plain).uncertainty(SENSOR) for mesh in (one, other)]
    both = Synthesizer(together(one, other), plain).uncertainty(SENSOR)
    np.testing.assert_allclose(both.sd, np.hypot(each[0].sd, each[1].sd), rtol=1e-5)
    np.testing.assert_allclose(both.expected, each[0].expected + each[1].expected, rtol=1e-5)
    # Somebody of whom nothing is said is as the map has it.
    half = Synthesizer(together(one, far), plain).uncertainty(SENSOR)
    np.testing.assert_array_equal(half.sd, each[0].sd)


def test_a_scene_is_cut_and_decimated_as_a_whole() -> None:
    scene = together(wobbling(8), beside(wobbling(8, seed=2), 1, 0, 0))
    part = scene.between(2, 5)
    np.testing.assert_array_equal(part.others[0].vertices, scene.others[0].vertices[2:5])
    fewer = decimate(scene, 0.5)
    assert [body.vertex_count < 0.6 * scene.vertex_count for body in fewer.bodies] == [True, True]
    with pytest.raises(Sd2Error, match="at other times"):
        replace(scene, others=(part,))
    with pytest.raises(Sd2Error, match="no faces"):
        replace(scene, others=(replace(scene.others[0], faces=None),))


@given(key=some.sampled_from([3, -1, slice(1, 4), slice(None), slice(4, 1), [0, 5, 2]]))
def test_made_vertices_are_picked_like_an_array(key: Any) -> None:
    values = np.random.default_rng(1).normal(size=(6, 4, 3)).astype(np.float32)
    made = MadeVertices((6, 4, 3), np.float32, lambda rows: values[rows])
    np.testing.assert_array_equal(made[key], values[key])
    np.testing.assert_array_equal(made[key, ..., 1], values[key, ..., 1])
    np.testing.assert_array_equal(np.asarray(made), values)
