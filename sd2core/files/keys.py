"""Keys of results: hashes of all that they depend on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from sd2core.files.resources import resource_path

_MAP = (
    "batch/synthesis.py",
    "io",
    "maps.py",
    "mesh",
    "plausibility/clock.py",
    "scattering",
    "sensor.py",
    "timebase.py",
)
"""Modules that any map depends on."""

_CODE: dict[str, tuple[str, ...]] = {
    "inspect": (*_MAP, "batch/inputs.py", "datasets/kept_maps.py", "files/digests.py", "recording"),
    "fit": ("batch/fitting.py", "body", "io", "mesh", "timebase.py"),
    "synthesise": (*_MAP, "body/limbs.py", "body/parts.py", "doppler", "accuracy", "numerics"),
    "denoise": (
        "batch/denoising.py",
        "datasets/kept_maps.py",
        "denoise",
        "mesh/presence.py",
        "pairs/segments.py",
        "maps.py",
    ),
    "simulate": (*_MAP, "datasets/simulating.py", "fmcw", "mocap/recording_pairs.py"),
    "export": (
        *_MAP,
        "batch/exporting.py",
        "datasets",
        "fmcw",
        "imu",
        "labels",
        "mocap/recording_pairs.py",
        "pairs/segments.py",
    ),
}
"""Modules that a step's results depend on, within sd2core."""

_RESOURCES: dict[str, tuple[str, ...]] = {
    "fit": ("body.npz", "lifter.npz", "sides.npz"),
    "synthesise": ("body.npz",),
}


def key_of(step: str, content: dict[str, Any]) -> str:
    """Return the key of a step's result: 32 hexadecimal digits, the same on every machine.

    ``content`` is all that the result depends on besides the code, as JSON can hold it. The
    order of keys does not matter.
    """
    text = json.dumps(
        [step, code_digest(step), content], sort_keys=True, allow_nan=False, ensure_ascii=True
    )
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@cache
def code_digest(step: str) -> str:
    """Hash of the code that makes a step's results, and of its bundled data."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for name in _CODE[step]:
        for file in _sources(package / name):
            digest.update(file.relative_to(package).as_posix().encode())
            digest.update(file.read_bytes())
    for name in _RESOURCES.get(step, ()):
        digest.update(resource_path(name).read_bytes())
    return digest.hexdigest()[:16]


def all_code_digest() -> str:
    """Hash of the code of all steps: the same where the same program is installed."""
    return hashlib.sha256("".join(map(code_digest, _CODE)).encode()).hexdigest()[:16]


def _sources(path: Path) -> Iterable[Path]:
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]
