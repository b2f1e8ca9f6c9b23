"""A study from its plan to its page: stopped, continued, nothing left out without a word."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copyfile

import numpy as np
import pytest
from small_pairs import write_pairs

from sd2core.cli import build_parser, run
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, find_model, load_model, save_model
from sd2core.errors import Sd2Error
from sd2core.pairs.labelling import TakeLabel, label_pairs
from sd2core.study import run as study_run
from sd2core.study import trial
from sd2core.study.plan import Denoiser, Learner, read_study
from sd2core.study.report import findings_of, untried, write_report
from sd2core.study.run import run_study
from sd2core.study.trial import REAL
from sd2core.train.config import read_config


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    pairs = write_pairs(tmp_path / "pairs.zarr", takes=4, frames=90, kind="real", limbs=True)
    label_pairs(pairs, [TakeLabel("*", f"t{number}", "ab"[number % 2]) for number in range(4)])
    path = tmp_path / "study.toml"
    path.write_text(
        'title = "Small"\nout = "made"\ndata = ["pairs.zarr"]\nshares = [0.2, 1.0]\nseeds = 1\n'
        'added = ["synthetic", "radar"]\n[[classifiers]]\nwindow_s = 0.4\n'
    )
    return path


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Dask's workers are not started; what is made is counted."""
    from concurrent.futures import Future
    from contextlib import contextmanager

    made: list[int] = []

    class Client:
        def submit(self, work, *arguments, pure):
            made.append(1)
            future: Future = Future()
            future.set_result(work(*arguments))
            return future

    @contextmanager
    def client(*_: object):
        yield Client(), list

    monkeypatch.setattr(study_run, "study_client", client)
    return made


@pytest.mark.slow
def test_a_study_is_whole_and_goes_on(plan: Path, in_this_process: list[int]) -> None:
    chosen = read_study(plan).model_copy(update={"shares": (1.0,)})
    steps: list[tuple[int, int]] = []
    results = run_study(chosen, progress=lambda done, total: steps.append((done, total)))
    assert len(results.runs) == len(in_this_process) == 6
    assert steps[-1] == (6, 6)
    assert results.kind == "real"
    for one in results.runs:
        assert set(one.takes) == set(one.scores) == {REAL, "synthetic", "radar"}
        for takes in one.takes.values():
            assert set(takes) == {f"{one.task.fold.judged}/t{number}" for number in range(4)}
            assert all(0 <= value <= 1 for pair in takes.values() for value in pair)
    (Path(chosen.out) / "runs").glob("*.json").__next__().unlink()
    again = run_study(chosen)
    assert len(in_this_process) == 7  # only what was missing
    assert [one.to_json() for one in again.runs] == [one.to_json() for one in results.runs]
    other = chosen.model_copy(update={"speeds": (0.8,)})
    run_study(other)
    assert len(in_this_process) == 7 + 6


def test_runs_are_of_the_denoiser_that_its_file_holds(
    plan: Path, in_this_process: list[int], tmp_path: Path
) -> None:
    file = tmp_path / "own.safetensors"
    chosen = read_study(plan).model_copy(
        update={"shares": (1.0,), "added": ("denoised",), "denoiser": Denoiser(file=str(file))}
    )
    for model, made in ((MAP_MODEL, 6), (LIMBS_MODEL, 12), (MAP_MODEL, 12)):
        copyfile(find_model(model), file)
        results = run_study(chosen)
        assert len(in_this_process) == made
    write_report(results, tmp_path)
    assert "has learnt from" not in (tmp_path / "study.md").read_text()
    trained = load_model(file)
    trained.card.about["subjects"] = {"training": ["s1", "x"], "validation": ["s2"]}
    save_model(file, trained)
    write_report(results, tmp_path)
    assert (
        "has learnt from, or was chosen by, people called s1, s2:"
        in (tmp_path / "study.md").read_text()
    )
    late_s = np.concatenate([one.scores[REAL].latencies_s for one in results.runs])
    # A window of 0.4 s ends with the sixth frame from the one on that is answered for.
    assert late_s.min() == pytest.approx(6 / 30)


def test_data_that_have_changed_are_read_again_by_all(
    plan: Path, in_this_process: list[int]
) -> None:
    """Workers of a scheduler live on, and so does a notebook."""
    chosen = read_study(plan).model_copy(update={"shares": (1.0,), "added": ()})
    first = run_study(chosen)
    pairs = plan.parent / "pairs.zarr"
    label_pairs(pairs, [TakeLabel("*", f"t{number}", "abc"[number % 3]) for number in range(4)])
    again = run_study(chosen)
    assert len(in_this_process) == len(first.runs) + len(again.runs)
    for results, classes in ((first, ("a", "b")), (again, ("a", "b", "c"))):
        assert results.classes == classes
        assert {one.scores[REAL].classes for one in results.runs} == {classes}


def test_a_study_that_cannot_be_is_no_study_that_was_stopped(
    plan: Path, in_this_process: list[int]
) -> None:
    chosen = read_study(plan)
    with pytest.raises(Sd2Error, match="nothing such"):
        run_study(chosen.model_copy(update={"classes": {"nothing such": "x"}}))
    folder = study_run.StudyFolder(Path(chosen.out))
    assert folder.state() == "failed"
    run_study(chosen.model_copy(update={"shares": (1.0,), "added": ()}))
    assert folder.state() == "finished"


