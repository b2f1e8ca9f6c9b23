"""A mesh (or point cloud) that moves: vertices, faces, times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.bodies import Body, persons_of
from sd2core.mesh.presence import Presence, checked
from sd2core.mesh.things import Surroundings
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.plausibility.clock import gaps_between
from sd2core.timebase import Timebase


class VertexArray(Protocol):
    """Interface of vertices: a NumPy array, or a chunked array that stays on disk."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(T, V, 3)."""

    @property
    def dtype(self) -> Any:
        """A floating point type."""

    def __getitem__(self, key: Any) -> Any: ...


@dataclass(frozen=True, eq=False)
class MeshSequence:
    """Vertices through time with one topology.

    Parameters
    ----------
    vertices : array, shape (T, V, 3)
        Metres in the camera frame (x right, y down, z forward). May stay on
        disk; read time ranges with :meth:`read`.
    faces : int32 array, shape (F, 3), or None
        Counter-clockwise seen from outside. None makes it a point cloud, which
        has no surface and takes visibility ``none`` only.
    timebase : Timebase
        One time per frame.
    source : str
        Origin of the mesh, for provenance.
    notes : tuple of str
        Remarks of the reader: repairs, and all else that the user should know.
    vertex_counts : int64 array, shape (V,), optional
        Number of vertices that each stands for, after decimation; None: for itself.
    present : bool array, shape (T,), optional
        False where there is no person. Vertices hold the last known pose there, which
        nothing may be concluded from. None: there is one in every frame.
    uncertainty : VelocityUncertainty, optional
        Standard deviations of the velocities; None: not stated.
    findings : tuple of Sd2Error
        What the reader found unlikely; in words it is among the notes.
    surroundings : Surroundings, optional
        Things that stand still around it; see :func:`sd2core.io.things.with_things`.
    others : tuple of MeshSequence
        Other bodies in the same scene, at the same times, with faces; see
        :func:`sd2core.io.bodies.with_bodies`.
    person : str
        Name of the person in a scene of several.
    placed : Body, optional
        Where one of the others comes from, and how it was put there.
    simulated : bool
        True if it is known that no camera saw it.

    Examples
    --------
    A triangle that moves towards the camera at 1 m/s:

    >>> import numpy as np
    >>> import sd2core as sd2
    >>> times = sd2.Timebase.regular(frames=4, frames_per_s=10)
    >>> corners = np.array([[0, 0, 3], [0.5, 0, 3], [0, 0.5, 3]])
    >>> forward = np.array([0, 0, -1.0]) * times.times_s[:, None, None]
    >>> mesh = sd2.MeshSequence(corners + forward, np.array([[0, 2, 1]]), times)
    >>> mesh.frame_count, mesh.vertex_count
    (4, 3)
    >>> mesh.between(1, 3).times_s
    array([0.1, 0.2])
    """

    vertices: VertexArray
    faces: NDArray[np.int32] | None
    timebase: Timebase
    source: str = ""
    notes: tuple[str, ...] = ()
    vertex_counts: NDArray[np.int64] | None = None
    present: NDArray[np.bool_] | None = None
    uncertainty: VelocityUncertainty | None = None
    findings: tuple[Sd2Error, ...] = ()
    surroundings: Surroundings | None = None
    others: tuple[MeshSequence, ...] = ()
    person: str = ""
    placed: Body | None = None
    simulated: bool = False

    def __post_init__(self) -> None:
        shape, name = tuple(self.vertices.shape), self.source or "The mesh"
        check_shape(shape, name)
        if shape[0] != len(self.timebase):
            raise Sd2Error(
                f"{name}: {shape[0]} frames but {len(self.timebase)} times",
                "one time per frame",
            )
        if self.vertex_counts is not None:
            counts = np.ascontiguousarray(self.vertex_counts, np.int64)
            if counts.shape != (shape[1],) or counts.min() < 1:
                raise Sd2Error(
                    f"{name}: vertex_counts of shape {counts.shape},"
                    f" the least of them {counts.min(initial=1)}",
                    f"{shape[1]} numbers from 1",
                )
            object.__setattr__(self, "vertex_counts", counts)
        if self.present is not None:
            present = checked(self.present, shape[0])
            # Someone everywhere is said in one way only.
            object.__setattr__(self, "present", None if present.all() else present)
        if (known := self.uncertainty) is not None:
            given = known.frame_count, len(known.vertex_limb)
            if given != shape[:2]:
                raise Sd2Error(
                    f"{name}: its uncertainty is of {given[0]} frames and {given[1]} vertices",
                    f"those of the mesh, {shape[0]} and {shape[1]}",
                )
        if self.faces is not None and not np.size(self.faces):
            object.__setattr__(self, "faces", None)
        for body in self.bodies if self.others else ():
            if body.faces is None or not np.array_equal(body.times_s, self.times_s):
                raise Sd2Error(
                    f"{body.source or 'A body'} of a scene of {len(self.bodies)} has"
                    + (" no faces" if body.faces is None else " frames at other times"),
                    "surfaces in frames at the same times",
                    "Put them together with sd2core.io.bodies.with_bodies",
                )
        if self.faces is not None:
            object.__setattr__(self, "faces", checked_faces(self.faces, shape[1], name))

    def __repr__(self) -> str:
        faces = "no triangles" if self.faces is None else f"{len(self.faces):,} triangles"
        parts = [
            f"{self.vertex_count:,} vertices, {faces}",
            self.timebase.words,
            *([self.source] if self.source else []),
        ]
        return f"<MeshSequence {' · '.join(parts)}>"

    @property
    def frame_count(self) -> int:
        """Number of frames T."""
        return int(self.vertices.shape[0])

    @property
    def vertex_count(self) -> int:
        """Number of vertices V."""
        return int(self.vertices.shape[1])

    @property
    def represented_count(self) -> int:
        """Number of vertices that these stand for: V, or before decimation."""
        if self.vertex_counts is None:
            return self.vertex_count
        return int(self.vertex_counts.sum())

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of every frame, shape (T,)."""
        return self.timebase.times_s

    @cached_property
    def presence(self) -> Presence:
        """Frames with a person, in stretches that no frames are lost from."""
        return Presence.of(self.present, self.frame_count, gaps_between(self.times_s))

    @property
    def bodies(self) -> tuple[MeshSequence, ...]:
        """Bodies of the scene, this one first."""
        return self, *self.others

    @property
    def persons(self) -> tuple[str, ...]:
        """Name of each of the bodies: its own, or ``person 2`` by its number; each once."""
        return persons_of(body.person for body in self.bodies)

    def body(self, person: str | None = None) -> MeshSequence:
        """One person of the scene, with what stands around; Sd2Error where a name is needed."""
        names = self.persons
        if person is None and not self.others:
            return self
        if person not in names:
            asked = "" if person is None else f", not {person}"
            raise Sd2Error(
                f"{self.source or 'The scene'} shows {' and '.join(names)}{asked}",
                "one of them by name",
                "Name one with --person, for data sets in the labels, in Python by mesh.body(NAME)",
            )
        alone = self.bodies[names.index(person)]
        return replace(alone, others=(), person=person, surroundings=self.surroundings)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Vertices of frames ``start`` to ``stop`` (exclusive) in memory, (n, V, 3)."""
        if not 0 <= start < stop <= self.frame_count:
            raise IndexError(f"frames {start} to {stop} of {self.frame_count}")
        return np.asarray(self.vertices[start:stop])

    def between(self, start: int, stop: int) -> MeshSequence:
        """Frames ``start`` to ``stop`` (exclusive) in memory, at their times."""
        known = self.uncertainty
        return replace(
            self,
            vertices=self.read(start, stop),
            timebase=Timebase(self.times_s[start:stop]),
            present=None if self.present is None else self.present[start:stop],
            uncertainty=None if known is None else known.of_frames(slice(start, stop)),
            others=tuple(body.between(start, stop) for body in self.others),
        )

    def frame(self, index: int) -> NDArray[Any]:
        """Vertices of one frame, (V, 3)."""
        return self.read(index, index + 1)[0]

    def person_at(self, time_s: float) -> int | None:
        """Frame at a time, None where the mesh has no frame or no person."""
        if not self.timebase.covers(time_s):
            return None
        frame = self.timebase.frame_at(time_s)
        return frame if self.presence.present[frame] else None


