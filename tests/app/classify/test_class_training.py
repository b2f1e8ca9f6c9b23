"""Classifiers trained beside the window, by a command that learns nothing."""

from __future__ import annotations

import shutil
import signal
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fake_class_command
import pytest
from scenes_of_people import scene
from small_pairs import write_pairs

from sd2app.classify.feature import recall_text
from sd2app.classify.model import note, run_headline
from sd2app.classify.run import ClassSetup, ClassTraining
from sd2app.command_line import full_parser, main
from sd2app.settings import Settings
from sd2app.training.run import division_text
from sd2app.widgets.run_text import time_text
from sd2core.classify.defaults import WIDTH, pace_kind
from sd2core.cli.classify.comparison import Table
from sd2core.cli.classify.train import Train
from sd2core.cli.command_parser import record_of
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.labels.field_edits import rename_persons
from sd2core.plug_ins import Group
from sd2core.runs.command_folder import CommandFolder, last_output
from sd2core.runs.pace import keep_pace
from sd2core.runs.progress import ProgressTail

SAMPLE = resource_path("swipes.sd2")
FAKE = (sys.executable, "-u", fake_class_command.__file__)


@pytest.fixture
def set_up(qtbot, tmp_path):
    settings, made, used = Settings.forgetful(), [], []
    data = write_pairs(tmp_path / "campaign.zarr")

    def training(*more: str) -> ClassTraining:
        command = (*FAKE, *more)
        folder = tmp_path / "classifiers"
        made.append(ClassTraining(settings, used.append, None, folder, command))
        return made[-1]

    def ready(model: ClassTraining) -> None:
        model.setup.add(data)
        qtbot.waitUntil(lambda: not model.setup.problem, timeout=10_000)

    def ended(model: ClassTraining) -> None:
        qtbot.waitUntil(lambda: model.run is None or not model.run.under_way, timeout=20_000)

    yield SimpleNamespace(training=training, ready=ready, ended=ended, used=used, data=data)
    for one in made:
        if one.under_way:
            one.run.tell("cancel")
            ended(one)
        one.close()


def typed(words: list[str]) -> object:
    """The command that words are understood as."""
    return record_of(full_parser().parse_args(words))


@pytest.mark.parametrize(("kept", "is_"), [("s4", "s4"), ("of-none", Train.model)])
def test_plug_ins_are_looked_for_only_where_a_kept_name_is_unknown(monkeypatch, kept, is_):
    settings, looked = Settings.forgetful(), []
    settings.set_value("classify/train/model", kept)
    monkeypatch.setattr(Group, "entries", property(lambda group: looked.append(group.name) or ()))
    setup = ClassSetup(settings, None)
    assert setup.value("model") == is_
    assert looked == ([] if kept == is_ else ["classifiers"])
    setup.close()


def test_what_is_set_up_is_the_command(set_up):
    model = set_up.training()
    assert model.why_not_train == "Add labelled data to learn from."
    set_up.ready(model)
    (source,) = model.setup.data
    assert source.text.startswith("pairs (simulated) · 3 people")
    out = Path("m.safetensors")
    data = str(set_up.data)
    # Network and steps are named even where they are as by default.
    assert model.setup.train_arguments(out) == [
        "classify", "train", data, "--out", "m.safetensors", "--steps", "300", "--model", "lstm",
    ]  # fmt: skip
    model.setup.set_value("model", "s4")
    model.setup.set_value("features", "peak")
    model.setup.set_value("width", 16)
    model.setup.set_value("delay_s", 0.25)
    model.setup.set_value("steps", 50)
    model.setup.set_value("seed", 7)
    model.setup.set_map("denoised", True)
    network = {"model": "s4", "features": "peak", "width": 16, "delay_s": 0.25, "steps": 50}
    sources = (LabelledSource(set_up.data),)
    chosen = Train(data=sources, out=out, maps="radar,denoised", seed=7, **network)
    assert typed(model.setup.train_arguments(out)) == chosen
    assert model.command.startswith("sd2 classify train")
    # A study takes its seeds and maps itself.
    table = Table(data=sources, out=Path("t"), quick=True, **network)
    assert typed(model.setup.table(Path("t"), quick=True, radar_only=False)) == table
    for name in ("radar", "denoised"):
        model.setup.set_map(name, False)
    assert model.why_not_train == "Choose maps to learn from."
    assert not model.setup.problem
    # All of it is there the next time.
    again = set_up.training().setup
    assert [one.path for one in again.data] == [set_up.data]
    assert (again.value("model"), again.value("seed"), again.maps) == ("s4", 7, ())


def test_the_command_is_one_that_the_program_has(set_up):
    from sd2core.classify.training import TrainOptions

    model = set_up.training()
    # The window may not ask for them: that would load torch.
    assert model.setup.value("steps") == TrainOptions().steps
    set_up.ready(model)
    for words in (
        model.setup.train_arguments(Path("m.safetensors")),
        model.setup.table(Path("t")),
    ):
        full_parser().parse_args([*words, "--progress-json"])


