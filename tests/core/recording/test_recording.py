"""Recordings: what is written is read back, moved, found again and never lost."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numbered_videos import write_video

from sd2core.errors import Sd2Error
from sd2core.files.paths import is_absolute, located_path, stored_path
from sd2core.labels.files import write_labels
from sd2core.labels.spans import Labels
from sd2core.labels.spans import Span as LabelSpan
from sd2core.mesh.bodies import Body
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.placements.placements import PlacementCloud, PlacementGrid
from sd2core.recording.document import Document
from sd2core.recording.recording import (
    FILE_NAME,
    VERSION,
    CameraEntry,
    MeshReading,
    Recording,
    Span,
    is_recording,
    open_recording,
)
from sd2core.sensor import Beam, VirtualSensor


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A data set: data/one/walk.mkv, data/one/walk.npz, data/one/capture/radar.npy."""
    folder = tmp_path / "data" / "one"
    (folder / "capture").mkdir(parents=True)
    for name in ("walk.mkv", "walk.npz", "faces.npy", "capture/radar.npy"):
        (folder / name).write_text(name)
    return folder


def make(files: Path, **options: object) -> Recording:
    return Recording.create(
        files.parent / "walk.sd2",
        video=files / "walk.mkv",
        mesh=files / "walk.npz",
        faces=files / "faces.npy",
        radar=files / "capture",
        **options,  # type: ignore[arg-type]
    )


def content(recording: Recording) -> dict:
    return json.loads((recording.folder / FILE_NAME).read_text(encoding="utf-8"))


def test_everything_is_read_back(files: Path) -> None:
    made = make(
        files,
        mesh_reading=MeshReading(frames_per_s=25.0, person="2", image_size=(640, 480)),
        radar_offset_s=-0.35,
        sensor=VirtualSensor((-1.0, 0.5, 2.0), 10.0, -5.0, Beam(60.0, 30.0)),
        spans=(Span(start_s=0.5, end_s=1.25, label="left → right"),),
        title="Wälk",
        simulated=True,
    )
    read = open_recording(made.folder)
    for name in Recording.__dataclass_fields__.keys() - {"_read"}:
        assert getattr(read, name) == getattr(made, name), name
    assert not read.missing()
    assert not read.notes


