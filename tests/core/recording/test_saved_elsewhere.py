"""Saving a recording that something else has changed, moved or deleted since it was read."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sd2core.labels.spans import Labels, Span
from sd2core.placements.placements import PlacementGrid
from sd2core.recording.recording import (
    GoneError,
    Recording,
    SavedElsewhereError,
    open_recording,
)
from sd2core.sensor import VirtualSensor

MINE, THEIRS = (Span(number, "Gestures", number, number + 1, "a") for number in (1, 2))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "walk.npz").write_text("mesh")
    made = Recording.create(tmp_path / "walk.sd2", mesh=tmp_path / "walk.npz")
    return made.folder


@pytest.fixture
def both(folder: Path) -> tuple[Recording, Recording]:
    """One recording, read by two."""
    return open_recording(folder), open_recording(folder)


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def labelled(recording: Recording) -> None:
    recording.labels = Labels(spans=(THEIRS,))


def moved(recording: Recording) -> None:
    recording.sensor = VirtualSensor(position_m=(0.0, 0.0, -1.0))


def planned(recording: Recording) -> None:
    recording.placements = PlacementGrid((2.0,))


def aligned(recording: Recording) -> None:
    recording.radar_offset_s = 0.5


def linked(recording: Recording) -> None:
    recording.video = recording.folder.parent / "walk.mkv"


def carried(recording: Recording) -> None:
    recording.imu_places = ("left-wrist",)


def measured(recording: Recording) -> None:
    recording.imu = recording.folder.parent / "wrist.csv"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (labelled, "1 span added"),
        (moved, "another sensor"),
        (planned, "another plan of placements"),
        (aligned, "another offset of the radar"),
        (linked, "another video"),
        (carried, "another set of inertial sensors"),
        (measured, "another file of the inertial sensor"),
    ],
)
def test_what_another_saved_is_never_overwritten_without_a_word(
    both: tuple[Recording, Recording], change: Callable[[Recording], None], says: str
) -> None:
    mine, theirs = both
    change(theirs)
    theirs.save()
    before = content(mine.folder)
    mine.title = "mine"
    with pytest.raises(SavedElsewhereError, match=f"since it was read: {says}") as caught:
        mine.save()
    assert content(mine.folder) == before
    found = caught.value.divergence.merged()
    assert found.notes == ()
    assert found.state.settings["title"] == "mine"
    assert found.state.settings | {"title": ""} == theirs.state().settings | {"title": ""}
    assert found.state.labels == theirs.labelled
    mine.accept(caught.value.theirs)
    mine.save()
    assert open_recording(mine.folder).title == "mine"


def test_who_saves_often_is_asked_nothing(both: tuple[Recording, Recording]) -> None:
    mine, theirs = both
    for number in range(3):
        mine.labels = Labels(spans=(Span(1, "Gestures", number, number + 1, "a"),))
        mine.radar_offset_s = float(number)
        mine.save()
    labelled(theirs)
    with pytest.raises(SavedElsewhereError):
        theirs.save()


def test_the_same_made_by_both_is_no_question(both: tuple[Recording, Recording]) -> None:
    mine, theirs = both
    for one in (theirs, mine):
        labelled(one)
        aligned(one)
        one.save()


def test_a_damaged_file_is_not_overwritten(both: tuple[Recording, Recording]) -> None:
    path = both[0].folder / "recording.json"
    path.write_text("{")
    with pytest.raises(Exception, match=r"recording\.json cannot be read"):
        both[0].save()
    assert path.read_text() == "{"


def test_fields_of_a_later_version_that_another_wrote_are_kept(folder: Path) -> None:
    mine = open_recording(folder)
    path = folder / "recording.json"
    path.write_text(path.read_text().replace("{", '{"later": 1,', 1))
    aligned(mine)
    mine.save()
    assert '"later": 1' in path.read_text()


def test_a_failed_save_is_tried_again_without_a_question(
    both: tuple[Recording, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    mine, _ = both
    labelled(mine)
    with monkeypatch.context() as patch:
        patch.setattr("sd2core.recording.recording.atomic_write_json", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            mine.save()
    assert (mine.folder / "labels.json").exists()
    aligned(mine)
    mine.save()
    assert open_recording(mine.folder).labels == mine.labels


class TestGone:
    def test_is_said_and_nothing_is_made(self, both: tuple[Recording, Recording]) -> None:
        mine, _ = both
        shutil.rmtree(mine.folder)
        with pytest.raises(GoneError, match=r"walk\.sd2 was renamed, moved or deleted"):
            mine.save()
        assert not mine.folder.exists()
        mine.folder.mkdir()  # the empty place of a drive that is not connected
        with pytest.raises(GoneError, match="its drive is not connected"):
            mine.save()
        assert list(mine.folder.iterdir()) == []

    def test_it_can_be_saved_elsewhere_without_the_files_that_went(self, tmp_path: Path) -> None:
        folder = tmp_path / "walk.sd2"
        folder.mkdir()
        (folder / "walk.npz").write_text("mesh")
        Recording.create(folder, mesh=folder / "walk.npz")
        mine = open_recording(folder)
        labelled(mine)
        moved_to = folder.rename(tmp_path / "run.sd2")
        made = mine.save_as(tmp_path / "again.sd2")
        assert made.missing() == {"mesh": folder / "walk.npz"}
        assert made.relink(moved_to).missing == ()
        found = open_recording(made.folder)
        assert found.mesh == moved_to / "walk.npz"
        assert found.labels == mine.labels
