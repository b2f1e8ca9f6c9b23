"""Denoised maps of sources; the model that was used last stays loaded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.denoise.files import describe_model
from sd2core.denoise.resample_to_model import check_map
from sd2core.maps import DopplerMap

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser


class Denoising:
    """Denoises one map after another."""

    def __init__(self) -> None:
        self._path: Path | None = None
        self._model: TrainedDenoiser | None = None

    def denoised(self, synthetic: DopplerMap, path: Path) -> DopplerMap:
        """What a radar would show in place of a synthetic map.

        Parameters
        ----------
        synthetic : DopplerMap
        path : Path
            Model file.

        Raises
        ------
        Sd2Error
            When the map is not of the kind that the model was trained on.
        """
        if self._model is None or path != self._path:
            from sd2core.denoise.files import load_model

            check_map(synthetic, describe_model(path))  # before torch is loaded: it takes seconds
            self._model, self._path = load_model(path), path
        return self._model.denoise(synthetic)