def known(model, qtbot) -> None:
    qtbot.waitUntil(lambda: all(one.facts for one in model.setup.data), timeout=10_000)


def test_recordings_have_persons_who_can_be_named(set_up, tmp_path, qtbot):
    setup = (model := set_up.training()).setup
    for name in ("a.sd2", "b.sd2"):
        shutil.copytree(SAMPLE, tmp_path / name)
        setup.add(tmp_path / name)
    known(model, qtbot)
    assert [one.nameable for one in setup.data] == [True, True]
    assert "labels" in setup.data[0].text
    assert (setup.division.training, setup.division.validation) == (("a",), ("b",))
    setup.name_person(tmp_path / "b.sd2", " be=n ")
    known(model, qtbot)
    assert (setup.division.training, setup.division.validation) == (("a",), ("be-n",))
    words = setup.train_arguments(Path("m.safetensors"))
    assert words[2:4] == [str(tmp_path / "a.sd2"), f"be-n={tmp_path / 'b.sd2'}"]
    again = set_up.training().setup
    assert [one.person for one in again.data] == ["", "be-n"]
    setup.name_person(tmp_path / "b.sd2", "a")
    known(model, qtbot)
    assert setup.division.by_take


def test_who_is_learnt_from_is_who_the_command_learns_from(set_up, tmp_path, qtbot):
    from sd2core.classify.splitting import split_clips
    from sd2core.cli.classify.data import clips_of

    setup = (model := set_up.training()).setup
    for path in (set_up.data, write_pairs(tmp_path / "more.zarr", ("s3", "s4"))):
        setup.add(path)
    known(model, qtbot)
    command = typed(setup.train_arguments(tmp_path / "m.safetensors"))
    parts = split_clips(clips_of(command.data, ("radar",))).to_json()
    division = setup.division
    assert parts["training"] == list(division.training)
    assert parts["validation"] == list(division.validation)
    assert parts["test"] == list(division.test)
    words = division_text(division, "sd2 classify eval")
    assert words.endswith("s4 kept for sd2 classify eval.")


def test_two_recordings_of_one_name_show_others_here_as_for_the_command(set_up, tmp_path, qtbot):
    from sd2core.cli.classify.data import clips_of

    setup = (model := set_up.training()).setup
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        made = scene(tmp_path / folder / "walk.sd2")
        made.subject, made.bodies = "", (replace(made.bodies[0], person=""),)
        made.labels = rename_persons(
            made.labels, dict(zip(("anna", "bert"), made.persons, strict=True))
        ).labels
        made.save()
        setup.add(made.folder)
    known(model, qtbot)
    division = setup.division
    people = {*division.training, *division.validation, *division.test}
    data = typed(setup.train_arguments(tmp_path / "m.safetensors")).data
    assert people == {*clips_of(data, ("synthetic",)).subjects}
    assert len(people) == 4


def test_what_does_not_go_together_is_named(set_up, tmp_path, qtbot):
    setup = (model := set_up.training()).setup
    set_up.ready(model)
    setup.add(write_pairs(tmp_path / "faster.zarr", rate_hz=60.0))
    known(model, qtbot)
    assert "60 frames/s" in setup.problem
    assert setup.division is None
    setup.remove(tmp_path / "faster.zarr")
    out = tmp_path / "set.zarr"
    export = ["export", str(set_up.data), "--kinds", "simulated", "--out", str(out)]
    assert main(export) == 0
    setup.remove(set_up.data)
    setup.add(out)
    known(model, qtbot)
    assert not model.why_not_train
    setup.set_map("denoised", True)
    assert model.why_not_train == "set.zarr has no denoised maps: choose others, or leave it out."
    assert not model.setup.problem


def test_how_long_it_takes_is_known_once_it_was_measured(set_up):
    model = set_up.training()
    set_up.ready(model)
    assert model.setup.step_s is None
    keep_pace(pace_kind("lstm", "columns", WIDTH), 40.0, 20)
    assert model.setup.step_s == pytest.approx(2.0)
    model.setup.set_value("model", "s4")
    assert model.setup.step_s is None


def test_what_cannot_be_learnt_from_is_named(set_up, tmp_path, qtbot):
    model = set_up.training()
    other = tmp_path / "notes.txt"
    other.write_text("no data")
    model.setup.add(other)
    qtbot.waitUntil(lambda: "notes.txt" in model.setup.problem, timeout=10_000)
    model.setup.remove(other)
    assert model.setup.problem == "Add labelled data to learn from."


