"""The menu of denoisers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import SignalInstance

from sd2app.denoise.model import DenoiseModel
from sd2app.denoise.text import kind_words, model_title, origin_words
from sd2app.widgets.model_menu import Entry, Face


class DenoiserChooser:
    """Denoisers to choose from."""

    title = "Denoise with"
    role = "Denoiser"
    none_tip = "Show no denoised map for this recording"

    def __init__(self, denoise: DenoiseModel) -> None:
        self._denoise = denoise

    @property
    def changed(self) -> SignalInstance:
        """Signal that texts or models may have changed."""
        return self._denoise.changed

    @property
    def path(self) -> Path | None:
        """The model in use."""
        return self._denoise.path

    def entries(self) -> Sequence[Entry]:
        """The models as they are on disk now."""
        return [
            Entry(
                f"{model_title(card)}\t{kind_words(card)}",
                f"{kind_words(card)}, {origin_words(card)}\n{card.path}",
                card.path,
            )
            for card in self._denoise.available()
        ]

    def face(self) -> Face:
        """Text and tooltip for the model in use."""
        card, path = self._denoise.card, self._denoise.path
        if self._denoise.problem:
            return Face("Denoiser not usable", self._denoise.problem)
        if card is not None:
            title = model_title(card)
            return Face(title, f"{title}: {kind_words(card)}, {origin_words(card)}")
        if path is not None and self._denoise.busy:
            return Face(f"Loading {path.stem}…", str(path))
        return Face("No denoiser", "Choose a model that denoises this map")
