"""Interface to the library's classifiers, which tests replace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap

if TYPE_CHECKING:
    from sd2app.background.model_worker.client import ModelProcess
    from sd2core.classify.card import ClassifierCard


class LiveClasses(Protocol):
    """Frames in, probabilities out, as late as the classifier's card says."""

    def advance(self, energies: NDArray[np.float32]) -> NDArray[np.float32]:
        """Probabilities that follow from the next frames: (frames, bins) → (answers, classes)."""

    def finish(self) -> NDArray[np.float32]:
        """Outstanding answers, as if nothing moved from now on; the session stays usable."""


class Classifier(Protocol):
    """A classifier that is loaded; its methods take a while."""

    def probabilities(self, doppler: DopplerMap) -> NDArray[np.float32]:
        """Class probabilities of every frame of a map, (frames, classes)."""

    def live(self) -> LiveClasses:
        """Session for live frames of one stretch, all with a person."""


@dataclass(frozen=True)
class ClassifierLibrary:
    """Functions of :mod:`sd2core.classify` that the models call; loading takes seconds at first."""

    available: Callable[[], Sequence[ClassifierCard]]  # the user's classifiers
    describe: Callable[[Path], ClassifierCard]
    load: Callable[[Path], Classifier]


def user_classifiers_folder() -> Path:
    """Folder of the user's classifiers; it need not exist yet."""
    from sd2core.denoise.files import user_models_folder

    return user_models_folder().parent / "classifiers"


def core_classifiers(process: ModelProcess) -> ClassifierLibrary:
    """Functions of the library; classifiers run in the model process, cards are read here."""
    from sd2core.classify.files import describe_classifier

    def available() -> Sequence[ClassifierCard]:
        cards = []
        for path in sorted(user_classifiers_folder().glob("*.safetensors")):
            try:
                cards.append(describe_classifier(path))
            except (Sd2Error, OSError):
                continue  # damaged: the others are still of use
        return cards

    return ClassifierLibrary(available, describe_classifier, process.load_classifier)
