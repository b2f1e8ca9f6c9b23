"""Nobody else is taken for the person: rendered people who meet, and real ones of a video."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from filmed_people import ONE_BY_ONE, film

from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmarks import find_landmarks
from sd2core.body.person_selection import Rectangle
from sd2core.body.track import LANDMARK, LandmarkTrack
from sd2core.io.video import open_video
from tools.fitting.cast import PEOPLE
from tools.fitting.people import FRAMES_PER_S, OUT_M, Actor, Part, actor, scenes

pytestmark = pytest.mark.slow

AWAY_M = 3.2
"""Distance of the person who is followed from the camera."""
BODY = slice(LANDMARK["shoulder.L"], None)

OWN = PEOPLE["emil"]
IN_LIKE_CLOTHES = replace(PEOPLE["dora"], outfit=replace(OWN.outfit, hair=(0.62, 0.48, 0.30)))
OTHERS = {"in other clothes": PEOPLE["bo"], "in like clothes": IN_LIKE_CLOTHES}

STANDS = Part(OWN, (0.0, 1.0, 2.0, 3.0), (0.0,) * 4, AWAY_M, (0.0, 25.0, -20.0, 0.0))
MEETINGS = {
    "passes 0.5 m in front": (0.5, (0.1, 4.1), (-2.2, 2.2), (-90.0,) * 2),
    "passes 1.5 m in front": (1.5, (0.1, 4.1), (-2.2, 2.2), (-90.0,) * 2),
    "passes 0.6 m behind": (-0.6, (0.1, 4.1), (-2.2, 2.2), (-90.0,) * 2),
    "stands beside": (0.05, (0.1, 1.7, 2.1), (OUT_M, 0.7, 0.7), (90.0, 90.0, 0.0)),
    "stops 1 m in front": (1.0, (0.1, 2.1, 3.4, 5.4), (-2.2, 0.0, 0.0, 2.2), (-90.0,) * 4),
}
"""How much nearer the other one is, and when they are where, turned which way."""


def rectangle(person: Actor, frame: int = 0) -> Rectangle:
    """Rectangle around a person."""
    low, high = person.points_px[frame].min(axis=0), person.points_px[frame].max(axis=0)
    return Rectangle(*(low - 12.0), *(high - low + 24.0), frame)


def followed(
    path: Path, models: LandmarkModels, people: list[Actor], around: Rectangle | None
) -> LandmarkTrack:
    with open_video(
        film(path, (picture for picture, _ in scenes(people)), frames_per_s=FRAMES_PER_S)
    ) as video:
        return find_landmarks(video, models, person=around)


def off(track: LandmarkTrack, person: Actor) -> np.ndarray:
    """Distance of the landmarks from a person's, as a share of their height in the picture."""
    truth = person.points_px
    away = np.hypot(*np.moveaxis(track.image_px[:, BODY] - truth[:, BODY], -1, 0))
    share: np.ndarray = np.median(away, axis=1) / np.ptp(truth[..., 1], axis=1)
    return share


def of_somebody_else(track: LandmarkTrack, people: list[Actor]) -> list[int]:
    """Frames whose landmarks are another person's rather than the person's."""
    own, other = (off(track, each) for each in people)
    wrong: list[int] = np.flatnonzero(track.present & (own > 0.1) & (other < own)).tolist()
    return wrong


@pytest.mark.parametrize("box", [True, False], ids=["rectangle", "no rectangle"])
@pytest.mark.parametrize("clothes", OTHERS)
@pytest.mark.parametrize("meeting", MEETINGS)
def test_who_meets_the_person(
    models: LandmarkModels, tmp_path: Path, meeting: str, clothes: str, box: bool
) -> None:
    nearer_m, times, x, yaw = MEETINGS[meeting]
    frames = int(FRAMES_PER_S * (times[-1] + 1.5))
    parts = [STANDS, Part(OTHERS[clothes], times, x, AWAY_M - nearer_m, yaw)]
    people = [actor(part, frames, "studio") for part in parts]
    track = followed(tmp_path / "two.mp4", models, people, rectangle(people[0]) if box else None)
    taken = [of_somebody_else(track, order) for order in (people, people[::-1])]
    if not box:  # either of them may be the most prominent person, but only one
        assert [] in taken
        return
    assert taken[0] == []
    assert track.present[:8].all()
    # The detector overlooks who is behind somebody else.
    assert nearer_m < 0.0 or "Others were seen" in " ".join(track.notes)