def test_a_training_is_followed_to_its_end_and_its_model_is_used(set_up, qtbot):
    model = set_up.training()
    set_up.ready(model)
    model.train()
    assert model.why_not_train.endswith("Wait for it, or stop it.")
    with pytest.raises(Sd2Error, match="is under way"):
        model.train()
    set_up.ended(model)
    run = model.run
    assert run.phase == "finished"
    assert run_headline(run) == "Finished"
    assert [step for step, _ in run.history.losses] == list(range(1, 7))
    assert [(one.recall, one.best) for one in run.history.checks] == [
        (0.5, True), (0.8, True), (0.7, False),
    ]  # fmt: skip
    assert recall_text(run.history.best) == "80.0 %, at step 4"
    assert time_text(run) == "took 0:12"
    assert not model.in_use
    model.use_model()
    (kept,) = set_up.used
    assert kept.read_bytes() == b"a model"
    assert kept.parent.name == "classifiers"
    assert model.in_use
    # Deleting the run leaves what is in use.
    model.delete()
    assert model.run is None
    qtbot.waitUntil(lambda: model.known == (), timeout=5_000)
    assert kept.exists()


@pytest.mark.slow
def test_time_left_is_told_from_what_it_took(set_up, qtbot):
    model = set_up.training("--step-s", "0.5")
    set_up.ready(model)
    model.train()
    qtbot.waitUntil(lambda: model.run.history.done >= 3, timeout=20_000)
    history = model.run.history
    # Two seconds a step, as it says.
    assert history.left_s == pytest.approx(2.0 * (fake_class_command.STEPS - history.done))
    assert model.mark == f"{100 * history.done / fake_class_command.STEPS:.0f} %"
    assert run_headline(model.run) == f"Training: step {history.done} of 6"


@pytest.mark.slow
def test_stop_keeps_the_best(set_up, qtbot):
    model = set_up.training("--step-s", "0.5")
    set_up.ready(model)
    model.train()
    qtbot.waitUntil(lambda: model.run.history.done >= 1, timeout=20_000)
    model.run.tell("stop")
    assert model.run.phase == "stopping"
    set_up.ended(model)
    assert model.run.phase == "stopped"
    assert model.run.history.done < fake_class_command.STEPS
    assert note(model.run) == "The best so far is kept."
    assert model.run.result.is_file()


@pytest.mark.slow
def test_cancel_deletes_what_it_made(set_up, qtbot):
    model = set_up.training("--step-s", "0.5")
    set_up.ready(model)
    model.train()
    folder = model.run.folder.path
    qtbot.waitUntil(lambda: model.run.history.begun, timeout=20_000)
    model.run.tell("cancel")
    qtbot.waitUntil(lambda: model.run is None, timeout=20_000)
    assert not folder.exists()


def test_one_that_fails_says_why(set_up, qtbot):
    model = set_up.training("--fail", "There is no labelled frame to learn from.")
    set_up.ready(model)
    with qtbot.waitSignal(model.failed, timeout=20_000):
        model.train()
    assert model.run.phase == "failed"
    assert model.run.text == "There is no labelled frame to learn from."
    assert model.run.result is None


def test_one_that_is_killed_is_not_taken_for_one_under_way(set_up):
    model = set_up.training("--die-at", "3")
    set_up.ready(model)
    model.train()
    set_up.ended(model)
    assert model.run.phase == "died"
    assert not model.why_not_train


@pytest.mark.slow
def test_another_window_finds_what_is_under_way(set_up, qtbot):
    first = set_up.training("--step-s", "0.5")
    set_up.ready(first)
    first.train()
    qtbot.waitUntil(lambda: first.run.history.begun, timeout=20_000)
    second = set_up.training()
    with qtbot.waitSignal(second.noted, timeout=20_000):
        second.look_for_runs()
    qtbot.waitUntil(lambda: second.run.phase == "running", timeout=20_000)
    second.run.tell("stop")
    set_up.ended(first)
    assert first.run.phase == "stopped"


@pytest.mark.slow
def test_a_real_command_is_stopped_as_by_ctrl_c(set_up, tmp_path, qtbot):
    folder = CommandFolder(tmp_path / "run")
    out = tmp_path / "c.safetensors"
    words = ["classify", "train", str(set_up.data), "--out", str(out)]
    endless = ["--steps", "100000", "--patience", "100000"]
    # As it is for whoever was started in the background of a script.
    heeded = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        folder.start([*words, *endless, "--progress-json"], {"what": "train"})
    finally:
        signal.signal(signal.SIGINT, heeded)
    lines, seen = ProgressTail(folder.progress), []

    def stepped() -> bool:
        seen.extend(event["event"] for event in lines.new())
        return "step" in seen or not (folder.live or folder.facts.get("code") is None)

    qtbot.waitUntil(stepped, timeout=60_000)
    folder.tell("stop")
    qtbot.waitUntil(lambda: folder.facts.get("code") is not None, timeout=60_000)
    assert folder.facts.get("code") == 130, last_output(folder.output)
    assert out.is_file()
    from sd2core.classify.files import describe_classifier

    card = describe_classifier(out)
    assert card.about["command"].startswith("sd2 classify train")


def test_a_command_that_is_refused_says_so(tmp_path, qtbot):
    folder = CommandFolder(tmp_path / "run")
    gone = str(tmp_path / "gone.zarr")
    folder.start(["info", gone], {"what": "train"})
    qtbot.waitUntil(lambda: folder.facts.get("code") is not None, timeout=60_000)
    assert folder.facts.get("code") == 1
    assert "gone.zarr" in last_output(folder.output)
