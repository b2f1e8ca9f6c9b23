"""Who is who when people meet: by their looks, and by where they can have got to."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from filmed_people import CAMERA, Picture, empty_room, film, person_at
from hypothesis import given
from hypothesis import strategies as st

from sd2core.body.identity import ALIKE, Appearance, Signature, Trail, alike, similarity
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmarks import find_landmarks
from sd2core.body.person_selection import Rectangle, Start
from sd2core.body.person_tracker import PersonTracker
from sd2core.body.roi import Roi
from sd2core.body.track import TORSO_CORNERS, LandmarkTrack
from sd2core.body.tracking import Search
from sd2core.io.video import open_video

STEP_S = 1.0 / 10.0
"""Time between looks."""
FRAMES = 40


def looks_of(seed: int) -> Signature:
    """Clothes of three colours; other seeds, other colours."""
    signature = np.zeros((6, 512), np.float32)
    for part in signature:
        part[np.random.default_rng(seed).choice(512, 3, replace=False)] = 1.0 / 3.0
    return signature


def walked(speed_px_s: float, steps: int) -> Trail:
    """Trail of somebody 400 pixels large who goes straight on."""
    trail = Trail(Roi(300.0, 200.0, 400.0), 0.0, 0.0)
    for step in range(1, steps + 1):
        time_s = step * STEP_S
        trail = trail.followed(Roi(300.0 + speed_px_s * time_s, 200.0, 400.0), time_s)
    return trail


class TestTrail:
    @given(speed_px_s=st.floats(-400.0, 400.0))
    def test_who_walks_on_is_expected_there(self, speed_px_s: float) -> None:
        trail = walked(speed_px_s, 15)
        there = trail.predicted(trail.time_s + STEP_S).centre_x_px
        assert there == pytest.approx(300.0 + speed_px_s * (trail.time_s + STEP_S), abs=0.5)

    @given(
        speed_px_s=st.floats(-300.0, 300.0),
        # 400 pixels are about 2.3 m, so that this is up to 4 m/s².
        acceleration_px_s2=st.floats(-690.0, 690.0),
        gap_s=st.floats(STEP_S, 0.9),
    )
    def test_who_starts_or_stops_while_hidden_can_have_got_there(
        self, speed_px_s: float, acceleration_px_s2: float, gap_s: float
    ) -> None:
        trail = walked(speed_px_s, 15)
        x = trail.roi.centre_x_px + speed_px_s * gap_s + 0.5 * acceleration_px_s2 * gap_s**2
        assert trail.reaches(Roi(x, 200.0, 400.0), trail.time_s + gap_s)

    @given(speed_px_s=st.floats(-300.0, 300.0), side=st.sampled_from([-1.0, 1.0]))
    def test_nobody_jumps_aside_or_grows_at_once(self, speed_px_s: float, side: float) -> None:
        trail = walked(speed_px_s, 15)
        now_s = trail.time_s + STEP_S
        expected = trail.predicted(now_s)
        aside = Roi(expected.centre_x_px + side * 40.0, 200.0, 400.0)
        assert not trail.reaches(aside, now_s)
        assert not trail.reaches(expected.scaled(1.25**side), now_s)
        assert trail.unlike(aside, now_s) > trail.unlike(expected, now_s)

    @given(speed_px_s=st.floats(-400.0, 400.0))
    def test_there_and_back_in_numbers(self, speed_px_s: float) -> None:
        trail = walked(speed_px_s, 4)
        again = Trail.of(trail.numbers())
        assert (again.roi, again.time_s) == (trail.roi, trail.time_s)
        np.testing.assert_array_equal(again.velocity, trail.velocity)


class TestAppearance:
    def test_a_person_is_known_from_every_side_that_was_seen(self) -> None:
        front, back = looks_of(1), looks_of(2)
        person = Appearance(front)
        for share in np.linspace(0.0, 1.0, 60, dtype=np.float32):
            person.learn((1 - share) * front + share * back)
        for _ in range(60):
            person.learn(back)
        assert similarity(person.recent, front) < ALIKE
        assert person.likeness(front) > ALIKE
        assert person.likeness(back) > ALIKE
        assert person.likeness(looks_of(3)) < 0.5

    def test_what_covers_a_person_for_a_moment_is_not_learnt(self) -> None:
        person = Appearance(looks_of(1))
        for looks in [looks_of(1)] * 15 + [looks_of(2)] * 4 + [looks_of(1)] * 15:
            person.learn(looks)
        assert person.likeness(looks_of(2)) < ALIKE

    def test_no_colours_are_like_none(self) -> None:
        assert similarity(np.zeros((6, 512), np.float32), looks_of(1)) == 0.0

    @pytest.mark.parametrize("part", range(6))
    def test_one_part_of_other_colours_tells_people_apart(self, part: int) -> None:
        other = looks_of(1)
        other[part] = looks_of(2)[part]
        assert similarity(looks_of(1), other) > 0.8
        assert not alike(looks_of(1), other)

    def test_what_is_hidden_is_not_compared_but_too_little_tells_nothing(self) -> None:
        half, less = looks_of(1), looks_of(1)
        half[4:] = 0.0
        less[3:] = 0.0
        assert alike(looks_of(1), half)
        assert not alike(looks_of(1), less)
        # Of one who was never seen whole, what was seen is enough.
        assert alike(less, looks_of(1))

    def test_what_is_seen_later_is_learnt_and_what_is_hidden_kept(self) -> None:
        upper = looks_of(1)
        upper[4:] = 0.0
        person = Appearance(upper)
        person.learn(looks_of(1))
        for _ in range(60):
            person.learn(upper)
        assert alike(person.recent, looks_of(1))
        assert not alike(person.recent, looks_of(2))


def between(start: float, end: float, first_s: float, last_s: float) -> np.ndarray:
    """Way from one place to another, standing before and after, in columns for every frame."""
    share = np.clip((STEP_S * np.arange(FRAMES) - first_s) / (last_s - first_s), 0.0, 1.0)
    return np.rint(start + share * (end - start)).astype(int)


OUTSIDE = 240
"""Columns from the middle at which nothing of a person is in the picture."""

STANDS = np.zeros(FRAMES, int)
MEETINGS = {
    "passes in front": (STANDS, between(-OUTSIDE, OUTSIDE, 0.5, 3.5), 1.25),
    "passes behind": (STANDS, between(-OUTSIDE, OUTSIDE, 0.5, 3.5), 0.7),
    "stops in front": (
        STANDS,
        between(-OUTSIDE, 0, 0.5, 1.6) + between(0, OUTSIDE, 2.6, 3.7),
        1.3,
    ),
    "crosses": (between(-80, 80, 0.4, 3.6), between(80, -80, 0.4, 3.6), 1.3),
    "comes when the person goes": (
        between(0, OUTSIDE, 1.0, 2.4),
        between(-OUTSIDE, 0, 1.0, 2.6),
        1.25,
    ),
}
"""Ways of the person followed and of another one, who is nearer by a factor."""


def filmed(path: Path, meeting: str, *, red: bool) -> Path:
    own, other, nearer = MEETINGS[meeting]
    pictures: list[Picture] = []
    for here, there in zip(own, other, strict=True):
        layers = [(int(here), False, 1.0), (int(there), red, nearer)]
        room = empty_room()
        for columns, is_red, scale in sorted(layers, key=lambda layer: layer[2]):
            room = person_at(room, columns, red=is_red, nearer=scale)
        pictures.append(room)
    return film(path, pictures, frames_per_s=10)


def followed(path: Path, models: LandmarkModels, own: np.ndarray) -> LandmarkTrack:
    left = CAMERA.width // 2 + int(own[0]) - 45
    with open_video(path) as video:
        return find_landmarks(video, models, person=Rectangle(left, 20, 90, 215))


def taken_over(track: LandmarkTrack, own: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Frames whose landmarks are those of another person."""
    middle = track.image_px[:, TORSO_CORNERS, 0].mean(axis=1) - CAMERA.width / 2
    away = np.abs(middle - own)
    known = track.present & ~track.bridged
    return np.flatnonzero(known & (away > 18) & (away > np.abs(middle - other)))