def test_opens_by_folder_or_by_file(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = make(files)
    monkeypatch.chdir(made.folder)
    for path in (Path(), Path(FILE_NAME), made.folder, made.folder / FILE_NAME):
        assert open_recording(path).video == files / "walk.mkv"
        assert is_recording(path)
    assert not is_recording(files / "walk.npz")


def test_paths_are_relative_with_forward_slashes(files: Path) -> None:
    assert content(make(files))["radar"] == "../one/capture"


def test_a_data_set_moves_as_a_whole(files: Path, tmp_path: Path) -> None:
    make(files)
    (tmp_path / "data").rename(tmp_path / "moved")
    moved = open_recording(tmp_path / "moved" / "walk.sd2")
    assert moved.video == tmp_path / "moved" / "one" / "walk.mkv"
    assert not moved.missing()


def test_a_recording_reached_through_a_link_finds_its_files(files: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere" / "deep").mkdir(parents=True)
    link = tmp_path / "elsewhere" / "deep" / "link"
    link.symlink_to(files.parent, target_is_directory=True)
    outside = tmp_path / "outside.mkv"
    outside.write_text("video")
    Recording.create(link / "linked.sd2", video=outside)
    read = open_recording(link / "linked.sd2")
    assert not read.missing()
    assert open_recording(files.parent / "linked.sd2").video == outside


@given(
    st.lists(st.sampled_from(["a", "b c", "ä.sd2"]), min_size=1, max_size=4),
    st.lists(st.sampled_from(["a", "b c", "ä.sd2"]), min_size=1, max_size=4),
)
def test_stored_paths_lead_back(path: list[str], folder: list[str]) -> None:
    root = Path("/root")
    target, home = root.joinpath(*path), root.joinpath(*folder)
    stored = stored_path(target, home)
    assert not is_absolute(stored)
    assert "\\" not in stored
    assert located_path(stored, home) == target


@pytest.mark.parametrize(
    "stored", ["D:/data/walk.mkv", "//server/share/walk.mkv", "/data/walk.mkv"]
)
def test_a_path_on_another_drive_is_kept_in_full(files: Path, stored: str) -> None:
    made = make(files)
    file = made.folder / FILE_NAME
    file.write_text(json.dumps(content(made) | {"video": stored}))
    read = open_recording(made.folder)
    assert read.video == Path(stored)
    assert read.missing() == {"video": Path(stored)}


def test_a_file_on_another_drive_is_noted(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def other_drive(path: Path, folder: Path) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    made = make(files)
    monkeypatch.setattr("sd2core.files.paths.os.path.relpath", other_drive)
    made.save()
    assert content(made)["video"] == (files / "walk.mkv").as_posix()
    assert "another drive" in made.notes[0]


def test_unknown_fields_survive_a_save(files: Path) -> None:
    made = make(files, spans=(Span(start_s=0, end_s=1, label="up"),))
    written = content(made)
    written["weather"] = {"make": "north"}
    written["sensor"]["name"] = "left"
    written["spans"][0]["annotator"] = "A"
    (made.folder / FILE_NAME).write_text(json.dumps(written))
    read = open_recording(made.folder)
    read.radar_offset_s = 0.5
    read.sensor = replace(read.sensor, position_m=(1.0, 0.0, 0.0))
    read.save()
    again = content(read)
    assert again["weather"] == {"make": "north"}
    assert again["sensor"]["name"] == "left"
    assert again["sensor"]["position_m"] == [1.0, 0.0, 0.0]
    assert again["spans"][0]["annotator"] == "A"
    assert again["radar_offset_s"] == 0.5


def test_saved_as_another_recording_nothing_is_lost(files: Path, tmp_path: Path) -> None:
    made = make(files, title="first", spans=(Span(start_s=0, end_s=1, label="up"),))
    written = content(made) | {"weather": {"make": "north"}}
    (made.folder / FILE_NAME).write_text(json.dumps(written))
    read = open_recording(made.folder)
    other = read.save_as(tmp_path / "other")
    other.radar_offset_s = 1.0
    other.save()
    assert content(other) == written | {
        "video": "../data/one/walk.mkv",
        "mesh": "../data/one/walk.npz",
        "faces": "../data/one/faces.npy",
        "radar": "../data/one/capture",
        "radar_offset_s": 1.0,
    }
    assert content(read) == written


def test_a_failed_save_leaves_the_old_recording(
    files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make(files, title="before")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sd2core.files.atomic.os.fsync", full)
    made.title = "after"
    with pytest.raises(OSError, match="No space"):
        made.save()
    assert open_recording(made.folder).title == "before"
    assert [path.name for path in made.folder.iterdir()] == [FILE_NAME]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": VERSION + 1}, r"of version 2.*the version of SD² Studio that wrote it"),
        ({"version": "new"}, "of version 'new'"),
        ({"format": "other"}, "format 'other'"),
        ({"radar_offset_s": "soon"}, "radar_offset_s is 'soon'"),
        ({"sensor": {"position_m": [0, 0]}}, "sensor.position_m"),
        ({"spans": [{"start_s": 2, "end_s": 1, "label": "x"}]}, "ends at 1.0 s"),
        ({"video": 3}, "video is 3"),
        ({"video": ""}, "recording.json: video is ''"),
        ({"mesh": " "}, "recording.json: mesh is ' '"),
        (
            {"sensor": {"beam": {"azimuth_width_deg": 500, "elevation_width_deg": 9}}},
            "recording.json.*azimuth_width_deg is 500",
        ),
        ({"sensor": {"beam": {"width": 5}}}, "recording.json: sensor.beam"),
        ({"radar_offset_s": 1e13}, "radar_offset_s is 10000"),
        ({"spans": [{"start_s": -1e308, "end_s": 1, "label": "x"}]}, "spans.0.start_s is -1e"),
        ({"camera": {"focal_px": 1e110}}, "camera.focal_px is 1e"),
        ({"camera": {"focal_px": 500, "width": 10**20}}, "camera.width is 1000"),
        ({"mesh_reading": {"image_size": [10**20, 1]}}, "mesh_reading.image_size.0 is 1000"),
        ({"mesh_reading": {"scale": -1}}, "recording.json: mesh_reading.scale is -1"),
        ({"mesh_reading": {"frames_per_s": 0}}, "recording.json: mesh_reading.frames_per_s is 0"),
        ({"mesh_reading": {"image_size": [0, 480]}}, "recording.json: mesh_reading.image_size.0"),
    ],
)
def test_what_is_wrong_is_said(files: Path, change: dict, says: str) -> None:
    made = make(files)
    (made.folder / FILE_NAME).write_text(json.dumps(content(made) | change))
    with pytest.raises(Sd2Error, match=says):
        open_recording(made.folder)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "\udcff", '"\\ud800"'])
