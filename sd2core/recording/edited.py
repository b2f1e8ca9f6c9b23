"""Fields of a recording that are edited beside its labels, as the journal of edits keeps them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.recording.divergence import WORDS, named
from sd2core.recording.document import Document
from sd2core.recording.recording import Recording, settings_of

_ALWAYS = ("sensor", "placements", "radar_offset_s")
MESH = ("mesh", "faces", "mesh_reading", "camera")
"""Names of the fields on which the mesh depends."""
EDITED = tuple(name for name in WORDS if name != "title")  # which saving elsewhere gives
"""Names of the fields. Journals of earlier versions lack some of them."""


def edited_fields(recording: Recording) -> dict[str, Any]:
    """Encode the fields as JSON holds them: equal fields are equal entries."""
    planned = recording.placements
    entry = {name: getattr(recording, name) for name in EDITED} | {
        "sensor": recording.sensor.as_dict(),
        "placements": None if planned is None else planned.as_dict(),
    }
    return dict(json.loads(json.dumps(entry, default=_encoded)))


def _encoded(value: Any) -> Any:
    if isinstance(value, Path):
        return str(plain_path(value))
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else asdict(value)


def decoded_fields(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Decode what :func:`edited_fields` encoded; Sd2Error where that is something else."""
    names = [name for name in EDITED if name in _ALWAYS or name in entry]
    try:
        document = Document.model_validate({name: entry[name] for name in names})
    except (KeyError, TypeError, ValueError) as error:
        raise Sd2Error(
            f"Sensor, placements and offset that were not saved cannot be read ({error})",
            f"the fields {', '.join(_ALWAYS)}",
        ) from error
    settings = settings_of(document, Path())
    return {name: settings[name] for name in names}


def differing(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Name the fields in which two entries differ, in words."""
    both = [name for name in EDITED if name in _ALWAYS or (name in one and name in other)]
    return named(name for name in both if one.get(name) != other.get(name))
