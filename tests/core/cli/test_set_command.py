"""``sd2 set``: a recording is wholly editable by command, and nothing else changes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2
from swinging_recordings import recording

from sd2core.files.recording_json import CameraEntry
from sd2core.files.resources import resource_path
from sd2core.io.mesh import save_mesh
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.pairs.store import read_pairs
from sd2core.placements.body_extent import BodyExtent
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import spherical_from_position


@pytest.fixture
def one(tmp_path: Path) -> Recording:
    return recording(tmp_path / "anna.sd2")


def content(one: Recording) -> dict:
    return json.loads((one.folder / "recording.json").read_text(encoding="utf-8"))


def test_what_is_not_named_stays(sd2: Sd2, one: Recording) -> None:
    before = content(one)
    outcome = sd2("set", one.folder, "--radar-offset-s", "-0.25", "--title", "Anna, again")
    assert outcome.code == 0, outcome.err
    assert "radar offset  -0.25 s" in outcome.out
    assert content(one) == before | {"radar_offset_s": -0.25, "title": "Anna, again"}


def test_pairs_are_made_with_the_radar_where_it_is_said_to_be(
    sd2: Sd2, one: Recording, tmp_path: Path
) -> None:
    assert sd2("set", one.folder, "--sensor", "0.5,-0.1,0").code == 0
    assert sd2("pairs", "recordings", one.folder, "--out", tmp_path / "p.zarr").code == 0
    (take,) = read_pairs(tmp_path / "p.zarr").takes
    np.testing.assert_allclose(take.sensor_position_m, (0.5, -0.1, 0.0))


def test_a_place_about_the_body_keeps_what_is_not_given(sd2: Sd2, one: Recording) -> None:
    target_m = BodyExtent.of(one.load_mesh()).target_m
    before = spherical_from_position(target_m, one.sensor.position_m)
    assert sd2("set", one.folder, "--range-m", "3.5", "--azimuth-deg", "25").code == 0
    moved = open_recording(one.folder).sensor.position_m
    found = spherical_from_position(target_m, moved)
    assert found == pytest.approx((3.5, 25.0, before[2]))


def test_another_mesh_comes_with_its_own_reading(sd2: Sd2, one: Recording, tmp_path: Path) -> None:
    assert sd2("set", one.folder, "--fps", "20").code == 0
    assert open_recording(one.folder).mesh_reading.frames_per_s == 20
    other = tmp_path / f"other{one.mesh.suffix}"
    copy = shutil.copytree if one.mesh.is_dir() else shutil.copy
    copy(one.mesh, other)
    assert sd2("set", one.folder, "--mesh", other).code == 0
    found = open_recording(one.folder)
    assert found.mesh == other
    assert found.mesh_reading.frames_per_s is None


def test_the_camera_is_the_videos_until_another_is_told(
    sd2: Sd2, one: Recording, tmp_path: Path
) -> None:
    """A mesh that knows of no camera leaves the one that is known; a focal length replaces it."""
    one.camera = CameraEntry(focal_px=900.0, source="user")
    one.save()
    save_mesh(one.load_mesh(), tmp_path / "other.npz")
    assert sd2("set", one.folder, "--mesh", tmp_path / "other.npz").code == 0
    assert open_recording(one.folder).focal_px(640, 480) == 900
    assert sd2("set", one.folder, "--focal-px", "700").code == 0
    assert open_recording(one.folder).focal_px(640, 480) == 700


def test_a_part_can_be_taken_out(sd2: Sd2, one: Recording) -> None:
    assert sd2("set", one.folder, "--without", "radar").code == 0
    assert open_recording(one.folder).radar is None


def test_things_are_put_into_the_scene_and_taken_out(
    sd2: Sd2, one: Recording, tmp_path: Path
) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    before, given = content(one), ("table@0,1.1,1.5,20", "box@1,1,2,-30,0.2,0.3,0.4")
    words = [
        word for thing in (*given, f"{tmp_path / 'flat.obj'}@0,0,9") for word in ("--thing", thing)
    ]
    outcome = sd2("set", one.folder, *words)
    assert outcome.code == 0, outcome.err
    assert "things" in outcome.out
    assert "table at x 0, y 1.1, z 1.5 m, turned by 20°; box at" in outcome.out
    assert [list(one.values()) for one in content(one)["things"]] == [
        ["table", [0, 1.1, 1.5], 20, None],
        ["box", [1, 1, 2], -30, [0.2, 0.3, 0.4]],
        ["../flat.obj", [0, 0, 9], 0, None],
    ]
    around = open_recording(one.folder).load_mesh().surroundings
    assert around is not None
    assert len(around.faces) == 60 + 12 + 1
    told = json.loads(sd2("info", one.folder, "--json").out)
    assert told["things"][1]["size_m"] == [0.2, 0.3, 0.4]
    assert sd2("set", one.folder, "--without", "things").code == 0
    assert content(one) == before


def test_labels_follow_the_name_of_their_person(sd2: Sd2, one: Recording) -> None:
    def persons(*named: str) -> list[str]:
        place = [part for name in named for part in ("--body", f"{name}={one.mesh}@1,0,0")]
        assert sd2("set", one.folder, *place).code == 0
        return [span.person for span in open_recording(one.folder).labelled.spans]

    persons("dora", "bert")
    recording = open_recording(one.folder)
    spans = (Span(k + 1, "all", k, k + 1, "turn", person=name) for k, name in enumerate(NAMES))
    recording.labels = Labels((LabelTrack("all"),), tuple(spans))
    recording.save()
    assert persons("dorothy", "bert") == ["dorothy", "bert", ""]
    assert persons("bert", "dorothy") == ["dorothy", "bert", ""]  # in another order
    assert persons("carl") == ["dorothy", "bert", ""]  # who went keeps what is theirs


def test_a_body_takes_its_faces_along(sd2: Sd2, one: Recording, tmp_path: Path) -> None:
    mesh = one.load_mesh()
    (there := tmp_path / "there").mkdir()
    np.savez(there / "points.npz", vertices=np.asarray(mesh.vertices), times_s=mesh.times_s)
    np.save(there / "faces.npy", mesh.faces)
    bert = Recording.create(
        there / "bert.sd2", mesh=there / "points.npz", faces=there / "faces.npy", subject="bert"
    )
    outcome = sd2("set", one.folder, "--body", f"{bert.folder}@1,0,0")
    assert outcome.code == 0, outcome.err
    assert content(one)["bodies"][0]["faces"] == "../there/faces.npy"

    def faces_of(recording: Recording) -> object:
        (other,) = open_recording(recording.folder).load_mesh().others
        return other.faces

    np.testing.assert_array_equal(faces_of(one), mesh.faces)
    copied = open_recording(one.folder).save_as(tmp_path / "copy.sd2", copy=True)
    assert content(copied)["bodies"][0]["faces"] == "faces.npy"
    (tmp_path / "store").mkdir()
    (there / "faces.npy").rename(tmp_path / "store" / "faces.npy")
    np.testing.assert_array_equal(faces_of(copied), mesh.faces)
    moved = open_recording(one.folder)
    assert set(moved.missing()) == {"faces of body 2"}
    assert moved.bodies_there == ()
    assert sd2("relink", one.folder, tmp_path / "store").code == 0
    np.testing.assert_array_equal(faces_of(one), mesh.faces)


def test_a_body_whose_file_has_no_faces_takes_those_that_are_named(
    sd2: Sd2, one: Recording, tmp_path: Path
) -> None:
    mesh = one.load_mesh()
    for name in ("points.npz", "a,b.npz"):
        np.savez(tmp_path / name, vertices=np.asarray(mesh.vertices), times_s=mesh.times_s)
    np.save(tmp_path / "faces.npy", mesh.faces)
    for file in ("points.npz", "a,b.npz"):
        refused = sd2("set", one.folder, "--body", tmp_path / file)
        assert "--body FILE,FACES" in " ".join(refused.err.split())
        typed = f"anna={tmp_path / file},{tmp_path / 'faces.npy'}@1,0,0"
        outcome = sd2("set", one.folder, "--body", typed)
        assert outcome.code == 0, outcome.err
        (anna,) = content(one)["bodies"]
        assert (anna["person"], anna["path"], anna["faces"]) == (
            "anna",
            f"../{file}",
            "../faces.npy",
        )
        (other,) = open_recording(one.folder).load_mesh().others
        np.testing.assert_array_equal(other.faces, mesh.faces)
    gone = sd2("set", one.folder, "--body", f"{tmp_path / 'points.npz'},none.npy@1,0,0")
    assert "The faces file none.npy does not exist" in gone.err


NAMES = ("dora", "bert", "")


def test_people_are_put_beside_the_first_and_taken_out(
    sd2: Sd2, one: Recording, tmp_path: Path
) -> None:
    before = content(one)
    assert one.mesh is not None
    outcome = sd2(
        *("set", one.folder, "--body", f"anna={one.mesh}@0.8,0,0.5,90,0.1"),
        *("--body", one.folder, "--body", f"{one.mesh}@0,0,1"),
    )
    assert outcome.code == 0, outcome.err
    assert "moved by x 0.8, y 0, z 0.5 m, turned by 90°, 0.1 s later" in outcome.out
    told = [
        (body["person"], body["moved_m"], body["turn_deg"], body["start_s"])
        for body in content(one)["bodies"]
    ]
    assert told == [
        ("anna", [0.8, 0, 0.5], 90, 0.1),
        (one.subject, [0, 0, 0], 0, 0),
        ("", [0, 0, 1], 0, 0),
    ]
    scene = open_recording(one.folder).load_mesh()
    assert len(scene.others) == 3
    assert len(json.loads(sd2("info", one.folder, "--json").out)["bodies"]) == 3
    assert sd2("set", one.folder, "--without", "bodies").code == 0
    assert content(one) == before


def test_walls_are_put_into_the_scene_and_taken_out(sd2: Sd2, one: Recording) -> None:
    before = content(one)
    outcome = sd2("set", one.folder, "--wall", "floor@1.1", "--wall", "30@2,6")
    assert outcome.code == 0, outcome.err
    assert "floor at 1.1 m, 8.2 dB; wall 30° to the right at 2 m, 6 dB" in outcome.out
    assert [list(wall.values()) for wall in content(one)["walls"]] == [
        [1.1, 0, -90, 8.2],
        [2, 30, 0, 6],
    ]
    around = open_recording(one.folder).load_mesh().surroundings
    assert around is not None
    assert [wall.loss_db for wall in around.walls] == [8.2, 6]
    assert json.loads(sd2("info", one.folder, "--json").out)["walls"][1]["azimuth_deg"] == 30
    assert sd2("set", one.folder, "--without", "walls").code == 0
    assert content(one) == before


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--body", "gone.npz"), "gone.npz does not exist"),
        (("--body", "anna.npz@1,2"), "[NAME=]FILE[,FACES][@X,Y,Z"),
        (("--wall", "floor"), "DIRECTION@M"),
        (("--wall", "north@2"), "degrees, e.g. right@2"),
        (("--wall", "floor@0"), "The distance of a wall is 0"),
        (("--wall", "floor@1,200"), "The loss of a wall is 200"),
        (("--thing", "table@0,1"), "SHAPE@X,Y,Z"),
        (("--thing", "0,1,2"), "The thing is ''"),
        (("--thing", "sofa@0,1,2"), "one of box, table"),
        (("--thing", "gone.obj@0,1,2"), "is not there"),
        (("--thing", "box@0,1,2,0,1,1,0"), "width, height and depth"),
        ((), "Nothing is to be set"),
        (("--mesh", "nowhere.zarr"), "The mesh nowhere.zarr does not exist"),
        (("--without", "mesh,radar"), "would hold nothing"),
        (("--without", "sensor"), "some of video, mesh"),
        (("--sensor", "0,0,0", "--range-m", "2"), "beside --sensor"),
        (("--without", "mesh", "--range-m", "2"), "without a mesh"),
        (("--receiver", "99"), "Receiver 99"),
        (("--without", "radar", "--receiver", "1"), "without raw samples"),
    ],
)
def test_what_cannot_be_changes_nothing(
    sd2: Sd2, one: Recording, words: tuple[str, ...], said: str
) -> None:
    before = content(one)
    outcome = sd2("set", one.folder, *words)
    assert outcome.code == 1
    assert said in outcome.err
    assert content(one) == before


def test_what_comes_with_the_program_is_not_changed(sd2: Sd2) -> None:
    outcome = sd2("set", resource_path("swipes.sd2"), "--title", "mine")
    assert "comes with the program" in outcome.err