def test_damaged_files_are_explained(files: Path, text: str) -> None:
    made = make(files)
    (made.folder / FILE_NAME).write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(Sd2Error, match=FILE_NAME):
        open_recording(made.folder)


def test_a_folder_that_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"has no recording.json.*sd2 import"):
        open_recording(tmp_path)


class TestCreate:
    def test_appends_the_suffix(self, files: Path) -> None:
        assert Recording.create(files / "walk.v2", video=files / "walk.mkv").folder.name == (
            "walk.v2.sd2"
        )

    def test_refuses_to_replace_a_recording(self, files: Path) -> None:
        make(files, title="first")
        with pytest.raises(Sd2Error, match="is a recording already"):
            make(files)
        assert open_recording(files.parent / "walk.sd2").title == "first"

    def test_refuses_a_file_that_is_not_there(self, files: Path) -> None:
        with pytest.raises(Sd2Error, match=r"The mesh .*no\.npz does not exist"):
            Recording.create(files / "x.sd2", mesh=files / "no.npz")
        assert not (files / "x.sd2").exists()

    @pytest.mark.parametrize("given_faces", [False, True])
    def test_refuses_nothing(self, files: Path, given_faces: bool) -> None:
        faces = files / "faces.npy" if given_faces else None
        with pytest.raises(Sd2Error, match="would hold nothing"):
            Recording.create(files / "x.sd2", faces=faces)

    @pytest.mark.parametrize(
        ("field", "value"),
        [
            ("radar_offset_s", float("nan")),
            ("imu_offset_s", 1e13),
            ("radar_receiver", 0),
            ("subject", 5),
            ("imu_places", (4711,)),
        ],
    )
    def test_refuses_what_could_not_be_read_again(
        self, files: Path, field: str, value: object
    ) -> None:
        with pytest.raises(Sd2Error, match=rf"walk\.sd2: {field}"):
            make(files, **{field: value})
        assert not (files.parent / "walk.sd2").exists()
        recording = make(files)
        setattr(recording, field, value)
        with pytest.raises(Sd2Error, match=rf"walk\.sd2: {field}"):
            recording.save()
        assert open_recording(recording.folder).title == recording.title

    def test_takes_a_folder_into_which_files_were_put(self, files: Path) -> None:
        folder = files / "ready.sd2"
        folder.mkdir()
        (folder / "body.npz").write_text("mesh")
        made = Recording.create(folder, mesh=folder / "body.npz", copy=True)
        assert content(made)["mesh"] == "body.npz"
        assert sorted(path.name for path in folder.iterdir()) == ["body.npz", FILE_NAME]

    def test_copies_files_and_folders(self, files: Path, tmp_path: Path) -> None:
        other = tmp_path / "other" / "walk.mkv"
        other.parent.mkdir()
        other.write_text("a mesh with the video's name")
        made = Recording.create(
            tmp_path / "all.sd2",
            video=files / "walk.mkv",
            mesh=other,
            radar=files / "capture",
            copy=True,
        )
        assert {role: content(made)[role] for role in ("video", "mesh", "radar")} == {
            "video": "walk.mkv",
            "mesh": "mesh-walk.mkv",
            "radar": "capture",
        }
        assert (made.folder / "mesh-walk.mkv").read_text() == other.read_text()
        assert (made.folder / "capture" / "radar.npy").read_text() == "capture/radar.npy"
        assert not list(made.folder.glob(".*"))

    def test_a_cancelled_copy_leaves_nothing(self, files: Path, tmp_path: Path) -> None:
        from sd2core.progress import Cancelled

        def stop(done: int, total: int) -> None:
            if done == 1:
                raise Cancelled

        with pytest.raises(Cancelled):
            Recording.create(
                tmp_path / "all.sd2",
                video=files / "walk.mkv",
                mesh=files / "walk.npz",
                copy=True,
                progress=stop,
            )
        assert not (tmp_path / "all.sd2").exists()
        assert (files / "walk.mkv").exists()