def test_the_page_says_what_was_found_and_what_was_not_tried(
    plan: Path, in_this_process: list[int]
) -> None:
    chosen = read_study(plan)
    results = run_study(chosen)
    said = write_report(results, Path(chosen.out))
    page = (Path(chosen.out) / "study.md").read_text(encoding="utf-8")
    assert said in page
    assert "A real radar" in page
    assert "denoised with texture maps" in page.partition("## Not tried")[2]
    assert "| 20% |" in page
    content = json.loads((Path(chosen.out) / "study.json").read_text(encoding="utf-8"))
    assert content["conclusion"] == said
    assert len(content["runs"]) == 12
    assert (Path(chosen.out) / "curve.png").stat().st_size > 10_000
    findings = findings_of(results)
    assert [one.added for one in findings] == ["synthetic", "radar"] * 2
    assert any("over 3, intervals over people" in one for one in untried(results))
    assert any("mirrored" in one for one in untried(results))


@pytest.mark.slow
def test_a_denoiser_that_cannot_learn_is_said(
    plan: Path, in_this_process: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def failed(place, *_):
        place.mkdir(parents=True)
        (place / "done").write_text(json.dumps({"reason": "too few frames"}))

    monkeypatch.setattr(study_run, "learn_denoiser", failed)
    chosen = read_study(plan).model_copy(
        update={"added": ("denoised", "synthetic+texture"), "shares": (1.0,)}
    )
    results = run_study(chosen)
    assert all(set(one.takes) == {REAL} for one in results.runs)
    assert all("too few frames" in reason for one in results.runs
               for reason in one.missing.values())  # fmt: skip
    assert any("too few frames" in one for one in untried(results))
    assert "Nothing was added" in write_report(results, Path(chosen.out))


@pytest.mark.slow
def test_movements_of_one_person_are_kept_apart_and_classifiers_compared(
    plan: Path, in_this_process: list[int]
) -> None:
    kernel = Learner(model="kernel", delay_s=0.3)
    chosen = read_study(plan).model_copy(
        update={"folds": "files", "parts": 3, "turns": "once", "shares": (1.0,), "added": (),
                "classifiers": (Learner(), kernel)}
    )  # fmt: skip
    results = run_study(chosen)
    assert len(results.runs) == 3
    judged = [take for one in results.runs for take in one.takes[REAL]]
    assert sorted(judged) == sorted(results.subject_of)  # Each once.
    assert all({*one.takes} == {REAL, kernel.title} for one in results.runs)
    said = write_report(results, Path(chosen.out))
    assert "Of 2 classifiers" in said
    assert kernel.title in (Path(chosen.out) / "study.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_bodies_that_no_radar_saw_are_added_in_every_fold(
    plan: Path, in_this_process: list[int], tmp_path: Path
) -> None:
    more = write_pairs(tmp_path / "more.zarr", ("stranger",), takes=2, limbs=True)
    label_pairs(more, [TakeLabel("*", f"t{number}", "ab"[number]) for number in range(2)])
    update = {"video": (str(more),), "added": ("simulated", "synthetic"), "shares": (1.0,)}
    results = run_study(read_study(plan).model_copy(update=update))
    assert results.others == 2
    assert all({*one.takes} == {REAL, "simulated", "synthetic"} for one in results.runs)
    assert not any(one.missing for one in results.runs)
    alone = read_study(plan).model_copy(update={**update, "added": ("simulated",)})
    # Without a person who is filmed, each of three is judged once.
    assert {len(one.task.fold.real) for one in run_study(alone).runs} == {2}


@pytest.mark.slow
def test_more_video_of_a_person_is_added_where_that_person_is_filmed(
    plan: Path, in_this_process: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    more = write_pairs(tmp_path / "more.zarr", ("s1",), takes=5, limbs=True)
    label_pairs(more, [TakeLabel("*", f"t{number}", "ab"[number % 2]) for number in range(5)])
    added: list[list[str]] = []
    learn = trial.learnt

    def learnt(*arguments):
        added.append([clip.title for clip in arguments[3]])
        return learn(*arguments)

    monkeypatch.setattr(trial, "learnt", learnt)
    update = {"video": (str(more),), "added": ("synthetic",), "shares": (1.0,)}
    run_study(read_study(plan).model_copy(update=update))
    # Its last take is of a movement that no radar saw.
    assert sorted({len(one) for one in added}) == [0, 4, 9]
    assert all(("s1/t4" in one) == (len(one) == 9) for one in added)


@pytest.mark.slow
def test_denoisers_learn_within_their_fold(plan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = plan.read_text().replace('["synthetic", "radar"]', '["denoised", "denoised+texture"]')
    text = text.replace("[0.2, 1.0]", "[1.0]")
    plan.write_text(
        text + "[denoiser]\nmodel = 's4d'\nsteps = 20\n"
        "options = {channels = 8, depth = 1, live = false}\n"
    )
    assert run(build_parser()[0], ["study", str(plan), "--workers", "2"]) == 0
    chosen = read_study(plan)
    assert "study.md" in capsys.readouterr().out
    content = json.loads((Path(chosen.out) / "study.json").read_text(encoding="utf-8"))
    assert all("denoised" in one["takes"] for one in content["runs"])
    folders = list((Path(chosen.out) / "denoisers").iterdir())
    assert len(folders) == 3  # one for each person whose radar is there
    for folder in folders:
        made = json.loads((folder / "run" / "run.json").read_text(encoding="utf-8"))
        assert made
        # As many steps on any machine, however busy it is.
        training = read_config(folder / "run" / "config.toml").training
        assert training.minutes is None
        assert training.epochs > 1
        subjects = {json.loads(line)["subject"] for line in
                    (folder / "pairs.zarr" / "takes.jsonl").read_text().splitlines()}  # fmt: skip
        assert len(subjects) == 1
