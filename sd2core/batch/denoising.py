"""The task that turns a synthetic map into what a radar would show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.batch.stretches import joined
from sd2core.spectrum import DopplerMap

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser

BEFORE_FRAMES, AFTER_FRAMES = 2048, 256
"""What a model is shown besides a stretch of a longer map: docs/scale.md has what that misses."""


@dataclass
class _Kept:
    """The model that one process keeps from one task to the next."""

    path: str = ""
    digest: str = ""
    model: TrainedDenoiser | None = None


_kept = _Kept()


def denoise(maps: Sequence[Path], number: int, model: str, digest: str, out: Path) -> None:
    """Denoise one of the stretches of a map and write it.

    Parameters
    ----------
    maps : sequence of Path
        The stretches that are looked at, in order: one, and its neighbours.
    number : int
        Which of them is denoised.
    model, digest : str
        Its file, and the hash of that.
    out : Path

    Raises
    ------
    Sd2Error
        When the map is not what the model was trained on.
    """
    parts = [DopplerMap.load(path) for path in maps]
    before = 0
    if number:
        first = parts[number - 1]
        count = len(first.timebase)
        before = min(BEFORE_FRAMES, count)
        parts[number - 1] = first.between(count - before, count)
    frames = len(parts[number].timebase)
    if number + 1 < len(parts):
        after = parts[number + 1]
        parts[number + 1] = after.between(0, min(AFTER_FRAMES, len(after.timebase)))
    own = parts[number]
    denoised = _model(model, digest).denoise(_as_one(parts, own))
    out.parent.mkdir(parents=True, exist_ok=True)
    if len(parts) > 1:
        denoised = denoised.between(before, before + frames)
    denoised.save(out)


def _as_one(parts: Sequence[DopplerMap], own: DopplerMap) -> DopplerMap:
    """Joined; what the map says of itself is that of the stretch itself."""
    from dataclasses import replace

    return replace(joined(parts), meta=own.meta)


def _model(path: str, digest: str) -> TrainedDenoiser:
    from sd2core.denoise.files import load_model
    from sd2core.denoise.threads import use_one_thread

    if _kept.model is None or (_kept.path, _kept.digest) != (path, digest):
        # There are as many processes as cores.
        use_one_thread()
        _kept.model = None
        _kept.model = load_model(Path(path))
        _kept.path, _kept.digest = path, digest
    return _kept.model
