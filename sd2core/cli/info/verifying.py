"""``sd2 info --verify``: every chunk of a file read, and compared with its checksum."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.io.kinds import Kind


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
    found = []
    with progress_bar("Verifying", "row") as progress:
        for array in arrays:
            found += array.damage("values", rows, progress)
    if found:
        raise Sd2Error(
            f"{path} is damaged: {'; '.join(map(str, found))}",
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
