"""People who meet stay who they are: rendered pairs, and six real people one after the other."""

from __future__ import annotations

from pathlib import Path

import pytest
from filmed_people import ONE_BY_ONE

from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.people import find_people
from sd2core.io.video import open_video
from tools.fitting.people import OTHERS, Meeting, meetings, told_apart

pytestmark = pytest.mark.slow

SOME = [each for each in meetings() if each.apart_m in (0.8, 1.5)]


@pytest.mark.parametrize("clothes", OTHERS)
@pytest.mark.parametrize("meeting", SOME, ids=[each.name for each in SOME])
def test_two_who_meet_are_not_exchanged(
    models: LandmarkModels, tmp_path: Path, meeting: Meeting, clothes: str
) -> None:
    _, people, outcome = told_apart(meeting, clothes, tmp_path / "pair.mp4")
    assert outcome.people == len(people) == 2
    assert outcome.right >= 0.99
    assert outcome.seen > 0.6 * outcome.observed


def test_six_real_people_are_six(shared_data: Path, models: LandmarkModels) -> None:
    with open_video(shared_data / "video" / "one_by_one.mp4") as video:
        people = find_people(video, models)
    assert len(people) == len(ONE_BY_ONE)
    for person, (first, last) in zip(people, ONE_BY_ONE, strict=True):
        frames = person.sightings.frames[person.seen]
        assert first - 6 <= frames[0] <= first + 10
        assert last - 10 <= frames[-1] <= last + 6
        assert len(frames) > 0.9 * (last - first)
