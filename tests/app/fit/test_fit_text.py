"""What a fit says, line by line, and what is made of it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sd2app.fit.model import FitProgress
from sd2app.widgets.text import about
from sd2core.runs.progress import read_events

START = {
    "event": "start",
    "format": "sd2-fit-progress",
    "version": 1,
    "frames": 90,
    "width": 640,
    "height": 480,
    "stages": ["find", "refine", "fit", "write"],
    "resumed": False,
}


def said(**content: object) -> FitProgress:
    progress = FitProgress()
    assert progress.take([content])
    return progress


def test_every_event_of_the_format_is_read() -> None:
    begun = said(**START)
    assert (begun.size, begun.resumed) == ((640, 480), False)
    assert begun.take([{"event": "progress", "stage": "write", "done": 1, "total": 1}])
    assert begun.share == 1.0  # it is the last of the stages
    progress = said(event="progress", stage="find", done=3, total=90, unit="frame")
    assert (progress.stage, progress.done, progress.total) == ("find", 3, 90)
    assert progress.unit == "frame"
    assert said(event="note", text="Turned.").notes == ["Turned."]
    assert said(event="error", text="No person.").error == "No person."


def test_landmarks_are_pixels_and_visibility() -> None:
    found = said(
        event="landmarks",
        stage="find",
        frame=7,
        image_px=[[k, 2 * k] for k in range(33)],
        visibility=[0.5] * 33,
    )
    assert found.newest == 7
    assert found.landmarks[7][5].tolist() == [5, 10, 0.5]
    nobody = said(event="landmarks", frame=8, image_px=[[None, None]] * 33, visibility=[0] * 33)
    assert np.isnan(nobody.landmarks[8][:, :2]).all()


def test_of_several_people_the_share_and_the_words_say_whose_stage_it_is() -> None:
    stages = ["refine 1", "refine 3", "fit 1", "write 1", "fit 3", "write 3"]
    progress = said(**START | {"stages": stages})
    shares = []
    for stage in stages:
        progress.take([{"event": "progress", "stage": stage, "done": 1, "total": 1}])
        shares.append(progress.share)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert progress.text.startswith("writing the mesh, person 3")


@pytest.mark.parametrize(
    "line",
    [
        "",
        "not JSON",
        "[1, 2]",
        '"start"',
        '{"event": "something-new", "text": "x"}',
        '{"no": "event"}',
        '{"event": "progress", "stage": "find"}',
        '{"event": "progress", "stage": "find", "done": "x", "total": 2}',
        '{"event": "landmarks", "frame": 1, "image_px": [[1, 2]], "visibility": [1]}',
        json.dumps(START | {"version": 2}),
        json.dumps(START | {"format": "other"}),
        '{"event": {"a": 1}}',
    ],
)
def test_what_cannot_be_read_is_ignored(line: str, tmp_path) -> None:
    (tmp_path / "lines").write_text(f"{line}\n")
    assert not FitProgress().take(read_events(tmp_path / "lines"))


@pytest.fixture
def run():
    """Progress on a clock that is set by hand."""
    now = [0.0]
    progress = FitProgress(lambda: now[0])
    progress.take([START])
    return progress, now


def report(progress: FitProgress, stage: str, done: int, total: int, unit: str) -> None:
    told = {"stage": stage, "done": done, "total": total, "unit": unit}
    assert progress.take([{"event": "progress", **told}])


def test_the_share_grows_from_nothing_to_all(run) -> None:
    progress, _ = run
    assert progress.share is None
    shares = []
    for stage in START["stages"]:
        for done in (0, 45, 90):
            report(progress, stage, done, 90, "frame")
            shares.append(progress.share)
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_time_left_is_what_the_speed_so_far_gives(run) -> None:
    progress, now = run
    report(progress, "find", 0, 90, "frame")
    now[0] = 1.0
    report(progress, "find", 9, 90, "frame")
    assert progress.left_s is None  # too early to say
    now[0] = 10.0
    report(progress, "find", 90, 90, "frame")
    share = progress.share
    assert progress.left_s == pytest.approx(10.0 * (1 - share) / share)


def test_a_continued_run_counts_only_its_own_time(run) -> None:
    progress, now = run
    report(progress, "refine", 45, 90, "frame")
    before = progress.share
    now[0] = 5.0
    report(progress, "refine", 90, 90, "frame")
    gained = progress.share - before
    assert progress.left_s == pytest.approx(5.0 * (1 - progress.share) / gained)


def test_a_slower_stage_is_judged_by_itself(run) -> None:
    progress, now = run
    report(progress, "find", 0, 90, "frame")
    now[0] = 3.0
    report(progress, "find", 90, 90, "frame")
    report(progress, "refine", 0, 90, "frame")
    before = progress.share
    assert progress.left_s == pytest.approx(3.0 * (1 - before) / before)
    now[0] = 33.0
    report(progress, "refine", 45, 90, "frame")
    assert progress.left_s == pytest.approx(30.0 * (1 - progress.share) / (progress.share - before))


def test_words(run) -> None:
    progress, _ = run
    assert progress.text == "starting"
    report(progress, "find", 3, 90, "frame")
    assert progress.text == "finding the person, frame 3 of 90"
    report(progress, "models", 4_200_000, 0, "byte")
    assert progress.text == "fetching the landmark models"
    report(progress, "models", 4_200_000, 9_000_000, "byte")
    assert progress.text == "fetching the landmark models, 4.2 of 9.0 MB"
    report(progress, "polish", 1, 2, "step")
    assert progress.text == "polish, step 1 of 2"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (4, "a few seconds left"),
        (33, "about 35 s left"),
        (61, "about 1 min left"),
        (200, "about 3 min left"),
        (7260, "about 2 h 1 min left"),
    ],
)
def test_time_left_in_words(seconds, words) -> None:
    assert f"{about(seconds)} left" == words
