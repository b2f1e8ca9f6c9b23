"""Denoised maps, and the choice of the denoiser."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from PySide6.QtWidgets import QMenu

from sd2app.background.model_worker.client import DenoiserLibrary
from sd2app.denoise.model import DenoiseModel
from sd2app.denoise.text import denoiser_page, kind_words, origin_words
from sd2app.feature import Action, Drop, Feature, Shell, report
from sd2app.maps.feature import MapExportDialog
from sd2app.maps.model import SynthesisModel
from sd2app.maps.stack import MapStack
from sd2app.session.session import Session
from sd2app.widgets.dialogs import accepted
from sd2app.widgets.model_menu import ModelButton, ModelMenu, Words

_WORDS = Words(
    "Denoise with",
    "Denoiser",
    "Show no denoised map for this recording",
    "Choose a model that denoises this map",
    kind_words,
    origin_words,
    "Open model file",
    "Model (*.safetensors);;All files (*)",
    denoiser_page,
)


class DenoiseFeature(Feature):
    """The synthetic map denoised by a model of the user's choice."""

    def __init__(
        self, session: Session, shell: Shell, synthesis: SynthesisModel, library: DenoiserLibrary
    ) -> None:
        self._session, self._shell = session, shell
        self.model = DenoiseModel(session, synthesis, library, session.parent)
        report(shell, self.model)
        self.changing = self.model.changed, *synthesis.completeness
        self.closing = self.working = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Models and what is done with them."""
        model = self.model
        return (
            Action(
                "export_denoised", "File", "Export denoised map…", (),
                "Write the denoised Doppler map with its provenance (.npz)",
                self._export, lambda: model.can_export,
            ),
            Action(
                "open_model", "Model", "Open model file…", (),
                "Denoise this recording with a model of your own (.safetensors)",
                lambda: self._models.open_file(), self._session.has_content,
            ),
            Action(
                "model_card", "Model", "About this model…", (),
                "What it learned from, what was measured of it, and its limits",
                lambda: self._models.show_card(), lambda: model.card is not None,
            ),
            Action(
                "compare_models", "Model", "Compare with the model before", ("B",),
                "Show the map of the model that was in use before below that of this one",
                lambda: model.set_comparing(not model.comparing),
                checked=lambda: model.comparing,
                why_not=lambda: (
                    "" if model.before is not None else "No other model has been in use here yet"
                ),
            ),
            Action(
                "texture", "Model", "Denoised as the radar would show it", (),
                "Draw the speckle and the gaps of a radar's map instead of the mean",
                lambda: model.set_textured(not model.textured),
                checked=lambda: model.textured, why_not=self._why_no_texture,
            ),
            Action(
                "live", "Model", "Denoise live while playing", ("V",),
                "Frame by frame as the clock reaches them, knowing the past only, as beside a"
                " radar",
                lambda: model.set_live(not model.live), checked=lambda: model.live,
            ),
        )  # fmt: skip

    def _why_no_texture(self) -> str:
        card = self.model.card
        if card is None:
            return "There is no denoised map: choose a model under Model"
        known = card.texture is not None
        return "" if known else "This model does not know the texture of a radar's maps"

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """The models to choose from."""
        return {"denoisers": lambda menu: menu.addMenu(self._models)}

    @cached_property
    def _models(self) -> ModelMenu:
        return ModelMenu(self.model, _WORDS, self._shell, ("open_model", "model_card"))

    def put_buttons(self, stack: MapStack) -> None:
        """Offer the models on the maps too."""
        stack.set_denoiser_buttons(ModelButton(self._models), ModelButton(self._models))

    def drop_of(self, path: Path) -> Drop | None:
        """Use a model file that is dropped."""
        if path.suffix != ".safetensors":
            return None
        return Drop("Denoise with this model", lambda: self._models.use(path))

    def _export(self) -> None:
        name = self._session.document.file_name("-denoised.npz")
        accepted(MapExportDialog("denoised", name, self.model, self._shell))
