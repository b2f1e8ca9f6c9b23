"""``sd2 info``: what is in a recording, video, mesh, capture, map, pairs, data set or model."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.info.description import (
    describe_imu,
    describe_map,
    describe_mesh,
    describe_parts,
    describe_radar,
    describe_recording,
    describe_video,
)
from sd2core.cli.output import Report, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENT
from sd2core.options.shared import Json, MeshReading

if TYPE_CHECKING:
    from sd2core.io.kinds import Kind


class Info(MeshReading, Json):
    """Options of ``sd2 info``.

    Parameters
    ----------
    path : PATH
        what to describe
    verify
        read every chunk and compare it with its checksum; what is damaged is named
    """

    path: Annotated[Path, ARGUMENT]
    verify: bool = False


@command("info", Info)
def _info(options: Info) -> Report:
    """What is in a recording, video, mesh, radar or IMU file, map, pairs, data set or model.

    sd2 info walk.sd2
    sd2 info walk.npz --json
    sd2 info walk.zarr --verify
    """
    path = _installed(options.path)
    if not options.verify:
        return describe(path, options)
    from sd2core.io.kinds import kind_of

    verified = verify(path, kind_of(path))
    description = describe(path, options)
    description.data["verified"] = verified
    description.facts["verified"] = in_words(verified)
    return description


def _installed(path: Path) -> Path:
    """File of an installed denoiser that is named in place of a file."""
    from sd2core.denoise.files import find_model

    if path.exists() or len(path.parts) != 1 or path.suffix:
        return path
    try:
        return find_model(path.name)
    except Sd2Error:
        return path


def describe(path: Path, options: MeshReading) -> Report:
    """Open whatever ``path`` is and describe it."""
    from sd2core.cli.reading import (
        load_mesh_from_options,
        open_recording_from_options,
        refuse_unused_mesh_options,
    )
    from sd2core.io.kinds import kind_of

    kind = kind_of(path)
    if kind == "recording":
        recording = open_recording_from_options(path, options)
        whom = options.person if recording.bodies else None
        return describe_recording(recording, describe_parts(recording, whom))
    if kind == "mesh":
        return describe_mesh(path, load_mesh_from_options(path, options))
    refuse_unused_mesh_options(options, path, None)
    if kind == "video":
        from sd2core.io.video import open_video

        with open_video(path) as video:
            return describe_video(path, video)
    if kind == "radar":
        return describe_radar(path)
    if kind == "imu":
        return describe_imu(path)
    if kind == "pairs":
        from sd2core.cli.info.learning_data import describe_pairs
        from sd2core.pairs.store import read_pairs

        return describe_pairs(path, read_pairs(path))
    if kind == "model":
        from sd2core.cli.info.model import describe_model_file

        return describe_model_file(path)
    if kind == "dataset":
        from sd2core.cli.info.learning_data import describe_dataset_at

        return describe_dataset_at(path)
    from sd2core.maps import DopplerMap

    return describe_map(path, DopplerMap.load(path))


def verify(path: Path, kind: Kind) -> dict[str, Any]:
    """Check what is stored in chunks; facts about it, empty where nothing is.

    Raises Sd2Error that names every damaged stretch.
    """
    if kind == "recording":
        from sd2core.recording.recording import open_recording

        recording = open_recording(path)
        mesh = recording.mesh
        return {} if mesh is None or "mesh" in recording.missing() else verify(mesh, "mesh")
    with ExitStack() as stack:
        arrays, rows = _arrays(path, kind, stack)
        return _verified(path, arrays, rows)


def _arrays(path: Path, kind: Kind, stack: ExitStack) -> tuple[Sequence[Any], range | None]:
    """Arrays of a file that are stored in chunks, and the rows that count."""
    if kind == "mesh" and (path.is_dir() or path.suffix == ".zip"):
        from sd2core.io.mesh_arrays import stored_arrays

        if path.is_file() or (path / "zarr.json").exists() or (path / ".zgroup").exists():
            return stored_arrays(path), None
    if kind == "pairs":
        from sd2core.pairs.store import open_takes

        facts, arrays = open_takes(path)
        return list(arrays.values()), range(facts.frames)
    if kind == "dataset":
        from sd2core.datasets.reading import open_dataset

        dataset = stack.enter_context(open_dataset(path))
        if dataset.form != "npz":
            return list(dataset.arrays.values()), None
    return (), None


def _verified(path: Path, arrays: Sequence[Any], rows: range | None) -> dict[str, Any]:
    damage = []
    with progress_bar("Verifying", "row") as progress:
        for array in arrays:
            damage += array.damage("values", rows, progress)
    if damage:
        raise Sd2Error(
            f"{path} is damaged: {'; '.join(map(str, damage))}",
            "chunks as they were written",
            "The rest can be read. Copy it again from where it came",
        )
    bare = [array.name for array in arrays if not array.checksums]
    return {"arrays": [array.name for array in arrays], "without_checksums": bare} if arrays else {}


def in_words(verified: dict[str, Any]) -> str:
    """Result of :func:`verify` as a fact."""
    if not verified:
        return "nothing: it is not stored in chunks"
    bare = verified["without_checksums"]
    if not bare:
        return "every chunk has its checksum"
    return (
        f"every chunk can be read, but {', '.join(bare)} came without checksums: values that"
        " changed would not be noticed"
    )
