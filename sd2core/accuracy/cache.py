"""Cache of measurements per clip, marked stale when scene or machine differ."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.accuracy.plans import Family
from sd2core.accuracy.results import Machine, Measurement
from sd2core.doppler.options import SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.files.atomic import keep_text
from sd2core.files.keys import code_digest
from sd2core.files.paths import user_cache
from sd2core.files.texts import read_text
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count
from sd2core.processes import processor_name
from sd2core.sensor import VirtualSensor
from sd2core.version import __version__


def clip_fingerprint(mesh: MeshSequence, frames: Iterable[int] = ()) -> str:
    """Fingerprint of a moving mesh: faces, counts, times, gaps, and some frames, or three."""
    digest = hashlib.sha256(repr((mesh.vertex_count, mesh.frame_count)).encode())
    if mesh.faces is not None:
        digest.update(mesh.faces.tobytes())
    if mesh.vertex_counts is not None:
        digest.update(mesh.vertex_counts.tobytes())
    digest.update(np.ascontiguousarray(mesh.times_s).tobytes())
    if mesh.present is not None:
        digest.update(mesh.present.tobytes())
    for frame in frames or (0, mesh.frame_count // 2, mesh.frame_count - 1):
        digest.update(np.ascontiguousarray(mesh.frame(frame)).tobytes())
    return digest.hexdigest()[:16]


def scene_fingerprint(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, family: Family
) -> str:
    """Fingerprint of everything that errors depend on, the code too.

    Parameters
    ----------
    mesh : MeshSequence
        With its uncertainty, where the options count the expected map.
    sensor : VirtualSensor
        Where it stands and looks.
    options : SynthesisOptions
        For what a plan does not choose.
    family : {"histogram", "fmcw"}
        Family of the plans measured.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    what: dict[str, Any] = {
        "clip": clip_fingerprint(mesh),
        "sensor": sensor.as_dict(),
        "options": asdict(options),
        "family": family,
        "code": [code_digest(step) for step in ("synthesise", "simulate")],
    }
    if mesh.surroundings is not None:
        what["surroundings"] = mesh.surroundings.digest
    if mesh.others:
        what["others"] = [clip_fingerprint(body) for body in mesh.others]
    known = [body.uncertainty for body in mesh.bodies if body.uncertainty is not None]
    if options.count == "expected" and known:
        stated = [
            values for one in known for values in (one.vertex_limb, one.along_mps, one.across_mps)
        ]
        what["uncertainty"] = [hashlib.sha256(values.tobytes()).hexdigest() for values in stated]
    return hashlib.sha256(repr(what).encode()).hexdigest()[:16]


def this_machine() -> Machine:
    """Processor, cores and program version in use."""
    return Machine(processor_name(), worker_count(), __version__)


_FORMAT = 1


def cached_measurement(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    options: SynthesisOptions,
    family: Family = "histogram",
) -> Measurement | None:
    """Last measurement of this clip, or None if there is none that can be read.

    It is ``stale`` if it was of another sensor place or other options, of other vertices in the
    frames that were measured, or on another machine or version.

    Parameters
    ----------
    mesh : MeshSequence
        Clip measured: measurements are found by :func:`clip_fingerprint` and family.
    sensor, options : VirtualSensor, SynthesisOptions
        Those in use now.
    family : {"histogram", "fmcw"}
        Family of the plans measured.
    """
    try:
        measurement, vertices = _read(_place(mesh, family))
    except (ValueError, KeyError, TypeError, Sd2Error):
        # A cache: what cannot be read is measured again.
        return None
    same = (
        measurement.scene == scene_fingerprint(mesh, sensor, options, family)
        and measurement.machine == this_machine()
        and vertices == _as_measured(mesh, measurement.frames)
    )
    return replace(measurement, stale=not same)


def store_measurement(mesh: MeshSequence, measurement: Measurement) -> None:
    """Keep a measurement in the user's cache folder, in place of the clip's last one.

    A folder that cannot be written to is no error.
    """
    vertices = _as_measured(mesh, measurement.frames)
    content = {"format": _FORMAT, **asdict(measurement), "vertices": vertices}
    del content["stale"]
    keep_text(_place(mesh, measurement.family), json.dumps(content))


def _place(mesh: MeshSequence, family: Family) -> Path:
    return user_cache("ladder") / f"{family}-{clip_fingerprint(mesh)}.json"


def _as_measured(mesh: MeshSequence, frames: Sequence[int]) -> list[str]:
    """Fingerprints of all bodies by the frames measured, and those beside: they tell velocities."""
    near = {frame + step for frame in frames for step in (-1, 0, 1)}
    within = sorted(near.intersection(range(mesh.frame_count)))
    return [clip_fingerprint(body, within) for body in mesh.bodies]


def _read(path: Path) -> tuple[Measurement, Any]:
    """A kept measurement, and the fingerprints of the vertices that it is of."""
    from pydantic import TypeAdapter

    content = json.loads(read_text(path, "a measurement"))
    if content["format"] != _FORMAT:
        raise ValueError(f"format {content['format']}")
    vertices = content.pop("vertices", None)
    text = json.dumps(content)
    return TypeAdapter(Measurement).validate_json(text, strict=True), vertices
