"""The trade without a window: whose wish rules, what is dropped, what is remembered."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from fake_accuracy import (
    COUNTING,
    EXACT,
    FACING,
    WAVES,
    FakeAccuracy,
    measurement_of,
    result_of,
    stale,
)
from PySide6.QtCore import QObject, QSettings

from sd2app.accuracy.model import AccuracyModel
from sd2app.session.tasks import TaskList
from sd2app.settings import DEFAULT_TOLERANCE, Settings
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.doppler.options import PRESETS
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

HERE, THERE = VirtualSensor(), VirtualSensor(position_m=(1.0, 0.0, 0.0))
BUDGET_MS = 0.1


def still_mesh():
    vertices = np.zeros((5, 3, 3), np.float32)
    return MeshSequence(vertices, np.array([[0, 1, 2]], np.int32), Timebase(np.arange(5) / 30))


class Desk:
    """A trade model with a scene, a fake library and what was emitted."""

    def __init__(self, settings=None, **answers):
        self.parent = QObject()
        self.fake = FakeAccuracy(**answers)
        self.jobs = TaskList(self.parent)
        self.settings = settings or Settings.forgetful()
        self.trade = AccuracyModel(self.jobs, self.settings, self.fake.library, self.parent)
        self.failures, self.notes = [], []
        self.trade.failed.connect(self.failures.append)
        self.trade.noted.connect(self.notes.append)
        self.trade.attach(still_mesh(), PRESETS["paper"])
        self.trade.measured.rest_at(HERE)

    def choose(self, qtbot, sensor=HERE):
        with qtbot.waitSignal(self.trade.decided):
            self.trade.choose(sensor, BUDGET_MS)


@pytest.fixture
def desk(qapp):
    desk = Desk(plan=AccuracyPlan(mask_stride=5), error=0.008)
    yield desk
    desk.fake.gate.set()
    desk.trade.close()


def test_a_choice_gives_the_plans_for_rest_and_for_dragging(desk, qtbot):
    trade = desk.trade
    assert trade.in_use is None
    desk.choose(qtbot)
    assert trade.in_use.plan == AccuracyPlan(mask_stride=5)
    assert (trade.in_use.error, trade.in_use.cost_ms) == (0.008, 0.6)
    assert trade.while_dragging.plan == FACING
    assert desk.fake.asked == [(DEFAULT_TOLERANCE, None, HERE), (None, BUDGET_MS, HERE)]
    assert trade.is_decided(HERE, BUDGET_MS)
    assert not trade.is_decided(THERE, BUDGET_MS)
    assert not trade.is_decided(HERE, 2 * BUDGET_MS)
    assert desk.jobs.jobs == ()


def test_the_plan_at_rest_is_used_before_that_for_dragging_is_chosen(desk, qtbot):
    began = threading.Event()

    def choose(*where, tolerance=None, **parts):
        if tolerance is None:
            began.set()
            desk.fake.gate.clear()
        return FakeAccuracy.choose(desk.fake, *where, tolerance=tolerance, **parts)

    desk.fake.choose = choose
    with qtbot.waitSignal(desk.trade.plan_changed):
        desk.trade.choose(HERE, BUDGET_MS)
    qtbot.waitUntil(began.is_set)
    assert desk.trade.in_use.plan == AccuracyPlan(mask_stride=5)
    assert desk.trade.while_dragging is None
    assert desk.trade.choosing
    with qtbot.waitSignal(desk.trade.decided):
        desk.fake.gate.set()
    assert desk.trade.while_dragging.plan == FACING


def test_the_tolerance_is_kept_from_one_start_to_the_next(desk, qtbot):
    desk.trade.set_tolerance(0.02)
    again = Desk(settings=desk.settings)
    assert again.trade.tolerance == 0.02
    again.trade.close()


@pytest.mark.parametrize("stored", ["nonsense", -1, 0, 7])
def test_a_stored_tolerance_that_is_none_is_not_taken(stored, tmp_path):
    store = QSettings(str(tmp_path / "settings.ini"), QSettings.Format.IniFormat)
    store.setValue("tolerance", stored)
    assert Settings(store).tolerance == DEFAULT_TOLERANCE


def test_another_tolerance_asks_for_a_choice_and_surveys_the_place_once(desk, qtbot):
    trade = desk.trade
    desk.fake.plans[0.1] = FACING
    desk.choose(qtbot)
    with qtbot.waitSignal(trade.requested):
        trade.set_tolerance(0.1)
    assert not trade.is_decided(HERE, BUDGET_MS)
    desk.choose(qtbot)
    assert trade.in_use.plan == FACING
    assert desk.fake.surveyed == [HERE]
    desk.choose(qtbot, THERE)
    assert desk.fake.surveyed == [HERE, THERE]
    # The second one builds on the first.
    assert desk.fake.alike == [None, HERE]


def test_the_newest_wish_wins(desk, qtbot):
    trade, fake = desk.trade, desk.fake
    fake.plans = {0.02: EXACT, 0.1: FACING}
    fake.gate.clear()
    trade.set_tolerance(0.02)
    trade.choose(HERE, BUDGET_MS)
    qtbot.waitUntil(lambda: bool(fake.surveyed))
    trade.set_tolerance(0.1)
    trade.choose(HERE, BUDGET_MS)
    qtbot.waitUntil(lambda: bool(fake.cancelled))
    fake.gate.set()
    qtbot.waitUntil(lambda: trade.in_use is not None)
    assert trade.in_use.plan == FACING
    assert len(desk.jobs.jobs) == 0


def test_hold_stops_the_choosing_and_decides_nothing(desk, qtbot):
    desk.fake.gate.clear()
    desk.trade.choose(HERE, BUDGET_MS)
    qtbot.waitUntil(lambda: bool(desk.fake.surveyed))
    assert desk.trade.choosing
    assert [job.title for job in desk.jobs.jobs] == ["Choosing what the scene requires"]
    desk.trade.hold()
    assert not desk.trade.choosing
    assert desk.jobs.jobs == ()
    # The library notices at its next report; the fake reports every 2 ms.
    qtbot.waitUntil(lambda: bool(desk.fake.cancelled))
    assert not desk.trade.is_decided(HERE, BUDGET_MS)
    desk.fake.gate.set()
    desk.choose(qtbot)
    assert desk.trade.in_use is not None


def test_a_user_who_cancels_the_choosing_is_not_asked_to_wait_again(desk, qtbot):
    desk.fake.gate.clear()
    desk.trade.choose(HERE, BUDGET_MS)
    with qtbot.waitSignal(desk.trade.decided):
        desk.jobs.cancel(desk.jobs.jobs[0])
    assert desk.jobs.jobs == ()
    assert desk.trade.in_use is None
    assert desk.trade.is_decided(HERE, BUDGET_MS)


def test_a_choice_that_fails_is_said_once_and_changes_nothing(desk, qtbot):
    desk.choose(qtbot)
    before = desk.trade.in_use
    desk.fake.failure = Sd2Error("The mesh cannot be decimated")
    desk.choose(qtbot, THERE)
    assert desk.failures == ["The mesh cannot be decimated."]
    assert desk.trade.in_use == replace(before, elsewhere=True)
    assert desk.trade.is_decided(THERE, BUDGET_MS)


def test_a_clicked_point_rules_until_the_tolerance_is_set_again(desk, qtbot):
    trade = desk.trade
    desk.choose(qtbot)
    trade.use(COUNTING[0])
    assert (trade.in_use.plan, trade.in_use.clicked) == (FACING, True)
    desk.fake.asked.clear()
    desk.choose(qtbot, THERE)
    assert desk.fake.asked == [(None, BUDGET_MS, THERE)]
    assert trade.in_use.plan == FACING
    trade.set_tolerance(trade.tolerance)
    assert not trade.in_use.clicked
    trade.use(COUNTING[0])
    trade.choose_by_tolerance()
    assert trade.in_use.plan == AccuracyPlan(mask_stride=5)


def test_an_fmcw_point_is_for_comparison(desk, qtbot):
    desk.choose(qtbot)
    before = desk.trade.in_use
    desk.trade.use(WAVES[0])
    assert desk.trade.in_use == before
    assert "--method fmcw" in desk.notes[0]


def test_measuring_is_a_job_and_is_remembered(desk, qtbot):
    trade, measured = desk.trade, desk.trade.measured
    desk.choose(qtbot)
    assert measured.can_measure
    desk.fake.gate.clear()
    measured.measure()
    assert not measured.can_measure
    qtbot.waitUntil(lambda: desk.jobs.jobs != () and desk.jobs.jobs[0].total == 10)
    desk.fake.gate.set()
    qtbot.waitUntil(lambda: measured.job is None)
    assert desk.jobs.jobs == ()
    assert measured.measurement.results == measurement_of(*COUNTING).results
    assert not measured.measurement.stale
    assert desk.fake.remembered == [measured.measurement]
    assert trade.current_point.errors.l1 == 0.008
    # The cheapest within 2 % is the mask every 5 frames; within 0.5 % only exact is.
    assert trade.cost_at(0.02) == 0.6
    assert trade.cost_at(0.005) == 2.1
    assert trade.cost_at(0.2) == 0.02


def test_no_plan_within_a_tolerance_has_no_cost(desk, qtbot):
    desk.fake.known["histogram", THERE] = measurement_of(*COUNTING[:1])
    desk.trade.measured.rest_at(THERE)
    qtbot.waitUntil(lambda: desk.trade.measured.counting is not None)
    assert desk.trade.cost_at(0.01) is None
    assert desk.trade.cost_at(0.2) == 0.02


def test_the_cost_of_a_tolerance_counts_the_chosen_plan_and_no_kept_mask(desk, qtbot):
    kept = result_of(AccuracyPlan(mask_reuse_m=0.1), 0.004, 0.01)
    desk.fake.known["histogram", THERE] = measurement_of(*COUNTING, kept)
    desk.fake.plan, desk.fake.error = AccuracyPlan(mask_stride=10), 0.001
    desk.trade.measured.rest_at(THERE)
    qtbot.waitUntil(lambda: desk.trade.measured.counting is not None)
    assert desk.trade.cost_at(0.005) == 2.1
    desk.choose(qtbot, THERE)
    assert desk.trade.cost_at(0.005) == 0.6


def test_a_plan_that_keeps_its_mask_is_not_used_at_rest(desk, qtbot):
    desk.choose(qtbot)
    before = desk.trade.in_use
    desk.trade.use(result_of(AccuracyPlan(mask_reuse_m=0.1), 0.004, 0.01))
    assert desk.trade.in_use == before
    assert "while the sensor moves" in desk.notes[0]


def test_a_measurement_cancelled_leaves_what_was_known(desk, qtbot):
    desk.fake.gate.clear()
    desk.trade.measured.measure()
    desk.trade.measured.cancel()
    qtbot.waitUntil(lambda: bool(desk.fake.cancelled))
    assert desk.trade.measured.measurement is None
    assert desk.jobs.jobs == ()
    assert desk.fake.remembered == []


def test_what_is_remembered_is_shown_and_a_move_makes_it_stale(desk, qtbot):
    measured, fake = desk.trade.measured, desk.fake
    here = measurement_of(*COUNTING)
    fake.known = {
        ("histogram", THERE): here,
        ("histogram", HERE): stale(here),
        ("fmcw", THERE): measurement_of(*WAVES, family="fmcw"),
    }
    desk.trade.measured.rest_at(THERE)
    qtbot.waitUntil(lambda: measured.measurement is not None)
    assert not measured.measurement.stale
    measured.set_family("fmcw")
    assert measured.measurement.family == "fmcw"
    assert measured.counting == here
    desk.trade.measured.rest_at(HERE)
    # At once, before anything is read.
    assert measured.measurement.stale
    qtbot.waitUntil(lambda: measured.counting is not None)
    assert measured.counting.stale


def test_a_measurement_that_ends_after_a_move_is_of_another_place(desk, qtbot):
    measured = desk.trade.measured
    desk.fake.gate.clear()
    measured.measure()
    desk.trade.measured.rest_at(THERE)
    desk.fake.gate.set()
    qtbot.waitUntil(lambda: measured.job is None)
    assert measured.measurement.stale
    assert not desk.fake.remembered[0].stale


def test_a_clicked_point_says_when_it_was_measured_elsewhere(desk, qtbot):
    trade = desk.trade
    trade.measured.measure()
    qtbot.waitUntil(lambda: trade.measured.job is None)
    trade.use(trade.measured.measurement.of(FACING))
    assert not trade.in_use.elsewhere
    trade.measured.rest_at(THERE)
    assert trade.in_use.elsewhere
    assert "elsewhere" in str(trade.in_use)
    desk.fake.known["histogram", HERE] = measurement_of(result_of(FACING, 0.2, 0.03))
    trade.measured.rest_at(HERE)
    qtbot.waitUntil(lambda: not trade.in_use.elsewhere)
    assert trade.in_use.error == 0.2


def test_another_scene_forgets_everything(desk, qtbot):
    trade = desk.trade
    desk.choose(qtbot)
    trade.use(COUNTING[0])
    trade.attach(None, PRESETS["paper"])
    assert trade.in_use is None
    assert trade.frames == 0
    assert not trade.measured.can_measure
    trade.choose(HERE, BUDGET_MS)
    assert not trade.choosing