@pytest.mark.parametrize("frame", [21, 25, 30])
def test_who_was_covered_is_not_taken_for_who_covered_them(
    models: LandmarkModels, tmp_path: Path, frame: int
) -> None:
    nearer_m, times, x, yaw = MEETINGS["stops 1 m in front"]
    parts = [Part(IN_LIKE_CLOTHES, times, x, AWAY_M - nearer_m, yaw), STANDS]
    people = [actor(part, int(FRAMES_PER_S * (times[-1] + 1.5)), "studio") for part in parts]
    track = followed(tmp_path / "two.mp4", models, people, rectangle(people[0], frame))
    # While one covers the other, landmarks are of both.
    between = people[0].points_px[:, BODY] - people[1].points_px[:, BODY]
    away = np.median(np.hypot(*np.moveaxis(between, -1, 0)), axis=1)
    apart = away > 0.4 * np.ptp(people[0].points_px[..., 1], axis=1)
    assert not apart[of_somebody_else(track, people)].any()
    assert track.present[21:30].all()
    assert track.present[apart].any()


def test_who_comes_when_the_person_has_left_stays_a_stranger(
    models: LandmarkModels, tmp_path: Path
) -> None:
    leaves = Part(OWN, (0.0, 0.5, 2.4), (0.0, 0.0, OUT_M), AWAY_M, (0.0, -90.0, -90.0))
    times, x = (0.0, 3.8, 5.7, 6.1), (-OUT_M, -OUT_M, 0.0, 0.0)
    comes = Part(IN_LIKE_CLOTHES, times, x, AWAY_M, (-90.0, -90.0, -90.0, 0.0))
    people = [actor(part, 75, "studio") for part in (leaves, comes)]
    track = followed(tmp_path / "one-after-another.mp4", models, people, rectangle(people[0]))
    assert not track.present[35:].any()
    assert "without the person from" in " ".join(track.notes)


@pytest.mark.parametrize("name", ["ada", "bo", "emil"])
def test_who_leaves_and_comes_back_is_known(
    models: LandmarkModels, tmp_path: Path, name: str
) -> None:
    times, x = (0.0, 0.5, 2.4, 3.9, 5.8, 6.2), (0.0, 0.0, OUT_M, OUT_M, 0.1, 0.1)
    part = Part(PEOPLE[name], times, x, AWAY_M, (0.0, -90.0, -90.0, 90.0, 90.0, 0.0))
    people = [actor(part, 80, "studio")]
    track = followed(tmp_path / "back.mp4", models, people, rectangle(people[0]))
    assert track.present[:15].all()
    # All of them is in the picture from frame 47; a second later it is sure who it is.
    assert track.present[58:].all()
    assert np.nanmax(off(track, people[0])[40:]) < 0.1
    assert "known by their looks alone" in " ".join(track.notes)


@pytest.mark.parametrize("who", [0, 1, 2, 3, 4, 5])
def test_of_six_real_people_one_is_followed(
    shared_data: Path, models: LandmarkModels, who: int
) -> None:
    first, last = ONE_BY_ONE[who]
    around = Rectangle(360.0, 10.0, 180.0, 400.0, (first + last) // 2)
    with open_video(shared_data / "video" / "one_by_one.mp4") as video:
        track = find_landmarks(video, models, person=around, silhouettes=1)
    frames = np.flatnonzero(track.present)
    assert first - 6 <= frames.min()
    assert frames.max() <= last + 6
    assert len(frames) > 0.85 * (last - first)
    assert "Others were seen: without the person from" in " ".join(track.notes)
