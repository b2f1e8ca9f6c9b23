"""Studies beside the window, by a command that learns nothing."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import fake_class_command
import pytest
from small_pairs import write_pairs

from sd2app.classify.run import ClassSetup
from sd2app.settings import Settings
from sd2app.study.runs import SWITCHES, StudyRuns
from sd2core.errors import Sd2Error

FAKE = (sys.executable, "-u", fake_class_command.__file__)


@pytest.fixture
def studies(qtbot, tmp_path):
    settings, made = Settings.forgetful(), []
    data = write_pairs(tmp_path / "campaign.zarr")
    setup = ClassSetup(settings, None)

    def runs(*more: str) -> StudyRuns:
        made.append(StudyRuns(settings, setup, None, tmp_path / "kept", (*FAKE, *more)))
        return made[-1]

    def ready() -> None:
        setup.add(data)
        qtbot.waitUntil(lambda: not setup.problem, timeout=10_000)

    def ended(model: StudyRuns) -> None:
        qtbot.waitUntil(lambda: model.run is None or not model.run.under_way, timeout=20_000)

    yield SimpleNamespace(runs=runs, ready=ready, ended=ended, data=data, folder=tmp_path)
    for one in made:
        if one.under_way:
            one.run.tell("cancel")
            ended(one)
        one.close()
    setup.close()


def plan_in(folder: Path) -> Path:
    path = folder / "mine.toml"
    path.write_text('title = "t"\nout = "made"\ndata = ["campaign.zarr"]\n')
    return path


def test_what_is_set_up_is_a_command_of_the_program(studies):
    from sd2app.command_line import full_parser

    model = studies.runs()
    assert model.why_not == "Add labelled data to learn from."
    with pytest.raises(Sd2Error, match="Add labelled data"):
        model.begin()
    studies.ready()
    words = model.arguments(Path("t"))
    assert words == [
        "classify", "table", str(studies.data), "--out", "t", "--quick", "--steps", "300",
    ]  # fmt: skip
    for name in SWITCHES:
        model.turn(name, True)
    words = model.arguments(Path("t"))
    assert words[5:8] == ["--quick", "--radar-only", "--same-people"]
    full_parser().parse_args([*words, "--progress-json"])
    assert all(map(studies.runs().is_on, SWITCHES))  # remembered


def test_a_study_is_followed_to_what_it_found(studies, qtbot):
    model = studies.runs()
    studies.ready()
    model.begin()
    assert "under way" in model.why_not
    studies.ended(model)
    assert model.run.phase == "finished"
    assert model.run.history.total == 6
    assert model.run.conclusion == "It helped."
    assert model.run.result.name == "study.json"
    qtbot.waitUntil(lambda: len(model.known) == 1, timeout=5_000)
    model.delete()
    assert model.run is None


def test_a_plan_is_run_where_it_says(studies):
    model = studies.runs()
    model.begin_plan(plan_in(studies.folder))
    studies.ended(model)
    assert model.run.result == studies.folder / "made" / "study.json"
    assert model.run.about["arguments"][0] == "study"
    # Deleting the run leaves what the plan made.
    model.delete()
    assert (studies.folder / "made" / "study.json").is_file()


def test_a_plan_that_is_wrong_is_not_begun(studies):
    path = plan_in(studies.folder)
    path.write_text(path.read_text() + "luck = 1\n")
    with pytest.raises(Sd2Error, match="luck is not known"):
        studies.runs().begin_plan(path)


@pytest.mark.slow
def test_a_study_that_was_stopped_goes_on_in_its_folder(studies, qtbot):
    model = studies.runs("--step-s", "0.5")
    studies.ready()
    model.begin()
    qtbot.waitUntil(lambda: model.run.history.done >= 1, timeout=20_000)
    model.run.tell("stop")
    studies.ended(model)
    assert model.run.result is None
    folder = model.run.folder.path
    model._command = FAKE
    model.again()
    studies.ended(model)
    assert model.run.folder.path == folder
    assert model.run.phase == "finished"
