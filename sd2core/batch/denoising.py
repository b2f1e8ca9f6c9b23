"""Task that denoises a synthetic map."""

from __future__ import annotations

from pathlib import Path

from sd2core.maps import DopplerMap


def denoise(synthetic: Path, model: str, out: Path, texture: int | None = None) -> None:
    """Denoise a map and write the result.

    Parameters
    ----------
    synthetic : Path
        File of the map.
    model : str
        File of the denoiser, which the process keeps from one task to the next.
    out : Path
        File to write.
    texture : int, optional
        Seed with which the map is drawn as a radar would show it. None leaves the texture out;
        Sd2Error if the model knows none.
    """
    from sd2core.datasets.kept_maps import denoised
    from sd2core.denoise.model import use_one_thread

    # There are as many processes as cores.
    use_one_thread()
    out.parent.mkdir(parents=True, exist_ok=True)
    denoised(DopplerMap.load(synthetic), Path(model), texture).save(out)
