"""Measurements kept per clip, and marked stale when scene or machine are no longer those."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from sd2core.accuracy.plans import AccuracyPlan, Family
from sd2core.accuracy.results import Cost, Errors, Machine, Measurement, PlanResult, Spread
from sd2core.accuracy.scene import clip_fingerprint, scene_fingerprint, this_machine
from sd2core.doppler.options import SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

_FORMAT = 1


def remembered(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    family: Family = "histogram",
) -> Measurement | None:
    """The last measurement of this clip, if there is one that can be read.

    ``stale`` when it was of another sensor place or other options, or on another
    machine or version.
    """
    try:
        content = json.loads(_place(mesh, family).read_text(encoding="utf-8"))
        measurement = _from_json(content)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, Sd2Error):
        # A cache: what cannot be read is measured again.
        return None
    same = (
        measurement.scene == scene_fingerprint(mesh, sensor, options, family)
        and measurement.machine == this_machine()
    )
    return replace(measurement, stale=not same)


def remember(mesh: MeshSequence, measurement: Measurement) -> None:
    """Keep a measurement in the user's cache folder, in place of the clip's last one.

    Where nothing can be written it is not kept, and nothing is said.
    """
    place = _place(mesh, measurement.family)
    content = {"format": _FORMAT, **asdict(measurement)}
    del content["stale"]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(place, json.dumps(content))
    except OSError:
        return


def _place(mesh: MeshSequence, family: Family) -> Path:
    import platformdirs

    folder = Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False)) / "ladder"
    return folder / f"{family}-{clip_fingerprint(mesh)}.json"


def _from_json(content: dict[str, Any]) -> Measurement:
    if content["format"] != _FORMAT:
        raise ValueError(f"format {content['format']}")
    return Measurement(
        family=content["family"],
        reference=AccuracyPlan.from_json(content["reference"]),
        results=tuple(_result(entry) for entry in content["results"]),
        scene=content["scene"],
        machine=Machine(**content["machine"]),
        frames=tuple(content["frames"]),
        source=content["source"],
        convergence=tuple(
            (int(pieces), float(change)) for pieces, change in content["convergence"]
        ),
    )


def _result(content: dict[str, Any]) -> PlanResult:
    return PlanResult(
        AccuracyPlan.from_json(content["plan"]),
        Errors(**_with_spreads(content["errors"])),
        Cost(**_with_spreads(content["cost"])),
    )


def _with_spreads(content: dict[str, Any]) -> dict[str, Any]:
    return {
        name: Spread(_number(value["median"]), _number(value["p95"]))
        if isinstance(value, dict)
        else _number(value)
        for name, value in content.items()
    }


def _number(value: Any) -> Any:
    """An integer stays one."""
    if not isinstance(value, int | float):
        raise TypeError(f"{value!r} is not a number")
    return value
