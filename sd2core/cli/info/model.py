"""``sd2 info`` of a trained denoiser or classifier."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sd2core.classify.card import FORMAT as CLASSIFIER
from sd2core.classify.card import ClassifierCard
from sd2core.classify.files import describe_classifier
from sd2core.cli.info.description import axis_in_words, bins_in_words
from sd2core.cli.output import Report
from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import describe_model
from sd2core.denoise.registry import MODELS, summary
from sd2core.denoise.weights import format_of

_UNITS = {"mps": "m/s", "s": "s", "hz": "Hz", "m": "m"}
"""Units, by how names of values end."""
_ABBREVIATIONS = ("mae", "rmse", "ssm")


def describe_model_file(path: Path) -> Report:
    """Describe a model file without its weights."""
    if format_of(path) == CLASSIFIER:
        return describe_classifier_card(path, describe_classifier(path))
    return describe_card(path, describe_model(path))


def describe_classifier_card(path: Path, card: ClassifierCard) -> Report:
    """Describe a classifier without its weights."""
    data = {"kind": "classifier", "path": str(path), **card.to_json()}
    shown = "whole columns" if card.features.kind == "columns" else "the strongest bin"
    facts = {
        "model": f"{card.model}{f' of {card.package}' if card.package else ''}, shown {shown};"
        f" learnt from {' and '.join(card.trained_on)} maps",
        "classes": ", ".join(card.classes),
        "answers": f"{card.delay_s:g} s late" if card.delay_frames else "at once",
        **_axis_facts(card),
        "parameters": f"{card.parameters:,}",
        **dict(_about(card.about)),
    }
    return Report(f"Classifier {path}" + (f": {card.title}" if card.title else ""), data, facts)


def describe_card(path: Path, card: ModelCard) -> Report:
    """Describe a denoiser without its weights."""
    data = {"kind": "model", "path": str(path), **card.to_json()}
    facts = {
        "model": model_words(card),
        **_axis_facts(card),
        **({} if card.known is None else {"has learnt from": card.known.words}),
        "parameters": f"{card.parameters:,}",
        **dict(_about(card.about)),
    }
    title = f"Denoiser {path}" + (f": {card.title}" if card.title else "")
    return Report(title, data, facts)


def model_words(card: ModelCard) -> str:
    """Kind of a denoiser and the data it learnt from."""
    words = f"{card.model}, {summary(card.model)}" if card.model in MODELS else card.model
    words += f" of {card.package}" if card.package else ""
    source = "a simulated radar" if card.trained_on == "simulated" else "a real radar"
    return f"{words}; learnt from {source}"


def _axis_facts(card: ModelCard | ClassifierCard) -> dict[str, str]:
    return {
        "velocity": axis_in_words(card.axis),
        "nulled bins": bins_in_words(card.axis, card.null_bins),
        "frame rate": f"{card.frame_rate_hz:.4g} frames/s",
    }


def _about(about: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in about.items():
        stem, _, unit = name.rpartition("_")
        unit = _UNITS.get(unit, "") if not isinstance(value, Mapping) else ""
        words = (stem if unit else name).split("_")
        label = prefix + " ".join(one.upper() if one in _ABBREVIATIONS else one for one in words)
        if isinstance(value, Mapping):
            yield from _about(value, f"{label}, ")
        elif isinstance(value, float):
            yield label, f"{value:.4g} {unit}".rstrip()
        elif isinstance(value, bool):
            yield label, "yes" if value else "no"
        elif value is not None and not isinstance(value, list | tuple):
            yield label, str(value)
