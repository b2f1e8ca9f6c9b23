"""A tour waits for the hand, rests when it is left, and goes on where it was."""

from __future__ import annotations

import pytest

from sd2app.settings import Settings
from sd2app.welcome.tour import Step, TourModel


class World:
    """What the steps ask about."""

    def __init__(self) -> None:
        self.number, self.sample, self.asked, self.pairs = 0, True, 0, True

    def open_sample(self) -> None:
        self.asked += 1


def grew(before: int, now: int) -> bool:
    return now > before


@pytest.fixture
def world() -> World:
    return World()


@pytest.fixture
def settings() -> Settings:
    return Settings.forgetful()


@pytest.fixture
def make(qtbot, world, settings):
    def made() -> TourModel:
        steps = [Step(name, "", (), lambda: world.number, grew) for name in ("One", "Two")]
        needy = Step("Three", "", (), lambda: world.number, grew, lambda: world.pairs)
        return TourModel([*steps, needy], settings, lambda: world.sample, world.open_sample)

    return made


def title(tour: TourModel) -> str | None:
    return None if tour.step is None else tour.step.title


def test_it_waits_until_the_hand_has_done_it(qtbot, make, world) -> None:
    tour = make()
    tour.begin()
    tour.look()
    assert title(tour) == "One"
    assert not tour.done

    world.number += 1
    tour.look()

    assert tour.done
    qtbot.waitUntil(lambda: title(tour) == "Two")
    tour.look()
    assert not tour.done  # what was done before does not count for the next


def test_it_goes_on_in_another_session_where_it_was_left(make) -> None:
    first = make()
    first.begin()
    first.skip()
    first.leave()
    assert first.step is None

    second = make()

    assert second.kept == 1
    second.begin()
    assert title(second) == "Two"


def test_it_begins_anew_after_its_end(make) -> None:
    tour = make()
    tour.begin()
    for _ in tour.steps:
        tour.skip()

    assert tour.over
    assert tour.step is None
    assert tour.kept == 0


def test_without_the_sample_it_asks_for_it_and_waits(make, world) -> None:
    world.sample = False
    tour = make()
    tour.begin()
    assert world.asked == 1
    assert tour.step is None

    world.sample = True
    tour.follow_document()

    assert title(tour) == "One"


def test_another_recording_lets_it_rest(make, world) -> None:
    tour = make()
    tour.begin()
    world.sample = False

    tour.follow_document()

    assert not tour.wanted


def test_a_step_without_what_it_needs_begins_with_the_one_before(make, world) -> None:
    tour = make()
    tour.begin()
    tour.skip()
    tour.skip()
    assert title(tour) == "Three"
    tour.leave()
    world.pairs = False

    tour.begin()

    assert title(tour) == "Two"


@pytest.mark.parametrize("stored", ["nonsense", 17, -1])
def test_a_stored_step_that_there_is_not_is_the_first(make, settings, stored) -> None:
    settings.set_value("tour/step", stored)

    assert make().kept == 0


def test_skipping_passes_over_what_lacks_what_it_needs(make, world) -> None:
    tour = make()
    tour.begin()
    world.pairs = False

    tour.skip()
    assert title(tour) == "Two"
    tour.skip()

    assert tour.over  # "Three" has nothing to work on, and "Two" was not asked for again
    assert tour.kept == 0
