"""What a measurement holds for: fingerprints of scene and machine."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.accuracy.plans import Family
from sd2core.accuracy.results import Machine
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count
from sd2core.sensor import VirtualSensor
from sd2core.version import __version__

_PROCESSORS = Path("/proc/cpuinfo")


def clip_fingerprint(mesh: MeshSequence) -> str:
    """Of a moving mesh: its faces, counts, times and gaps, and three of its frames."""
    digest = hashlib.sha256(repr((mesh.vertex_count, mesh.frame_count)).encode())
    if mesh.faces is not None:
        digest.update(mesh.faces.tobytes())
    if mesh.vertex_counts is not None:
        digest.update(mesh.vertex_counts.tobytes())
    digest.update(np.ascontiguousarray(mesh.times_s).tobytes())
    if mesh.present is not None:
        digest.update(mesh.present.tobytes())
    for frame in (0, mesh.frame_count // 2, mesh.frame_count - 1):
        digest.update(np.ascontiguousarray(mesh.frame(frame)).tobytes())
    return digest.hexdigest()[:16]


def scene_fingerprint(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, family: Family
) -> str:
    """Of everything that errors depend on."""
    what: dict[str, Any] = {
        "clip": clip_fingerprint(mesh),
        "sensor": asdict(sensor),
        "options": asdict(options),
        "family": family,
    }
    return hashlib.sha256(repr(what).encode()).hexdigest()[:16]


def this_machine() -> Machine:
    """What costs depend on here and now."""
    return Machine(_processor(), worker_count(), __version__)


def _processor() -> str:
    if _PROCESSORS.exists():
        for line in _PROCESSORS.read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()