def check_shape(shape: tuple[int, ...], name: str) -> None:
    """Raise Sd2Error unless this is the shape of the vertices of a mesh."""
    if len(shape) != 3 or shape[2] != 3 or 0 in shape:
        raise Sd2Error(
            f"{name}: the vertices have shape {shape}",
            "(frames, vertices, 3), none of them zero",
            "Transpose or cut the array where the file is written",
        )


def checked_faces(faces: ArrayLike, vertices: int, name: str) -> NDArray[np.int32]:
    """Faces (F, 3) of a mesh with so many vertices; Sd2Error if they are none, or of another."""
    numbers = np.asarray(faces)
    if numbers.ndim != 2 or numbers.shape[1] != 3 or numbers.dtype.kind not in "iuf":
        raise Sd2Error(
            f"{name}: the faces have shape {numbers.shape} and type {numbers.dtype}",
            "(faces, 3): three vertex numbers per triangle",
            "Triangulate the surface where the file is written",
        )
    if numbers.dtype.kind == "f" and not (numbers == np.floor(numbers)).all():
        raise Sd2Error(f"{name}: face numbers are not whole", "vertex numbers such as 0, 1, 2")
    least, most = numbers.min(initial=0), numbers.max(initial=0)
    if least < 0 or most >= vertices:
        raise Sd2Error(
            f"{name}: a face names vertex {least if least < 0 else most:.0f},"
            f" the mesh has {vertices:,} vertices",
            f"vertex numbers from 0 to {vertices - 1}",
            "Give the faces that belong to this mesh (--faces)",
        )
    return np.ascontiguousarray(numbers, np.int32)


def refuse_missing(vertices: NDArray[Any], first_frame: int, source: str) -> None:
    """Raise Sd2Error for a coordinate that is NaN or infinite, naming frame and vertex.

    ``vertices`` (n, V, 3) are those from ``first_frame`` on.
    """
    finite = np.isfinite(vertices)
    if finite.all():
        return
    frame, vertex = np.argwhere(~finite)[0][:2]
    raise Sd2Error(
        f"{source or 'The mesh'}: vertex {vertex} of frame {first_frame + frame} is at"
        f" {place_in_words(vertices[frame, vertex])}",
        "finite coordinates in metres in every frame",
        "Fill that vertex, or leave out the frame, where the file is written",
    )


def place_in_words(place_m: NDArray[Any]) -> str:
    """Coordinates for a message: ``(0.1, nan, 2.5)``."""
    return f"({', '.join(f'{value:g}' for value in place_m)})"
