"""Accuracy plans with known answers, for tests of what the window does with them."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.results import (
    Choice,
    Cost,
    Errors,
    Machine,
    Measurement,
    PlanResult,
    Reason,
    Spread,
)

EXACT = AccuracyPlan()
FACING = AccuracyPlan(visibility="facing")
REASONS = (
    Reason("static", False, 0.91, "91 % of the vertices never leave the nulled bins: not modelled"),
    Reason("occlusion", True, 0.14, "what stands in between changes this map by 14 %: modelled"),
)


def errors_of(l1):
    around = Spread(l1, 2 * l1)
    return Errors(l1, 1.5 * l1, around, around, around, around, around, 20)


def result_of(plan, l1, cost_ms):
    cost = Cost(Spread(2 * cost_ms, 2 * cost_ms), Spread(cost_ms, cost_ms), 3 << 20, 0.25)
    return PlanResult(plan, errors_of(l1), cost)


def measurement_of(*results, family="histogram", scene="here"):
    return Measurement(
        family=family,
        reference=reference_plan(family),
        results=tuple(sorted(results, key=lambda result: result.cost.all_cores_ms.median)),
        scene=scene,
        machine=Machine("A processor", 2, "1"),
        frames=tuple(range(8)),
    )


COUNTING = (
    result_of(FACING, 0.13, 0.02),
    result_of(AccuracyPlan(visibility="depth", depth_resolution=128), 0.03, 1.0),
    result_of(AccuracyPlan(mask_stride=5), 0.008, 0.6),
    result_of(EXACT, 0.0, 2.1),
)
WAVES = (
    result_of(AccuracyPlan(signal="fmcw"), 0.02, 4.0),
    result_of(AccuracyPlan(signal="direct", motion="interpolated"), 0.0, 400.0),
)


class FakeSurvey:
    """Survey and trial in one, of a scene that is not looked at."""

    def __init__(self, mesh, sensor, options):
        self.mesh, self.sensor, self.options = mesh, sensor, options
        self.trial, self.built_on = self, None

    def at(self, sensor):
        """That of another place, which builds on this one."""
        other = FakeSurvey(self.mesh, sensor, self.options)
        other.built_on = self.sensor
        return other

    def forget(self):
        """Nothing was prepared."""


class FakeAccuracy:
    """What it answers, what it was asked, and a gate that keeps an answer back.

    Without a plan for a tolerance the one given as ``plan`` is chosen; ``gate``
    is open unless a test clears it, and progress is reported meanwhile.
    """

    def __init__(self, plan=EXACT, error=0.0, dragging=FACING):
        self.plans = {}
        self.plan, self.error, self.holds = plan, error, True
        self.dragging = dragging
        self.asked, self.surveyed, self.alike, self.cancelled = [], [], [], []
        self.failure = None
        self.gate = threading.Event()
        self.gate.set()
        self.known = {}
        self.remembered = []

    def library(self):
        """Itself, in place of the functions of the library."""
        return self

    def cached_measurement(self, mesh, sensor, options, family):
        return self.known.get((family, sensor))

    def _wait(self, progress):
        try:
            while not self.gate.wait(0.002):
                progress(0, 10)
        except BaseException:
            self.cancelled.append(time.monotonic())
            raise
        progress(10, 10)

    def survey_scene(self, mesh, sensor, options, progress, *, trial):
        self.surveyed.append(sensor)
        self.alike.append(trial and trial.built_on)
        self._wait(progress)
        return FakeSurvey(mesh, sensor, options)

    def choose(self, mesh, sensor, *, tolerance=None, budget_ms=None, progress, **parts):
        self.asked.append((tolerance, budget_ms, sensor))
        assert parts["survey"].sensor == sensor
        self._wait(progress)
        if self.failure is not None:
            raise self.failure
        if tolerance is None:
            return Choice(self.dragging, True, errors_of(0.13), 0.02, REASONS, None, budget_ms, 0.1)
        plan = self.plans.get(tolerance, self.plan)
        return Choice(plan, self.holds, errors_of(self.error), 0.6, REASONS, tolerance, None, 0.1)

    def measure(self, mesh, sensor, *, options, family, memory, progress):
        # Tracing that ends while another thread's kernel allocates ends the process.
        assert not memory
        self._wait(progress)
        results = COUNTING if family == "histogram" else WAVES
        return measurement_of(*results, family=family)

    def store_measurement(self, mesh, measurement):
        self.remembered.append(measurement)


def stale(measurement):
    return replace(measurement, stale=True)
