"""Everybody in a video is followed and told apart; nobody is exchanged silently."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
import pytest
from filmed_people import crossing, empty_room, film

from sd2core.body.blazepose import (
    CENTRE,
    POINTS,
    RIM,
    Detection,
    Pose,
    PoseDetector,
    PoseLandmarker,
)
from sd2core.body.identity import Appearance, Trail
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.people import SeenPerson, chosen_people, find_people, of_two
from sd2core.body.people_following import Doubt, PeopleFollower, Sight, Stretch, assigned
from sd2core.body.people_joining import cleared, joined
from sd2core.body.roi import MARGIN, Pixels, Roi, roi_numbers
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video

WIDTH_PX, SIZE_PX, STEP_S = 1200, 400.0, 0.1


def looks_of(seed: int) -> np.ndarray:
    """Clothes of three colours; other seeds, other colours."""
    signature = np.zeros((6, 512), np.float32)
    for part in signature:
        part[np.random.default_rng(seed).choice(512, 3, replace=False)] = 1.0 / 3.0
    return signature


def stretch(
    from_s: float, to_s: float, from_px: float, to_px: float, clothes: int = 0, size: float = 1.0
) -> Stretch:
    """Somebody who goes across the picture."""
    times = np.arange(round(from_s / STEP_S), round(to_s / STEP_S) + 1) * STEP_S
    places = np.interp(times, (from_s, to_s), (from_px, to_px))
    rois = [Roi(float(x), 300.0, size * SIZE_PX) for x in places]
    trail = Trail(rois[0], float(times[0]), float(times[0]))
    for time_s, roi in zip(times[1:].tolist(), rois[1:], strict=True):
        trail = trail.followed(roi, time_s)
    return Stretch(
        trail,
        Appearance(looks_of(clothes)),
        numbers=np.rint(times / STEP_S).astype(int).tolist(),
        times_s=times.tolist(),
        rois=[roi_numbers(roi) for roi in rois],
        confidence=[1.0] * len(times),
        score=1.0,
    )


def whose(stretches: list[Stretch]) -> list[list[int]]:
    """Numbers of the stretches of each person."""
    return [
        [stretches.index(each) for each in one.stretches] for one in joined(stretches, WIDTH_PX)
    ]


class TestJoining:
    def test_who_goes_straight_on_behind_another_in_like_clothes_is_the_same(self) -> None:
        right = [stretch(0.0, 1.5, 200.0, 500.0), stretch(2.2, 3.6, 640.0, 920.0)]
        left = [stretch(0.0, 1.5, 1000.0, 700.0), stretch(2.2, 3.6, 560.0, 280.0)]
        assert whose([right[0], left[0], right[1], left[1]]) == [[0, 2], [1, 3]]

    def test_clothes_tell_who_turned_back(self) -> None:
        before = [stretch(0.0, 1.5, 200.0, 500.0, 1), stretch(0.0, 1.5, 1000.0, 700.0, 2)]
        after = [stretch(2.5, 4.0, 700.0, 1000.0, 2), stretch(2.5, 4.0, 500.0, 200.0, 1)]
        assert whose([*before, *after]) == [[0, 3], [1, 2]]

    def test_sizes_tell_too(self) -> None:
        before = [stretch(0.0, 1.5, 400.0, 600.0), stretch(0.0, 1.5, 800.0, 600.0, size=1.6)]
        after = [stretch(2.2, 4.0, 600.0, 600.0, size=1.6), stretch(2.2, 4.0, 600.0, 600.0)]
        assert whose([*before, *after]) == [[0, 3], [1, 2]]

    def test_who_cannot_be_told_is_another_person_who_may_be_the_same(self) -> None:
        before = [stretch(0.0, 1.5, 590.0, 600.0), stretch(0.0, 1.5, 610.0, 600.0)]
        after = [stretch(3.0, 4.5, 600.0, 500.0), stretch(3.0, 4.5, 600.0, 700.0)]
        people = joined([*before, *after], WIDTH_PX)
        assert [len(each.stretches) for each in people] == [1, 1, 1, 1]
        assert {people.index(each.may_be) for each in people[2:]} == {0, 1}

    def test_who_leaves_is_not_who_comes_next_in_like_clothes(self) -> None:
        leaves, comes = stretch(0.0, 3.0, 600.0, 1180.0), stretch(6.0, 9.0, 1180.0, 600.0)
        assert whose([leaves, comes]) == [[0], [1]]

    def test_who_is_not_seen_for_a_while_amid_the_picture_is_the_same(self) -> None:
        assert whose([stretch(0.0, 3.0, 600.0, 600.0), stretch(6.0, 9.0, 620.0, 600.0)]) == [[0, 1]]

    def test_certainty_is_told_and_below_that_of_who_was_never_lost(self) -> None:
        parts = [stretch(0.0, 1.5, 200.0, 500.0), stretch(2.2, 3.6, 640.0, 920.0)]
        (person,) = joined(parts, WIDTH_PX)
        assert 0.9 < person.certainty < 1.0
        (whole,) = joined([stretch(0.0, 3.6, 200.0, 920.0)], WIDTH_PX)
        assert whole.certainty == 1.0


def body(x_px: float, size: float = 1.0, clothes: int = 0) -> Sight:
    """Somebody in a picture."""
    square = Roi(x_px, 300.0, size * SIZE_PX)
    points = np.zeros((POINTS, 2))
    points[CENTRE] = points[RIM] = x_px, 300.0
    points[RIM, 1] -= square.size_px / (2.0 * MARGIN)
    unseen = np.zeros(33)
    mask = np.zeros((256, 256), np.float32)
    pose = Pose(points, unseen, np.zeros((33, 3)), unseen, unseen, 1.0, mask, square)
    return Sight(pose, looks_of(clothes), mask > 0.5, 1.0)


class TestClearing:
    def who(self, *sights: Sight) -> list[tuple[int, float]]:
        """Whose the bodies of a picture at 2 s are, between one who stands and one who crosses."""
        stands = [stretch(0.0, 1.6, 600.0, 600.0), stretch(2.4, 4.0, 600.0, 600.0)]
        crosses = [
            stretch(0.0, 1.6, 200.0, 520.0, size=1.5),
            stretch(2.4, 4.0, 680.0, 1000.0, size=1.5),
        ]
        people = joined([stands[0], crosses[0], stands[1], crosses[1]], WIDTH_PX)
        assert [len(each.stretches) for each in people] == [2, 2]
        told = cleared([Doubt(20, 2.0, list(sights))], people)
        return [(row, each.roi.size_px / SIZE_PX) for row, number, each in told if number == 20]

    def test_size_before_and_after_tells_who_was_in_front(self) -> None:
        assert self.who(body(600.0, 1.5)) == [(1, pytest.approx(1.5))]
        assert self.who(body(600.0)) == [(0, pytest.approx(1.0))]

    def test_two_bodies_go_to_two_people(self) -> None:
        told = dict(self.who(body(603.0), body(601.0, 1.5)))
        assert told == {0: pytest.approx(1.0), 1: pytest.approx(1.5)}

    def test_who_may_be_either_stays_in_doubt(self) -> None:
        assert self.who(body(600.0, 1.5**0.5)) == []

    def test_who_has_not_come_back_is_not_seen(self) -> None:
        (person,) = joined([stretch(0.0, 1.6, 600.0, 600.0)], WIDTH_PX)
        assert list(cleared([Doubt(17, 1.7, [body(600.0)])], [person])) == []


class Staged:
    """Detector and landmark network of one person whose place is in the picture's first pixel."""

    def picture(self, x_px: int, *, shown: bool, detected: bool) -> Pixels:
        picture = np.zeros((240, 320, 3), np.uint8)
        picture[0, 0] = x_px, shown, detected
        return picture

    def look(self, picture: Pixels, square: Roi | None) -> tuple[list[Detection], float]:
        x_px, _, detected = picture[0, 0].tolist()
        return [Detection(Roi(x_px, 120.0, 200.0), 1.0)] * detected, float(detected)

    def in_picture(self, picture: Pixels, roi: Roi) -> Pose:
        x_px, shown, _ = picture[0, 0].tolist()
        points = np.array([x_px, 120.0]) + np.random.default_rng(0).uniform(-60, 60, (POINTS, 2))
        points[CENTRE], points[RIM] = (x_px, 120.0), (x_px, 120.0 - 100.0 / MARGIN)
        seen, mask = np.ones(33), np.ones((256, 256), np.float32)
        return Pose(points, seen, np.zeros((33, 3)), seen, seen, float(shown), mask, roi)


