"""Models that denoise, in words, the same wherever they are shown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sd2app.widgets.model_page import (
    ModelPage,
    about_sections,
    map_and_file_rows,
    model_title,
)

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
}


def kind_words(card: ModelCard) -> str:
    """Kind of network."""
    return _KINDS.get(card.model, card.model)


def origin_words(card: ModelCard) -> str:
    """Origin of the training data; simulation is named as such."""
    if card.trained_on == "simulated":
        return "learned from simulated data only"
    return "learned from real captures"


def track_words(card: ModelCard) -> str:
    """Text beside the title of the denoised map."""
    simulated = " (simulated data only)" if card.trained_on == "simulated" else ""
    return f"{model_title(card)}{simulated}"


def denoised_words(card: ModelCard | None) -> str:
    """Description of a map made by this model; empty without a model."""
    return "" if card is None else track_words(card)


def denoiser_page(card: ModelCard) -> ModelPage:
    """Page of facts about a denoiser."""
    return ModelPage(
        model_title(card),
        card.trained_on == "simulated",
        list(card_rows(card)),
        list(about_sections(card.about)),
    )


def card_rows(card: ModelCard) -> Iterator[tuple[str, str]]:
    """Facts of a model card, a name and a text each."""
    yield "Kind", f"{kind_words(card)}, {card.parameters:,} parameters"
    yield "Learned from", "simulated data only" if card.trained_on == "simulated" else "real data"
    yield from map_and_file_rows(card.axis, card.frame_rate_hz, card.path)
