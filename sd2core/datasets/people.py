"""Who a source is of where labels name persons: their body, their labels, their frames."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.source import FROM_A_MESH
from sd2core.errors import Sd2Error
from sd2core.labels.per_frame import label_per_frame
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording, is_recording, open_recording


def people_shown(paths: Sequence[Path]) -> list[str]:
    """Person of each recording or map, see :func:`told_apart`."""
    return told_apart(
        [open_recording(path).subject if is_recording(path) else "" for path in paths], paths
    )


def told_apart(said: Sequence[str], paths: Sequence[Path]) -> list[str]:
    """Names that files give people; without one each shows another, called as file or folder is."""
    places = [Path(os.path.abspath(path)) for path in paths]  # however they were typed
    names = [name or path.stem for name, path in zip(said, paths, strict=True)]
    folders = [path.parent.name or path.stem for path in places]
    stems = [f"{path.parent.name} {path.stem}" for path in places]
    for others in (folders, stems, [str(path) for path in places]):
        count = Counter(name for known, name in zip(said, names, strict=True) if not known)
        names = [
            known or (name if count[name] == 1 else other)
            for known, name, other in zip(said, names, others, strict=True)
        ]
    return names


def subject_of(recording: Recording, person: str, first: str) -> str:
    """Subject whom a person of a recording is; ``first`` is that of the first, or of everybody."""
    persons = recording.persons
    if person in ("", persons[0]):
        return first
    own = dict(zip(persons[1:], (one.person for one in recording.bodies), strict=True))
    # Who has no name is somebody else in each recording.
    folder = recording.folder
    usual = first in (folder.stem, recording.subject)
    called = folder.stem if usual else f"{folder.parent.name} {folder.stem}"
    return person if own.get(person, person) else f"{called} {person}"


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

    @property
    def in_scene(self) -> tuple[str, ...]:
        """Persons who are in the scene, in the order of the bodies; a video is fitted to one."""
        return self.recording.persons[: None if self.recording.mesh else 1]

    def number(self, person: str) -> int | None:
        """Number of a person's body; None where the person is not in the scene."""
        persons = self.in_scene
        # Whoever is named is the only one there is.
        if len(persons) == len(self.labels.persons) == 1:
            return 0
        return persons.index(person) if person in persons else None

    def bodies(self, person: str) -> tuple[MeshSequence, ...]:
        """Bodies whose map a source is of; none where the person is not in the scene."""
        if not person:
            return self.everybody
        number = self.number(person)
        return () if number is None else self.everybody[number : number + 1]

    def body(self, person: str) -> MeshSequence:
        """Body that inertial sensors are fixed to; Sd2Error where none is, or it is not told."""
        bodies = self.bodies(person)
        if not bodies:
            raise Sd2Error(
                f"{self.recording.folder} has no mesh" + (f" of {person}" if person else ""),
                "one, to which inertial sensors can be fixed",
                "Fit a mesh with `sd2 fit`, or export without them",
            )
        return replace(bodies[0], others=()) if person else bodies[0].body()

    def labels_of(self, person: str) -> Labels:
        """Labels that hold for the person."""
        return self.labels.of_person(person) if person else self.labels

    def unclear(
        self, person: str, names: tuple[str, ...], times_s: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Frames in which a radar sees somebody else do what a label of the person is not."""
        if not person:
            return np.zeros(len(times_s), bool)
        others = tuple(span for span in self.labels.spans if span.person not in ("", person))
        own, theirs = (
            label_per_frame(labels, names, times_s)
            for labels in (self.labels_of(person), replace(self.labels, spans=others))
        )
        return (theirs > 0) & (theirs != own)

    def known(
        self, person: str, names: tuple[str, ...], maps: dict[MapKind, DopplerMap]
    ) -> dict[MapKind, DopplerMap]:
        """Maps of a source, a radar's with the frames in which it is not :meth:`unclear`.

        Raises Sd2Error where there are none.
        """
        if not maps:
            absent = person and self.number(person) is None
            which = f"of {person}, who is not in its scene" if absent else "that is wanted"
            raise Sd2Error(
                f"{self.recording.folder} has no map {which}",
                "a mesh of who is labelled, or a radar file",
            )
        if not person:
            return maps
        times_s = next(iter(maps.values())).times_s
        clear = ~self.unclear(person, names, times_s)
        return {
            kind: one if kind in FROM_A_MESH else replace(one, present=one.present_mask & clear)
            for kind, one in maps.items()
        }

    def shown(self, person: str, kinds: Iterable[MapKind]) -> dict[str, Any]:
        """People of the scene, and the kinds of maps that show them all, for provenance."""
        persons = self.in_scene if self.recording.mesh else ()
        scene = list(dict.fromkeys([*persons, *self.labels.persons]))
        if not person or len(scene) < 2:
            return {}
        everybody = [kind for kind in kinds if kind not in FROM_A_MESH]
        return {"scene": scene, "person": person, "everybody": everybody}


def map_of(person: str, body: MeshSequence, everybody: DopplerMap) -> DopplerMap:
    """Map of a person of a scene alone, from the split map of all."""
    return replace(everybody.of_person(person), present=present_frames([body]))


def present_frames(bodies: Iterable[MeshSequence]) -> NDArray[np.bool_]:
    """Frames in which the motion of one of the bodies can be known."""
    return np.logical_or.reduce([body.presence.measured for body in bodies])
