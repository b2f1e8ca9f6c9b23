"""Task that denoises a synthetic map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.maps import DopplerMap, joined

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser


def denoise(
    maps: Sequence[Path], model: str, digest: str, outs: Sequence[Path], texture: int | None = None
) -> None:
    """Denoise a map, given in parts in order, and write one file per part, in order.

    Parameters
    ----------
    maps : sequence of Path
        Files of the parts.
    model : str
        File of the denoiser.
    digest : str
        Hash of that file's content: a worker loads the model again when it is another.
    outs : sequence of Path
        Files to write, as many as ``maps``.
    texture : int, optional
        Seed with which a map is drawn as a radar would show it. None leaves the texture out;
        Sd2Error if the model knows none.
    """
    trained = _model(model, digest)
    outs[0].parent.mkdir(parents=True, exist_ok=True)
    parts = [DopplerMap.load(path) for path in maps]
    denoised = trained.denoise(joined(parts))
    if texture is not None:
        denoised = trained.card.needed_texture().on(denoised, texture)
    start = 0
    for part, out in zip(parts, outs, strict=True):
        stop = start + len(part.timebase)
        one = denoised.between(start, stop)
        replace(one, meta={**one.meta, "input": part.meta}).save(out)
        start = stop


@lru_cache(maxsize=1)
def _model(path: str, digest: str) -> TrainedDenoiser:
    """Load a model, which the process keeps from one task to the next."""
    from sd2core.denoise.files import load_model
    from sd2core.denoise.model import use_one_thread

    # There are as many processes as cores.
    use_one_thread()
    return load_model(Path(path))
