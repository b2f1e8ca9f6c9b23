"""Bodies of files are put in their places and on the clock of the first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io import bodies
from sd2core.io.bodies import load_scene, with_bodies
from sd2core.io.mesh import save_mesh
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.timebase import Timebase

FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[-0.2, -0.9, 3], [0.2, -0.9, 3.2], [0, 0.9, 2.8], [0, 0, 3.4]])


def walker(frames: int = 20, frames_per_s: float = 20.0, start_s: float = 0.0) -> MeshSequence:
    """A tetrahedron that goes to the right, faster and faster."""
    clock = Timebase.regular(frames, frames_per_s, start_s)
    path = np.stack([clock.times_s**2, 0 * clock.times_s, 0 * clock.times_s], axis=1)
    return MeshSequence(CORNERS + path[:, None], FACES, clock, "walker")


@pytest.fixture
def path(tmp_path: Path) -> str:
    save_mesh(walker(), tmp_path / "walker.npz")
    return str(tmp_path / "walker.npz")


def test_the_same_clock_and_place_are_taken_as_they_are(path: str) -> None:
    scene = load_scene(path, bodies=[Body(path, person="anna")], called="bert")
    assert scene.persons == ("bert", "anna")
    (other,) = scene.others
    np.testing.assert_array_equal(other.read(0, 20), scene.read(0, 20))
    assert other.present is None
    assert with_bodies(scene, []).others == ()


def test_who_stays_is_the_same_and_who_moves_is_not_read_again(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    anna, bert = Body(path, (1, 0, 0)), Body(path, (2, 0, 0), person="bert")
    scene = with_bodies(walker(), [anna, bert])
    assert [other.placed for other in scene.others] == [anna, bert]

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError

    with monkeypatch.context() as patched:
        patched.setattr(bodies, "load_mesh", refuse)
        again = with_bodies(scene, [Body(path, (3, 0, 0)), bert])
    assert again.others[1] is scene.others[1]
    np.testing.assert_allclose(again.others[0].frame(3) - scene.others[0].frame(3), [[2, 0, 0]] * 4)
    # A file that was written over is read again.
    save_mesh(walker(21), path)
    np.testing.assert_array_equal(with_bodies(walker(21), [anna]).others[0].presence.present, True)


def test_placed_and_turned_about_its_own_middle(path: str) -> None:
    turned = Body(path, moved_m=(1.0, 0.1, -0.5), turn_deg=90)
    (other,) = with_bodies(walker(), [turned]).others
    low, high = CORNERS.min(axis=0), CORNERS.max(axis=0)
    middle = (low + high) / 2
    first = other.frame(0)
    assert (first.min(axis=0) + first.max(axis=0)) / 2 == pytest.approx(
        middle + np.array([1, 0.1, -0.5])
    )
    # Seen from above clockwise: what went to the right now comes towards the camera.
    went = other.read(19, 20)[0] - first
    np.testing.assert_allclose(went, np.tile([0, 0, -(0.95**2)], (4, 1)), atol=1e-12)


def test_another_clock_is_interpolated_and_nobody_is_there_outside(tmp_path: Path) -> None:
    save_mesh(walker(41, 25.0), tmp_path / "later.npz")
    (other,) = with_bodies(walker(60), [Body(str(tmp_path / "later.npz"), start_s=0.5)]).others
    times_s = other.times_s - 0.5
    inside = (times_s >= -1e-6) & (times_s <= 1.6 + 1e-6)
    np.testing.assert_array_equal(other.presence.present, inside)
    expected = CORNERS + np.stack([times_s**2, 0 * times_s, 0 * times_s], axis=1)[:, None]
    found = other.read(0, 60)
    # Tangents at the two ends are of lines.
    within = inside & (times_s > 0.05) & (times_s < 1.55)
    np.testing.assert_allclose(found[within], expected[within], atol=1e-9)
    assert np.isfinite(found).all()


def test_doubts_stay_along_the_line_that_the_camera_saw(tmp_path: Path) -> None:
    """To the sensor that stands to the moved body as the camera did to it, as much is unknown."""
    known = VelocityUncertainty(
        ("all",), np.zeros(4, int), np.full((20, 1), 0.5), np.full((20, 1), 0.1)
    )
    save_mesh(replace(walker(), uncertainty=known), tmp_path / "doubtful.npz")
    body = Body(str(tmp_path / "doubtful.npz"), moved_m=(2.0, 0.0, 1.0), turn_deg=-40)
    (other,) = with_bodies(walker(), [body]).others
    own = other.uncertainty
    assert own is not None
    places_m = other.read(0, 20).mean(axis=1)[:, None]
    np.testing.assert_allclose(own.towards(own.camera_m, places_m), 0.5, rtol=1e-6)
    to_camera = np.asarray(own.camera_m) - places_m[0, 0]
    middle_m = walker().frame(0).mean(axis=0)
    assert np.linalg.norm(to_camera) == pytest.approx(np.linalg.norm(middle_m))


def test_what_cannot_be_in_a_scene_is_named(path: str, tmp_path: Path) -> None:
    cloud = replace(walker(), faces=None)
    save_mesh(cloud, tmp_path / "cloud.npz")
    for mesh, body, said in (
        (walker(), Body(str(tmp_path / "gone.npz")), "gone.npz of a body is not there"),
        (walker(), Body(str(tmp_path / "cloud.npz")), "cloud.npz has no faces"),
        (cloud, Body(path), "walker has no faces"),
        (walker(), Body(path, start_s=9), "never there"),
    ):
        with pytest.raises(Sd2Error, match=said):
            with_bodies(mesh, [body])
    with pytest.raises(Sd2Error, match="21 more bodies"):
        with_bodies(walker(), [Body(path)] * 21)
    for wrong in ({"turn_deg": 400}, {"moved_m": (0, 0, np.nan)}, {"start_s": np.inf}):
        with pytest.raises(Sd2Error, match=r"walker\.npz"):
            Body(path, **wrong)


def test_words_say_what_is_not_as_in_the_file() -> None:
    assert Body("a/anna.npz").words == "anna.npz"
    told = Body("anna.npz", (0.8, 0, 0.5), 90, -2, "anna").words
    assert told == "anna of anna.npz, moved by x 0.8, y 0, z 0.5 m, turned by 90°, 2 s earlier"
