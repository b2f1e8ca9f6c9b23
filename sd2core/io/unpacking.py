"""Conversion of a large ``.npz`` mesh to a Zarr store, block by block."""

from __future__ import annotations

from pathlib import Path
from typing import IO, Any

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder
from sd2core.files.numpy_files import NpzArrays, open_npz_file, read_array_header
from sd2core.files.stores import create_array, create_group
from sd2core.io.mesh_arrays import VERTEX_NAMES, create_vertices, frames_per_chunk, is_small

_EXPECTED = "a complete .npz file that holds plain numbers"
Header = tuple[tuple[int, ...], bool, np.dtype[Any]]


def npz_bytes(path: Path) -> int:
    """Bytes of an ``.npz``'s arrays in memory; Sd2Error if it is no ``.npz``."""
    with open_npz_file(path, ".npz", _EXPECTED) as arrays:
        return sum(member.file_size for member in arrays.zip.infolist())


def npz_vertices(path: Path) -> tuple[int, int]:
    """Frames and vertices of the mesh in an ``.npz``, read from a header; Sd2Error without any."""
    with open_npz_file(path, ".npz", _EXPECTED) as arrays, _vertices(arrays, path) as stream:
        frames, vertices, _ = _header(stream, path)[0]
        return frames, vertices


def unpack_npz(path: Path, out: Path) -> None:
    """Write the arrays of an ``.npz`` mesh to a Zarr folder, which takes its name when complete.

    Nothing is checked, completed or placed: that is done when the store is read. Raises
    Sd2Error if it cannot be read.
    """
    with atomic_folder(out) as folder, open_npz_file(path, ".npz", _EXPECTED) as arrays:
        group = create_group(folder)
        with _vertices(arrays, path) as stream:
            _copy_vertices(stream, group, path)
        for name in filter(is_small, arrays):
            if name == "limbs":
                group.attrs[name] = [str(one) for one in np.atleast_1d(arrays[name])]
            else:
                name, array = _storable(name, arrays[name])
                create_array(group, name, data=array)


def _storable(name: str, array: np.ndarray) -> tuple[str, np.ndarray]:
    """An array by its name; dates, which a store may not hold, as nanoseconds."""
    if array.dtype.kind not in "mM":
        return name, array
    return f"{name.removesuffix('_s')}_ns", array.astype(f"{array.dtype.kind}8[ns]").astype("i8")


def _copy_vertices(stream: IO[bytes], group: Any, path: Path) -> None:
    shape, by_column, dtype = _header(stream, path)
    if by_column:
        raise Sd2Error(f"{path}: the vertices are stored by columns", "frame after frame (C order)")
    vertices = create_vertices(group, shape, dtype)
    step = frames_per_chunk(shape, dtype)
    frame_bytes = int(np.prod(shape[1:])) * dtype.itemsize
    for start in range(0, shape[0], step):
        count = min(step, shape[0] - start)
        block = stream.read(count * frame_bytes)
        if len(block) < count * frame_bytes:
            raise Sd2Error(f"{path} ends in frame {start} of {shape[0]}", "a complete file")
        vertices[start : start + count] = np.frombuffer(block, dtype).reshape(count, *shape[1:])


def _vertices(arrays: NpzArrays, path: Path) -> IO[bytes]:
    """File of the vertices, with its header."""
    for name in VERTEX_NAMES:
        if name in arrays:
            return arrays.zip.open(f"{name}.npy")
    raise Sd2Error(
        f"{path} holds {', '.join(sorted(arrays.zip.namelist())) or 'nothing'}",
        "an array 'vertices' (or 'verts') of shape (frames, vertices, 3)",
    )


def _header(stream: IO[bytes], path: Path) -> Header:
    shape, by_column, dtype = read_array_header(stream)
    if len(shape) != 3 or shape[2] != 3 or dtype.kind != "f":
        raise Sd2Error(
            f"{path}: the vertices have shape {shape} and type {dtype}",
            "(frames, vertices, 3) of floating-point numbers",
        )
    return shape, by_column, dtype
