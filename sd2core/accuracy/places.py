"""Choice of one plan for many sensor places around a mesh, where that saves time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sd2core.accuracy.choosing import check_options, check_request, choose
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.survey import survey_scene
from sd2core.accuracy.trial import Trial
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

MAX_PLACES = 3
"""On which a plan is checked: each takes some hundred milliseconds."""

_MIN_FRAMES = 4000
"""Of maps: of fewer, choosing takes longer than it saves. Of a body of 5,000 vertices that is so
below 3,200, of smaller ones below 5,600 to 8,800, by some tenths of a second
(tests/benchmarks/test_tolerance_speed.py)."""


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
    """Choose the cheapest plan that holds a tolerance at all these places; each time the same.

    Chosen at the first place and checked at the others; where it does not hold, another one
    is chosen there. Of few frames, and where no other plan holds everywhere, maps are made with
    the most accurate plan, which does.

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
        For what a plan does not choose.

    Raises
    ------
    Sd2Error
        For a tolerance out of bounds, or options that take Vid2Doppler's velocities.
    """
    check_request(tolerance)
    options = check_options(mesh, options)
    why = f"{frames:,} frames of maps are too few to choose a plan for"
    if frames >= _MIN_FRAMES:
        if (placed := _chosen(mesh, places, tolerance, options)) is not None:
            return placed
        why = f"No cheaper plan is known to hold {tolerance:.1%} from every place"
    best = reference_plan("histogram", options.weight, surface=mesh.faces is not None)
    return PlacedPlan(best, 0.0, (f"{why}: the most accurate one is taken",))


def _chosen(
    mesh: MeshSequence,
    places: Sequence[VirtualSensor],
    tolerance: float,
    options: SynthesisOptions,
) -> PlacedPlan | None:
    """First plan that is the cheapest at one place and holds at all of them, or None."""
    first = Trial(mesh, places[0], options, take_sample(mesh, places[0], options))
    trials = [first, *(first.at(place) for place in places[1:])]
    for place, trial in zip(places, trials, strict=True):
        survey = survey_scene(mesh, place, options, trial=trial)
        choice = choose(mesh, place, tolerance=tolerance, options=options, survey=survey)
        if not choice.holds:
            return None
        worst = max(each.errors(choice.plan).l1 for each in trials)
        if worst <= tolerance and all(each.tells for each in trials):
            return PlacedPlan(choice.plan, worst, tuple(reason.text for reason in choice.reasons))
    return None
