"""Interface to the library's models, which tests replace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from sd2app.background.model_worker.client import ModelProcess, RemoteClassifier, RemoteDenoiser
from sd2core.classify.card import ClassifierCard
from sd2core.classify.files import available_classifiers, describe_classifier
from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import available_models, describe_model

Card = TypeVar("Card", bound=Any)
Model = TypeVar("Model")


@dataclass(frozen=True)
class ModelLibrary(Generic[Card, Model]):
    """Functions on models of one kind."""

    available: Callable[[], Sequence[Card]]  # bundled models and the user's own
    describe: Callable[[Path], Card]
    load: Callable[[Path], Model]  # takes seconds the first time
    close: Callable[[], None] = lambda: None  # release everything

    def named(self, name: str) -> Card | None:
        """Card of a model that comes with the program; a user's own of that name goes first."""
        return next((card for card in self.available() if card.name == name), None)


DenoiserLibrary = ModelLibrary[ModelCard, RemoteDenoiser]
ClassifierLibrary = ModelLibrary[ClassifierCard, RemoteClassifier]


def core_denoisers(process: ModelProcess) -> DenoiserLibrary:
    """Denoisers of the library, in the model process; cards are read here."""
    return ModelLibrary(available_models, describe_model, process.load, process.close)


def core_classifiers(process: ModelProcess) -> ClassifierLibrary:
    """Classifiers of the library, in the model process; cards are read here."""
    return ModelLibrary(available_classifiers, describe_classifier, process.load_classifier)
