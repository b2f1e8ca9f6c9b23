"""Things that stand still in a scene: a shelf of simple ones, their sizes and places."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.walls import Wall
from sd2core.sensor import Vector

FARTHEST_THING_M = 1000.0
"""Largest coordinate of a thing, where single precision is right to a tenth of a millimetre."""

SIZES_M = 1e-3, 100.0
"""Least and greatest width, height and depth of a thing."""

MAX_THINGS = 100
"""In one scene."""

Surface = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Vertices (V, 3) in metres, and faces (F, 3), counter-clockwise seen from outside."""

_Boxes = tuple[tuple[Vector, Vector], ...]
"""Lowest and highest corner of boxes in a thing of width, height and depth 1.

It stands on the origin: x and z from −0.5 to 0.5, and y, which is down, from −1 to 0.
"""

SHELF: Mapping[str, tuple[Vector, _Boxes]] = {
    "box": ((0.5, 0.5, 0.5), (((-0.5, -1.0, -0.5), (0.5, 0.0, 0.5)),)),
    "table": (
        (1.2, 0.75, 0.7),
        (
            ((-0.5, -1.0, -0.5), (0.5, -0.95, 0.5)),
            *(
                ((x, -0.95, z), (x + 0.05, 0.0, z + 0.08))
                for x, z in product((-0.5, 0.45), (-0.5, 0.42))
            ),
        ),
    ),
    "screen": ((1.0, 1.8, 0.03), (((-0.5, -1.0, -0.5), (0.5, 0.0, 0.5)),)),
    "doorway": (
        (1.4, 2.2, 0.12),
        (
            ((-0.5, -1.0, -0.5), (-0.32, 0.0, 0.5)),
            ((0.32, -1.0, -0.5), (0.5, 0.0, 0.5)),
            ((-0.32, -1.0, -0.5), (0.32, -0.92, 0.5)),
        ),
    ),
}
"""Usual width, height and depth in metres of simple things, and the boxes that they are made of."""

_BOX_FACES = np.array(
    [
        *((0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7)),  # of least and greatest x
        *((0, 4, 5), (0, 5, 1), (2, 7, 6), (2, 3, 7)),  # y
        *((0, 2, 6), (0, 6, 4), (1, 7, 3), (1, 5, 7)),  # z
    ],
    np.int32,
)
"""Faces of a box whose corners count up in z, then y, then x."""


