"""Choice of one plan for many sensor places around a mesh, where that saves time.

Choosing takes as long as thousands of frames of maps. So the times of choosing, of maps with the
given options, and of maps with the most accurate plan are first estimated on a few frames.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sd2core.accuracy.choosing import check_options, check_request, choose
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.survey import survey_scene
from sd2core.accuracy.trial import Trial, synthesizer_for
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.reference import reference_stretch
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

MAX_PLACES = 3
"""On which a plan is checked: each takes some hundred milliseconds."""

_CHOOSING_FRAMES, _CHECKING_FRAMES = 250, 80
"""Frames of the reference that choosing takes about as long as (how well that fits prints
tests/benchmarks/test_tolerance_speed.py), and that are checked on."""

_MIN_FRAMES = 1000
"""Of maps: fewer are made in the time that any estimate takes."""

_RUN_FRAMES = 5
_RUNS = 2
_SAVED_SHARE = 0.25
"""Of the estimated time of maps, what a chosen plan is taken to save. Frames in short runs, which
are timed, take up to half as long again as those of whole maps, and plans often save little."""


@dataclass(frozen=True)
class PlacedPlan:
    """A plan for all places around a mesh."""

    plan: AccuracyPlan
    error_l1: float
    """The largest on the places that were checked; 0 for the most accurate plan, against which
    errors are measured."""
    reasons: tuple[str, ...]  # sentences

    def provenance(self) -> dict[str, Any]:
        """Entries for the metadata of a map."""
        return self.plan.provenance(self.error_l1) | {"plan_reasons": list(self.reasons)}


def spread(sensors: Sequence[VirtualSensor]) -> list[VirtualSensor]:
    """Places on which a plan is checked: the first, the last and some in between."""
    numbers = np.linspace(0, len(sensors) - 1, min(MAX_PLACES, len(sensors))).round().astype(int)
    return [sensors[number] for number in numbers.tolist()]


def choose_for_places(
    mesh: MeshSequence,
    places: Sequence[VirtualSensor],
    frames: int,
    tolerance: float,
    options: SynthesisOptions,
) -> PlacedPlan:
    """Choose the cheapest plan that holds a tolerance at all these places.

    Chosen at the first place and checked at the others; where it does not hold, another one
    is chosen there. Where choosing is estimated to take longer than it saves, maps are made
    as the options say, if that holds, or with the most accurate plan, which does.

    Parameters
    ----------
    mesh : MeshSequence
        Whole mesh, not decimated.
    places : sequence of VirtualSensor
        A few of all, see :func:`spread`.
    frames : int
        Frames of all maps that are to be made, together.
    tolerance : float
        As for :func:`~sd2core.accuracy.choosing.choose`: relative L1 after smoothing, above 0 and
        up to 1.
    options : SynthesisOptions
        For what a plan does not choose; taken as a plan, they are tried too.

    Raises
    ------
    Sd2Error
        For a tolerance out of bounds, or options that take Vid2Doppler's velocities.
    """
    check_request(tolerance)
    options = check_options(mesh, options)
    search = PlanSearch(mesh, places, tolerance, options)
    if frames < _MIN_FRAMES:
        return search.top(f"{frames:,} frames of maps are too few to choose a plan for")
    reference_s, top_s = search.reference_s(), search.frame_s(search.most_accurate)
    plain_s = search.frame_s(search.plain)
    checking_s = _CHECKING_FRAMES * len(places) * reference_s
    choosing_s = _CHOOSING_FRAMES * reference_s
    held: PlacedPlan | None = None
    if checking_s < (top_s - plain_s) * frames:
        held = search.checked(search.plain, ("As the options say: that holds the tolerance",))
    frame_s = top_s if held is None else plain_s
    if choosing_s + checking_s < _SAVED_SHARE * frame_s * frames:
        chosen = search.chosen()
        if chosen is not None and search.frame_s(chosen.plan) < frame_s:
            return chosen
        why = f"No cheaper plan is known to hold {tolerance:.1%} from every place"
    else:
        why = f"Choosing a plan would take longer than it saves on {frames:,} frames of maps"
    return held or search.top(why)


class PlanSearch:
    """Plans tried on one mesh from some places."""

    def __init__(
        self,
        mesh: MeshSequence,
        places: Sequence[VirtualSensor],
        tolerance: float,
        options: SynthesisOptions,
    ) -> None:
        self._mesh, self._places, self._tolerance = mesh, places, tolerance
        self._options = options
        self.most_accurate = reference_plan(
            "histogram", options.weight, surface=mesh.faces is not None
        )
        # Wrapping costs nothing, and is what the most accurate plan does.
        self.plain = AccuracyPlan(
            visibility=options.visibility,
            depth_resolution=options.depth_resolution,
            mask_stride=options.mask_stride,
            weight=options.weight,
            range_law=options.range_law,
            frame_rate_factor=options.oversampling,
        )
        self._trials: list[Trial] = []

    def top(self, reason: str) -> PlacedPlan:
        """Most accurate plan, taken for this reason."""
        return PlacedPlan(self.most_accurate, 0.0, (f"{reason}: the most accurate one is taken",))

    def checked(self, plan: AccuracyPlan, reasons: tuple[str, ...]) -> PlacedPlan | None:
        """Plan with its largest error, or None if it does not hold everywhere."""
        worst = 0.0
        for trial in self._tried():
            worst = max(worst, trial.errors(plan).l1)
            if worst > self._tolerance or not trial.tells:
                return None
        return PlacedPlan(plan, worst, reasons)

    def chosen(self) -> PlacedPlan | None:
        """First plan that is the cheapest at one place and holds at all of them, or None."""
        for place, trial in zip(self._places, self._tried(), strict=True):
            survey = survey_scene(self._mesh, place, self._options, trial=trial)
            choice = choose(
                self._mesh,
                place,
                tolerance=self._tolerance,
                options=self._options,
                dragging=False,
                survey=survey,
            )
            if not choice.holds:
                return None
            placed = self.checked(choice.plan, tuple(reason.text for reason in choice.reasons))
            if placed is not None:
                return placed
        return None

    def reference_s(self) -> float:
        """Processor seconds of a frame of the reference."""
        exact = self.most_accurate.options(self._options)
        frames = [start for start, _ in self._runs()]
        spent_s = []
        for frame in (frames[0], *frames):  # the first call reads what is compiled
            begun_s = time.thread_time()
            reference_stretch(self._mesh, self._places[0], exact, frame, frame + 1)
            spent_s.append(time.thread_time() - begun_s)
        return float(np.mean(spent_s[1:]))

    def frame_s(self, plan: AccuracyPlan) -> float:
        """Processor seconds of a frame of a map, with what all places share prepared."""
        synthesizer = synthesizer_for(plan, self._mesh, self._options)
        here = self._places[0]
        x, y, z = here.position_m
        spent_s, count = 0.0, 0
        for start, stop in self._runs():
            # Moved a little: what is visible from a place is kept, and would cost nothing.
            for place in (here, replace(here, position_m=(x + 1e-6, y, z))):
                last_s = synthesizer.stretch(place, start, stop, shares=False).processor_s
            spent_s, count = spent_s + last_s, count + stop - start
        return spent_s / count

    def _runs(self) -> list[tuple[int, int]]:
        """Some frames on end, evenly over the clip."""
        frames = self._mesh.frame_count
        length = min(_RUN_FRAMES, frames)
        starts = {int((frames - length) * (2 * k + 1) / (2 * _RUNS)) for k in range(_RUNS)}
        return [(start, start + length) for start in sorted(starts)]

    def _tried(self) -> list[Trial]:
        if not self._trials:
            sample = take_sample(self._mesh, self._places[0], self._options)
            first = Trial(self._mesh, self._places[0], self._options, sample)
            self._trials = [first, *(first.at(place) for place in self._places[1:])]
        return self._trials
