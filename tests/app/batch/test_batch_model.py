"""Batches of the window, without a window; the work itself is pretended."""

from __future__ import annotations

import glob
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sd2app.background import run_monitor
from sd2app.batch.model import BatchModel
from sd2app.batch.run import (
    BatchMonitor,
    batch_time_text,
    estimate_facts,
    estimate_headline,
    headline,
    plan_of,
    step_facts,
    unusable_text,
)
from sd2app.batch.setup import FORMATS, BatchSetupModel
from sd2app.settings import Settings
from sd2core.batch.estimate import BatchEstimate, StepEstimate
from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan import BatchPlan, Recordings
from sd2core.batch.plan_file import read_plan, write_plan
from sd2core.errors import Sd2Error
from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.synthesis import Synthesis
from sd2core.placements.placements import PlacementGrid
from sd2core.processes import ProcessId
from sd2core.timebase import Timebase

FAKE = Path(__file__).resolve().parents[2] / "fake_batch.py"


@pytest.fixture(autouse=True)
def quick(monkeypatch) -> None:
    """Look more often than a person would."""
    monkeypatch.setattr(run_monitor, "POLL_MS", 30)


@pytest.fixture
def meshes(tmp_path) -> list[Path]:
    """Three small meshes in a folder with a bracket in its name."""
    folder = tmp_path / "people [1]"
    folder.mkdir()
    files = [folder / f"{name}.npz" for name in ("ann", "ben", "cleo")]
    for file in files:
        save_mesh(MeshSequence(np.ones((3, 4, 3), "f4"), None, Timebase.regular(3, 30.0)), file)
    return files


@pytest.fixture
def made(qtbot):
    models: list[BatchModel] = []

    def make(*options: object, settings: Settings | None = None) -> BatchModel:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        models.append(BatchModel(settings or Settings.forgetful(), None, command))
        return models[-1]

    yield make
    for model in models:
        run = model.run
        if run is not None and run.under_way and run.folder.exists:
            pid = run.folder.status().pid
            if run.folder.live and pid:
                os.kill(pid, signal.SIGKILL)
        model.close()


def looked(qtbot, setup: BatchSetupModel) -> None:
    qtbot.waitUntil(lambda: all(e.count is not None or e.problem for e in setup.data))


def begin(qtbot, model: BatchModel, files: list[Path]) -> None:
    model.setup.add(*files)
    looked(qtbot, model.setup)
    model.ask_estimate()
    qtbot.waitUntil(lambda: not model.why_not_start, timeout=20_000)
    model.start()


def until(qtbot, model: BatchModel, phase: str) -> None:
    qtbot.waitUntil(
        lambda: model.run is not None and model.run.loaded and model.run.phase == phase,
        timeout=20_000,
    )


# Setting up


def test_what_is_added_is_looked_at_and_becomes_a_plan(qtbot, meshes, tmp_path):
    setup = BatchSetupModel(Settings.forgetful())
    assert setup.problem == "Add recordings to work on."
    setup.add(*meshes[:2], meshes[0])
    looked(qtbot, setup)
    assert [entry.path for entry in setup.data] == meshes[:2]
    assert sum(one.count or 0 for one in setup.data) == 2
    plan = setup.plan()
    assert plan.recordings.files == tuple(map(str, meshes[:2]))
    assert plan.out == str(meshes[0].parent / "ann batch")
    assert plan.placements == {"kind": "recording"}
    assert plan.synthesise.tolerance is None
    setup.set_value("accuracy", "tolerance")
    assert setup.plan().synthesise.tolerance == setup.tolerance
    for form in FORMATS:
        setup.set_value("format", form)
        assert setup.plan().export.format == form
    setup.set_value("denoise", False)
    setup.set_value("export", False)
    setup.set_out(tmp_path / "made")
    setup.set_placements(PlacementGrid((1.0, 2.0)))
    plan = setup.plan()
    assert plan.denoise is plan.export is None
    assert plan.out == str(tmp_path / "made")
    assert plan.placement_count == 2
    setup.remove(meshes[0])
    assert setup.plan().recordings.files == (str(meshes[1]),)
    setup.close()


