"""Several moving bodies in one scene, on one clock."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.digests import signature
from sd2core.io.mesh import load_mesh
from sd2core.mesh.bodies import MAX_BODIES, Body
from sd2core.mesh.made_vertices import ChangedVertices, shifted, unshifted
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import turn_matrix
from sd2core.scattering.resampling import resample_mesh


def load_scene(
    path: Path | str,
    *,
    bodies: Iterable[Body] = (),
    called: str = "",
    simulated: bool = False,
    **reading: Any,
) -> MeshSequence:
    """Read a mesh, and the bodies that move beside it.

    Parameters
    ----------
    path : path
        Of the mesh.
    bodies : iterable of Body
        As for :func:`with_bodies`.
    called : str
        Name of the person whom the mesh is of.
    simulated : bool
        True if no camera saw it.
    **reading
        Arguments of :func:`sd2core.load_mesh`.
    """
    mesh = replace(load_mesh(path, **reading), simulated=simulated)
    return with_bodies(mesh, bodies, person=called)


def with_bodies(
    mesh: MeshSequence, bodies: Iterable[Body], *, person: str | None = None
) -> MeshSequence:
    """Put other bodies into the scene of a mesh, in place of those that were there.

    The file of one that is there already, turned like that, is not read again.

    They are brought to the times of the mesh: a file of the same times is taken as it is, another
    is interpolated, and nobody is there before its first frame and after its last one. Maps are
    sums over all bodies; each hides what is behind it.

    Parameters
    ----------
    mesh : MeshSequence
        The first body, with faces.
    bodies : iterable of Body
    person : str, optional
        Name of the first one; by default as it was.

    Raises
    ------
    Sd2Error
        For a file that is no surface, or too many bodies.

    Examples
    --------
    Somebody who does the same 1 m behind and half a second later:

    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> path = resource_path("swipes.sd2") / "mesh.zarr"
    >>> behind = sd2.Body(str(path), moved_m=(0.8, 0, 1), start_s=0.5, person="anna")
    >>> scene = sd2.with_bodies(sd2.load_mesh(path).between(30, 60), [behind])
    >>> scene.persons, scene.others[0].frame_count
    (('person 1', 'anna'), 30)
    """
    named = tuple(bodies)
    first = replace(mesh, others=(), person=mesh.person if person is None else person)
    if not named:
        return first
    if len(named) > MAX_BODIES:
        raise Sd2Error(f"There are {len(named)} more bodies", f"up to {MAX_BODIES}")
    if mesh.faces is None:
        raise _no_surface(mesh.source or "The mesh")
    return replace(first, others=tuple(_known(body, mesh) or _placed(body, mesh) for body in named))


def _known(body: Body, scene: MeshSequence) -> MeshSequence | None:
    """Body that is in the scene already, moved to its new place; None if its file is to be read."""
    others = [(other.placed, other) for other in scene.others if other.placed is not None]
    for placed, other in others:
        if placed == body:
            return other
    for placed, other in others:
        if replace(placed, moved_m=body.moved_m, person=body.person) == body:
            return _named(shifted(unshifted(other)[0], body.moved_m), body)
    return None


def _named(mesh: MeshSequence, body: Body) -> MeshSequence:
    return replace(mesh, person=body.person, surroundings=None, placed=body)


def _placed(body: Body, first: MeshSequence) -> MeshSequence:
    """Body of a file, in its place and at the times of the first."""
    path = Path(body.path)
    try:
        own = _read(body)
    except Sd2Error as error:
        if path.exists():
            raise
        raise Sd2Error(
            f"The mesh {path} of a body is not there",
            "the file where the recording or the command says",
            "Move it back, find it again (File → Find missing files…, or `sd2 relink`), or say anew"
            " who is there: `sd2 set RECORDING --body`",
        ) from error
    if own.faces is None:
        raise _no_surface(str(path), "`sd2 set RECORDING --body FILE,FACES`")
    if body.start_s:
        own = replace(own, timebase=own.timebase.shifted(body.start_s))
    on_clock, _ = resample_mesh(own, first.times_s)
    if on_clock.present is not None and not on_clock.present.any():
        spans = [f"{one.times_s[0]:.2f} to {one.times_s[-1]:.2f} s" for one in (own, first)]
        raise Sd2Error(
            f"{body.name} is never there: its frames are from {spans[0]}",
            f"some within those of the first body, {spans[1]}",
            "Shift it in time",
        )
    return _named(shifted(_turned(on_clock, own, body.turn_deg), body.moved_m), body)


def at_hand(body: Body, scene: MeshSequence) -> bool:
    """True if a body can be put into a scene without reading its file."""
    return _known(body, scene) is not None or _file_of(body) in _FILES


def _read(body: Body) -> MeshSequence:
    """Mesh of a file, kept while it is moved about."""
    file = _file_of(body)
    if (mesh := _FILES.get(file)) is None:
        faces = {} if body.faces is None else {"faces": body.faces}
        mesh = load_mesh(Path(body.path), **{**body.reading, **faces})
        with _FILES_LOCK:
            while len(_FILES) >= _FILES_KEPT:
                del _FILES[next(iter(_FILES))]
            _FILES[file] = mesh
    return mesh


def _file_of(body: Body) -> tuple[object, ...]:
    """Key of a file that is kept; another signature is of another content."""
    return body.path, body.faces, str(body.reading), str(signature(body.files))


_FILES: dict[tuple[object, ...], MeshSequence] = {}  # the last one read is last
_FILES_LOCK = Lock()
_FILES_KEPT = 4


def _turned(mesh: MeshSequence, own: MeshSequence, turn_deg: float) -> MeshSequence:
    """Mesh turned about the middle of its first frame in ``own``, which is as its file has it."""
    if not turn_deg:
        return mesh
    turn = turn_matrix(turn_deg)
    points = own.frame(int(np.argmax(own.presence.present))).astype(np.float64)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    by_m = middle - turn @ middle
    x, y, z = by_m.tolist()
    known = mesh.uncertainty
    return replace(
        mesh,
        vertices=ChangedVertices(mesh, lambda points: points @ turn.T + by_m),
        # What is known badly is so along the line from where the camera was.
        uncertainty=None if known is None else replace(known, camera_m=(x, y, z)),
    )


def _no_surface(what: str, how: str = "--faces") -> Sd2Error:
    return Sd2Error(
        f"{what} has no faces, it is a point cloud",
        "surfaces: in a scene of several bodies one hides another",
        f"Give the faces ({how})",
    )