class TestRelink:
    def test_all_missing_files_by_one_folder(self, files: Path, tmp_path: Path) -> None:
        made = make(files)
        files.rename(tmp_path / "disk")
        read = open_recording(made.folder)
        assert set(read.missing()) == {"video", "mesh", "faces", "radar"}
        result = read.relink(tmp_path)
        assert set(result.paths) == {"video", "mesh", "faces", "radar"}
        assert not result.missing
        again = open_recording(made.folder)
        assert not again.missing()
        assert content(again)["video"] == "../../disk/walk.mkv"

    def test_the_mesh_files_of_things_are_found_as_well(self, files: Path, tmp_path: Path) -> None:
        chair = files / "chair.obj"
        chair.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        made = make(files)
        box, seat = Thing("box", (0, 1, 2)), Thing(str(chair), (1, 1, 2), 30.0)
        made.things = (box, seat, replace(seat, position_m=(2, 1, 2)))
        made.save()
        assert not made.missing()
        (tmp_path / "store").mkdir()
        chair.rename(tmp_path / "store" / "chair.obj")
        read = open_recording(made.folder)
        assert read.missing() == {"thing 2": chair, "thing 3": chair}
        assert read.things_there == (box,)
        found = tmp_path / "store" / "chair.obj"
        assert read.relink(tmp_path / "store").paths == {"thing 2": found, "thing 3": found}
        again = open_recording(made.folder)
        assert not again.missing()
        assert [one.shape for one in again.things] == ["box", str(found), str(found)]
        assert again.things[1].turn_deg == 30.0

    def test_what_was_never_saved_is_not_saved(
        self, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        files.rename(tmp_path / "disk")
        (tmp_path / "here").mkdir()
        monkeypatch.chdir(tmp_path / "here")
        unsaved = Recording(Path(), video=files / "walk.mkv")
        assert unsaved.relink(tmp_path).paths == {"video": tmp_path / "disk" / "walk.mkv"}
        assert not list((tmp_path / "here").iterdir())

    def test_the_longest_common_path_wins(self, files: Path, tmp_path: Path) -> None:
        made = make(files)
        for name in ("one", "two"):
            (tmp_path / "disk" / name).mkdir(parents=True)
            (tmp_path / "disk" / name / "walk.mkv").write_text(name)
        (files / "walk.mkv").unlink()
        result = made.relink(tmp_path / "disk")
        assert result.paths == {"video": tmp_path / "disk" / "one" / "walk.mkv"}
        assert made.mesh == files / "walk.npz"

    def test_equally_good_files_are_named_and_left_alone(self, files: Path, tmp_path: Path) -> None:
        made = make(files)
        before = content(made)
        candidates = tuple(tmp_path / "disk" / name / "walk.mkv" for name in ("a", "b"))
        for path in candidates:
            path.parent.mkdir(parents=True)
            path.write_text("video")
        (files / "walk.mkv").unlink()
        (files / "walk.npz").unlink()
        result = made.relink(tmp_path / "disk")
        assert not result.paths
        assert result.ambiguous == {"video": candidates}
        assert result.missing == ("mesh",)
        assert content(made) == before

    def test_the_folder_itself_may_be_what_is_missing(self, files: Path, tmp_path: Path) -> None:
        made = make(files)
        (files / "capture").rename(tmp_path / "capture")
        assert made.relink(tmp_path / "capture").paths == {"radar": tmp_path / "capture"}

    def test_a_file_is_no_folder(self, files: Path) -> None:
        with pytest.raises(Sd2Error, match="is not a folder"):
            make(files).relink(files / "walk.mkv")


def test_the_video_places_a_mesh_that_is_centred_on_its_root(
    shared_data: Path, tmp_path: Path
) -> None:
    """As in the output of VIBE: a box of 240 pixels in the middle of a 640 x 480 video."""
    frames = 3
    person = {
        "verts": np.random.default_rng(0).normal(0, 0.3, (frames, 20, 3)),
        "pred_cam": np.tile([1.0, 0.0, 0.0], (frames, 1)),
        "bboxes": np.tile([320.0, 240.0, 240.0, 240.0], (frames, 1)),
    }
    person["verts"] -= person["verts"].mean(axis=1, keepdims=True)
    (tmp_path / "vibe.pkl").write_bytes(pickle.dumps({1: person}))
    video = shared_data / "video" / "help.mkv"
    made = Recording.create(tmp_path / "a.sd2", video=video, mesh=tmp_path / "vibe.pkl")
    made.mesh_reading = MeshReading(focal_px=600.0)
    # Half the crop, 1.1 times 120 pixels, is 1 m at a focal length of 600 pixels.
    away_m = 5.0 / 1.1
    assert made.load_mesh().frame(0).mean(axis=0) == pytest.approx([0, 0, away_m], abs=1e-5)
    made.mesh_reading = MeshReading(focal_px=600.0, image_size=(400, 480))
    aside = [away_m * 120 / 600, 0, away_m]
    assert made.load_mesh().frame(0).mean(axis=0) == pytest.approx(aside, abs=1e-5)


class TestPattern:
    """A mesh may be ``frames/*.obj``."""

    @pytest.fixture
    def made(self, files: Path) -> Recording:
        (files / "frames").mkdir()
        for number in range(3):
            (files / "frames" / f"{number}.obj").write_text("v")
        return Recording.create(files.parent / "p.sd2", mesh=files / "frames" / "*.obj")

    def test_is_stored_and_there(self, made: Recording) -> None:
        assert content(made)["mesh"] == "../one/frames/*.obj"
        assert not open_recording(made.folder).missing()

    def test_is_found_by_its_folder(self, made: Recording, files: Path, tmp_path: Path) -> None:
        (files / "frames").rename(tmp_path / "frames")
        (tmp_path / "other" / "frames").mkdir(parents=True)
        assert made.missing()
        assert made.relink(tmp_path).paths == {"mesh": tmp_path / "frames" / "*.obj"}

    def test_is_not_copied(self, made: Recording, tmp_path: Path) -> None:
        with pytest.raises(Sd2Error, match="Give their folder"):
            made.save_as(tmp_path / "copy", copy=True)
        assert not (tmp_path / "copy.sd2").exists()


def test_the_documented_example_is_complete_and_true() -> None:
    documentation = Path(__file__).resolve().parents[3] / "docs" / "formats.md"
    section = documentation.read_text(encoding="utf-8").split("\n## Recordings\n")[1]
    example = json.loads(section.split("```json")[1].split("```")[0])
    assert Document.model_validate(example).model_dump(mode="json") == example
    assert example.keys() == Document.model_fields.keys()
    assert example["mesh_reading"].keys() == MeshReading.model_fields.keys()


def test_a_missing_file_is_explained_when_it_is_opened(files: Path) -> None:
    made = make(files)
    (files / "walk.npz").unlink()
    with pytest.raises(Sd2Error, match=r"mesh of .*walk\.npz.*sd2 relink"):
        made.load_mesh()
    made.mesh = None
    with pytest.raises(Sd2Error, match="holds no mesh"):
        made.load_mesh()


def test_a_file_with_brackets_in_its_name_moves_like_any_other(files: Path, tmp_path: Path) -> None:
    video = files / "walk [1].mkv"
    video.write_text("video")
    made = Recording.create(files.parent / "b.sd2", video=video)
    assert not made.missing()
    (tmp_path / "disk").mkdir()
    # What the name would stand for as a pattern, beside what it is.
    (tmp_path / "disk" / "walk 1.mkv").write_text("another")
    video.rename(tmp_path / "disk" / video.name)
    assert made.missing() == {"video": video}
    assert made.relink(tmp_path / "disk").paths == {"video": tmp_path / "disk" / video.name}
    copied = made.save_as(tmp_path / "copy", copy=True)
    assert content(copied)["video"] == video.name


def test_a_copy_replaces_no_file_that_is_there(files: Path, tmp_path: Path) -> None:
    folder = tmp_path / "all.sd2"
    folder.mkdir()
    for name in ("walk.mkv", "video-walk.mkv"):
        (folder / name).write_text("precious")
    (folder / "video-2-walk.mkv").symlink_to("nowhere")
    made = Recording.create(folder, video=files / "walk.mkv", copy=True)
    assert [(folder / name).read_text() for name in ("walk.mkv", "video-walk.mkv")] == [
        "precious",
        "precious",
    ]
    assert (folder / "video-2-walk.mkv").is_symlink()
    assert content(made)["video"] == "video-3-walk.mkv"
    assert (folder / "video-3-walk.mkv").read_text() == "walk.mkv"


def test_the_camera_is_kept_and_scales_with_the_picture(files: Path) -> None:
    made = make(files, camera=CameraEntry(focal_px=900, width=1280, height=720, source="user"))
    read = open_recording(made.folder)
    assert read.camera == made.camera
    assert read.focal_px(1280, 720) == 900
    assert read.focal_px(640, 360) == 450
    # A camera held upright: its longer side is still the longer side.
    assert read.focal_px(720, 1280) == 900


def test_a_recording_that_says_nothing_of_its_camera(files: Path) -> None:
    made = make(files)
    written = content(made)
    del written["camera"]
    (made.folder / FILE_NAME).write_text(json.dumps(written))
    read = open_recording(made.folder)
    assert read.camera is None
    assert read.focal_px(640, 480) is None
    read.mesh_reading = MeshReading(focal_px=700.0)
    assert read.focal_px(640, 480) == 700
    read.camera = CameraEntry(focal_px=650)
    assert read.focal_px(640, 480) == 650


@pytest.mark.parametrize("camera", [{"focal_px": 0}, {"width": 640}, {"focal_px": 5, "width": 0}])
def test_an_impossible_camera_is_refused(files: Path, camera: dict) -> None:
    made = make(files)
    (made.folder / FILE_NAME).write_text(json.dumps(content(made) | {"camera": camera}))
    with pytest.raises(Sd2Error, match="camera"):
        open_recording(made.folder)


def test_the_chosen_denoiser_moves_with_the_recording(files: Path, tmp_path: Path) -> None:
    made = make(files)
    assert made.denoiser is None
    assert made.bundled_denoiser is None
    made.denoiser = files / "own.safetensors"
    made.denoiser.write_bytes(b"weights")
    made.save()
    moved = tmp_path / "elsewhere"
    files.parent.rename(moved)
    again = open_recording(moved / made.folder.relative_to(files.parent))
    assert again.denoiser == moved / files.relative_to(files.parent) / "own.safetensors"
    assert not again.missing()
    again.denoiser, again.bundled_denoiser = None, ""
    again.save()
    assert open_recording(again.folder).bundled_denoiser == ""
    assert open_recording(again.folder).denoiser is None


def test_planned_placements_are_kept(files: Path) -> None:
    made = make(files)
    assert made.placements is None
    for planned in (
        PlacementGrid((1.0, 2.0), (-30.0, 30.0)),
        PlacementCloud(7, (1.0, 3.0), seed=4),
        None,
    ):
        made.placements = planned
        made.save()
        assert open_recording(made.folder).placements == planned


def test_inertial_sensors_are_kept_and_their_file_is_found_again(
    files: Path, tmp_path: Path
) -> None:
    (files / "wrist.csv").touch()
    recording = Recording.create(tmp_path / "walk.sd2", video=files / "walk.mkv")
    assert (recording.imu, recording.imu_offset_s, recording.imu_places) == (None, 0.0, ())
    recording.imu, recording.imu_offset_s = files / "wrist.csv", -0.25
    recording.imu_places = ("left-wrist", "4711")
    recording.save()
    again = open_recording(recording.folder)
    assert (again.imu, again.imu_offset_s) == (files / "wrist.csv", -0.25)
    assert again.imu_places == ("left-wrist", "4711")

    document = json.loads((recording.folder / "recording.json").read_text())
    for name in ("imu", "imu_offset_s", "imu_places"):  # as earlier versions wrote it
        del document[name]
    (recording.folder / "recording.json").write_text(json.dumps(document))
    assert open_recording(recording.folder).imu_places == ()

    again.imu = tmp_path / "gone" / "wrist.csv"
    assert again.missing() == {"imu": tmp_path / "gone" / "wrist.csv"}
    with pytest.raises(Sd2Error, match=r"inertial sensor's file .* does not exist"):
        again.save_as(tmp_path / "other.sd2")


@pytest.mark.parametrize("place", ["", "Left wrist", "-1", "left_wrist", "1" * 10, 17])
def test_an_impossible_place_of_an_inertial_sensor_is_refused(files: Path, place: object) -> None:
    recording = Recording.create(files / "walk.sd2", video=files / "walk.mkv")
    path = recording.folder / "recording.json"
    document = json.loads(path.read_text())
    path.write_text(json.dumps(document | {"imu_places": [place]}))
    with pytest.raises(Sd2Error, match="imu_places"):
        open_recording(recording.folder)


def test_damaged_placements_are_named(files: Path) -> None:
    made = make(files)
    damaged = {**content(made), "placements": {"kind": "grid", "ranges_m": [0.0]}}
    (made.folder / FILE_NAME).write_text(json.dumps(damaged))
    with pytest.raises(Sd2Error, match=r"recording\.json: A placement has the range 0 m"):
        open_recording(made.folder)


def test_a_missing_denoiser_is_named_and_hinders_nothing(files: Path) -> None:
    made = make(files)
    made.denoiser = files / "gone.safetensors"
    made.save()
    again = open_recording(made.folder)
    assert again.missing() == {"denoiser": files / "gone.safetensors"}
    other = again.save_as(made.folder.with_name("other.sd2"))
    assert open_recording(other.folder).denoiser == files / "gone.safetensors"
    with pytest.raises(Sd2Error, match="would hold nothing"):
        Recording.create(made.folder.with_name("third.sd2"), denoiser=other.folder)


def test_labels_beside_a_recording_are_its_labels(files: Path) -> None:
    made = Recording.create(files.parent / "p.sd2", mesh=files / "walk.npz")
    assert made.unlabelled
    labels = Labels(spans=(LabelSpan(1, "Gestures", 0.5, 1.0, "left-to-right"),)).shifted(0.25)
    assert [(span.start_s, span.end_s) for span in labels.spans] == [(0.75, 1.25)]
    write_labels(made.folder / "labels.json", labels)
    assert open_recording(made.folder).labelled == labels
    assert not open_recording(made.folder).unlabelled


def test_labels_that_somebody_else_edits_are_left_alone(files: Path) -> None:
    made = Recording.create(files.parent / "walk.sd2", video=files / "walk.mkv")
    theirs = Labels(spans=(LabelSpan(1, "Gestures", 0.5, 1.0, "left-to-right"),))
    write_labels(made.folder / "labels.json", theirs)
    made.labels, made.labels_elsewhere = Labels(), True
    made.sensor = VirtualSensor(position_m=(1.0, 0.0, 0.0))
    made.save()
    again = open_recording(made.folder)
    assert (again.labels, again.sensor) == (theirs, made.sensor)
    # A recording of one's own is another matter.
    own = made.save_as(files.parent / "own.sd2")
    assert not own.labels_elsewhere
    assert open_recording(own.folder).labels == Labels()
    made.read_labels_again()
    assert made.labels == theirs
    (made.folder / "labels.json").write_text("{")
    with pytest.raises(Sd2Error, match=r"labels\.json cannot be read"):
        made.read_labels_again()
    assert made.labels == theirs


def test_files_of_things_go_with_a_copy(tmp_path: Path) -> None:
    """The same file twice is copied once; a moved folder finds it."""
    for name in ("walk.npz", "chair.obj"):
        (tmp_path / name).write_text(name)
    chair = str(tmp_path / "chair.obj")
    things = (Thing(chair, (0, 1, 2)), Thing("box", (1, 1, 1)), Thing(chair, (0, 1, 3), 20.0))
    linked = Recording.create(tmp_path / "linked", mesh=tmp_path / "walk.npz", things=things)
    assert open_recording(linked.folder).things == things
    copied = linked.save_as(tmp_path / "copied", copy=True)
    moved = copied.folder.rename(tmp_path / "moved.sd2")
    (tmp_path / "chair.obj").unlink()
    found = open_recording(moved).things
    assert [Path(one.shape).name for one in found] == ["chair.obj", "box", "chair.obj"]
    assert Path(found[0].shape).read_text() == "chair.obj"
    assert [one.position_m for one in found] == [one.position_m for one in things]
    assert sorted(path.name for path in moved.iterdir()) == ["chair.obj", FILE_NAME, "walk.npz"]


def test_a_thing_that_cannot_be_is_named_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "walk.npz").touch()
    made = Recording.create(tmp_path / "walk", mesh=tmp_path / "walk.npz")
    content = json.loads((made.folder / FILE_NAME).read_text())
    for thing, said in (
        ({"shape": "sofa", "position_m": [0, 0, 1]}, "sofa"),
        ({"shape": "box", "position_m": [0, 0, 1], "turn_deg": 400}, "400"),
        ({"shape": "box"}, "position_m"),
        ({"shape": "box", "position_m": [0, 0, 1], "colour": "red"}, "colour"),
    ):
        (made.folder / FILE_NAME).write_text(json.dumps(content | {"things": [thing]}))
        with pytest.raises(Sd2Error, match=FILE_NAME) as caught:
            open_recording(made.folder)
        assert said in str(caught.value)


