"""Models that denoise, in words, the same wherever they are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sd2app.widgets.model_page import ModelPage, about_sections, map_and_file_rows, model_title

if TYPE_CHECKING:
    from sd2core.denoise.card import ModelCard

_KINDS = {
    "s4": "S4 (HiPPO-LegS)",
    "s4d": "S4D (diagonal)",
    "s4-serial": "S4, serialised",
    "gru": "GRU",
    "unet": "U-Net",
    "swin": "Swin transformer",
    "none": "No denoising",
    "median": "Median filter",
    "wiener": "Wiener filter",
    "ridge": "Ridge regression",
}


def kind_words(card: ModelCard) -> str:
    """Kind of network."""
    return _KINDS.get(card.model, card.model)


def origin_words(card: ModelCard) -> str:
    """Data that a model learned from, in words; simulation is named as such."""
    if card.trained_on == "simulated":
        return "simulated data only"
    return "real captures"


def track_words(card: ModelCard | None) -> str:
    """Description of a map that a model makes; empty without a model."""
    if card is None:
        return ""
    simulated = " (simulated data only)" if card.trained_on == "simulated" else ""
    return f"{model_title(card)}{simulated}"


def denoiser_page(card: ModelCard) -> ModelPage:
    """Page of facts about a denoiser."""
    simulated = card.trained_on == "simulated"
    rows = [
        ("Kind", f"{kind_words(card)}, {card.parameters:,} parameters"),
        ("Learned from", "simulated data only" if simulated else "real data"),
        *([] if card.known is None else [("Movements", card.known.words)]),
        *map_and_file_rows(card.axis, card.frame_rate_hz, card.path),
    ]
    return ModelPage(model_title(card), simulated, rows, list(about_sections(card.about)))
