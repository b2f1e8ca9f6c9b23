"""``sd2 fit --people``: who is there, and a mesh of each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from cli_outcome import Sd2
from filmed_people import crossing, film, swiping

from sd2core.body.fit_people import fit_people, people_to_fit
from sd2core.body.fit_video import FitChoices, FitReport
from sd2core.body.landmark_models import LandmarkModels
from sd2core.io.fitted import fitted_camera
from sd2core.io.mesh import load_mesh
from sd2core.progress import Progress, silent


@pytest.fixture(scope="module")
def video(models: LandmarkModels, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("crossing")
    return film(folder / "two.mp4", crossing(), frames_per_s=10)


@pytest.mark.slow
def test_a_list_needs_no_output(video: Path, sd2: Sd2) -> None:
    told = json.loads(sd2("fit", video, "--people", "list", "--json").out)["people"]
    assert [each["number"] for each in told] == [1, 2]
    assert all(each["to_s"] > each["from_s"] + 1.5 for each in told)
    assert all(0 < each["box"][0] < 320 for each in told)
    rows = sd2("fit", video, "--people", "list").out.splitlines()
    assert len(rows) == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "--out is not given"),
        (["--people", "all"], "--out is not given"),
        (["--people", "everyone", "--out", "x.zarr"], "none of all, list"),
        (["--people", "1", "--person-box", "1,1,9,9", "--out", "x.zarr"], "--person-box"),
        (["--people", "1", "--landmarks", "l.npz", "--out", "x.zarr"], "--landmarks"),
    ],
)
def test_what_cannot_be_is_refused(words: list[str], message: str, sd2: Sd2) -> None:
    outcome = sd2("fit", "two.mp4", *words)
    assert outcome.code != 0
    assert message in outcome.err


def test_no_bar_stands_where_a_result_is_printed(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bars, beside = [], []

    @contextmanager
    def bar(what: str, unit: str) -> Iterator[Progress]:
        bars.append(what)
        yield silent
        bars.remove(what)

    def fitted(video: Path, out: Path, people: list[Any], *more: Any, **_: Any) -> Iterator[Any]:
        more[1](1).progress_of("write")
        yield people[0], out, more[0], None

    person = SimpleNamespace(number=1, certainty=1.0)
    monkeypatch.setattr("sd2core.body.fit_people.people_to_fit", lambda *_: [person])
    monkeypatch.setattr("sd2core.body.fit_people.is_stopped", lambda *_: False)
    monkeypatch.setattr("sd2core.body.fit_people.fit_people", fitted)
    monkeypatch.setattr("sd2core.cli.fit.progress_bar", bar)
    monkeypatch.setattr("sd2core.cli.fit._summary", lambda *_: {})
    monkeypatch.setattr("sd2core.cli.fit._print", lambda *_: beside.append([*bars]))
    out = tmp_path / "two.zarr"
    assert sd2("fit", "two.mp4", "--people", "all", "--out", out).code == 0
    assert beside == [[]]


@pytest.mark.slow
def test_each_gets_a_mesh(video: Path, sd2: Sd2, tmp_path: Path) -> None:
    words = ["fit", video, "--people", "all", "--resolution", "low"]
    words += ["--landmark-model", "full", "--out", tmp_path / "two.npz"]
    lines = [json.loads(line) for line in sd2(*words, "--progress-json").out.splitlines()]
    start = next(line for line in lines if line["event"] == "start")
    stages = ["refine 1", "refine 2", "fit 1", "write 1", "fit 2", "write 2"]
    assert start["stages"] == stages
    told = [line["stage"] for line in lines if line["event"] == "progress"]
    assert [each for each in dict.fromkeys(told) if each in stages] == stages
    assert sorted(each.name for each in tmp_path.iterdir()) == ["two-1.npz", "two-2.npz"]
    again = sd2(*words)
    assert again.code == 1
    assert "two-1.npz exists" in again.err


@pytest.mark.slow
def test_nobody_is_fitted_where_one_is_missing(video: Path, sd2: Sd2, tmp_path: Path) -> None:
    outcome = sd2("fit", video, "--people", "1,9", "--out", tmp_path / "two.npz")
    assert outcome.code == 1
    assert "no person 9" in outcome.err
    assert "1 to 2" in outcome.err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_who_is_alone_is_fitted_as_without_a_list(sd2: Sd2, tmp_path: Path) -> None:
    video = film(tmp_path / "one.mp4", swiping()[0][:6])
    fits = []
    for name, people in (
        ("plain", ()),
        ("all", ("--people", "all")),
        ("twice", ("--people", "1,1")),
    ):
        out = tmp_path / f"{name}.npz"
        words = ["--resolution", "low", "--landmark-model", "full", "--out", out]
        assert sd2("fit", video, *people, *words).code == 0
        fits.append(load_mesh(out))
    for fit in fits[1:]:
        np.testing.assert_array_equal(fit.read(0, 6), fits[0].read(0, 6))


@pytest.mark.slow
def test_a_stopped_run_makes_what_is_left(video: Path, sd2: Sd2, tmp_path: Path) -> None:
    words = ["fit", video, "--people", "all", "--resolution", "low"]
    words += ["--landmark-model", "full", "--out", tmp_path / "two.npz"]
    choices = FitChoices(resolution="low", landmark_model="full")
    report = FitReport(lambda _: silent, lambda *_: None, lambda *_: None)
    people = people_to_fit(video, (), choices, report)

    def stop_after_one() -> None:
        next(fit_people(video, tmp_path / "two.npz", people, choices, lambda _: report))

    def camera_of(person: int) -> str:
        camera = fitted_camera(tmp_path / f"two-{person}.npz")
        return "" if camera is None else camera.source

    stop_after_one()
    other = (*words, "--field-of-view", "70")
    assert "two-1.npz exists" in sd2(*other).err  # by another camera it is not done
    assert sd2(*other, "--overwrite").code == 0
    assert [camera_of(1), camera_of(2)] == ["user", "user"]
    stop_after_one()
    written = (tmp_path / "two-1.npz").stat().st_mtime_ns
    assert sd2(*words).code == 0
    assert [camera_of(1), camera_of(2)] == ["default", "default"]
    assert (tmp_path / "two-1.npz").stat().st_mtime_ns == written