def test_a_folder_stands_for_the_recordings_below_it(qtbot, tmp_path):
    folder = tmp_path / "all [1]"
    for name in ("one/a.sd2", "two/b.sd2"):
        (folder / name).mkdir(parents=True)
        (folder / name / "recording.json").write_text("{}")
    (folder / "one" / "walk.mp4").write_bytes(b"")
    setup = BatchSetupModel(Settings.forgetful())
    setup.add(folder)
    looked(qtbot, setup)
    assert sum(one.count or 0 for one in setup.data) == 2
    (pattern,) = setup.plan().recordings.files
    assert sorted(glob.glob(pattern, recursive=True)) == [
        str(folder / "one" / "a.sd2"),
        str(folder / "two" / "b.sd2"),
    ]
    setup.close()


def test_what_cannot_be_worked_on_is_said(qtbot, tmp_path):
    setup = BatchSetupModel(Settings.forgetful())
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "nothing").mkdir()
    for name, words in (
        ("notes.txt", "is empty"),
        ("nowhere", "does not exist"),
        ("nothing", "nothing"),
    ):
        setup.add(tmp_path / name)
        looked(qtbot, setup)
        assert words in setup.problem
        with pytest.raises(Sd2Error, match=words):
            setup.plan()
        setup.remove(tmp_path / name)
    setup.close()


def test_choices_are_kept_from_one_start_to_the_next(qtbot, meshes, tmp_path):
    settings = Settings.forgetful()
    first = BatchSetupModel(settings)
    first.add(*meshes)
    first.set_out(tmp_path / "made")
    first.set_value("format", "h5")
    first.set_value("fit", False)
    first.set_value("workers", 1)
    first.close()
    again = BatchSetupModel(settings)
    looked(qtbot, again)
    assert [entry.path for entry in again.data] == meshes
    assert (again.out, again.workers) == (tmp_path / "made", 1)
    assert (again.value("format"), again.value("fit"), again.value("denoise")) == (
        "h5",
        False,
        True,
    )
    again.set_value("workers", 10_000)
    assert again.workers < 10_000
    again.close()
    settings.set_value("batch/format", "nonsense")
    odd = BatchSetupModel(settings)
    assert odd.value("format") == "zarr"
    odd.close()


def test_a_start_waits_for_the_estimate_of_what_is_set_up(qtbot, made, meshes):
    model = made()
    assert "Add recordings" in model.why_not_start
    model.setup.add(*meshes)
    looked(qtbot, model.setup)
    assert "have not been counted" in model.why_not_start
    with pytest.raises(Sd2Error, match="have not been counted"):
        model.start()
    model.ask_estimate()
    assert "Working out" in model.why_not_start
    qtbot.waitUntil(lambda: not model.why_not_start, timeout=20_000)
    assert estimate_headline(model.estimate) == (
        "3 recordings: the first tasks tell how long it takes, at most 4.6 kB"
    )
    assert estimate_facts(model.estimate) == [
        ("Look at recordings", "3 to do"),
        ("Synthesise", "3 to do · at most 1.2 kB"),
        ("Denoise", "3 to do · at most 1.2 kB"),
        ("Export", "1 to do · at most 2.3 kB"),
    ]
    assert unusable_text(model.estimate) == ""
    model.setup.set_value("denoise", False)
    assert "have not been counted" in model.why_not_start


