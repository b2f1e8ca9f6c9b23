"""Fitting in a process: progress, landmarks, cancel, resume, failure, and what it leaves."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QLockFile

from sd2app.command_line import main
from sd2app.fit.feature import make_recording
from sd2app.fit.model import UNFINISHED, FitModel
from sd2app.fit.request import LOCK_NAME, FitRequest, Person, read_request, settled
from sd2app.settings import Settings
from sd2core.cli import build_parser
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import CameraEntry, Span
from sd2core.recording.recording import Recording, open_recording

FAKE = Path(__file__).resolve().parents[2] / "fake_fit.py"


@pytest.fixture
def settings() -> Settings:
    return Settings.forgetful()


@pytest.fixture
def made(qtbot, settings):
    """Makes models whose fit is pretended; options are those of ``fake_fit.py``."""
    models: list[FitModel] = []

    def make(*options: object) -> FitModel:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        models.append(FitModel(settings, command=command))
        return models[-1]

    yield make
    for model in models:
        model.close()


@pytest.fixture
def request_(tmp_path: Path) -> FitRequest:
    (tmp_path / "walk.mp4").write_bytes(b"a video")
    return FitRequest(tmp_path / "walk.mp4", tmp_path / "walk.sd2")


def until(qtbot, model: FitModel, state: str) -> None:
    qtbot.waitUntil(lambda: model.state == state, timeout=20_000)


def test_a_fit_from_beginning_to_end(made, qtbot, request_, settings) -> None:
    model = made("--frames", 20)
    finished: list[FitRequest] = []
    model.finished.connect(finished.append)
    model.start(request_)
    assert model.busy
    assert settings.paths(UNFINISHED) == [request_.folder]
    until(qtbot, model, "finished")
    assert finished == [request_]
    assert request_.mesh.exists()
    assert model.notes == "This was no fit."
    assert model.progress.size == (160, 120)
    assert model.progress.stage == "write"
    assert model.landmarks_at(7)[0].tolist() == pytest.approx([75.0, 10.0, 1.0])
    assert model.landmarks_at(21) is None
    assert settings.paths(UNFINISHED) == []
    assert not (request_.folder / LOCK_NAME).exists()


def test_landmarks_are_told_while_it_runs(made, qtbot, request_) -> None:
    model = made("--frames", 40, "--pause-s", 0.02)
    frames: list[int | None] = []
    model.changed.connect(lambda: frames.append(model.progress and model.progress.newest))
    model.start(request_)
    qtbot.waitUntil(lambda: len({*frames} - {None}) >= 3, timeout=20_000)
    assert model.state == "running"
    told = [frame for frame in frames if frame is not None]
    assert told == sorted(told)
    assert all(model.landmarks_at(frame) is not None for frame in told)


def test_cancelled_says_so_at_once_and_is_continued(made, qtbot, request_, settings) -> None:
    model = made("--frames", 30, "--stop-at", 12)
    model.start(request_)
    qtbot.waitUntil(lambda: model.landmarks_at(12) is not None, timeout=20_000)
    model.cancel()
    assert model.state == "cancelling"
    until(qtbot, model, "stopped")
    assert request_.partials[0].read_text() == "13"
    assert not request_.mesh.exists()
    assert settings.paths(UNFINISHED) == [request_.folder]
    model.resume()
    until(qtbot, model, "finished")
    assert model.progress.resumed
    assert model.landmarks_at(3) is not None  # still known from before it was stopped


def test_another_start_of_the_program_offers_to_continue(made, qtbot, request_, settings) -> None:
    model = made("--frames", 30, "--stop-at", 12)
    model.start(request_)
    qtbot.waitUntil(lambda: model.landmarks_at(12) is not None, timeout=20_000)
    model.close()  # as when the program is closed, or killed
    later = made("--frames", 30)
    later.look_for_runs()
    assert later.state == "stopped"
    assert later.request == request_
    later.resume()
    until(qtbot, later, "finished")
    assert later.progress.resumed


def test_a_fit_that_goes_on_without_its_window_is_found_again(
    made, qtbot, request_, settings
) -> None:
    model = made("--frames", 30, "--stop-at", 12)
    model.start(request_)
    qtbot.waitUntil(lambda: model.landmarks_at(12) is not None, timeout=20_000)
    launched = request_.run / "launched.json"
    told = json.loads(launched.read_text())
    told["window"]["started_unix_s"] -= 3600.0  # it was killed, and its number given away
    launched.write_text(json.dumps(told))
    model._run.close()
    later = made()
    later.look_for_runs()
    assert later.state == "running"
    # It is this window's now.
    assert not made().take_up(request_.folder)
    qtbot.waitUntil(lambda: later.landmarks_at(12) is not None, timeout=20_000)
    later.cancel()
    until(qtbot, later, "stopped")
    assert request_.partials[0].read_text() == "13"


def test_discarding_leaves_nothing(made, qtbot, request_, settings) -> None:
    model = made("--frames", 30, "--stop-at", 2)
    model.start(request_)
    qtbot.waitUntil(lambda: model.landmarks_at(2) is not None, timeout=20_000)
    model.cancel()
    until(qtbot, model, "stopped")
    model.discard()
    assert model.state == "idle"
    assert not request_.folder.exists()
    assert settings.paths(UNFINISHED) == []


def test_a_refusal_is_shown_as_it_is(made, qtbot, request_) -> None:
    model = made("--refuse", "There is nobody in walk.mp4. Film a person.")
    model.start(request_)
    until(qtbot, model, "failed")
    assert model.text == "There is nobody in walk.mp4. Film a person."
    model.dismiss()
    assert model.state == "idle"
    assert not request_.folder.exists()


def test_a_crash_is_no_success_and_can_be_continued(made, qtbot, request_) -> None:
    model = made("--frames", 30, "--die-at", 4)
    model.start(request_)
    until(qtbot, model, "failed")
    assert model.text
    model.dismiss()
    assert request_.partials[0].exists()
    assert read_request(request_.folder) == request_


def test_a_program_that_is_not_there(qtbot, request_, settings) -> None:
    model = FitModel(settings, command=["/no/such/program"])
    model.start(request_)
    until(qtbot, model, "failed")
    assert model.text


def test_one_at_a_time(made, qtbot, request_, tmp_path) -> None:
    model = made("--stop-at", 0)
    model.start(request_)
    with pytest.raises(Sd2Error, match="already"):
        model.start(request_)
    other = made()
    with pytest.raises(Sd2Error, match="another window"):
        other.start(request_)
    assert not other.take_up(request_.folder)


def test_a_mesh_without_its_recording_is_not_fitted_again(made, qtbot, request_) -> None:
    model = made("--frames", 20)
    model.start(request_)
    until(qtbot, model, "finished")  # and then the program is killed
    later = made("--refuse", "It began anew")
    assert later.take_up(request_.folder)
    later.resume()
    assert later.state == "finished"


def test_other_choices_begin_anew(made, qtbot, request_) -> None:
    model = made("--frames", 30, "--stop-at", 5)
    model.start(request_)
    qtbot.waitUntil(lambda: model.landmarks_at(5) is not None, timeout=20_000)
    model.cancel()
    until(qtbot, model, "stopped")
    taller = FitRequest(request_.video, request_.folder, stature_m=1.9)
    again = made("--frames", 30)
    again.start(taller)
    until(qtbot, again, "finished")
    assert not again.progress.resumed


# --- requests -----------------------------------------------------------------------------


def test_a_request_as_a_command_line(tmp_path) -> None:
    request = FitRequest(
        Path("walk.mp4"), Path("w.sd2"), 1.7, 612.5, Person(frame=9, x=1, y=2, width=30, height=40)
    )
    assert request.arguments() == [
        "fit", "walk.mp4", "--out", str(Path("w.sd2/mesh.zarr")), "--person-box", "1,2,30,40",
        "--person-frame", "9", "--overwrite", "--stature-m", "1.7", "--focal-px", "612.5",
        "--progress-json",
    ]  # fmt: skip


def test_the_command_knows_every_word_of_it(tmp_path) -> None:
    request = FitRequest(
        Path("walk.mp4"), Path("w.sd2"), 1.7, 612.5, Person(frame=9, x=1, y=2, width=30, height=40)
    )
    options = build_parser()[0].parse_args(request.arguments())
    assert (options.video, options.out) == (request.video, request.mesh)
    assert (options.stature_m, options.focal_px) == (1.7, 612.5)
    assert (options.person_box, options.person_frame) == ((1, 2, 30, 40), 9)
    assert options.progress_json


def test_a_request_is_read_back(request_) -> None:
    asked = FitRequest(request_.video, request_.folder, 1.7, 612.5, Person(9, 1, 2, 30, 40))
    asked.save()
    assert read_request(request_.folder) == asked


def test_the_command_line_opens_what_was_stopped(request_, monkeypatch, capsys) -> None:
    shown: list[object] = []
    monkeypatch.setattr("sd2app.command_line._show", lambda paths, _: shown.append(paths))
    request_.folder.mkdir()
    assert main(["open", str(request_.folder)]) == 1  # it holds nothing
    request_.save()
    assert main(["open", str(request_.folder)]) == 0
    assert shown == [[request_.folder]]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 9}', '{"version": 1, "person": 3}'])
def test_a_damaged_request_is_none(request_, text) -> None:
    request_.save()
    (request_.folder / "fit-request.json").write_text(text)
    assert read_request(request_.folder) is None


def test_a_recording_of_something_else_is_refused(request_, tmp_path) -> None:
    (tmp_path / "other.mp4").write_bytes(b"")
    Recording.create(request_.folder, video=tmp_path / "other.mp4")
    with pytest.raises(Sd2Error, match="something else"):
        settled(request_)


def test_a_recording_with_a_mesh_is_refused(request_, tmp_path) -> None:
    (tmp_path / "mesh.npz").write_bytes(b"")
    Recording.create(request_.folder, video=request_.video, mesh=tmp_path / "mesh.npz")
    with pytest.raises(Sd2Error, match="has a mesh"):
        settled(request_)


def test_a_mesh_that_lies_there_is_not_written_over(request_) -> None:
    request_.mesh.mkdir(parents=True)
    assert settled(request_).mesh != request_.mesh


def test_a_name_gets_its_ending(request_, tmp_path) -> None:
    asked = FitRequest(request_.video, tmp_path / "somewhere")
    assert settled(asked).folder == tmp_path / "somewhere.sd2"


# --- the recording ------------------------------------------------------------------------


def fitted(request: FitRequest, camera: object = None) -> FitRequest:
    request.save()
    request.mesh.mkdir()
    attributes = {} if camera is None else {"fit": {"camera": camera}}
    (request.mesh / "zarr.json").write_text(json.dumps({"attributes": attributes}))
    return request


def test_the_recording_has_video_mesh_and_the_camera_of_the_fit(request_) -> None:
    camera = {"focal_px": 700.0, "width": 640, "height": 480, "source": "metadata"}
    recording = make_recording(fitted(request_, camera), (640, 480), None)
    read = open_recording(request_.folder)
    assert (read.video, read.mesh) == (request_.video, request_.mesh)
    assert read.camera == recording.camera == CameraEntry(**camera)
    assert read_request(request_.folder) is None


def test_the_users_focal_length_is_kept_where_the_mesh_says_none(request_) -> None:
    request = FitRequest(request_.video, request_.folder, focal_px=650.0)
    recording = make_recording(fitted(request), (640, 480), None)
    assert recording.camera == CameraEntry(focal_px=650, width=640, height=480, source="user")


def test_what_was_open_is_taken_along(request_, tmp_path) -> None:
    (tmp_path / "radar").mkdir()
    spans = (Span(start_s=0, end_s=1, label="up"),)
    base = Recording(
        Path(), video=request_.video, radar=tmp_path / "radar", radar_offset_s=0.5, spans=spans
    )
    make_recording(fitted(request_), (640, 480), base)
    read = open_recording(request_.folder)
    assert read.radar == tmp_path / "radar"
    assert (read.radar_offset_s, read.spans) == (0.5, spans)


def test_a_recording_that_is_there_gets_the_mesh(request_, tmp_path) -> None:
    Recording.create(request_.folder, video=request_.video, radar_offset_s=1.5, title="Mine")
    request = settled(request_)
    make_recording(fitted(request), (640, 480), None)
    read = open_recording(request_.folder)
    assert read.mesh == request.mesh
    assert (read.title, read.radar_offset_s) == ("Mine", 1.5)


def test_something_else_that_is_open_is_not_taken_along(request_, tmp_path) -> None:
    base = Recording(Path(), video=tmp_path / "other.mp4", radar_offset_s=0.5)
    assert make_recording(fitted(request_), None, base).radar_offset_s == 0.0


def test_a_stale_lock_is_no_hindrance(made, qtbot, request_) -> None:
    request_.save()
    lock = QLockFile(str(request_.folder / LOCK_NAME))
    assert lock.tryLock(0)
    copy = (request_.folder / LOCK_NAME).read_text().splitlines()
    lock.unlock()
    copy[0] = "999999999"  # a process that is long gone
    (request_.folder / LOCK_NAME).write_text("\n".join(copy) + "\n")
    model = made("--frames", 5)
    model.start(request_)
    until(qtbot, model, "finished")


def test_points_are_of_all_landmarks(made, qtbot, request_) -> None:
    model = made("--frames", 5)
    model.start(request_)
    until(qtbot, model, "finished")
    points = np.stack([model.landmarks_at(frame) for frame in range(5)])
    assert points.shape == (5, 33, 3)
    assert np.diff(points[:, 0, 0]) == pytest.approx(1.0)  # they move to the right
