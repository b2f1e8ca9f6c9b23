"""Kinematics are those of a body that moves as known, in the frame of the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from turning_bodies import turning_body

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body
from sd2core.body.parts import body_parts, known_parts, parts_by_shape
from sd2core.doppler import Synthesizer
from sd2core.doppler.kinematics import joint_vertices, kinematics
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES, VertexParts
from sd2core.sensor import VirtualSensor

TURNING = turning_body(10)
FRAMES_PER_S = 30.0


def told(mesh: MeshSequence, place: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    found = kinematics(mesh, known_parts(mesh), VirtualSensor(place))
    assert found is not None
    return found


def of(values: np.ndarray, quantity: str) -> np.ndarray:
    """One quantity of all joints, (joints, frames)."""
    column: np.ndarray = values[:, QUANTITIES.index(quantity)]
    return column


@settings(max_examples=20, deadline=None)
@given(
    step=st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    place=st.tuples(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(-3.0, 0.0)),
)
def test_a_body_that_is_carried_along(step: tuple[float, ...], place: tuple[float, ...]) -> None:
    still = TURNING.frame(0).astype(np.float64)
    moved = still + np.arange(6)[:, None, None] * np.array(step)
    mesh = replace(
        TURNING.between(0, 6), vertices=moved.astype(np.float32), source=f"{step} {place}"
    )
    values = told(mesh, place)
    rows = joint_vertices(still, mesh.faces, known_parts(mesh))
    joints = np.array([moved[:, row].mean(axis=1) for row in rows])  # (J, T, 3)
    range_m = np.linalg.norm(joints - place, axis=2)
    towards = -(range_m[:, 2:] - range_m[:, :-2]) / 2.0 * FRAMES_PER_S
    np.testing.assert_allclose(of(values, "towards_mps")[:, 1:-1], towards, atol=2e-4)
    speed = np.linalg.norm(step) * FRAMES_PER_S
    np.testing.assert_allclose(of(values, "speed_mps"), speed, atol=2e-4)
    # The places about the trunk are lengths of the same body from wherever it is seen.
    placed = [of(values, name) for name in ("nearer_m", "aside_m", "above_m")]
    away = np.linalg.norm(joints - joints[:1], axis=2)
    np.testing.assert_allclose(np.linalg.norm(placed, axis=0), away, atol=1e-5)
    assert not of(values, "sigma_mps").any()


def test_where_joints_are_as_a_sensor_sees_them() -> None:
    """The body looks along -z, at the camera: its left is on the right of the picture."""
    values = told(TURNING)[..., 0]
    place = {
        name: dict(zip(QUANTITIES, row, strict=True))
        for name, row in zip(JOINTS, values, strict=True)
    }
    assert place["head"]["above_m"] > 0.25
    assert place["foot.L"]["above_m"] < -0.8
    assert place["shoulder.L"]["aside_m"] > 0.1
    assert place["shoulder.R"]["aside_m"] < -0.1
    behind = told(TURNING, (0.0, 0.0, 4.0))[..., 0]
    aside, nearer = (QUANTITIES.index(name) for name in ("aside_m", "nearer_m"))
    np.testing.assert_allclose(behind[:, aside], -values[:, aside], atol=0.02)
    np.testing.assert_allclose(behind[:, nearer], -values[:, nearer], atol=0.02)


@pytest.mark.parametrize("kind", ["own parts", "by shape"])
def test_joints_lie_where_the_bones_meet(kind: str) -> None:
    body = Body.load("medium")
    points = body.vertices_m.astype(np.float64)
    mesh = MeshSequence(
        np.repeat(body.vertices_m[None], 2, axis=0), body.faces, TURNING.between(0, 2).timebase
    )
    parts = body_parts(mesh)
    if kind == "by shape":
        by_shape = parts_by_shape(points, body.faces)
        assert by_shape is not None
        parts = VertexParts(PARTS, by_shape)
    assert parts is not None
    limbs = vertex_limbs(body)
    found = {
        name: points[row].mean(axis=0)
        for name, row in zip(JOINTS, joint_vertices(points, body.faces, parts), strict=True)
    }
    bones = body.skeleton
    for side in "LR":
        for joint, bone in (("elbow", "lowerarm01"), ("knee", "lowerleg01")):
            true = bones.heads_m[bones.names.index(f"{bone}.{side}")]
            assert np.linalg.norm(found[f"{joint}.{side}"] - true) < 0.06, joint
        hand = points[limbs == LIMBS.index(f"hand.{side}")].mean(axis=0)
        assert np.linalg.norm(found[f"hand.{side}"] - hand) < 0.08
    head = points[limbs == LIMBS.index("head")].mean(axis=0)
    assert np.linalg.norm(found["head"] - head) < 0.12


def test_sigma_is_that_of_the_limb_towards_the_sensor() -> None:
    limbs = vertex_limbs(Body.load("low"))
    along = np.arange(1.0, len(LIMBS) + 1.0) * np.ones((10, 1))
    known = VelocityUncertainty(
        LIMBS, limbs, along.astype(np.float32), 0.0 * along.astype(np.float32)
    )
    sigma = of(told(replace(TURNING, uncertainty=known)), "sigma_mps")
    for joint, limb in (("head", "head"), ("hand.L", "hand.L"), ("foot.R", "foot.R")):
        np.testing.assert_allclose(sigma[JOINTS.index(joint)], LIMBS.index(limb) + 1.0, rtol=1e-6)


def test_nothing_is_said_where_nobody_is() -> None:
    present = np.ones(10, bool)
    present[4:7] = False
    values = told(replace(TURNING, present=present))
    assert not values[..., 4:7].any()
    assert np.abs(of(values, "towards_mps")[JOINTS.index("hand.L"), :3]).min() > 0.01


def test_kinematics_come_with_limb_maps(tmp_path) -> None:  # type: ignore[no-untyped-def]
    sensor, parts = VirtualSensor((0.3, 0.0, 0.0)), known_parts(TURNING)
    made = Synthesizer(TURNING).limb_maps(sensor, parts)
    assert made.limbs is not None
    assert made.limbs.kinematics is not None
    np.testing.assert_array_equal(made.limbs.kinematics, told(TURNING, sensor.position_m))
    some = Synthesizer(TURNING).limb_maps(sensor, parts, frames=(3, 8)).limbs
    assert some is not None
    np.testing.assert_array_equal(some.kinematics, made.limbs.kinematics[..., 3:8])
    made.save(tmp_path / "map.npz")
    again = DopplerMap.load(tmp_path / "map.npz").limbs
    assert again is not None
    columns = again.inputs((KINEMATICS,))
    assert columns.shape == (10, 32 + len(JOINTS) * len(QUANTITIES) + len(PARTS))
    np.testing.assert_allclose(columns[:, :32], made.values.T, rtol=1e-5, atol=1e-8)
    np.testing.assert_array_equal(columns[:, 32], made.limbs.kinematics[0, 0])
    with pytest.raises(Sd2Error, match=r"have no kinematics.*--limbs"):
        LimbMaps(again.parts, again.values).inputs((KINEMATICS,))
    with pytest.raises(Sd2Error, match=r"Kinematics of shape \(2, 3, 4\)"):
        LimbMaps(again.parts, again.values, np.zeros((2, 3, 4), np.float32))


def test_only_the_frames_around_a_stretch_are_read() -> None:
    """A long recording is streamed: a stretch must not read all of it."""
    long = turning_body(600)
    whole = told(long)
    read: list[tuple[int, int]] = []

    class Watched:
        shape, dtype, ndim = long.vertices.shape, long.vertices.dtype, 3

        def __getitem__(self, key: slice | int) -> np.ndarray:
            if isinstance(key, slice):
                read.append((key.start, key.stop))
            return np.asarray(long.vertices[key])

    watched = replace(long, vertices=Watched())
    for _ in range(2):
        part = kinematics(watched, known_parts(watched), VirtualSensor(), (300, 310))
        np.testing.assert_array_equal(part, whole[..., 300:310])
    # A block of frames, and one to find the joints in.
    assert sum(stop - start for start, stop in read) <= 256 + 1


def test_other_parts_have_none() -> None:
    thirds = np.arange(TURNING.vertex_count) % 3
    assert kinematics(TURNING, VertexParts(("a", "b", "c"), thirds), VirtualSensor()) is None
    assert kinematics(TURNING, VertexParts(PARTS, thirds), VirtualSensor()) is None


def test_joints_of_a_scene_are_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """They do not depend on the sensor: of the next place no frame is read again."""
    scene = replace(TURNING, others=(replace(TURNING, person="anna"),))
    maps = Synthesizer(scene, "paper")
    maps.limb_maps(VirtualSensor(), body_parts(scene))
    read: list[tuple[int, int]] = []
    whole = MeshSequence.read
    monkeypatch.setattr(
        MeshSequence, "read", lambda mesh, *span: (read.append(span), whole(mesh, *span))[1]
    )
    maps.limb_maps(VirtualSensor((0.2, 0.0, 0.0)), body_parts(scene))
    assert read == []
