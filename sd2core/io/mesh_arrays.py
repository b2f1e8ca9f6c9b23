"""Meshes kept as named arrays: ``.npz`` files and chunked Zarr stores."""

from __future__ import annotations

import re
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder, atomic_write, full_disk_named
from sd2core.files.numpy_files import open_npz_file
from sd2core.files.stores import (
    COPY_AGAIN,
    Damage,
    Depth,
    StoredArray,
    array_in,
    array_names,
    create_array,
    create_group,
    open_group,
    unreadable,
)
from sd2core.io.mesh_clock import clock_of, is_of_clock
from sd2core.io.stored_vertices import StoredVertices
from sd2core.mesh.sequence import MeshSequence, VertexArray, refuse_missing
from sd2core.progress import Progress, silent

VERTEX_NAMES = ("vertices", "verts")
FACE_NAMES = ("faces", "triangles")
UNCERTAINTY_NAMES = ("vertex_limb", "limb_velocity_sigma_mps", "limb_velocity_sigma_across_mps")
_SMALL_NAMES = (*FACE_NAMES, *UNCERTAINTY_NAMES, "vertex_counts", "present", "limbs")

_PARAMETER = re.compile(
    r"^(smplx?|smpl_.*|poses?|betas|thetas|(root|global)_orient|body_pose|transl?|pose_body|mhr_model_params)$"
)
"""Names of arrays that describe a body of the SMPL family or of MHR, among others."""
_CHUNK_BYTES = 2 * 2**20
_WHOLE_CHECK_BYTES = 128 * 2**20
"""Size of the vertices on disk up to which all are checked when a mesh is opened."""
_FORMAT = "sd2-mesh"


@dataclass
class RawMesh:
    """Content of a file, before times are completed and anything is checked."""

    vertices: VertexArray  # (T, V, 3)
    faces: NDArray[Any] | None = None
    times_s: NDArray[np.float64] | None = None
    frames_per_s: float | None = None
    notes: list[str] = field(default_factory=list)
    findings: list[Sd2Error] = field(default_factory=list)
    vertex_counts: NDArray[np.int64] | None = None  # (V,), how many each stands for
    present: NDArray[np.bool_] | None = None  # (T,), False without a person
    limbs: tuple[str, ...] = ()  # names, in the order in which arrays number them
    uncertainty: tuple[NDArray[Any], ...] | None = None  # as UNCERTAINTY_NAMES has them
    frame_numbers: NDArray[np.int64] | None = None  # (T,), of the video, when some are missing

    def __post_init__(self) -> None:
        if not isinstance(self.notes, list):  # of a plug-in; a text would be taken letter by letter
            raise TypeError(f"the notes are of type {type(self.notes).__name__}, not a list")


def read_npz(path: Path) -> RawMesh:
    """Read ``vertices`` and, where present, ``faces``, ``times_s`` and ``fps``."""
    expected = "a complete .npz file that holds plain numbers"
    remedy = "Write it again with numpy.savez(path, vertices=..., faces=..., times_s=...)"
    with open_npz_file(path, ".npz", expected, remedy) as archive:
        arrays = {name: archive[name] for name in archive if name in VERTEX_NAMES or is_small(name)}
        names = list(archive)
    return named_arrays(arrays, names, str(path))


def no_vertices(source: str, names: Sequence[str]) -> Sd2Error:
    """Error for a file that holds no vertices, by the names of what it holds."""
    shown = ", ".join(names[:12]) or "nothing"
    if any(_PARAMETER.search(name) for name in names):
        return Sd2Error(
            f"{source} holds body parameters and no vertices ({shown}), as AMASS, AIST++, GVHMR,"
            " 4D-Humans (PHALP), SAM 3D Body and others write them",
            "vertices, or the model of the body that makes them of the parameters",
            "Give the model file with sd2 import --body-model, or let that tool export one OBJ per"
            " frame and open the folder",
        )
    return Sd2Error(
        f"{source} holds {shown}",
        "'vertices' (or 'verts') of shape (frames, vertices, 3), in a pickle perhaps per person",
        "Save them as numpy.savez('mesh.npz', vertices=verts, faces=faces, times_s=times)",
    )


def is_small(name: str) -> bool:
    """True for the name of an array beside the vertices that is read."""
    return name in _SMALL_NAMES or is_of_clock(name)


