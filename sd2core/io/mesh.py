"""Reading and writing meshes of every kind that is known."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error, wanted
from sd2core.files.limits import check_regular
from sd2core.files.paths import as_path, is_pattern
from sd2core.files.texts import errors_in
from sd2core.files.turns import Turn, rotation_of
from sd2core.io.fitted import fitted_doubts
from sd2core.io.mesh_arrays import RawMesh, read_npz, read_zarr, write_npz, write_zarr
from sd2core.io.mesh_checks import (
    check_mesh,
    judge_body,
    mark_empty_frames,
    mark_gaps,
    uncertainty_of,
)
from sd2core.io.mesh_files import (
    MOTION_SUFFIXES,
    SURFACE_SUFFIXES,
    read_faces,
    read_mesh_files,
    refuse_motion,
)
from sd2core.io.mesh_models import is_estimate, read_model_output
from sd2core.io.readers import MESH_FILES, FileReader, MeshHints, plug_in_for
from sd2core.io.stored_vertices import StoredVertices, real_type
from sd2core.io.things import with_things, with_walls
from sd2core.mesh.sequence import MeshSequence, check_shape
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.progress import Progress, silent
from sd2core.timebase import Timebase

_KNOWN = (
    ".npz, .zarr, .zarr.zip, .obj/.ply/.glb (one, a folder or a pattern such as 'frames/*.obj'), "
    "or the output of an estimator (.pkl, .npz, .npy, .pt, .json)"
)

NO_TIMES = (
    "The file holds no times: 30 frames/s are assumed. Pass --fps with the video's rate, every"
    " velocity is proportional to it."
)
"""Note on a mesh whose frame rate was assumed."""


def load_mesh(
    path: Path | str,
    *,
    faces: Path | str | None = None,
    frames_per_s: float | None = None,
    scale: float | None = None,
    person: int | str | None = None,
    image_size: tuple[int, int] | None = None,
    focal_px: float | None = None,
    distance_m: float | None = None,
    turn: Turn | None = None,
    body_model: Path | str | None = None,
    things: Iterable[Thing] = (),
    walls: Iterable[Wall] = (),
    progress: Progress = silent,
) -> MeshSequence:
    """Read a mesh sequence or point cloud.

    Parameters
    ----------
    path : path
        ``.npz`` or Zarr (``vertices`` (T, V, 3), ``faces`` (F, 3), ``times_s``
        (T,)); a file, folder or pattern of OBJ, PLY or GLB, one file per frame
        in natural order of their names; the output of an estimator of bodies or
        motion capture (docs/formats.md), of which nothing is executed.
    faces : path, optional
        ``.npy``, ``.npz`` or a mesh file with the triangles, instead of those
        in the file.
    frames_per_s : float, optional
        Replaces the file's times. Without it a file that has none is taken to
        be at 30 frames/s, with a note.
    scale : float, optional
        Factor to metres. Giving it, 1.0 included, also says that the size is
        right and needs no check.
    person : optional
        Which person of a file of several; by default the one seen longest.
    image_size : (width, height), optional
        Of the video that an estimator saw: places its root-centred mesh in front of
        the camera.
    focal_px : float, optional
        Focal length of that video; by default the file's, or the image's diagonal.
    distance_m : float, optional
        Moves the mesh forward, for one that is centred on the body's root.
    turn : optional
        Turns the mesh about an axis of the camera's frame before it is moved, right-handed:
        ``x180`` for one with y up and z backward, ``x90`` for one with z up.
    body_model : path, optional
        Model of SMPL, SMPL-H, SMPL-X, or MHR, that makes vertices of parameters. MHR's is a
        program in TorchScript, which is run (docs/formats.md).
    things : iterable of Thing
        What stands still around it, as for :func:`~sd2core.io.things.with_things`.
    walls : iterable of Wall
        What mirrors waves, as for :func:`~sd2core.io.things.with_walls`.
    progress : callable
        Called while files are read; may raise ``Cancelled``.

    Returns
    -------
    MeshSequence
        With notes about everything that was assumed or repaired, and on what of a body by
        `sd2 fit` is not to be believed. Vertices in
        memory are all checked; those on disk in a sample of frames here, and
        for finite values whenever they are read.

    Raises
    ------
    Sd2Error
        When the file cannot be understood; it says what to do.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    >>> mesh.frame_count, mesh.vertex_count
    (450, 5000)
    """
    path = as_path(path)
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise Sd2Error(f"The scale is {scale}", "a positive factor to metres, such as 0.001")
    model = None if body_model is None else as_path(body_model)
    raw = _read(path, MeshHints(person, image_size, focal_px, distance_m, model, progress))
    source = str(path)
    if faces is not None:
        raw.faces = read_faces(Path(faces))
    _as_vertices(raw, source)
    mark_gaps(raw)
    times_s = _times(raw, frames_per_s, source)
    mark_empty_frames(raw, source)
    _place(raw, 1.0 if scale is None else scale, turn, distance_m or 0.0)
    check_mesh(raw, times_s, source, check_size=scale is None)
    with errors_in(source, remedy=""):
        timebase = Timebase(times_s)
    judge_body(raw, times_s)
    known = uncertainty_of(raw, source)
    if known is not None:
        known = known.times(_velocity_factor(raw.times_s, times_s, scale))
    mesh = MeshSequence(
        raw.vertices,
        raw.faces,
        timebase,
        source,
        (*raw.notes, *map(str, raw.findings), *fitted_doubts(path)),
        raw.vertex_counts,
        raw.present,
        known,
        tuple(raw.findings),
    )
    return with_walls(with_things(mesh, things), walls)


def save_mesh(mesh: MeshSequence, path: Path | str, progress: Progress = silent) -> None:
    """Write a mesh as ``.npz``, ``.zarr`` or ``.zarr.zip``, block by block and in one step.

    Things and walls around it, and that it is simulated, are a recording's and are not written;
    nor is what only the file of a fit tells: camera, stature, doubts. To keep them, copy that file.

    Raises
    ------
    Sd2Error
        When the name ends in none of these, a vertex is not finite, or others are in the scene.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> points = np.random.default_rng(0).random((5, 20, 3)) + [0, 0, 2]
    >>> mesh = sd2.MeshSequence(points, None, sd2.Timebase.regular(5, 30))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sd2.save_mesh(mesh, Path(folder) / "points.npz")
    ...     sd2.load_mesh(Path(folder) / "points.npz").vertex_count
    20
    """
    path = as_path(path)
    wanted(mesh, MeshSequence, 'Read one with sd2.load_mesh("walk.npz")')
    if not path.absolute().parent.is_dir():
        raise Sd2Error(
            f"The folder {path.absolute().parent} does not exist", "an existing folder for the mesh"
        )
    if mesh.others:
        raise Sd2Error(
            f"The mesh is a scene of {len(mesh.bodies)} bodies, and {path.name} holds one",
            "a single body",
            "Save mesh.body(person) of each of mesh.persons",
        )
    if path.suffix.lower() == ".npz":
        write_npz(mesh, path, progress)
    elif path.suffix.lower() == ".zarr" or path.name.lower().endswith(".zarr.zip"):
        write_zarr(mesh, path, progress)
    else:
        raise Sd2Error(
            f"The mesh is to be saved as {path.name}",
            "a name that ends in .npz, .zarr or .zarr.zip",
            "Use .zarr for long recordings and .npz for exchange",
        )


def _read(path: Path, hints: MeshHints) -> RawMesh:
    if not (is_pattern(path) or path.exists()):
        raise Sd2Error(f"{path} does not exist", f"a mesh: {_KNOWN}", "Check the path")
    check_regular(path)
    for reader in _READERS:
        if reader.fits(path):
            return reader.read(path, hints)
    plug_in, faults = plug_in_for(path, MESH_FILES)
    if plug_in is not None:
        return plug_in.use(lambda reader: reader.read(path, hints), RawMesh)
    if path.suffix.lower() in MOTION_SUFFIXES:
        refuse_motion(path)
    raise Sd2Error(f"{path} is not a mesh of a kind that is known", f"a mesh: {_KNOWN}", faults)


def _is_zarr(path: Path) -> bool:
    if not path.is_dir():
        return path.name.lower().endswith(".zarr.zip")
    markers = ("zarr.json", ".zgroup", ".zarray")
    return path.suffix.lower() == ".zarr" or any((path / name).exists() for name in markers)


def _read_surfaces(path: Path, hints: MeshHints) -> RawMesh:
    return read_mesh_files(path, hints.person, hints.progress)


_READERS: tuple[FileReader[RawMesh], ...] = (
    FileReader(_read_surfaces, recognises=is_pattern),
    FileReader(lambda path, hints: read_zarr(path), recognises=_is_zarr),
    FileReader(read_model_output, recognises=is_estimate),
    FileReader(_read_surfaces, recognises=Path.is_dir),
    FileReader(lambda path, hints: read_npz(path), (".npz",)),
    FileReader(_read_surfaces, SURFACE_SUFFIXES),
)
"""Readers of meshes; the first that fits is taken, and those of plug-ins after all of them."""


def _as_vertices(raw: RawMesh, source: str) -> None:
    """Turn what was read into real numbers of shape (T, V, 3)."""
    if not isinstance(raw.vertices, StoredVertices):
        vertices = np.asarray(raw.vertices)
        if vertices.dtype.kind not in "fiu":
            raise Sd2Error(
                f"{source}: the vertices are of type {vertices.dtype}", "numbers in metres"
            )
        vertices = vertices.astype(real_type(vertices.dtype), copy=False)
        raw.vertices = vertices[None] if vertices.ndim == 2 else vertices
    check_shape(tuple(raw.vertices.shape), source)


def _place(raw: RawMesh, scale: float, turn: str | None, distance_m: float) -> None:
    shift_m = np.array([0, 0, distance_m], np.float32)
    rotation = None if turn is None else rotation_of(turn)
    if isinstance(raw.vertices, StoredVertices):
        raw.vertices.scale, raw.vertices.shift_m = scale, shift_m
        raw.vertices.rotation = rotation
        return
    vertices: NDArray[Any] = np.asarray(raw.vertices)
    if scale != 1.0:
        vertices = vertices * vertices.dtype.type(scale)
    if rotation is not None:
        vertices = vertices @ rotation.T.astype(vertices.dtype)
    if distance_m:
        vertices = vertices + shift_m.astype(vertices.dtype)
    raw.vertices = vertices


def _velocity_factor(
    given_s: NDArray[np.float64] | None, times_s: NDArray[np.float64], scale: float | None
) -> float:
    """Ratio of velocities to those by the file's own times and unit."""
    factor = 1.0 if scale is None else scale
    step_s = 0.0 if given_s is None or len(times_s) < 2 else float(np.median(np.diff(given_s)))
    return factor * step_s / float(np.median(np.diff(times_s))) if step_s > 0 else factor


def _times(raw: RawMesh, frames_per_s: float | None, source: str) -> NDArray[np.float64]:
    """Times of all frames: from options, from the file, or assumed."""
    count = int(raw.vertices.shape[0])
    if frames_per_s is not None and not (np.isfinite(frames_per_s) and frames_per_s > 0):
        raise Sd2Error(f"The frame rate is {frames_per_s}", "a positive number of frames per s")
    if raw.times_s is not None and frames_per_s is None:
        if raw.times_s.shape != (count,):
            raise Sd2Error(
                f"{source}: {count} frames but times of shape {raw.times_s.shape}",
                "one time per frame",
                "Pass --fps to place the frames evenly instead",
            )
        return raw.times_s
    if raw.times_s is not None:
        raw.notes.append(f"The times in the file are replaced by {frames_per_s:g} frames/s.")
    rate = frames_per_s or raw.frames_per_s
    if rate is None:
        rate = 30.0
        raw.notes.append(NO_TIMES)
    elif not (np.isfinite(rate) and rate > 0):
        raise Sd2Error(f"{source}: the frame rate is {rate}", "a positive number of frames per s")
    numbers = np.arange(count) if raw.frame_numbers is None else raw.frame_numbers
    return numbers / rate