@pytest.mark.slow
@pytest.mark.parametrize("red", [False, True], ids=["in the same clothes", "in other clothes"])
@pytest.mark.parametrize("meeting", MEETINGS)
def test_who_passes_does_not_take_over(
    models: LandmarkModels, tmp_path: Path, meeting: str, red: bool
) -> None:
    own, other, nearer = MEETINGS[meeting]
    track = followed(filmed(tmp_path / "two.mp4", meeting, red=red), models, own)
    assert len(taken_over(track, own, other)) == 0
    # Each is some 60 columns wide, the nearer one more.
    covered = (np.abs(own - other) < 30 * (1.0 + nearer)) & (nearer > 1.0)
    # A person who is nearly out of the picture may be lost before they are.
    seen = (np.abs(own) < 100) & ~covered
    # In the same clothes it takes longer until it is clear who comes out of a crossing.
    assert track.present[seen].mean() > (0.9 if red or meeting != "crosses" else 0.75)


@pytest.mark.slow
def test_another_one_who_comes_when_the_person_has_gone_is_not_taken_for_them(
    models: LandmarkModels, tmp_path: Path
) -> None:
    own, other = between(0, OUTSIDE, 0.2, 1.4)[:26], between(-OUTSIDE, 0, 1.2, 2.4)[:26]
    pictures = [
        person_at(person_at(empty_room(), int(here)), int(there), red=True)
        for here, there in zip(own, other, strict=True)
    ]
    with open_video(film(tmp_path / "one-after-another.mp4", pictures, frames_per_s=10)) as video:
        track = find_landmarks(video, models, person=Rectangle(115, 20, 90, 215))
    assert track.present[:7].all()
    assert not track.present[16:].any()
    assert "whoever is seen may be somebody else" in " ".join(track.notes)


@pytest.mark.parametrize(
    ("number", "since_s", "taken_back"),
    [
        (8, 0.3, [4, 5, 6, 7, 8]),
        (8, 0.0, list(range(1, 9))),
        (13, 0.2, [12, 13]),
        (13, 0.0, [10, 11, 12, 13]),
    ],
)
def test_what_is_taken_back_is_of_one_half_of_the_search(
    number: int, since_s: float, taken_back: list[int]
) -> None:
    """From a start in frame 4 ten looks lead ahead and four back; times are of either half."""
    times = SimpleNamespace(times_s=0.1 * np.arange(14))
    video: Any = SimpleNamespace(timebase=times, width=320, height=240)
    nobody: Any = None
    search = Search(video, Start(4, Roi(1.0, 1.0, 1.0)), PersonTracker(nobody, nobody))
    search._rois[:] = 1.0
    search._forget(number, since_s + 1e-9)
    assert np.flatnonzero(np.isnan(search._rois[:, 0])).tolist() == taken_back
    assert np.flatnonzero(search._unclear).tolist() == taken_back