def named_arrays(arrays: dict[str, Any], names: list[str], source: str) -> RawMesh:
    """Pick vertices, faces, times and rate out of arrays by their names."""
    vertices = _first(arrays, VERTEX_NAMES)
    if vertices is None:
        raise no_vertices(source, sorted(names))
    held = [name for name in UNCERTAINTY_NAMES if name in arrays]
    if held and len(held) < len(UNCERTAINTY_NAMES):
        raise Sd2Error(
            f"{source} holds {' and '.join(held)}",
            f"{', '.join(UNCERTAINTY_NAMES)}: all of them, or none",
        )
    limbs = arrays.get("limbs")
    shape = np.shape(vertices)
    clock = clock_of([arrays], shape[0] if len(shape) == 3 else 1, source)
    return RawMesh(
        vertices=vertices,
        faces=_first(arrays, FACE_NAMES),
        times_s=clock.times_s,
        frames_per_s=clock.frames_per_s,
        frame_numbers=clock.frame_numbers,
        notes=[*clock.notes],
        vertex_counts=arrays.get("vertex_counts"),
        present=arrays.get("present"),
        limbs=() if limbs is None else tuple(map(str, np.atleast_1d(limbs))),
        uncertainty=tuple(arrays[name] for name in held) if held else None,
    )


def read_zarr(path: Path) -> RawMesh:
    """Open a Zarr folder or ``.zarr.zip``; the vertices stay on disk.

    Frames of damaged chunks are left out, as if nobody had been there.
    """
    group = open_group(path)
    names = array_names(path)
    small = [name for name in names if is_small(name)]
    arrays: dict[str, Any] = {name: array_in(group, path, name, "rows")[...] for name in small}
    stored = _vertices(group, path, names)
    if stored is not None:
        arrays["vertices"] = stored
    attributes = dict(group.attrs)
    arrays |= {
        name: value
        for name, value in attributes.items()
        if name not in arrays and (name == "limbs" or is_of_clock(name))
    }
    raw = named_arrays(arrays, names, str(path))
    if raw.faces is not None and not len(raw.faces):
        raw.faces = None
    assert stored is not None
    damaged: tuple[Damage, ...] = ()
    if len(stored.shape) == 3:
        thorough: Depth = "checksums" if stored.checksums else "values"
        whole = stored.file_bytes <= _WHOLE_CHECK_BYTES
        damaged = stored.damage(thorough if whole else "lengths")
    raw.vertices = StoredVertices(stored, damaged)
    if damaged:
        _leave_out(raw, damaged, path)
    if len(stored.shape) == 3 and raw.vertices.large_chunks:
        raw.notes.append(
            f"The vertices are stored in chunks of {raw.vertices.frames_per_chunk:,} frames "
            f"({raw.vertices.chunk_bytes / 2**20:,.0f} MiB), which are read whole for every frame "
            "shown. Saving the mesh again makes it fast."
        )
    return raw


def stored_arrays(path: Path) -> list[StoredArray]:
    """Arrays of a mesh in Zarr, not yet read."""
    group = open_group(path)
    names = array_names(path)
    vertices = _vertices(group, path, names)
    small = [array_in(group, path, name, "rows") for name in names if is_small(name)]
    return small if vertices is None else [vertices, *small]


def _vertices(group: Any, path: Path, names: list[str]) -> StoredArray | None:
    """Vertices among the arrays of a group; None if there are none."""
    name = next((name for name in VERTEX_NAMES if name in names), None)
    return None if name is None else array_in(group, path, name, "frames", sparse=False)


def _leave_out(raw: RawMesh, damaged: tuple[Damage, ...], path: Path) -> None:
    """Mark the frames of damaged chunks as frames without a person."""
    frames = raw.vertices.shape[0]
    present = np.ones(frames, bool) if raw.present is None else np.array(raw.present, bool)
    lost = np.zeros(frames, bool)
    for one in damaged:
        lost[one.start : one.stop] = True
    if lost.all():
        raise unreadable(path, damaged)
    if len(present) == frames:
        raw.present = present & ~lost
    where = "; ".join(map(str, damaged))
    raw.notes.append(
        f"{path.name} is damaged: {where}. These frames are left out, as if nobody had been there. "
        f"{COPY_AGAIN}."
    )


