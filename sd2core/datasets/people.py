"""Who a source is of where labels name persons: their body, their labels, their frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.source import FROM_A_MESH, label_per_frame
from sd2core.labels.spans import Labels
from sd2core.maps import MapKind
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording


def subject_of(recording: Recording, person: str, first: str) -> str:
    """Subject whom a person of a recording is; ``first`` is that of the first, or of everybody."""
    there = recording.persons
    if person in ("", there[0]):
        return first
    own = dict(zip(there[1:], (one.person for one in recording.bodies), strict=True))
    # Who has no name is somebody else in each recording.
    return person if own.get(person, person) else f"{recording.folder.stem} {person}"


@dataclass(frozen=True, eq=False)
class People:
    """People of a recording; an empty ``person`` is everybody, where labels name nobody."""

    recording: Recording
    mesh: MeshSequence | None
    labels: Labels

    @property
    def everybody(self) -> tuple[MeshSequence, ...]:
        """All bodies of the scene."""
        return () if self.mesh is None else self.mesh.bodies

    def bodies(self, person: str) -> tuple[MeshSequence, ...]:
        """Bodies whose map a source is of; none where the person is not in the scene."""
        there, bodies = self.recording.persons, self.everybody
        # Whoever is named is the only one there is.
        if not person or (len(bodies) == 1 and len(self.labels.persons) == 1):
            return bodies
        return (bodies[there.index(person)],) if bodies and person in there else ()

    def labels_of(self, person: str) -> Labels:
        """Labels that hold for the person."""
        return self.labels.of_person(person) if person else self.labels

    def unclear(
        self, person: str, names: tuple[str, ...], times_s: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Frames in which a radar sees somebody else do what a label of the person is not."""
        if not person:
            return np.zeros(len(times_s), bool)
        others = [span for span in self.labels.spans if span.person not in ("", person)]
        own, theirs = (
            label_per_frame(spans, names, times_s)
            for spans in (self.labels_of(person).spans, others)
        )
        return (theirs > 0) & (theirs != own)

    def shown(self, person: str, kinds: Iterable[MapKind]) -> dict[str, Any]:
        """Who is in the scene, and which kinds of maps show them all, for provenance."""
        there = self.recording.persons[: len(self.everybody)]
        scene = list(dict.fromkeys([*there, *self.labels.persons]))
        if not person or len(scene) < 2:
            return {}
        everybody = [kind for kind in kinds if kind not in FROM_A_MESH]
        return {"scene": scene, "person": person, "everybody": everybody}


def present_frames(bodies: Iterable[MeshSequence]) -> NDArray[np.bool_]:
    """Frames in which the motion of one of the bodies can be known."""
    return np.logical_or.reduce([body.presence.measured for body in bodies])
