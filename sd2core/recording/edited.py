"""Fields of a recording that are edited beside its labels, as the journal of edits keeps them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from pydantic import ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.recording_json import SensorEntry
from sd2core.placements.placements import placements_from_dict
from sd2core.recording.divergence import WORDS
from sd2core.recording.recording import Recording
from sd2core.sensor import VirtualSensor

EDITED = ("sensor", "placements", "radar_offset_s")
"""Names of the fields."""


def edited_fields(recording: Recording) -> dict[str, Any]:
    """Encode the fields as JSON holds them: equal fields are equal entries."""
    planned = recording.placements
    entry = {
        "sensor": asdict(recording.sensor),
        "placements": None if planned is None else planned.as_dict(),
        "radar_offset_s": recording.radar_offset_s,
    }
    return dict(json.loads(json.dumps(entry)))


def decoded_fields(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Decode what :func:`edited_fields` encoded; Sd2Error where that is something else."""
    try:
        sensor = SensorEntry.model_validate(entry["sensor"])
        planned = entry["placements"]
        return {
            "sensor": VirtualSensor(**dict(sensor)),
            "placements": None if planned is None else placements_from_dict(planned),
            "radar_offset_s": float(entry["radar_offset_s"]),
        }
    except (KeyError, TypeError, ValueError, ValidationError) as error:
        raise Sd2Error(
            f"Sensor, placements and offset that were not saved cannot be read ({error})",
            f"the fields {', '.join(EDITED)}",
        ) from error


def differing(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Name the fields in which two entries differ, in words."""
    return [WORDS[name] for name in EDITED if one.get(name) != other.get(name)]