def test_bodies_go_with_a_copy_and_are_found_again(tmp_path: Path) -> None:
    for name in ("walk.npz", "anna.npz"):
        (tmp_path / name).write_text(name)
    anna = Body(str(tmp_path / "anna.npz"), (1, 0, 0), 90, 0.5, "anna", {"scale": 0.01})
    bert = Body(str(tmp_path / "walk.npz"))
    made = Recording.create(tmp_path / "duo", mesh=tmp_path / "walk.npz", bodies=(anna, bert))
    assert json.loads((made.folder / FILE_NAME).read_text())["bodies"][0]["path"] == "../anna.npz"
    assert open_recording(made.folder).bodies == (anna, bert)
    copied = made.save_as(tmp_path / "copied", copy=True)
    moved = copied.folder.rename(tmp_path / "moved.sd2")
    found = open_recording(moved)
    assert not found.missing()
    assert [Path(one.path).read_text() for one in found.bodies] == ["anna.npz", "walk.npz"]
    assert all(Path(one.path).parent == moved for one in found.bodies)
    # A file that was moved is missing, and found by its name.
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "anna.npz").rename(tmp_path / "elsewhere" / "anna.npz")
    lost = open_recording(made.folder)
    assert lost.missing() == {"body 2": tmp_path / "anna.npz"}
    assert lost.relink(tmp_path / "elsewhere").paths.keys() == {"body 2"}
    again = open_recording(made.folder)
    assert not again.missing()
    assert again.bodies[0].moved_m == (1, 0, 0)
    assert again.mesh == tmp_path / "walk.npz"


