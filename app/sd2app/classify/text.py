"""Classifiers in words, the same wherever they are shown."""

from __future__ import annotations

from collections.abc import Iterable

from sd2app.classify.run import ClassRun
from sd2app.classify.track import ClassReading
from sd2app.widgets.model_page import ModelPage, about_sections, map_and_file_rows, model_title
from sd2app.widgets.run_text import PHASES
from sd2core.classify.card import ClassifierCard

MODEL_WORDS = {"lstm": "LSTM (the paper's)", "s4": "S4", "kernel": "kernel (few recordings)"}
FEATURE_WORDS = {"columns": "all speeds", "peak": "strongest speed alone (the paper's)"}
_KINDS = {
    "simulated": "simulated radar",
    "real": "real radar",
    "synthetic": "synthetic",
    "denoised": "denoised synthetic",
}


def kinds_text(kinds: Iterable[str]) -> str:
    """Kinds of maps; what is simulated is called so."""
    return " and ".join(_KINDS.get(kind, kind) for kind in kinds)


def learned_text(card: ClassifierCard) -> str:
    """Kinds of maps that it learned from, in words."""
    return f"learned from {kinds_text(card.trained_on)} maps"


def network_text(card: ClassifierCard) -> str:
    """Network and features in words."""
    model = MODEL_WORDS.get(card.model, card.model)
    return f"{model}, {FEATURE_WORDS.get(card.features.kind, card.features.kind)}"


def classifier_page(card: ClassifierCard) -> ModelPage:
    """Page with the card of a classifier."""
    rows = [
        ("Kind", f"{network_text(card)}, {card.parameters:,} parameters"),
        ("Learned from", f"{kinds_text(card.trained_on)} maps"),
        ("Classes", ", ".join(card.classes)),
        ("Answers", delay_text(card) + (", having seen what follows" * bool(card.delay_frames))),
        *map_and_file_rows(card.axis, card.frame_rate_hz, card.path),
    ]
    simulated = "real" not in card.trained_on
    return ModelPage(model_title(card), simulated, rows, list(about_sections(card.about)))


def reading_text(reading: ClassReading | None) -> str:
    """The class of a frame and how sure it is."""
    if reading is None:
        return ""
    if reading.nobody:
        return "no person"
    best = reading.best
    text = f"{reading.classes[best]} {100 * reading.shares[best]:.0f} %"
    return f"{text}, {ago_text(reading.ago_s)}" if reading.ago_s else text


def ago_text(seconds: float) -> str:
    """Age of an answer in words."""
    return f"{seconds:.1f} s ago"


def delay_text(card: ClassifierCard) -> str:
    """Delay of the classifier's answers."""
    return f"{card.delay_s:.2g} s late" if card.delay_frames else "at once"


def run_headline(run: ClassRun) -> str:
    """Current phase of the run in words."""
    history = run.history
    if run.phase != "running":
        return PHASES[run.phase]
    return f"Training: step {history.done} of {history.total}"


def note(run: ClassRun) -> str:
    """Advice for a run that was stopped or did not reach its end."""
    if run.phase == "died":
        return "It was killed, or the machine was switched off."
    if run.phase == "stopped":
        return "The best so far is kept." if run.result else "There was nothing to keep yet."
    return ""