class TestLookingBack:
    def numbers(self, shown_from: int, detected_from: int) -> list[list[int]]:
        """Pictures in which each stretch was seen."""
        stage = Staged()
        follower = PeopleFollower(cast(PoseDetector, stage), cast(PoseLandmarker, stage))
        for number in range(10):
            shown, detected = number >= shown_from, number >= detected_from
            picture = stage.picture(80 + 3 * number, shown=shown, detected=detected)
            follower.step(picture, number, STEP_S * number)
        return [each.numbers for each in follower.stretches]

    def test_who_is_detected_late_is_followed_backwards(self) -> None:
        assert self.numbers(0, 4) == [list(range(10))]

    def test_nobody_is_followed_to_where_they_are_not_seen(self) -> None:
        assert self.numbers(2, 4) == [list(range(2, 10))]


class TestLooksAtTwo:
    def test_a_square_that_grows_before_and_after_a_gap_is_around_two(self) -> None:
        sizes = np.array([100.0] * 8 + [104.0, 112.0, np.nan, np.nan, 125.0] + [101.0] * 8)
        assert np.flatnonzero(of_two(sizes)).tolist() == [9, 12]

    def test_who_comes_nearer_is_one(self) -> None:
        sizes = np.linspace(100.0, 130.0, 31)
        sizes[14:17] = np.nan
        assert not of_two(sizes).any()

    def test_first_and_last_looks_count(self) -> None:
        assert not of_two(np.array([np.nan, 120.0] + [100.0] * 8 + [120.0, np.nan])).any()


