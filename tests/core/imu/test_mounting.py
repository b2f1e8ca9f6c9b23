"""A sensor sits where it was put, and moves with what carries it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from sd2core.body.model import Body, Resolution
from sd2core.errors import Sd2Error
from sd2core.imu.mounting import PLACES, checked_places, mounted, place_near
from sd2core.imu.virtual import imu_at_frames, virtual_imu
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.build_sample.swipes import posed

FRAMES = 12
TURNS = Rotation.from_rotvec(np.outer(np.arange(FRAMES) / 10, [0.3, -1.0, 0.5]))


def body_of(body: Body, rotations: np.ndarray, moved_m: np.ndarray | None = None) -> MeshSequence:
    vertices = posed(body, rotations, moved_m)
    time = Timebase.regular(len(vertices), 30.0)
    return MeshSequence(vertices.astype(np.float32), body.faces, time, "the body")


def at_rest(body: Body, frames: int = 1) -> np.ndarray:
    """Rotations of all bones of a body that keeps still."""
    return np.tile(np.eye(3), (frames, len(body.skeleton), 1, 1))


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load("medium")


def sphere(centres_m: np.ndarray, turns: Rotation | None = None) -> MeshSequence:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    points = np.tile(ball.vertices, (len(centres_m), 1, 1))
    if turns is not None:
        points = np.einsum("tij,tvj->tvi", turns.as_matrix(), points)
    time = Timebase.regular(len(centres_m), 30.0)
    return MeshSequence(points + centres_m[:, None], np.asarray(ball.faces), time)


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_axes_on_a_body_are_those_of_its_bones(resolution: Resolution) -> None:
    """The body faces the camera: its left is x, down is y, its front is -z."""
    body = Body.load(resolution)
    mesh = body_of(body, at_rest(body))
    axes = {place: mounted(mesh, place).rotation for place in PLACES}
    for turn in axes.values():
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(turn) == pytest.approx(1.0)
    for place in ("head", "chest", "pelvis"):
        assert axes[place][1, 0] < -0.9  # x is upwards
    for part in ("upper-arm", "forearm", "wrist", "hand", "thigh", "shank"):
        assert axes[f"left-{part}"][1, 0] > 0.5  # x is downwards
        assert axes[f"left-{part}"][0, 2] > 0.7  # z is to the left
    assert axes["left-foot"][2, 0] < -0.8  # x is forwards
    assert axes["left-foot"][1, 2] < -0.8  # z is upwards
    assert axes["chest"][2, 2] < -0.9
    assert axes["pelvis"][2, 2] > 0.9


def test_sensors_sit_on_the_skin_of_their_part(body: Body) -> None:
    mesh = body_of(body, at_rest(body))
    heads = body.skeleton.heads_m
    for place, bone, within_m in (
        ("left-wrist", "wrist.L", 0.06),
        ("right-wrist", "wrist.R", 0.06),
        ("left-hand", "finger3-1.L", 0.08),
        ("right-foot", "foot.R", 0.12),
        ("left-shank", "lowerleg02.L", 0.09),
    ):
        mounting = mounted(mesh, place)
        away = mounting.position_m - heads[body.skeleton.index[bone]]
        assert np.linalg.norm(away) < within_m, place
        # On the outside of what carries it.
        middle = mounting.weights @ mounting.vertices_m
        assert (mounting.position_m - middle) @ mounting.rotation[:, 2] > 0.01, place


def test_the_right_side_mirrors_the_left(body: Body) -> None:
    mesh = body_of(body, at_rest(body))
    mirror = np.diag([-1.0, 1.0, 1.0])
    for place in PLACES:
        if place.startswith("left-"):
            left, right = mounted(mesh, place), mounted(mesh, place.replace("left", "right"))
            np.testing.assert_allclose(right.position_m, mirror @ left.position_m, atol=0.01)
            x, y, z = (mirror @ left.rotation).T
            expected = np.stack([x, -y, z], axis=1)  # right-handed again
            np.testing.assert_allclose(right.rotation, expected, atol=0.02)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("place", PLACES)
def test_a_sensor_turns_and_moves_with_the_whole_body(body: Body, place: str) -> None:
    rotations = at_rest(body, FRAMES)
    rotations[:, 0] = TURNS.as_matrix()
    moved_m = np.linspace([0.0, 0.0, 2.0], [1.0, -0.5, 3.0], FRAMES)
    mesh = body_of(body, rotations, moved_m)
    mounting = mounted(mesh, place)
    path = mounting.path(mesh)
    root = body.skeleton.heads_m[0]
    arm = mounting.position_m - root - moved_m[0]
    np.testing.assert_allclose(
        path.rotation, TURNS.as_matrix() @ mounting.rotation, atol=2e-5, err_msg=place
    )
    expected = TURNS.apply(arm) + root + moved_m
    np.testing.assert_allclose(path.position_m, expected, atol=2e-6, err_msg=place)


@pytest.mark.parametrize(
    ("place", "bone", "degrees"),
    [("head", "head", 1.0), ("left-foot", "foot.L", 4.0), ("right-hand", "wrist.R", 6.0)],
)
def test_a_sensor_turns_with_its_bone(body: Body, place: str, bone: str, degrees: float) -> None:
    turns = Rotation.from_rotvec(np.outer(np.linspace(0, 0.5, FRAMES), [1.0, 0.0, 0.0]))
    rotations = at_rest(body, FRAMES)
    rotations[:, body.skeleton.index[bone]] = turns.as_matrix()
    mesh = body_of(body, rotations)
    mounting = mounted(mesh, place)
    found = Rotation.from_matrix(mounting.path(mesh).rotation @ mounting.rotation.T)
    # The skin between two bones follows both.
    assert np.degrees((found * turns.inv()).magnitude()).max() < degrees


def test_a_patch_of_a_surface_has_the_axes_that_are_stated() -> None:
    mesh = sphere(np.tile([0.0, 0.0, 3.0], (FRAMES, 1)), TURNS)
    outwards = (mesh.frame(0) - [0.0, 0.0, 3.0]) / 0.3
    for vertex in (0, 17, 100, 321, 600):
        mounting = mounted(mesh, vertex)
        x, y, z = mounting.rotation.T
        np.testing.assert_allclose(z, outwards[vertex], atol=0.03)
        np.testing.assert_allclose(np.cross(z, x), y, atol=1e-9)
        # Nearest to upwards within the surface.
        upwards = np.array([0.0, -1.0, 0.0])
        level = upwards - (upwards @ z) * z
        if np.linalg.norm(level) > 0.2:
            np.testing.assert_allclose(x, level / np.linalg.norm(level), atol=1e-9)
        path = mounting.path(mesh)
        np.testing.assert_allclose(path.rotation, TURNS.as_matrix() @ mounting.rotation, atol=1e-6)
        np.testing.assert_allclose(path.position_m, mesh.vertices[:, vertex], atol=1e-9)


def test_on_a_level_surface_x_is_the_nearest_axis_of_the_world() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0.1], [0, 0, 1], [-1, 0, 0], [0, 0, -1]]) * 0.1
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4]])
    mesh = MeshSequence(np.tile(points, (6, 1, 1)), faces, Timebase.regular(6, 30.0))
    rotation = mounted(mesh, "0").rotation
    np.testing.assert_allclose(abs(rotation[:, 0]), [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(abs(rotation[:, 2]), [0, 1, 0], atol=1e-9)


@pytest.mark.parametrize("aside_m", [0.1, 1e-6, 0.0])
def test_a_surface_of_one_triangle_carries_a_sensor_unless_it_is_a_line(aside_m: float) -> None:
    points = np.array([[0.0, 0.0, 2.0], [0.1, 0.0, 2.0], [0.05, aside_m, 2.0]])
    still = np.tile(points, (6, 1, 1))
    mesh = MeshSequence(still, np.array([[0, 1, 2]]), Timebase.regular(6, 30.0))
    if aside_m > 0.01:
        np.testing.assert_allclose(abs(mounted(mesh, 0).rotation[:, 2]), [0, 0, 1], atol=1e-9)
    else:
        with pytest.raises(Sd2Error, match="the 3 vertices around number 0 make no surface"):
            mounted(mesh, 0)


def test_a_frame_without_a_body_moves_nothing() -> None:
    mesh = sphere(np.tile([0.0, 0.0, 3.0], (40, 1)))
    points = np.array(mesh.vertices)
    points[:5], points[20:25] = np.nan, np.nan
    there = np.isfinite(points).all(axis=(1, 2))
    gappy = MeshSequence(points, mesh.faces, mesh.timebase, present=there)
    signals = imu_at_frames(gappy, 7)
    assert (signals.known == there).all()
    np.testing.assert_allclose(
        np.linalg.norm(signals.acceleration_mps2[there], axis=1), 9.81, atol=1e-6
    )


def test_a_vertex_of_a_body_agrees_with_the_bone_under_it(body: Body) -> None:
    rotations = at_rest(body, 60)
    angles = 0.4 * np.sin(np.arange(60) / 30 * 4)
    turns = Rotation.from_rotvec(np.outer(angles, [0, 0, 1])).as_matrix()
    rotations[:, body.skeleton.index["upperleg01.L"]] = turns
    mesh = body_of(body, rotations)
    named = mounted(mesh, "left-shank")
    vertex = int(np.argmin(np.linalg.norm(mesh.frame(0) - named.position_m, axis=1)))
    one, other = virtual_imu(mesh, "left-shank"), virtual_imu(mesh, vertex)
    lengths = [np.linalg.norm(signals.acceleration_mps2, axis=1) for signals in (one, other)]
    assert np.abs(lengths[0] - 9.81).max() > 1.0
    np.testing.assert_allclose(*lengths, atol=0.1)


def test_what_can_be_asked_for_is_said(body: Body) -> None:
    still = np.tile([0.0, 0.0, 3.0], (6, 1))
    with pytest.raises(Sd2Error, match=r"not the bundled body.* 'left-wrist'.*0 to 641"):
        mounted(sphere(still), "left-wrist")
    mesh = body_of(body, at_rest(body))
    with pytest.raises(Sd2Error, match=r"at 'nose'.*left-wrist.*vertex, 0 to 4999"):
        mounted(mesh, "nose")
    with pytest.raises(Sd2Error, match=r"5,000 vertices.*number 5000"):
        mounted(mesh, 5000)
    with pytest.raises(Sd2Error, match="at '-1'"):
        mounted(mesh, -1)
    with pytest.raises(Sd2Error, match="each once"):
        checked_places(("head", "head"))
    with pytest.raises(Sd2Error, match="some of head"):
        checked_places(("knee",))


def test_what_has_no_surface_is_refused() -> None:
    ball = sphere(np.tile([0.0, 0.0, 3.0], (6, 1)))
    cloud = MeshSequence(ball.vertices, None, ball.timebase)
    with pytest.raises(Sd2Error, match="without a surface"):
        mounted(cloud, 0)
    line = np.tile(np.outer(np.arange(4.0), [1.0, 0.0, 0.0]), (6, 1, 1))
    degenerate = MeshSequence(line, np.array([[0, 1, 2]]), ball.timebase)
    for vertex in (0, 3):
        with pytest.raises(Sd2Error, match="make no surface"):
            mounted(degenerate, vertex)
    nobody = MeshSequence(ball.vertices, ball.faces, ball.timebase, present=np.zeros(6, bool))
    with pytest.raises(Sd2Error, match="no frame with a body"):
        mounted(nobody, 0)
    for frame in (0, 3):
        points = np.array(ball.vertices)
        points[frame, 5] = np.nan
        torn = MeshSequence(points, ball.faces, ball.timebase)
        with pytest.raises(Sd2Error, match=f"vertex 5 of frame {frame}"):
            mounted(torn, 5).path(torn)


def test_a_rate_below_the_motion_and_a_clip_too_short_are_refused() -> None:
    ball = sphere(np.tile([0.0, 0.0, 3.0], (30, 1)))
    for rate_hz, words in ((11.0, "12 or more"), (0.0, "The rate"), (1e6, "The rate")):
        with pytest.raises(Sd2Error, match=words):
            virtual_imu(ball, 0, rate_hz=rate_hz)
    with pytest.raises(Sd2Error, match="6 frames on end"):
        virtual_imu(ball.between(0, 5), 0)
    signals = virtual_imu(ball, 0, rate_hz=200.0)
    assert signals.rate_hz == pytest.approx(200.0)
    assert len(signals.times_s) == int(29 / 30 * 200) + 1
    assert signals.known.all()


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_the_place_near_a_vertex_is_the_one_that_sits_there(resolution: Resolution) -> None:
    body = Body.load(resolution)
    mesh = body_of(body, at_rest(body))
    for place in PLACES:
        assert place_near(mesh, mounted(mesh, place).vertex) == place


def test_the_place_near_a_vertex_is_on_the_same_limb(body: Body) -> None:
    """Wherever one bone carries the skin for the most part, also where another place is nearer."""
    mesh = body_of(body, at_rest(body))
    index = body.skeleton.index
    leading = body.bones[np.arange(len(body.bones)), body.weights.argmax(axis=1)]
    for bone, part in (
        ("head", "head"),
        ("finger2-3.L", "left-hand"),
        ("toe1-2.R", "right-foot"),
        ("lowerleg02.L", "left-shank"),
        ("upperleg01.R", "right-thigh"),
    ):
        vertices = np.flatnonzero((leading == index[bone]) & (body.weights.max(axis=1) > 0.6))
        assert vertices.size, bone
        assert {place_near(mesh, int(vertex)) for vertex in vertices} == {part}


def test_on_any_other_surface_the_place_is_the_vertex() -> None:
    assert place_near(sphere(np.zeros((6, 3))), 17) == "17"
