"""Maps that were computed before, each under the hash of all that it depends on."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.body.parts import synthetic_map
from sd2core.denoise.files import describe_model
from sd2core.denoise.resample_to_model import check_map
from sd2core.errors import Sd2Error
from sd2core.files.digests import cached_digest
from sd2core.files.keys import key_of
from sd2core.files.paths import user_cache
from sd2core.maps import DopplerMap
from sd2core.progress import Progress, part_of, silent

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.doppler import Synthesizer
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VirtualSensor

LIMIT_BYTES = 256 << 20
"""For all of them together: a minute takes some 100 KB, split by limbs more."""


def found_map(key: str) -> DopplerMap | None:
    """Map that is kept under a key, or None where there is none, or none that can be read."""
    place = _place(key)
    with suppress(Sd2Error, OSError):
        os.utime(place)  # those used last stay
        return DopplerMap.load(place)
    return None


def kept_map(key: str, make: Callable[[], DopplerMap]) -> DopplerMap:
    """Map of a key, made where none is kept; what cannot be written is made every time."""
    kept = found_map(key)
    if kept is None:
        kept, place = make(), _place(key)
        with suppress(OSError):
            place.parent.mkdir(parents=True, exist_ok=True)
            kept.save(place)
            _make_room(place.parent)
    return kept


def mesh_identity(recording: Recording, digest: Callable[[Path], str] = cached_digest) -> str:
    """Hash of a recording's mesh, and of what stands and moves around it, and how it is read."""
    reading = {key: str(value) for key, value in recording.mesh_options().items() if key != "faces"}
    return key_of("inspect", {"mesh": [[*map(digest, recording.scene_files)], reading]})


def synthetic_key(mesh: str, maker: Synthesizer, sensor: VirtualSensor, *, limbs: bool) -> str:
    """Key of a map, split by ``limbs`` or not, of a maker whose mesh was one of this identity."""
    content = {
        "mesh": mesh,
        "sources": [body.source for body in maker.mesh.bodies],  # which the map names
        "vertices": maker.mesh.vertex_count,
        "options": asdict(maker.options),
        "left_out": sorted(maker.left_out),
        "sensor": sensor.as_dict(),
        "limbs": limbs,
    }
    return key_of("synthesise", content)


def computed_maps(
    recording: Recording,
    maker: Synthesizer,
    sensor: VirtualSensor,
    model: Path | None = None,
    *,
    limbs: bool = False,
    texture: int | None = None,
    progress: Progress = silent,
) -> tuple[DopplerMap, DopplerMap | None]:
    """Synthetic map of a recording's mesh and, with a denoiser, what that makes of it.

    Parameters
    ----------
    recording, maker, sensor
        The maker is of the recording's mesh.
    model : Path, optional
        File of the denoiser.
    limbs, texture, progress
        True for a map that is split even where the denoiser does not need it; the others are
        as for :func:`denoised`.
    """
    limbs = limbs or (model is not None and bool(describe_model(model).parts))
    key = synthetic_key(mesh_identity(recording), maker, sensor, limbs=limbs)
    share = part_of(progress, 0.0, 1.0 if model is None else 0.5)
    counted = kept_map(key, lambda: synthetic_map(maker, sensor, limbs=limbs, progress=share))
    if model is None:
        return counted, None
    made_by = {"name": model.name, "model": cached_digest(model), "texture": texture}
    key, rest = key_of("denoise", {"maps": [key], **made_by}), part_of(progress, 0.5, 1.0)
    return counted, kept_map(key, lambda: denoised(counted, model, texture, rest))


def denoised(
    synthetic: DopplerMap, path: Path, texture: int | None = None, progress: Progress = silent
) -> DopplerMap:
    """Denoise a synthetic map with a model file; the model used last is kept.

    With the seed of a texture it is drawn as the radar would show it.
    """
    card = describe_model(path)
    check_map(synthetic, card)  # before torch is loaded: it takes seconds
    law = None if texture is None else card.needed_texture()
    made = _loaded(path, path.stat().st_mtime_ns).denoise(synthetic, progress)
    return made if law is None or texture is None else law.on(made, texture)


@lru_cache(maxsize=1)
def _loaded(path: Path, changed_ns: int) -> TrainedDenoiser:
    from sd2core.denoise.files import load_model

    return load_model(path)


def _place(key: str) -> Path:
    return user_cache("maps") / f"{key}.npz"


def _make_room(folder: Path) -> None:
    """Delete the maps that were not used for longest, beyond the limit."""
    files = ((one.stat(), one) for one in folder.glob("*.npz"))
    used_bytes = 0
    for facts, path in sorted(files, key=lambda one: -one[0].st_mtime_ns):
        used_bytes += facts.st_size
        if used_bytes > LIMIT_BYTES:
            path.unlink(missing_ok=True)
