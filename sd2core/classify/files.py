"""Model files of classifiers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.classify.card import ClassifierCard
from sd2core.classify.defaults import CLASSIFIERS
from sd2core.denoise.files import readable, save_network, user_models_folder
from sd2core.denoise.weights import SUFFIX, Shapes, read_header, read_network
from sd2core.errors import Sd2Error
from sd2core.files.resources import bundled_files, resource_path

if TYPE_CHECKING:
    from sd2core.classify.live import TrainedClassifier
    from sd2core.classify.models import Classifier

GESTURES = "gestures"
"""Name of the bundled classifier."""

_EXPECTED = "a classifier (.safetensors) written by `sd2 classify train`"


def save_classifier(path: Path, trained: TrainedClassifier) -> ClassifierCard:
    """Write a classifier to one file, in one step, and return the card as it is in the file.

    Raises Sd2Error if the name does not end in ``.safetensors``, or the card holds what
    JSON cannot.
    """
    card = trained.card
    return save_network(Path(path), trained.network, card, CLASSIFIERS.package_of(card.model))


def describe_classifier(path: Path) -> ClassifierCard:
    """Read the card of a classifier's file, without its weights and without torch.

    Raises Sd2Error if it is missing, damaged, of a newer version, or something else.
    """
    return _read_header(Path(path))[0]


def load_classifier(path: Path) -> TrainedClassifier:
    """Load a classifier. Raises Sd2Error if it is missing, damaged or inconsistent."""
    path = Path(path)
    card, shapes = _read_header(path)
    CLASSIFIERS.check_installed(card.model, card.package, path)

    from sd2core.classify.live import TrainedClassifier
    from sd2core.classify.models import build

    def built() -> Classifier:
        return build(card.model, card.features.size, len(card.classes), **card.options)

    network = read_network(path, built, card.model, shapes, _EXPECTED)
    return TrainedClassifier(network, card)


def available_classifiers() -> list[ClassifierCard]:
    """Cards of the user's classifiers and the bundled one; damaged files are left out."""
    own = sorted(user_classifiers_folder().glob(f"*{SUFFIX}"))
    return readable([*own, *bundled_files(f"{GESTURES}{SUFFIX}")], describe_classifier)


def bundled_classifier() -> Path:
    """File of the classifier that comes with the program."""
    return resource_path(f"{GESTURES}{SUFFIX}")


def user_classifiers_folder() -> Path:
    """Folder of the user's classifiers; it may not exist yet."""
    return user_models_folder().parent / "classifiers"


def _read_header(path: Path) -> tuple[ClassifierCard, Shapes]:
    header, shapes = read_header(path, _EXPECTED)
    if header.get("format") == "sd2-denoiser":
        raise Sd2Error(
            f"{path} is a denoiser", "a classifier", "Train one with `sd2 classify train`"
        )
    return ClassifierCard.from_json(header, path), shapes