def test_a_wall_that_cannot_be_is_named_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "walk.npz").touch()
    wall = Wall(2.0, 30.0, loss_db=5.0)
    made = Recording.create(tmp_path / "walk", mesh=tmp_path / "walk.npz", walls=(wall,))
    assert open_recording(made.folder).walls == (wall,)
    content = json.loads((made.folder / FILE_NAME).read_text())
    for walls in ([{"distance_m": 0, "loss_db": 3}], [{"distance_m": 2, "loss_db": -1}], [{}]):
        (made.folder / FILE_NAME).write_text(json.dumps(content | {"walls": walls}))
        with pytest.raises(Sd2Error, match=FILE_NAME):
            open_recording(made.folder)


@pytest.mark.parametrize(("rate", "offered"), [(25, [25.0]), (30, [])])
def test_a_mesh_without_times_is_offered_the_rate_of_its_video(
    tmp_path: Path, rate: int, offered: list[float]
) -> None:
    video = write_video(tmp_path / "v.mp4", 5, rate=rate)
    still = np.random.default_rng(0).uniform(1.0, 2.0, (8, 3))
    np.savez(tmp_path / "m.npz", vertices=np.tile(still, (5, 1, 1)))
    made = Recording(tmp_path / "walk.sd2", video=video, mesh=tmp_path / "m.npz")
    findings = made.load_mesh().findings
    assert [one.cure.value for one in findings if one.cure is not None] == offered
    made.mesh_reading = MeshReading(frames_per_s=rate)
    assert made.load_mesh().findings == ()
