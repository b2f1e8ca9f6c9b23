"""Things around a mesh, from the shelf or read from mesh files, and walls."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.io.mesh_files import read_surface
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import MAX_THINGS, Surface, Surroundings, Thing
from sd2core.mesh.walls import MAX_WALLS, Wall

_MAX_FACES = 200_000
"""Of a thing: each is looked at in every frame."""


def with_things(mesh: MeshSequence, things: Iterable[Thing]) -> MeshSequence:
    """Put things around a mesh, in place of those that were there; its walls stay.

    They hide what is behind them wherever visibility is by ``depth`` or ``exact``, and echo
    where a radar's signal is simulated.

    Raises Sd2Error for a file that is no surface.

    Examples
    --------
    A screen between camera and person leaves nothing to be seen:

    >>> import sd2core as sd2
    >>> mesh = sd2.open_sample().load_mesh().between(30, 36)
    >>> screen = sd2.Thing("screen", position_m=(0, 2, 1), size_m=(3, 4, 0.03))
    >>> float(sd2.Synthesizer(sd2.with_things(mesh, [screen])).map().values.sum())
    0.0
    """
    all_things = tuple(things)
    if len(all_things) > MAX_THINGS:
        raise Sd2Error(f"There are {len(all_things)} things", f"up to {MAX_THINGS}")
    surfaces = tuple(
        one.placed(_read(Path(one.shape)) if one.is_file else None) for one in all_things
    )
    walls = () if mesh.surroundings is None else mesh.surroundings.walls
    return replace(mesh, surroundings=Surroundings.of(all_things, surfaces, walls))


def with_walls(mesh: MeshSequence, walls: Iterable[Wall]) -> MeshSequence:
    """Put walls around a mesh, in place of those that were there; its things stay.

    By way of each, first-order mirror paths add to maps and simulated signals.

    Examples
    --------
    >>> import sd2core as sd2
    >>> mesh = sd2.open_sample().load_mesh().between(30, 36)
    >>> sd2.with_walls(mesh, [sd2.Wall(1.0, azimuth_deg=90)]).surroundings.walls[0].words
    'wall right at 1 m, 8.2 dB'
    """
    all_walls = tuple(walls)
    if len(all_walls) > MAX_WALLS:
        raise Sd2Error(f"There are {len(all_walls)} walls", f"up to {MAX_WALLS}")
    around = mesh.surroundings
    things = ((), ()) if around is None else (around.things, around.surfaces)
    return replace(mesh, surroundings=Surroundings.of(*things, all_walls))


def _read(path: Path) -> Surface:
    """Surface of a file in its own frame; one that is dragged is not read again."""
    if not path.is_file():
        raise Sd2Error(
            f"The mesh {path} of a thing is not there",
            "the file where the recording or the command says",
            "Move it back, find it again (File → Find missing files…, or `sd2 relink`), or say anew"
            " what stands there with `sd2 set RECORDING --thing`",
        )
    return _read_once(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _read_once(path: Path, _modified_ns: int) -> Surface:
    vertices, faces = read_surface(path)
    if faces is None or len(faces) > _MAX_FACES:
        raise Sd2Error(
            f"{path} has {0 if faces is None else len(faces):,} triangles",
            f"a surface of up to {_MAX_FACES:,}",
            "Export it with fewer" if faces is not None else "",
        )
    if not np.isfinite(vertices).all():
        raise Sd2Error(f"{path} has a vertex without a place", "finite coordinates")
    return vertices, faces.astype(np.int32)
