"""Landmark files: a whole track for exchange, and the state of a stopped search."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.track import PER_FRAME, Landmarks, LandmarkTrack, parts
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.timebase import Timebase

FORMAT = "sd2-landmarks"
VERSION = 1

_ARRAYS = (*PER_FRAME, "silhouette_frames", "silhouettes")


def save_track(track: Landmarks, path: Path | str) -> None:
    """Write landmarks to one file (.npz), part by part and in one step."""
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "width": track.width,
        "height": track.height,
        "notes": list(track.notes),
    }
    small = {
        "meta": np.array(json.dumps(meta, ensure_ascii=False)),
        "times_s": track.timebase.times_s,
        "silhouette_frames": track.silhouette_frames,
        "silhouettes": track.silhouettes,
    }
    with (
        atomic_write(Path(path)) as stream,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, array in small.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
        for name in PER_FRAME:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                _write_parts(member, track, name)


def _write_parts(member: IO[bytes], track: Landmarks, name: str) -> None:
    """One array of a track as ``.npy``."""
    for start, stop in parts(len(track)):
        values = getattr(track.part(start, stop), name)
        if start == 0:
            shape = (len(track), *values.shape[1:])
            header = {"descr": values.dtype.str, "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(member, header)
        member.write(np.ascontiguousarray(values).tobytes())


def load_track(path: Path | str) -> LandmarkTrack:
    """Read a file of :func:`save_track`; Sd2Error if it is missing, damaged or newer."""
    path = Path(path)
    arrays, meta = read_arrays(path)
    if meta.get("format") != FORMAT or not 1 <= meta.get("version", 0) <= VERSION:
        raise Sd2Error(
            f"{path} is of format {meta.get('format')!r} version {meta.get('version')}",
            f"{FORMAT!r} up to version {VERSION}",
        )
    try:
        frames = len(arrays["times_s"])
        track = LandmarkTrack(
            timebase=Timebase(arrays["times_s"]),
            width=int(meta["width"]),
            height=int(meta["height"]),
            notes=tuple(str(note) for note in meta["notes"]),
            **{name: arrays[name] for name in _ARRAYS},
        )
        shapes = {name: getattr(track, name).shape for name in _ARRAYS[:7]}
    except (KeyError, TypeError, ValueError) as error:
        raise _unreadable(path, error) from error
    expected: dict[str, tuple[int, ...]]
    expected = {"image_px": (frames, 33, 2), "world_m": (frames, 33, 3)}
    expected |= dict.fromkeys(("depth_px", "visibility"), (frames, 33))
    for name, shape in shapes.items():
        if shape != expected.get(name, (frames,)):
            raise _unreadable(path, f"{name} has shape {shape}")
    return track


def write_arrays(
    path: Path, arrays: Mapping[str, NDArray[Any]], meta: Mapping[str, object]
) -> None:
    """Replace a file by arrays and a description, in one step."""
    with atomic_write(path) as stream:
        text = json.dumps(meta, ensure_ascii=False)
        named: dict[str, Any] = {"meta": np.array(text), **arrays}
        np.savez_compressed(stream, **named)


def read_arrays(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read what :func:`write_arrays` wrote; no pickle is executed."""
    if not path.is_file():
        raise Sd2Error(f"{path} does not exist", "a file of landmarks (.npz)")
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        meta = json.loads(str(arrays.pop("meta")))
        if not isinstance(meta, dict):
            raise TypeError("no description")
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise _unreadable(path, error) from error
    return arrays, meta


def _unreadable(path: Path, why: object) -> Sd2Error:
    return Sd2Error(
        f"{path} cannot be read as landmarks ({why})", "a file written by SD² Studio (.npz)"
    )
