"""Recognising files by their names and first entries, at little cost."""

from __future__ import annotations

import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_regular
from sd2core.files.numpy_files import npz_names
from sd2core.files.paths import PICKLE_SUFFIXES, is_pattern
from sd2core.files.stores import read_attributes
from sd2core.files.texts import reading_as
from sd2core.io.estimator_files import files_of_people, holds_bodies
from sd2core.io.imu_columns import holds_inertial_signals
from sd2core.io.mesh_files import MOTION_SUFFIXES
from sd2core.io.readers import MESH_FILES, RADAR_FILES, plug_in_for
from sd2core.pairs.summary import is_pair_store
from sd2core.plug_ins import Group

Kind = Literal["recording", "video", "mesh", "radar", "map", "imu", "pairs", "model", "dataset"]

DATASET_FORMAT = "sd2-dataset"

_DRAWN_TEXT = "tty"
"""Format by which FFmpeg draws any text as a terminal would."""

VIDEO_SUFFIXES = frozenset({
    ".mp4", ".mkv", ".mov", ".avi", ".webm", ".m4v", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts",
    ".wmv", ".3gp", ".3g2", ".flv", ".ogv", ".mxf", ".gif",
})  # fmt: skip
"""Usual ones, for dialogs and patterns; others are recognised by what is in them."""
RADAR_MAP_SUFFIXES = frozenset({".h5", ".hdf5"})
RADAR_SUFFIXES = (
    frozenset({".npy", ".mat", ".bin", ".sigmf-meta", ".sigmf-data"}) | RADAR_MAP_SUFFIXES
)
_LOOKED_INTO = (".safetensors", ".npz", ".zarr", *RADAR_MAP_SUFFIXES)
"""Endings of what is named where a folder itself is nothing that is known."""
MESH_SUFFIXES = frozenset({".obj", ".ply", ".glb", ".pt", ".pth"}) | PICKLE_SUFFIXES


def kind_of(path: Path) -> Kind:
    """Recognise a file or folder; Sd2Error if it does not exist or is of no known kind."""
    path = Path(path)
    if is_pattern(path):
        return "mesh"
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", "a file or folder", "Check the path")
    if path.is_dir():
        return _kind_of_folder(path)
    check_regular(path)
    suffix = path.suffix.lower()
    if is_dataset(path):
        return "dataset"
    if path.name == "recording.json":
        return "recording"
    if suffix in VIDEO_SUFFIXES:
        return "video"
    if suffix in MESH_SUFFIXES or path.name.endswith(".zarr.zip"):
        return "mesh"
    if suffix in RADAR_SUFFIXES:
        return "mesh" if suffix == ".npy" and holds_bodies(path) else "radar"
    if suffix == ".safetensors":
        return "model"
    if holds_inertial_signals(path):
        return "imu"
    if suffix == ".npz":
        return "map" if _is_doppler_map(path) else "mesh"
    from sd2core.io.radar.points import column_names, holds_unnamed_columns, looks_like_points

    if looks_like_points(path):
        return "radar"
    kind, faults = _kind_by_plug_ins(path)
    if kind is not None:
        return kind
    if suffix in MOTION_SUFFIXES:
        return "mesh"  # whose reader says what to do
    if _holds_pictures(path):
        return "video"
    if not path.stat().st_size:
        raise Sd2Error(
            f"{path} is empty", "a file with content", "Copy it again, or write it again"
        )
    if holds_unnamed_columns(path):
        column_names(path)  # refuses it, and says how to name them
    raise Sd2Error(
        f"{path} is of no kind that is known",
        "a recording (.sd2), a video (.mp4, .mkv …), a mesh (.npz, .zarr, .obj, .ply, .glb, .pkl),"
        " a radar capture (a folder with radar.npy, the .h5 of a K60168A or an A121, the .bin of a"
        " DCA1000, or samples with a description: .npy, .h5, .mat,"
        " .sigmf-meta; or a table of points, .csv) or samples of an inertial"
        " sensor (.csv, .sto)",
        faults,
    )


def is_dataset(path: Path) -> bool:
    """True if a path looks like a data set of ``sd2 export``, finished or not; reads little."""
    suffix = path.suffix.lower()
    if path.is_dir():
        return bool(read_attributes(path).get("format") == DATASET_FORMAT)
    check_regular(path)
    if suffix == ".npz":
        return "segment_label" in npz_names(path)
    if suffix in RADAR_MAP_SUFFIXES:
        import h5py

        with (
            suppress(OSError, ValueError, KeyError, TypeError, RecursionError),
            h5py.File(path, "r") as file,
        ):
            return bool(file.attrs.get("format", "") == DATASET_FORMAT)
    return False


def _kind_of_folder(folder: Path) -> Kind:
    if (folder / "recording.json").exists():
        return "recording"
    if is_pair_store(folder):
        return "pairs"
    if is_dataset(folder):
        return "dataset"
    if (folder / "zarr.json").exists() or folder.suffix == ".zarr":
        return "mesh"
    if (folder / "live.json").exists():
        return "radar"
    if (folder / "radar.npy").exists() or any(folder.glob("*/radar.npy")):
        return "radar"
    suffixes = {entry.suffix.lower() for entry in folder.iterdir()}
    if suffixes & MESH_SUFFIXES or any(map(_may_be_of_a_person, files_of_people(folder)[:1])):
        return "mesh"
    if ".bin" in suffixes and suffixes & {".cfg", ".json"}:
        return "radar"
    kind, faults = _kind_by_plug_ins(folder)
    if kind is not None:
        return kind
    known = [one for one in sorted(folder.iterdir()) if one.suffix in _LOOKED_INTO]
    raise Sd2Error(
        f"The folder {folder} holds nothing that is known",
        "recording.json, zarr.json, radar.npy, or .obj/.ply/.glb files",
        f"{faults} Of what is in it: `sd2 info {known[0]}`".lstrip() if known else faults,
    )


def _kind_by_plug_ins(path: Path) -> tuple[Kind | None, str]:
    """Kind of what a plug-in reads; without one, what is wrong with plug-ins."""
    faults = []
    groups: tuple[tuple[Kind, Group[Any]], ...] = (("mesh", MESH_FILES), ("radar", RADAR_FILES))
    for kind, group in groups[path.is_dir() :]:  # a folder is no mesh of theirs
        plug_in, fault = plug_in_for(path, group)
        if plug_in is not None:
            return kind, ""
        faults.append(fault)
    return None, " ".join(filter(None, faults))


def _holds_pictures(path: Path) -> bool:
    from sd2core.io.video_index import open_stream  # loads FFmpeg

    try:
        container, _ = open_stream(path)
    except Sd2Error:
        return False
    with container:
        return container.format.name != _DRAWN_TEXT


def _may_be_of_a_person(path: Path) -> bool:
    return not (is_dataset(path) or _is_doppler_map(path))


def _is_doppler_map(path: Path) -> bool:
    expected = "an .npz written by NumPy or SD² Studio"
    with reading_as(".npz", path, expected), zipfile.ZipFile(path) as archive:
        return "velocity_mps.npy" in archive.namelist()