def test_an_estimate_in_words():
    synthesise = StepEstimate(there=1, to_do=4, frames=120, seconds=180.0, bytes=2_000_000)
    made = BatchEstimate(
        3, 2, 2, {"inspect": StepEstimate(there=2), "synthesise": synthesise},
        ["a.npz: It is damaged.", "b.npz: It is not there."],
    )  # fmt: skip
    assert estimate_headline(made) == "3 recordings: about 2 min on 2 workers, at most 2 MB"
    assert estimate_facts(made) == [
        ("Look at recordings", "0 to do · 2 there already"),
        ("Synthesise", "4 to do · 1 there already · about 3 min · at most 2 MB"),
        ("Looked at", "2; the others are taken to be like them"),
    ]
    assert unusable_text(made) == "Cannot be used: a.npz: It is damaged. (1 more cannot, either.)"
    synthesise.to_do = 0
    assert estimate_headline(made) == "3 recordings: all of it is there already"


def test_a_refused_estimate_is_said(qtbot, made, meshes):
    model = made()
    model.setup.add(*meshes)
    model.setup.set_value("model", "nobody's")
    looked(qtbot, model.setup)
    model.ask_estimate()
    qtbot.waitUntil(lambda: model.refused, timeout=20_000)
    assert "There is no model called" in model.why_not_start


# Following


def test_a_batch_runs_to_its_end_and_its_results_are_listed(qtbot, made, meshes):
    model = made("--fail", 1)
    said: list[str] = []
    model.noted.connect(said.append)
    begin(qtbot, model, meshes)
    until(qtbot, model, "finished")
    run = model.run
    assert read_plan(run.folder.plan).recordings.files == tuple(map(str, meshes))
    assert headline(run) == "Finished, but 1 task could not be done"
    assert step_facts(run) == [
        ("Look at recordings", 2, 3, "2 of 3"),
        ("Synthesise", 2, 3, "2 of 3"),
        ("Denoise", 2, 3, "2 of 3"),
    ]
    assert batch_time_text(run) == "took 1:30"
    assert run.history.failures[0] == (
        "ann.npz, synthesise from place 2: It is damaged. Expected: a mesh. Make it again."
    )
    # What only served to start it is gone.
    assert not run.folder.output.exists()
    assert not plan_of(run.folder.path).exists()
    assert run.facts.splitlines() == [f"looked at {file.name}" for file in meshes]
    qtbot.waitUntil(lambda: bool(model.results.rows))
    # One row per map, of two stretches each.
    assert [(row.recording, row.placement) for row in model.results.rows] == [
        ("ben.npz", 1), ("ben.npz", 2), ("cleo.npz", 1), ("cleo.npz", 2),
    ]  # fmt: skip
    assert model.results.card == "# A data set"
    index = model.results.index
    assert [model.results.data(index(1, column)) for column in range(5)] == [
        "ben.npz", "ben", "2", "1 m, azimuth 90°, elevation 0°", "synthetic, denoised",
    ]  # fmt: skip
    assert len(said) == 1
    assert "1 task could not be done" in said[0]
    # The same, or more, in the same folder replaces nothing; another recording alone does.
    model.setup.set_out(run.folder.path)
    assert not model.replaces
    model.setup.remove(meshes[0])
    assert model.replaces


@pytest.mark.slow
def test_a_batch_outlives_the_model_and_is_found_again(qtbot, made, meshes):
    settings = Settings.forgetful()
    first = made("--step-s", 1.0, settings=settings)
    begin(qtbot, first, meshes)
    until(qtbot, first, "running")
    # Its process is there before it has said what it does.
    qtbot.waitUntil(lambda: first.run.folder.exists, timeout=20_000)
    first.close()
    second = made(settings=settings)
    said: list[str] = []
    second.noted.connect(said.append)
    second.look_for_runs()
    until(qtbot, second, "running")
    assert any("is under way" in words for words in said)
    until(qtbot, second, "finished")
    assert any("is done" in words for words in said)


@pytest.mark.slow
def test_stop_keeps_what_is_done_and_the_same_goes_on(qtbot, made, meshes):
    model = made("--step-s", 0.3)
    begin(qtbot, model, meshes)
    until(qtbot, model, "running")
    model.tell("stop")
    assert model.run.phase == "stopping"
    until(qtbot, model, "stopped")
    assert model.run.resumable
    model.resume()
    until(qtbot, model, "finished")
    assert not model.run.history.failures


