"""What is to be exported: counted while it is chosen, written in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from PySide6.QtCore import QObject
from swinging_recordings import recording
from turning_bodies import turning_body

from sd2app.dataset_export.feature import (
    inertial_words,
    label_words,
    size_words,
    split_words,
)
from sd2app.dataset_export.model import MAPS, Exported, ExportModel, ExportRun
from sd2app.session.tasks import TaskList
from sd2core.errors import Sd2Error
from sd2core.imu.mounting import PLACES
from sd2core.io.mesh import save_mesh
from sd2core.placements.placements import PlacementGrid
from sd2core.recording.recording import Recording
from sd2core.runs.command_folder import CommandFolder

FAKE = Path(__file__).resolve().parents[2] / "fake_export.py"


@pytest.fixture
def made(qtbot, tmp_path: Path):
    parent = QObject()
    models = []

    def make(how: str = "done", program: str = sys.executable) -> ExportModel:
        command = [program, str(FAKE), how]
        models.append(ExportModel(TaskList(parent), parent, command, tmp_path / "exports"))
        return models[-1]

    yield make
    for model in models:
        model.close()
    for folder in map(CommandFolder, (tmp_path / "exports").glob("*")):
        with suppress(Sd2Error):
            folder.tell("stop")
        qtbot.waitUntil(lambda folder=folder: not folder.live, timeout=20_000)
    parent.deleteLater()


@pytest.fixture
def people(tmp_path: Path) -> Path:
    (tmp_path / "people").mkdir()
    for name in ("anna", "ben"):
        recording(tmp_path / "people" / f"{name}.sd2")
    return tmp_path / "people"


def counted(model: ExportModel, qtbot) -> None:
    qtbot.waitUntil(lambda: not model.counting, timeout=20_000)


def test_choices_are_counted_at_once(made, people, qtbot) -> None:
    model = made()
    model.begin(people / "anna.sd2")
    assert model.counting
    assert model.forecast is None
    counted(model, qtbot)
    assert model.forecast is not None
    # 120 frames in steps of 62: at 0 and, to their end, at 48.
    assert (model.forecast.segments, model.forecast.sources) == (2, 1)
    model.choose(segment_frames=30, overlap_frames=0)
    counted(model, qtbot)
    assert model.forecast.segments == 4
    assert size_words(model.forecast, 30).startswith("4 segments of 1.0 s from 1 view · ")
    # It swings from 1 s to 2 s.
    assert label_words(model.forecast) == "Labels: background 3 · swing 1"
    assert split_words(model.forecast) == (
        "Split: all 4 to train (anna); none to validate or test on"
    )
    model.choose(kinds=MAPS["radar"])
    counted(model, qtbot)
    assert model.forecast.of_kind == {"simulated": 4}


def test_a_folder_has_people_and_planned_places(made, people, qtbot) -> None:
    planning = recording(people / "carla.sd2", radar=False)
    planning.placements = PlacementGrid((1.0, 2.0, 3.0))
    planning.save()
    model = made()
    model.begin(people)
    assert model.places == 3
    counted(model, qtbot)
    assert model.forecast.sources == 3
    model.choose(placements="planned")
    counted(model, qtbot)
    assert model.forecast.sources == 6
    model.choose(subjects=("ann", "ann", "ben"))
    counted(model, qtbot)
    assert model.forecast.split.validation == ("ann",)
    model.choose(subjects=("ann",))
    counted(model, qtbot)
    assert "1 people are named for 3 recordings" in model.problem
    assert not model.ready
    model.begin(people / "anna.sd2")
    assert (model.choice.subjects, model.choice.placements, model.places) == (None, None, 0)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"kinds": ()}, "No map is chosen."),
        ({"segment_frames": 200}, "No recording has 200 frames on end with a person."),
    ],
)
def test_what_cannot_be_exported_is_said(made, people, qtbot, change, problem) -> None:
    model = made()
    model.begin(people / "anna.sd2")
    model.choose(**change)
    counted(model, qtbot)
    assert model.problem == problem
    assert not model.ready
    model.start(people / "set.zarr")
    assert not model.under_way


def test_it_is_written_by_another_process(made, people, qtbot) -> None:
    model = made()
    model.begin(people)
    model.choose(segment_frames=30, overlap_frames=5, kinds=MAPS["synthetic"], subjects=("a", "b"))
    counted(model, qtbot)
    out = people / "set.h5"
    said: list[str] = []
    model.noted.connect(said.append)
    model.failed.connect(said.append)
    model.start(out)
    assert model.under_way
    assert not model.ready
    qtbot.waitUntil(lambda: not model.under_way, timeout=20_000)
    assert model.result == Exported(
        out, people / "set.card.md", people / "set.png", 7, 2, ("b: it is damaged",)
    )
    assert said == [f"7 segments from 2 views are in {out}.", "Left out: b: it is damaged"]
    assert json.loads((people / "set.h5.asked").read_text()) == [
        "export", str(people), "--out", str(out), "--kinds", "synthetic", "--segment-frames", "30",
        "--overlap-frames", "5", "--subjects", "a,b", "--progress-json",
    ]  # fmt: skip
    model.choose(overlap_frames=6)
    assert model.result is None


@pytest.mark.parametrize(
    ("how", "why"), [("refused", "It cannot be."), ("silent", "the disk is full")]
)
def test_what_goes_wrong_is_said(made, people, qtbot, how: str, why: str) -> None:
    model = made(how)
    model.begin(people)
    counted(model, qtbot)
    with qtbot.waitSignal(model.failed, timeout=20_000) as failed:
        model.start(people / "set.zarr")
    assert failed.args == [why]
    assert model.result is None


def test_it_can_be_stopped(made, people, qtbot) -> None:
    model = made("slow")
    model.begin(people)
    counted(model, qtbot)
    said: list[str] = []
    model.failed.connect(said.append)
    model.start(people / "set.zarr")
    qtbot.waitUntil(lambda: model.run is not None and model.run.history.done == 500, timeout=20_000)
    model.tell("stop")
    qtbot.waitUntil(lambda: not model.under_way, timeout=20_000)
    assert not said
    assert model.ready


def begun(model: ExportModel, people: Path, qtbot) -> None:
    model.begin(people)
    model.choose(segment_frames=30, overlap_frames=5, kinds=MAPS["synthetic"], subjects=("a", "b"))
    counted(model, qtbot)
    model.start(people / "set.h5")
    qtbot.waitUntil(lambda: model.run is not None and model.run.history.done == 500, timeout=20_000)


def test_it_outlives_the_window_and_is_found_by_the_next(made, people, qtbot) -> None:
    first, second = made("slow"), made()
    begun(first, people, qtbot)
    choice = first.choice
    first.close()
    with qtbot.waitSignal(second.noted, timeout=20_000) as noted:
        second.look_for_runs()
    assert noted.args[0].startswith("set.h5 is under way.")
    assert second.under_way
    assert second.choice == choice
    qtbot.waitUntil(
        lambda: second.run is not None and second.run.history.done == 500, timeout=20_000
    )
    counted(second, qtbot)
    assert second.forecast is not None
    assert not second.ready
    (people / "set.h5.go").touch()
    qtbot.waitUntil(lambda: not second.under_way, timeout=20_000)
    assert second.result.segments == 7
    third = made()
    with qtbot.waitSignal(third._lister.finished, timeout=20_000):
        third.look_for_runs()
    assert not third.under_way


def test_what_was_written_meanwhile_is_said(made, people, qtbot, tmp_path) -> None:
    first, second = made("slow"), made()
    begun(first, people, qtbot)
    first.close()
    (people / "set.h5.go").touch()
    (folder,) = map(CommandFolder, (tmp_path / "exports").iterdir())
    # Its code is there a moment before its process has ended.
    qtbot.waitUntil(
        lambda: folder.facts.get("code") is not None and not folder.live, timeout=20_000
    )
    said: list[str] = []
    second.noted.connect(said.append)
    second.look_for_runs()
    qtbot.waitUntil(lambda: bool(said), timeout=20_000)
    assert not second.under_way
    assert said == [f"7 segments from 2 views are in {people / 'set.h5'}."]


def test_one_that_was_killed_is_said(made, people, qtbot) -> None:
    model = made("slow")
    begun(model, people, qtbot)
    os.kill(model.run.process.pid, signal.SIGKILL)
    with qtbot.waitSignal(model.failed, timeout=20_000) as failed:
        pass
    assert failed.args[0].startswith("set.h5 was not written to its end")
    assert model.ready


def test_one_that_cannot_be_started_is_said(made, people, qtbot) -> None:
    model = made(program="/no/such/program")
    model.begin(people)
    counted(model, qtbot)
    with qtbot.waitSignal(model.failed, timeout=20_000) as failed:
        model.start(people / "set.h5")
    assert "cannot be started" in failed.args[0]
    assert not model.under_way
    with qtbot.waitSignal(model._lister.finished, timeout=20_000):
        model.look_for_runs()
    assert not model.under_way


def test_lines_that_say_nothing_are_left_alone(qtbot, tmp_path) -> None:
    run = ExportRun(tmp_path)
    for told in ({}, {"event": "else"}, {"event": "done"}, {"event": []}):
        assert not run.history.take([told])
    assert run.history.written is None
    run.close()


def test_inertial_sensors_of_the_recordings_are_offered(made, tmp_path: Path, qtbot) -> None:
    (tmp_path / "people").mkdir()
    save_mesh(turning_body(60), tmp_path / "body.npz")
    for name, places in (("anna", ("right-wrist", "17", "head")), ("ben", ("chest",))):
        one = Recording.create(tmp_path / "people" / f"{name}.sd2", mesh=tmp_path / "body.npz")
        one.imu_places = places
        one.save()
    model = made()
    model.begin(tmp_path / "people")
    assert model.imu_places == ("head", "chest", "right-wrist")  # vertices have no names
    assert inertial_words(model.imu_places) == "at head, chest, right wrist"
    model.choose(segment_frames=20, overlap_frames=0)
    counted(model, qtbot)
    without = model.forecast.total_bytes
    model.choose(imu=model.imu_places)
    counted(model, qtbot)
    # Six numbers of four bytes for each sensor and frame.
    assert model.forecast.total_bytes - without == model.forecast.segments * 20 * 3 * 6 * 4
    out = tmp_path / "set.zarr"
    model.start(out)
    qtbot.waitUntil(lambda: not model.under_way, timeout=20_000)
    words = json.loads(out.with_name("set.zarr.asked").read_text())
    assert words[words.index("--imu") + 1] == "head,chest,right-wrist"
    model.begin(tmp_path / "people" / "ben.sd2")
    assert model.choice.imu == ("chest",)


def test_sensors_in_words() -> None:
    assert inertial_words(()) == "none placed"
    assert inertial_words(PLACES[:6]).endswith(" and 2 more")
