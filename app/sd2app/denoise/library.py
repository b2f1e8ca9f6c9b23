"""Interface to the library's denoisers, which tests replace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sd2core.maps import DopplerMap

if TYPE_CHECKING:
    from sd2app.background.model_worker.client import ModelProcess
    from sd2core.denoise.card import ModelCard


class LiveSession(Protocol):
    """Session that denoises live frames."""

    equals_batch: bool

    def step(self, energies: NDArray[np.float32], present: bool = True) -> NDArray[np.float32]:
        """Answer to the next frame (bins,)."""

    def advance(
        self, energies: NDArray[np.float32], present: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Answers to the next frames (frames, bins)."""


class Denoiser(Protocol):
    """A loaded model; its methods take a while."""

    equals_batch: bool  # frame after frame gives what the whole map does
    frame_rate_hz: float  # of the maps that it learned from

    def denoise(self, doppler: DopplerMap) -> DopplerMap:
        """Denoise a synthetic map."""

    def live(self) -> LiveSession:
        """Session for live frames."""


@dataclass(frozen=True)
class DenoiserLibrary:
    """Functions of :mod:`sd2core.denoise` that the models call; tests replace them."""

    available: Callable[[], Sequence[ModelCard]]  # bundled models and the user's own
    describe: Callable[[Path], ModelCard]
    load: Callable[[Path], Denoiser]  # takes seconds the first time
    close: Callable[[], None] = lambda: None  # release everything

    def named(self, name: str) -> ModelCard | None:
        """Card of a model that comes with the program; a user's own of that name goes first."""
        return next((card for card in self.available() if card.name == name), None)


def core_library(process: ModelProcess) -> DenoiserLibrary:
    """Functions of the library; models run in the model process, cards are read here."""

    def available() -> Sequence[ModelCard]:
        from sd2core.denoise.files import available_models

        return available_models()

    def describe(path: Path) -> ModelCard:
        from sd2core.denoise.files import describe_model

        return describe_model(path)

    return DenoiserLibrary(available, describe, process.load, process.close)
