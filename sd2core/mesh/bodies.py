"""Bodies that move in a scene beside the first one: files, places, names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.paths import files_at
from sd2core.mesh.things import FARTHEST_THING_M
from sd2core.sensor import Vector

MAX_BODIES = 20
"""In one scene, beside the first: each is a map of its own to compute."""

LATEST_S = 1e6
"""Farthest that a body is shifted in time."""


@dataclass(frozen=True)
class Body:
    """A moving mesh beside that of the recording, in the same scene.

    Parameters
    ----------
    path : str
        The mesh file.
    moved_m : tuple of 3 floats
        How far it is moved from where its file has it: x right, y down, z forward.
    turn_deg : float
        Turn about the vertical through its middle in its first frame, seen from above clockwise,
        from -360 to 360.
    start_s : float
        How much later it moves than its file's times say.
    person : str
        Name of the person.
    reading : mapping
        Further arguments with which :func:`sd2core.load_mesh` reads the file.
    faces : str, optional
        File with its faces, where the mesh file has none.

    Examples
    --------
    >>> import sd2core as sd2
    >>> sd2.Body("anna.npz", moved_m=(0.8, 0, 0.5), turn_deg=90, person="anna").words
    'anna of anna.npz, moved by x 0.8, y 0, z 0.5 m, turned by 90°'
    """

    path: str
    moved_m: Vector = (0.0, 0.0, 0.0)
    turn_deg: float = 0.0
    start_s: float = 0.0
    person: str = ""
    reading: Mapping[str, Any] = field(default_factory=dict)
    faces: str | None = None

    def __post_init__(self) -> None:
        moved = tuple(map(float, self.moved_m))
        if len(moved) != 3 or not all(abs(value) <= FARTHEST_THING_M for value in moved):
            raise Sd2Error(
                f"{self.name} is moved by {self.moved_m}",
                f"three numbers x, y, z in metres, up to {FARTHEST_THING_M:g}",
            )
        object.__setattr__(self, "moved_m", moved)
        if not abs(self.turn_deg) <= 360:
            raise Sd2Error(f"{self.name} is turned by {self.turn_deg}", "-360 to 360 degrees")
        if not abs(self.start_s) <= LATEST_S:
            raise Sd2Error(
                f"{self.name} moves {self.start_s} s later", f"up to {LATEST_S:g} s to either side"
            )

    @property
    def name(self) -> str:
        """Name of the person, or of the file."""
        return self.person or self.file_name

    @property
    def files(self) -> list[Path]:
        """Files that it is read from."""
        return [*files_at(Path(self.path)), *([] if self.faces is None else [Path(self.faces)])]

    @property
    def file_name(self) -> str:
        """Name of the file."""
        return self.path.replace("\\", "/").rstrip("/").rpartition("/")[2]

    @property
    def words(self) -> str:
        """Text such as ``anna of anna.npz, moved by x 0.8, y 0, z 0 m, 2 s later``."""
        x, y, z = self.moved_m
        parts = [f"{self.person} of {self.file_name}" if self.person else self.file_name]
        if any(self.moved_m):
            parts.append(f"moved by x {x:g}, y {y:g}, z {z:g} m")
        if self.turn_deg:
            parts.append(f"turned by {self.turn_deg:g}°")
        if self.start_s:
            parts.append(f"{abs(self.start_s):g} s {'later' if self.start_s > 0 else 'earlier'}")
        return ", ".join(parts)


def persons_of(names: Iterable[str]) -> tuple[str, ...]:
    """Name of each body of a scene: its own, or ``person 2`` by its number; each once.

    Examples
    --------
    >>> from sd2core.mesh.bodies import persons_of
    >>> persons_of(["", "anna", "anna"])
    ('person 1', 'anna', 'anna (3)')
    """
    persons: list[str] = []
    for number, given in enumerate(names, 1):
        name = given.strip() or f"person {number}"
        persons.append(f"{name} ({number})" if name in persons else name)
    return tuple(persons)


def renamed(first: str, before: Sequence[Body], after: Sequence[Body]) -> dict[str, str]:
    """Old and new names of those beside ``first`` who are called otherwise, of the same files."""
    if len(before) != len(after):
        return {}
    old, new = (
        persons_of([first, *(one.person for one in bodies)])[1:] for bodies in (before, after)
    )
    return {
        name: other
        for one, then, name, other in zip(before, after, old, new, strict=True)
        if (one.path, one.reading) == (then.path, then.reading) and name not in new
    }