def test_a_stop_before_there_is_a_folder_is_heard(qtbot, made, meshes):
    model = made("--slow-start-s", 1.0, "--step-s", 5)
    model.setup.add(*meshes)
    looked(qtbot, model.setup)
    model.ask_estimate()
    qtbot.waitUntil(lambda: not model.why_not_start, timeout=20_000)
    model.start()
    model.tell("stop")
    until(qtbot, model, "stopped")


@pytest.mark.parametrize(
    ("options", "phase", "words"),
    [
        (("--break", "The scheduler is away"), "failed", "The scheduler is away"),
        (("--die-at", "2"), "died", ""),
    ],
)
def test_a_batch_that_breaks_says_why(qtbot, made, meshes, options, phase, words):
    model = made(*options)
    said: list[str] = []
    model.failed.connect(said.append)
    begin(qtbot, model, meshes)
    until(qtbot, model, phase)
    assert words in model.run.text
    assert any("did not come to its end" in one for one in said)
    assert model.run.resumable


def test_a_batch_that_is_refused_says_what_it_was_told(qtbot, made, meshes, tmp_path):
    model = made()
    model.setup.set_out(tmp_path / "other")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("mine")
    begin(qtbot, model, meshes)
    until(qtbot, model, "failed")
    assert "is not the folder of a batch" in model.run.text
    assert BatchFolder(tmp_path / "other").output.exists()
    assert (tmp_path / "other" / "thesis.txt").read_text() == "mine"


def test_two_are_not_started_in_one_folder(qtbot, made, meshes, tmp_path):
    model = made("--step-s", 30)
    begin(qtbot, model, meshes)
    qtbot.waitUntil(lambda: model.run.folder.exists, timeout=20_000)
    model.select(None)
    model.ask_estimate()
    qtbot.waitUntil(lambda: not model.why_not_start, timeout=20_000)
    with pytest.raises(Sd2Error, match="A process is at work"):
        model.start()
    model.open_run(meshes[0].parent / "ann batch")
    until(qtbot, model, "running")
    with pytest.raises(Sd2Error, match="no folder of a batch"):
        model.open_run(tmp_path)


def test_a_batch_that_was_deleted_is_looked_at_no_more(qtbot, made, meshes):
    model = made()
    begin(qtbot, model, meshes)
    until(qtbot, model, "finished")
    shutil.rmtree(model.run.folder.path)
    qtbot.waitUntil(lambda: model.run is None, timeout=20_000)
    assert not BatchFolder(meshes[0].parent / "ann batch").exists


def test_a_batch_that_was_too_quick_to_be_seen_at_work_is_told_from_one_that_was_refused(
    qtbot, meshes, tmp_path
):
    out = tmp_path / "made"
    write_plan(
        plan_of(out),
        BatchPlan(
            out=str(out), recordings=Recordings(files=(str(meshes[0]),)), synthesise=Synthesis()
        ),
    )
    command = [sys.executable, str(FAKE), "batch", str(plan_of(out)), "--workers", "1"]
    process = subprocess.Popen(command)
    started = ProcessId.of(process.pid)
    assert process.wait() == 0
    # The same number, of a process that was started later: what is there is not of it.
    another = ProcessId(started.pid, started.started_unix_s + 60.0)
    for launched, phase in ((started, "finished"), (another, "failed")):
        follower = BatchMonitor(out, process=launched)
        qtbot.waitUntil(lambda f=follower: f.loaded, timeout=20_000)
        assert follower.phase == phase
        if phase == "finished":
            shutil.move(out, tmp_path / "elsewhere")
            qtbot.waitUntil(lambda f=follower: f.phase == "gone", timeout=20_000)
            shutil.move(tmp_path / "elsewhere", out)
        follower.close()
