"""Functions of the library that choose and measure accuracy plans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan, Family
    from sd2core.accuracy.results import Choice, Measurement
    from sd2core.accuracy.survey import Survey
    from sd2core.doppler.synthesizer import Synthesizer


class AccuracyLibrary:
    """Functions of :mod:`sd2core.accuracy` that the models call; tests replace them.

    They are imported when they are called, in a background thread: the signal chain that comes
    with them takes a second to load.
    """

    def survey(
        self,
        mesh: MeshSequence,
        sensor: VirtualSensor,
        options: SynthesisOptions,
        progress: Progress,
        like: Survey | None,
    ) -> Survey:
        """Look at a scene; ``like`` is an earlier survey of the same mesh."""
        from sd2core.accuracy.survey import survey_scene

        return survey_scene(mesh, sensor, options, progress, like=like)

    def choose(self, mesh: MeshSequence, sensor: VirtualSensor, **wish: Any) -> Choice:
        """Choose a plan, and drop what was prepared for its survey."""
        from sd2core.accuracy.choosing import choose

        chosen = choose(mesh, sensor, **wish)
        survey: Survey | None = wish.get("survey")
        if survey is not None:
            survey.trial.forget()
        return chosen

    def measure(self, mesh: MeshSequence, sensor: VirtualSensor, **wish: Any) -> Measurement:
        """Measure all plans of a family but for their memory: the window's other threads work."""
        from sd2core.accuracy.measuring import measure

        return measure(mesh, sensor, memory=False, **wish)

    def recall(
        self, mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, family: Family
    ) -> Measurement | None:
        """Read the measurement of a scene that an earlier one has stored."""
        from sd2core.accuracy.cache import cached_measurement

        return cached_measurement(mesh, sensor, options, family)

    def store(self, mesh: MeshSequence, measurement: Measurement) -> None:
        """Store a measurement."""
        from sd2core.accuracy.cache import store_measurement

        store_measurement(mesh, measurement)

    def synthesizer_for(
        self,
        plan: AccuracyPlan,
        mesh: MeshSequence,
        options: SynthesisOptions,
        like: Synthesizer | None,
    ) -> Synthesizer:
        """Make a synthesizer that follows a plan."""
        from sd2core.accuracy.trial import synthesizer_for

        return synthesizer_for(plan, mesh, options, like=like)