def write_npz(mesh: MeshSequence, path: Path, progress: Progress = silent) -> None:
    """Write a mesh block by block into one compressed ``.npz``, in one step."""
    step = frames_per_chunk(mesh.vertices.shape, mesh.vertices.dtype)
    dtype = np.dtype(mesh.vertices.dtype).newbyteorder("<")
    deflate = zipfile.ZIP_DEFLATED
    with atomic_write(path) as stream, zipfile.ZipFile(stream, "w", deflate) as archive:
        # Without a date, so that the same mesh gives the same bytes.
        with archive.open("vertices.npy", "w", force_zip64=True) as member:
            header = {"descr": dtype.str, "fortran_order": False, "shape": mesh.vertices.shape}
            np.lib.format.write_array_header_1_0(member, header)
            for start in range(0, mesh.frame_count, step):
                progress(start, mesh.frame_count)
                member.write(_block(mesh, start, step).astype(dtype, copy=False).tobytes())
        texts = {} if mesh.uncertainty is None else {"limbs": np.array(mesh.uncertainty.limbs)}
        for name, array in (small_arrays(mesh) | texts).items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    progress(mesh.frame_count, mesh.frame_count)


def write_zarr(mesh: MeshSequence, path: Path, progress: Progress = silent) -> None:
    """Write a mesh chunk by chunk into a folder that takes its name when complete.

    A chunk holds about 2 MB: all vertices of a stretch of frames.
    """
    if path.suffix.lower() == ".zip":
        with (
            full_disk_named(path),
            tempfile.TemporaryDirectory(".tmp", f".{path.name}.", path.parent) as place,
        ):
            _write_group(mesh, Path(place), progress)
            with atomic_write(path) as stream:
                _zip_folder(Path(place), stream)
    elif path.is_file():
        raise Sd2Error(f"{path} is a file", "a folder name for a .zarr mesh", "Remove or rename it")
    else:
        with atomic_folder(path) as folder:
            _write_group(mesh, folder, progress)
    progress(mesh.frame_count, mesh.frame_count)


def _write_group(mesh: MeshSequence, folder: Path, progress: Progress) -> None:
    step = frames_per_chunk(mesh.vertices.shape, mesh.vertices.dtype)
    group = create_group(folder, {"format": _FORMAT, "version": 1, "unit": "m"})
    vertices = create_vertices(group, mesh.vertices.shape, mesh.vertices.dtype)
    for start in range(0, mesh.frame_count, step):
        progress(start, mesh.frame_count)
        block = _block(mesh, start, step)
        vertices[start : start + len(block)] = block
    write_small(mesh, group)


def small_arrays(mesh: MeshSequence) -> dict[str, NDArray[Any]]:
    """Arrays of a mesh without its vertices, under their names in files."""
    arrays: dict[str, NDArray[Any] | None] = {
        "faces": mesh.faces,
        "times_s": mesh.times_s,
        "vertex_counts": mesh.vertex_counts,
        "present": mesh.present,
    }
    if (known := mesh.uncertainty) is not None:
        values = (known.vertex_limb, known.along_mps, known.across_mps)
        arrays |= dict(zip(UNCERTAINTY_NAMES, values, strict=True))
    return {name: np.array(array) for name, array in arrays.items() if array is not None}


def write_small(mesh: MeshSequence, group: Any) -> None:
    """Write everything of a mesh but its vertices into a Zarr group."""
    for name, array in small_arrays(mesh).items():
        create_array(group, name, data=array)
    if mesh.uncertainty is not None:
        group.attrs["limbs"] = list(mesh.uncertainty.limbs)


def _block(mesh: MeshSequence, start: int, step: int) -> NDArray[Any]:
    block = mesh.read(start, min(start + step, mesh.frame_count))
    refuse_missing(block, start, mesh.source)
    return block


def create_vertices(group: Any, shape: tuple[int, ...], dtype: Any) -> Any:
    """Create an array for vertices (T, V, 3) in a Zarr group, to be filled chunk by chunk."""
    from zarr.codecs import BloscCodec

    return create_array(
        group,
        "vertices",
        shape=shape,
        chunks=(frames_per_chunk(shape, dtype), *shape[1:]),
        dtype=np.dtype(dtype).newbyteorder("<"),
        compressor=BloscCodec(cname="lz4", clevel=5, shuffle="shuffle"),
        # A chunk that goes missing is then found, not read as zeros.
        fill_value=float("nan"),
    )


def frames_per_chunk(shape: tuple[int, ...], dtype: Any) -> int:
    """Frames of a chunk of about 2 MB."""
    frame_bytes = shape[1] * 3 * np.dtype(dtype).itemsize
    return int(min(max(_CHUNK_BYTES // frame_bytes, 1), shape[0]))


def _zip_folder(folder: Path, stream: Any) -> None:
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                archive.write(file, file.relative_to(folder).as_posix())


def _first(arrays: dict[str, Any], names: tuple[str, ...]) -> Any | None:
    return next((arrays[name] for name in names if name in arrays), None)
