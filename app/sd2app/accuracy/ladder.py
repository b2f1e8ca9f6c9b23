"""The accuracy functions of the library, which is loaded at the first call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.choosing import Survey
    from sd2core.accuracy.plans import AccuracyPlan, Family
    from sd2core.accuracy.results import Choice, Measurement
    from sd2core.doppler.synthesizer import Synthesizer


@dataclass(frozen=True)
class Ladder:
    """Functions of :mod:`sd2core.accuracy` that the models call; tests replace them."""

    survey: Callable[[MeshSequence, VirtualSensor, SynthesisOptions, Progress, Any], Any]
    choose: Callable[..., Choice]
    measure: Callable[..., Measurement]
    remembered: Callable[..., Measurement | None]
    remember: Callable[[MeshSequence, Measurement], None]
    synthesizer_for: Callable[
        [AccuracyPlan, MeshSequence, SynthesisOptions, Synthesizer | None], Any
    ]


# Imported in the functions: they run in a background thread, and the signal
# chain that comes with the ladder takes a second to load.


def _survey(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    progress: Progress,
    like: Survey | None,
) -> Survey:
    from sd2core.accuracy.choosing import survey_scene

    return survey_scene(mesh, sensor, options, progress, like=like)


def _choose(mesh: MeshSequence, sensor: VirtualSensor, **wish: Any) -> Choice:
    from sd2core.accuracy.choosing import choose

    return choose(mesh, sensor, **wish)


def _measure(mesh: MeshSequence, sensor: VirtualSensor, **wish: Any) -> Measurement:
    from sd2core.accuracy.measuring import measure

    return measure(mesh, sensor, **wish)


def _remembered(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, family: Family
) -> Measurement | None:
    from sd2core.accuracy.cache import cached_measurement

    return cached_measurement(mesh, sensor, options, family)


def _remember(mesh: MeshSequence, measurement: Measurement) -> None:
    from sd2core.accuracy.cache import store_measurement

    store_measurement(mesh, measurement)


def _synthesizer_for(
    plan: AccuracyPlan, mesh: MeshSequence, options: SynthesisOptions, like: Synthesizer | None
) -> Synthesizer:
    from sd2core.accuracy.trial import synthesizer_for

    return synthesizer_for(plan, mesh, options, like=like)


CORE = Ladder(_survey, _choose, _measure, _remembered, _remember, _synthesizer_for)
"""Functions of the library itself."""