class TestAssigning:
    def test_bodies_go_to_whom_least_speaks_against(self) -> None:
        assert assigned(np.array([[0.5, 9.0], [8.0, 1.0]])) == ({0: 0, 1: 1}, set())

    def test_two_who_may_be_exchanged_are_doubtful(self) -> None:
        assert assigned(np.array([[1.0, 2.0], [1.5, 1.0]]))[1] == {0, 1}

    def test_one_body_of_two_who_may_be_it_is_doubtful(self) -> None:
        order, doubtful = assigned(np.array([[1.0], [2.0]]))
        assert set(order) == doubtful == {0}

    def test_one_who_may_be_a_body_of_nobody_is_doubtful(self) -> None:
        assert assigned(np.array([[3.0, 3.5]]))[1] == {0}
        assert assigned(np.array([[1.0, 5.0]]))[1] == set()

    def test_nobody_is_put_into_a_body_unlike_theirs(self) -> None:
        assert assigned(np.array([[20.0]])) == ({}, set())


@pytest.fixture(scope="module")
def people(
    models: LandmarkModels, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, list[SeenPerson]]:
    path = film(tmp_path_factory.mktemp("crossing") / "two.mp4", crossing(), frames_per_s=10)
    with open_video(path) as video:
        return path, find_people(video, models)


class TestFinding:
    @pytest.mark.slow
    def test_two_who_cross_are_two_and_go_on(self, people: tuple[Path, list[SeenPerson]]) -> None:
        _, found = people
        assert [each.number for each in found] == [1, 2]
        ways = [each.sightings.rois[each.seen, 0] for each in found]
        across = [way[-1] - way[0] for way in ways]
        assert min(across) < -120.0
        assert max(across) > 120.0
        for way, side in zip(ways, np.sign(across), strict=True):
            assert (side * np.diff(way) > -15.0).all()
        assert all(0.9 < each.certainty <= 1.0 for each in found)

    def test_each_knows_of_the_other(self, people: tuple[Path, list[SeenPerson]]) -> None:
        _, (one, two) = people
        both = one.seen & two.seen
        assert both.sum() > 10
        sides = [each.sightings.others[both, :2] for each in (one, two)]
        assert (sides[0] == sides[1][:, ::-1]).all()

    def test_what_was_found_is_kept(
        self, people: tuple[Path, list[SeenPerson]], models: LandmarkModels
    ) -> None:
        path, found = people
        with open_video(path) as video:
            video.close()  # nothing is read again
            again = find_people(video, models)
        for one, two in zip(found, again, strict=True):
            np.testing.assert_array_equal(one.sightings.rois, two.sightings.rois)

    def test_only_who_is_there_can_be_chosen(self, people: tuple[Path, list[SeenPerson]]) -> None:
        _, found = people
        assert chosen_people(found, ()) == found
        assert chosen_people(found, (2,)) == found[1:]
        with pytest.raises(Sd2Error, match="no person 3"):
            chosen_people(found, (3,))

    def test_an_empty_room_is_refused(self, models: LandmarkModels, tmp_path: Path) -> None:
        path = film(tmp_path / "empty.mp4", [empty_room()] * 4)
        with open_video(path) as video, pytest.raises(Sd2Error, match="Nobody was found"):
            find_people(video, models)
