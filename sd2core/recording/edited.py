"""Fields of a recording that are edited beside its labels, as the journal of edits keeps them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import SensorEntry
from sd2core.placements.placements import placements_from_dict
from sd2core.recording.divergence import WORDS
from sd2core.recording.recording import Recording
from sd2core.sensor import VirtualSensor

_ALWAYS = ("sensor", "placements", "radar_offset_s")
_INERTIAL = ("imu", "imu_offset_s", "imu_places")
_CHANNEL = ("radar_receiver", "radar_transmitter")
EDITED = (*_ALWAYS, *_INERTIAL, *_CHANNEL)
"""Names of the fields. Journals of earlier versions end with the third or the sixth."""


def edited_fields(recording: Recording) -> dict[str, Any]:
    """Encode the fields as JSON holds them: equal fields are equal entries."""
    planned = recording.placements
    entry = {
        "sensor": asdict(recording.sensor),
        "placements": None if planned is None else planned.as_dict(),
        "radar_offset_s": recording.radar_offset_s,
        "imu": None if recording.imu is None else str(plain_path(recording.imu)),
        "imu_offset_s": recording.imu_offset_s,
        "imu_places": recording.imu_places,
        "radar_receiver": recording.radar_receiver,
        "radar_transmitter": recording.radar_transmitter,
    }
    return dict(json.loads(json.dumps(entry)))


def decoded_fields(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Decode what :func:`edited_fields` encoded; Sd2Error where that is something else."""
    try:
        sensor = SensorEntry.model_validate(entry["sensor"])
        planned = entry["placements"]
        fields: dict[str, Any] = {
            "sensor": VirtualSensor(**dict(sensor)),
            "placements": None if planned is None else placements_from_dict(planned),
            "radar_offset_s": float(entry["radar_offset_s"]),
        }
        if "imu_places" in entry:
            file = entry["imu"]
            fields |= {
                "imu": None if file is None else Path(file),
                "imu_offset_s": float(entry["imu_offset_s"]),
                "imu_places": tuple(map(str, entry["imu_places"])),
            }
        if "radar_receiver" in entry:
            fields |= {name: _number(entry[name]) for name in _CHANNEL}
        return fields
    except (KeyError, TypeError, ValueError, ValidationError) as error:
        raise Sd2Error(
            f"Sensor, placements and offset that were not saved cannot be read ({error})",
            f"the fields {', '.join(_ALWAYS)}",
        ) from error


def _number(entry: Any) -> int | None:
    """Decode a number from 1 on, or none."""
    if entry is not None and int(entry) < 1:
        raise ValueError(f"{entry!r} is no number from 1 on")
    return None if entry is None else int(entry)


def differing(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Name the fields in which two entries differ, in words."""
    both = [name for name in EDITED if name in _ALWAYS or (name in one and name in other)]
    return [WORDS[name] for name in both if one.get(name) != other.get(name)]