@dataclass(frozen=True)
class Thing:
    """A thing that stands still and hides what is behind it.

    Parameters
    ----------
    shape : str
        Name of a simple one from :data:`SHELF`, or the path of a mesh file (OBJ, PLY, GLB, STL;
        metres, y up).
    position_m : tuple of 3 floats
        Middle of its foot in the camera frame: x right, y down, z forward.
    turn_deg : float
        Turn about the vertical, seen from above clockwise, from -360 to 360.
    size_m : tuple of 3 floats, optional
        Width, height and depth of what it fills; None: as usual, or as the file has it.

    Examples
    --------
    >>> import sd2core as sd2
    >>> sd2.Thing("screen", position_m=(0.3, 0.9, 1.2), size_m=(0.6, 1.8, 0.03)).words
    'screen at x 0.3, y 0.9, z 1.2 m, 0.6 × 1.8 × 0.03 m'
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    shape: str
    position_m: Vector
    turn_deg: float = 0.0
    size_m: Vector | None = None

    def __post_init__(self) -> None:
        if self.shape not in SHELF and "." not in self.shape:
            raise Sd2Error(
                f"The thing is {self.shape!r}",
                f"one of {', '.join(SHELF)}, or the path of a mesh file such as chair.obj",
            )
        position = tuple(map(float, self.position_m))
        if len(position) != 3 or not all(abs(value) <= FARTHEST_THING_M for value in position):
            raise Sd2Error(
                f"The place of the {self.name} is {self.position_m}",
                f"three numbers x, y, z in metres, up to {FARTHEST_THING_M:g}",
            )
        object.__setattr__(self, "position_m", position)
        if not abs(self.turn_deg) <= 360:
            raise Sd2Error(f"The {self.name} is turned by {self.turn_deg}", "-360 to 360 degrees")
        if self.size_m is None:
            return
        low, high = SIZES_M
        size = tuple(map(float, self.size_m))
        if len(size) != 3 or not all(low <= value <= high for value in size):
            raise Sd2Error(
                f"The size of the {self.name} is {self.size_m}",
                f"width, height and depth from {low:g} to {high:g} m",
            )
        object.__setattr__(self, "size_m", size)

    @property
    def name(self) -> str:
        """Name: the shape, or that of the file."""
        return self.shape.replace("\\", "/").rpartition("/")[2]

    @property
    def is_file(self) -> bool:
        """True if its shape is the path of a mesh file."""
        return self.shape not in SHELF

    @property
    def words(self) -> str:
        """Text such as ``box at x 0, y 1, z 2 m, turned by 30°``."""
        x, y, z = self.position_m
        turn = f", turned by {self.turn_deg:g}°" if self.turn_deg else ""
        size = "" if self.size_m is None else f", {' × '.join(f'{m:g}' for m in self.size_m)} m"
        return f"{self.name} at x {x:g}, y {y:g}, z {z:g} m{turn}{size}"

    def placed(self, unplaced: Surface | None = None) -> Surface:
        """Surface in the camera frame.

        ``unplaced`` is that of its file, in metres and with y up; one of the shelf needs none.
        """
        if unplaced is None:
            usual_m, boxes = SHELF[self.shape]
            unit = [_box(*ends) for ends in boxes]
            vertices = np.concatenate(unit) * (self.size_m or usual_m)
            faces = np.concatenate([_BOX_FACES + 8 * number for number in range(len(boxes))])
        else:
            vertices, faces = unplaced[0] * [1.0, -1.0, -1.0], unplaced[1]
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            vertices = vertices - [0.5 * (low[0] + high[0]), high[1], 0.5 * (low[2] + high[2])]
            if self.size_m is not None:
                extent_m = high - low
                vertices = vertices * np.divide(
                    self.size_m, extent_m, out=np.ones(3), where=extent_m > 0
                )
        return vertices @ turn_matrix(self.turn_deg).T + self.position_m, faces


def turn_matrix(turn_deg: float) -> NDArray[np.float64]:
    """Matrix (3, 3) of a turn about the vertical, seen from above clockwise."""
    turn = math.radians(turn_deg)
    cos, sin = math.cos(turn), math.sin(turn)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Things and walls around a moving mesh, and the surfaces of things in the camera frame."""

    things: tuple[Thing, ...]
    surfaces: tuple[Surface, ...]  # of each
    vertices_m: NDArray[np.float64]  # of all, (V, 3)
    faces: NDArray[np.int32]  # (F, 3)
    walls: tuple[Wall, ...] = ()

    @classmethod
    def of(
        cls, things: tuple[Thing, ...], surfaces: tuple[Surface, ...], walls: tuple[Wall, ...] = ()
    ) -> Surroundings | None:
        """Join things, their surfaces and walls; None where there are none."""
        if not things and not walls:
            return None
        return cls(things, surfaces, *joined(surfaces), walls)

    def without(self, parts: Collection[str]) -> Surroundings | None:
        """These without ``things`` or ``walls``; None where nothing is left."""
        kept = ((), ()) if "things" in parts else (self.things, self.surfaces)
        return self.of(*kept, () if "walls" in parts else self.walls)

    @property
    def surface(self) -> Surface:
        """That of all things."""
        return self.vertices_m, self.faces

    @cached_property
    def boxes_m(self) -> NDArray[np.float64]:
        """Lowest and highest corner of each thing, (things, 2, 3)."""
        ends = [(vertices.min(axis=0), vertices.max(axis=0)) for vertices, _ in self.surfaces]
        return np.array(ends).reshape(-1, 2, 3)

    def by_way_of(
        self, wall: Wall, own: Surface | None = None, others: Sequence[Surface] = ()
    ) -> Surface:
        """Things that can hide a body from the image of a sensor behind a wall.

        Things and other bodies before the wall, and their images and the body's own: the sensor's
        image sees the latter as the sensor sees the former.
        """
        hiding = [before_wall(wall, *surface) for surface in (self.surface, *others)]
        images = hiding if own is None else [*hiding, own]
        return joined([*hiding, *((wall.mirrored(vertices), faces) for vertices, faces in images)])

    @cached_property
    def digest(self) -> str:
        """Hash of surfaces and walls: all that a map depends on."""
        walls = repr(self.walls).encode() if self.walls else b""
        surfaces = self.vertices_m.tobytes() + self.faces.tobytes()
        return hashlib.sha256(surfaces + walls).hexdigest()

    def as_dict(self) -> dict[str, list[dict[str, Any]]]:
        """Plain values of ``things`` and ``walls``, for provenance; of which there are none, none.

        >>> Surroundings.of((), (), (Wall(2.0, loss_db=6.0),)).as_dict()
        {'walls': [{'distance_m': 2.0, 'azimuth_deg': 0.0, 'elevation_deg': 0.0, 'loss_db': 6.0}]}
        """
        things, walls = [asdict(one) for one in self.things], [asdict(one) for one in self.walls]
        every = {"things": things, "walls": walls}
        return {name: entries for name, entries in every.items() if entries}


def before_wall(wall: Wall, vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Surface:
    """Surface without the faces that are wholly behind a wall."""
    before = wall.before_m(vertices_m) > 0
    return vertices_m, faces if before.all() else faces[before[faces].any(axis=1)]


def joined(surfaces: Sequence[Surface]) -> Surface:
    """Several surfaces as one."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces)])
    faces = [faces + number for (_, faces), number in zip(surfaces, first, strict=False)]
    # Plain memory of this type, as compiled kernels take it.
    return (
        np.concatenate([np.empty((0, 3)), *(vertices for vertices, _ in surfaces)]),
        np.ascontiguousarray(np.concatenate([np.empty((0, 3), np.int32), *faces]), np.int32),
    )


def _box(low: Vector, high: Vector) -> NDArray[np.float64]:
    """Corners of a box, (8, 3)."""
    return np.array(list(product(*zip(low, high, strict=True))))
