"""How the meshes of files that were opened lately are read, so that nobody is asked again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sd2app.settings import Settings
from sd2core.files.recording_json import MeshReading
from sd2core.recording.recording import Recording

_NAME = "mesh_readings"


def keep_reading(settings: Settings, paths: Sequence[Path], recording: Recording) -> None:
    """Remember how the mesh of files that were opened together is read, while they are listed."""
    content = {
        "reading": recording.mesh_reading.model_dump(mode="json", exclude_none=True),
        "faces": None if recording.faces is None else str(recording.faces),
    }
    kept, key = settings.table(_NAME), _key(paths)
    if kept.get(key) != content:
        listed = {key, *map(_key, settings.recent)}
        kept = {one: value for one, value in kept.items() if one in listed}
        settings.keep_table(_NAME, kept | {key: content})


def kept_reading(settings: Settings, paths: Sequence[Path]) -> dict[str, Any] | None:
    """Fields of a recording by which the mesh was read; None where that is not known."""
    content = settings.table(_NAME).get(_key(paths), {})
    try:
        faces, reading = content["faces"], MeshReading.model_validate(content["reading"])
        return {"mesh_reading": reading, "faces": None if faces is None else Path(faces)}
    except (TypeError, KeyError, ValueError):
        return None


def _key(paths: Sequence[Path]) -> str:
    return "\n".join(map(str, paths))
