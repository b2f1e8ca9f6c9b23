"""Videos in which the head of who was fitted is covered, or that are deleted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import zarr
from cli_outcome import Sd2

from sd2core.body.camera import PinholeCamera
from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import CameraEntry, MeshReading
from sd2core.io.mesh import save_mesh
from sd2core.io.video import VideoReader, open_video
from sd2core.io.video_writing import write_video
from sd2core.live.videos import hide_person
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording, open_recording
from sd2core.timebase import Timebase

CAMERA = PinholeCamera(192, 144, 120.0)
UNEVEN_S = np.cumsum([0.0, *[0.033, 0.034, 0.05, 0.033, 0.1] * 5])
NOBODY = slice(20, 26)
"""Frames without a person: the last six."""


def _walking(there: np.ndarray | None = None) -> MeshSequence:
    """The bundled body, 2.4 m ahead, that steps aside by 1 m."""
    body = Body.load("low")
    vertices = np.repeat(body.vertices_m[None], len(UNEVEN_S), axis=0)
    vertices[..., 0] += np.linspace(-0.5, 0.5, len(UNEVEN_S))[:, None]
    vertices[..., 1] -= vertices[..., 1].mean()
    vertices[..., 2] += 2.4
    return MeshSequence(vertices.astype(np.float32), body.faces, Timebase(UNEVEN_S), present=there)


def _heads_px(mesh: MeshSequence) -> list[np.ndarray]:
    """Pixels (row, column) of the head, frame by frame."""
    head = vertex_limbs(Body.load("low")) == LIMBS.index("head")
    found = []
    for frame in range(mesh.frame_count):
        points_px = CAMERA.project(mesh.frame(frame)[head].astype(float)).astype(int)
        found.append(np.unique(points_px[:, ::-1], axis=0))
    return found


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """Detail everywhere, a body in it, and nobody at the end."""
    there = np.ones(len(UNEVEN_S), bool)
    there[NOBODY] = False
    rng = np.random.default_rng(5)
    coarse = rng.choice(np.array([40, 215], np.uint8), (36, 48, 1))
    picture = coarse.repeat(4, axis=0).repeat(4, axis=1).repeat(3, axis=2)
    folder = tmp_path / "walk.sd2"
    folder.mkdir()
    write_video(
        folder / "video.mp4", [picture] * len(UNEVEN_S), 30, (192, 144), times_s=UNEVEN_S, crf=10
    )
    save_mesh(_walking(there), folder / "fit.zarr")
    return Recording.create(
        folder,
        video=folder / "video.mp4",
        mesh=folder / "fit.zarr",
        camera=CameraEntry(focal_px=120.0, width=192, height=144),
    )


def _pictures(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    with open_video(folder / "video.mp4") as video:
        return np.array(list(video.frames()), float), video.timebase.times_s


def test_the_head_is_covered_where_it_was_fitted(recording: Recording) -> None:
    """What is said later, of the camera or of how the mesh is read, moves nobody in the video."""
    camera = {"focal_px": 120.0, "width": 192, "height": 144, "source": "default"}
    fit = zarr.open_group(str(recording.mesh), mode="r+")
    fit.attrs["fit"] = {"camera": camera}
    recording.camera = CameraEntry(focal_px=60.0)
    recording.mesh_reading = MeshReading(distance_m=2.0, frames_per_s=5.0)
    recording.save()
    assert hide_person(recording.folder, "blur")
    after, _ = _pictures(recording.folder)
    for frame, head in enumerate(_heads_px(_walking())[: NOBODY.start]):
        assert after[frame][tuple(head.T)].std(axis=0).max() < 4


def test_a_body_of_other_pictures_covers_nothing(recording: Recording) -> None:
    camera = {"focal_px": 120.0, "width": 144, "height": 144, "source": "default"}
    zarr.open_group(str(recording.mesh), mode="r+").attrs["fit"] = {"camera": camera}
    with pytest.raises(Sd2Error, match="fitted to pictures of 144 × 144"):
        hide_person(recording.folder, "blur")


def test_the_head_loses_its_detail_and_nothing_else_changes(recording: Recording) -> None:
    before, times_s = _pictures(recording.folder)
    assert hide_person(recording.folder, "blur")
    after, after_s = _pictures(recording.folder)
    np.testing.assert_allclose(after_s, times_s, rtol=0, atol=2e-5)
    np.testing.assert_allclose(after_s, UNEVEN_S, rtol=0, atol=2e-5)
    rows, columns = np.mgrid[:144, :192]
    for frame, head in enumerate(_heads_px(_walking())[: NOBODY.start]):
        shown = tuple(head.T)
        assert before[frame][shown].std(axis=0).min() > 25
        assert after[frame][shown].std(axis=0).max() < 4
        # Far from any head that is near in time, the picture is as it was.
        middle = head.mean(axis=0)
        away = np.hypot(rows - middle[0], columns - middle[1]) > 60
        if frame < NOBODY.start - 4:
            assert np.abs(after[frame] - before[frame])[away].mean() < 10
            assert after[frame][away].std() > 40
    # Where nobody was fitted, somebody may come or go: all of it is covered.
    assert after[NOBODY].std(axis=(1, 2)).max() < 4
    assert [one.name for one in recording.folder.iterdir() if "part" in one.name] == []
    # Once is enough.
    written = (recording.folder / "video.mp4").read_bytes()
    assert not hide_person(recording.folder, "blur")
    assert (recording.folder / "video.mp4").read_bytes() == written


def test_an_interrupted_cover_leaves_the_original(recording: Recording) -> None:
    original = (recording.folder / "video.mp4").read_bytes()

    def stop(done: int, total: int) -> None:
        if done == 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hide_person(recording.folder, "blur", stop)
    assert (recording.folder / "video.mp4").read_bytes() == original
    assert not list(recording.folder.glob(".*"))


def test_the_command_covers_or_deletes_and_info_tells(sd2: Sd2, recording: Recording) -> None:
    folder = recording.folder
    assert "heads covered" not in sd2("info", folder).out
    assert sd2("set", folder, "--anonymise", "blur").code == 0
    assert "192 x 144 pixels, heads covered" in sd2("info", folder).out
    assert json.loads(sd2("info", folder, "--json").out)["video"]["heads_covered"] is True
    again = sd2("set", folder, "--anonymise", "blur")
    assert "done before" in again.err
    assert sd2("set", folder, "--anonymise", "drop").code == 0
    assert not (folder / "video.mp4").exists()
    left = open_recording(folder)
    assert left.video is None
    np.testing.assert_allclose(left.load_mesh().timebase.times_s, UNEVEN_S, atol=2e-5)


def test_what_cannot_be_covered_stays_and_is_said(recording: Recording, tmp_path: Path) -> None:
    original = (recording.folder / "video.mp4").read_bytes()
    body = _walking()
    foreign = MeshSequence(body.vertices, body.faces[::2].copy(), body.timebase)
    save_mesh(foreign, tmp_path / "other.npz")
    recording.mesh = tmp_path / "other.npz"
    recording.save()
    with pytest.raises(Sd2Error, match=r"not known where its head is"):
        hide_person(recording.folder, "blur")
    recording.mesh = None
    recording.save()
    for how in ("blur", "drop"):
        with pytest.raises(Sd2Error, match="has no body"):
            hide_person(recording.folder, how)
    assert (recording.folder / "video.mp4").read_bytes() == original


def test_two_who_cover_the_same_video_at_once_leave_a_whole_one(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    others: list[bool] = []

    def while_another_does(path: Path) -> VideoReader:
        if not others:
            others.append(False)  # the other one does not wait for a third
            others[0] = hide_person(recording.folder, "blur")
        return open_video(path)

    _, times_s = _pictures(recording.folder)
    monkeypatch.setattr("sd2core.live.videos.open_video", while_another_does)
    assert hide_person(recording.folder, "blur")
    assert others == [True]
    after, found_s = _pictures(recording.folder)
    assert len(after) == len(times_s)
    np.testing.assert_allclose(found_s, times_s, atol=1e-4)
    kept = {path.name for path in recording.folder.iterdir()}
    assert kept == {"recording.json", "video.mp4", "fit.zarr"}
