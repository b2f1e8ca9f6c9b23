"""What a fit says, line by line, and what is made of it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sd2app.fit.progress import (
    Done,
    FitProgress,
    Found,
    Noted,
    Progressed,
    Refused,
    Started,
    left_in_words,
    message_of,
)
from sd2core.runs.progress import read_events

START = {
    "event": "start",
    "format": "sd2-fit-progress",
    "version": 1,
    "frames": 90,
    "width": 640,
    "height": 480,
    "stages": ["find", "refine", "lift", "fit", "write"],
    "resumed": False,
}


def said(**content: object):
    return message_of(content)


def test_every_event_of_the_format_is_read() -> None:
    assert message_of(START) == Started(
        90, 640, 480, ("find", "refine", "lift", "fit", "write"), False
    )
    assert said(event="progress", stage="find", done=3, total=90, unit="frame") == Progressed(
        "find", 3, 90, "frame"
    )
    assert said(event="note", text="Turned.") == Noted("Turned.")
    assert said(event="done", out="m.zarr", frames=90, present=88, seconds=20.5) == Done(
        90, 88, 20.5
    )
    assert said(event="error", text="No person.") == Refused("No person.")


def test_landmarks_are_pixels_and_visibility() -> None:
    found = said(
        event="landmarks",
        stage="find",
        frame=7,
        image_px=[[k, 2 * k] for k in range(33)],
        visibility=[0.5] * 33,
    )
    assert isinstance(found, Found)
    assert found.frame == 7
    assert found.points[5].tolist() == [5, 10, 0.5]
    nobody = said(event="landmarks", frame=8, image_px=[[None, None]] * 33, visibility=[0] * 33)
    assert np.isnan(nobody.points[:, :2]).all()


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
    assert all(message_of(event) is None for event in read_events(tmp_path / "lines"))


@pytest.fixture
def run():
    """Progress on a clock that is set by hand."""
    now = [0.0]
    progress = FitProgress(lambda: now[0])
    progress.start(message_of(START))
    return progress, now


def test_the_share_grows_from_nothing_to_all(run) -> None:
    progress, _ = run
    assert progress.share is None
    shares = []
    for stage in START["stages"]:
        for done in (0, 45, 90):
            progress.report(Progressed(stage, done, 90, "frame"))
            shares.append(progress.share)
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_time_left_is_what_the_speed_so_far_gives(run) -> None:
    progress, now = run
    progress.report(Progressed("find", 0, 90, "frame"))
    now[0] = 1.0
    progress.report(Progressed("find", 9, 90, "frame"))
    assert progress.left_s is None  # too early to say
    now[0] = 10.0
    progress.report(Progressed("find", 90, 90, "frame"))
    share = progress.share
    assert progress.left_s == pytest.approx(10.0 * (1 - share) / share)


def test_a_continued_run_counts_only_its_own_time(run) -> None:
    progress, now = run
    progress.report(Progressed("refine", 45, 90, "frame"))
    before = progress.share
    now[0] = 5.0
    progress.report(Progressed("refine", 90, 90, "frame"))
    gained = progress.share - before
    assert progress.left_s == pytest.approx(5.0 * (1 - progress.share) / gained)


def test_a_slower_stage_is_judged_by_itself(run) -> None:
    progress, now = run
    progress.report(Progressed("find", 0, 90, "frame"))
    now[0] = 3.0
    progress.report(Progressed("find", 90, 90, "frame"))
    progress.report(Progressed("refine", 0, 90, "frame"))
    before = progress.share
    assert progress.left_s == pytest.approx(3.0 * (1 - before) / before)
    now[0] = 33.0
    progress.report(Progressed("refine", 45, 90, "frame"))
    assert progress.left_s == pytest.approx(30.0 * (1 - progress.share) / (progress.share - before))


def test_words(run) -> None:
    progress, _ = run
    assert progress.text == "starting"
    progress.report(Progressed("find", 3, 90, "frame"))
    assert progress.text == "finding the person, frame 3 of 90"
    progress.report(Progressed("models", 4_200_000, 0, "byte"))
    assert progress.text == "fetching the landmark models"
    progress.report(Progressed("models", 4_200_000, 9_000_000, "byte"))
    assert progress.text == "fetching the landmark models, 4.2 of 9.0 MB"
    progress.report(Progressed("polish", 1, 2, "step"))
    assert progress.text == "polish, step 1 of 2"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (None, ""),
        (4, "a few seconds left"),
        (33, "about 35 s left"),
        (61, "about 1 min left"),
        (200, "about 3 min left"),
        (7260, "about 2 h 1 min left"),
    ],
)
def test_time_left_in_words(seconds, words) -> None:
    assert left_in_words(seconds) == words
