"""What is asked before a fit: camera, person, height, and where it is saved."""

from __future__ import annotations

import math
from pathlib import Path

import av
import numpy as np
import pytest
from PySide6.QtGui import QImage

from sd2app.fit.request import FitRequest, Person
from sd2app.fit.setup import FitSetupModel, folder_for
from sd2core.recording.recording import Recording


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """Ten pictures of 160 × 120, frame k of brightness 20 k."""
    path = tmp_path / "walk.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=30)
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        for number in range(10):
            picture = np.full((120, 160, 3), 20 * number, np.uint8)
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return path


@pytest.fixture
def setup(qtbot, video):
    setup = FitSetupModel()
    setup.choose_video(video)
    qtbot.waitUntil(lambda: setup.picture is not None, timeout=10_000)
    yield setup
    setup.close()


def test_who_is_ticked_or_drawn_around_is_fitted_and_not_both(setup) -> None:
    setup.tick(3, True)
    setup.tick(1, True)
    request = setup.request()
    assert request.people == (1, 3)
    assert [mesh.name for mesh in request.meshes] == ["mesh-1.zarr", "mesh-3.zarr"]
    assert request.command(Path("x.zarr")).people == ("1", "3")
    setup.set_person(10, 10, 90, 90)
    assert setup.choices.people == ()
    setup.tick(2, True)
    assert setup.request().person is None
    assert [mesh.name for mesh in setup.request().meshes] == ["mesh.zarr"]
    setup.tick(2, False)
    assert setup.request().people == ()


def test_a_video_without_anybody_is_told(setup, models, qtbot) -> None:
    setup.find_people()
    assert setup.searched == 0.0
    qtbot.waitUntil(lambda: setup.searched is None, timeout=60_000)
    assert setup.portraits == []
    assert "Nobody was found" in setup.problem


def test_the_video_is_shown_from_its_middle(setup, video, qtbot) -> None:
    assert setup.ready
    assert (setup.frames, setup.size, setup.frame) == (10, (160, 120), 5)
    assert setup.picture.mean() == pytest.approx(100, abs=4)
    setup.show_frame(2)
    qtbot.waitUntil(lambda: abs(float(setup.picture.mean()) - 40) < 4)


def test_a_picture_is_no_video_to_fit_to(setup, tmp_path, qtbot) -> None:
    QImage(160, 120, QImage.Format.Format_RGB888).save(str(tmp_path / "still.png"))
    setup.choose_video(tmp_path / "still.png")
    qtbot.waitUntil(lambda: bool(setup.problem), timeout=10_000)
    assert setup.problem == "still.png has one frame: a body is fitted to a video."
    assert not setup.ready


def test_nothing_said_leaves_all_to_the_fit(setup, video) -> None:
    assert setup.request() == FitRequest(video, video.with_name("walk.sd2"))


def test_field_of_view_and_focal_length_are_one_thing(setup) -> None:
    setup.change(camera="angle")
    setup.change(angle_deg=90.0)
    assert setup.request().focal_px == pytest.approx(80.0)
    setup.set_focal(160.0)
    assert setup.choices.angle_deg == pytest.approx(2 * math.degrees(math.atan(0.5)))
    setup.change(camera="file")
    assert setup.request().focal_px is None


def test_a_rectangle_may_be_drawn_from_any_corner_and_beyond_the_edge(setup) -> None:
    setup.show_frame(3)
    setup.set_person(100.4, 80.2, -20, 10.6)
    assert setup.choices.person == Person(frame=3, x=0, y=11, width=100, height=69)
    setup.show_frame(7)
    assert setup.choices.person.frame == 3
    setup.set_person(10, 10, 11, 90)  # a slip of the hand
    assert setup.choices.person.width == 100
    setup.change(person=None)
    assert setup.request().person is None


def test_heights_stay_human(setup) -> None:
    setup.change(stature_m=17.0)
    assert setup.choices.stature_m == 2.6
    setup.change(stature_m=None)
    assert setup.request().stature_m is None


def test_a_file_that_is_no_video_is_explained(qtbot, tmp_path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    setup = FitSetupModel()
    setup.choose_video(tmp_path / "text.mp4")
    qtbot.waitUntil(lambda: bool(setup.problem), timeout=10_000)
    assert "text.mp4" in setup.problem
    assert not setup.ready
    setup.close()


def test_a_stopped_fit_is_continued_with_its_choices_and_not_with_others(qtbot, video) -> None:
    kept = FitRequest(video, video.with_name("walk.sd2"), 1.66, 123.0, Person(4, 10, 10, 60, 90))
    kept.save()
    setup = FitSetupModel()
    setup.choose_video(video)
    qtbot.waitUntil(lambda: setup.picture is not None, timeout=10_000)
    assert setup.continues
    assert setup.frame == 4
    assert setup.request().asks_the_same(kept)
    setup.change(stature_m=1.8)
    assert setup.kept is not None
    assert not setup.continues
    setup.close()


def test_where_it_is_saved_by_default(video, tmp_path) -> None:
    assert folder_for(video) == tmp_path / "walk.sd2"
    (tmp_path / "walk.sd2").mkdir()
    assert folder_for(video) == tmp_path / "walk-2.sd2"
    saved = Recording.create(tmp_path / "mine.sd2", video=video)
    assert folder_for(video, saved) == tmp_path / "mine.sd2"
    (tmp_path / "m.npz").write_bytes(b"")
    saved.mesh = tmp_path / "m.npz"
    assert folder_for(video, saved) == tmp_path / "walk-2.sd2"
    assert folder_for(video, Recording(Path(), video=video)) == tmp_path / "walk-2.sd2"
