"""Model files of denoisers and the folders they are found in."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.denoise.card import ModelCard
from sd2core.denoise.network_card import Card
from sd2core.denoise.registry import DENOISERS
from sd2core.denoise.weights import SUFFIX, Shapes, read_header, read_network, write_weights
from sd2core.errors import Sd2Error
from sd2core.files.limits import check_regular
from sd2core.files.paths import as_path, user_data
from sd2core.files.resources import bundled_files

if TYPE_CHECKING:
    from torch import nn

    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.denoise.model import Denoiser

MAP_MODEL, LIMBS_MODEL = "denoiser", "denoiser-limbs"
"""Names of the bundled models, of which :func:`default_name` chooses."""

_EXPECTED = "a model file (.safetensors) written by `sd2 train`"


def default_name(*, limbs: bool) -> str:
    """Name of the model that is used when none is named, of what there is to denoise.

    The parts of the body tell more than the map alone, where they are known.
    """
    return LIMBS_MODEL if limbs else MAP_MODEL


def save_model(path: Path, trained: TrainedDenoiser) -> ModelCard:
    """Write a model to one file, in one step, and return the card as written.

    Raises Sd2Error when the name does not end in ``.safetensors``, or the card holds what JSON
    cannot.
    """
    card = trained.card
    return save_network(Path(path), trained.network, card, DENOISERS.package_of(card.model))


def save_network(path: Path, network: nn.Module, card: Card, package: str) -> Card:
    """Write a network of a plug-in's ``package`` or, if that is empty, of this program's."""
    from sd2core.denoise.model import parameter_count

    card = replace(card, path=path, parameters=parameter_count(network), package=package)
    write_weights(path, network, card.to_json())
    return card


def describe_model(path: Path) -> ModelCard:
    """Read the card of a model file; the weights stay on disk.

    Raises
    ------
    Sd2Error
        When it is missing, damaged, of a newer version, or something else.
    """
    return _read_header(Path(path))[0]


def load_model(model: Path | str) -> TrainedDenoiser:
    """Load a model, ready to be used.

    Parameters
    ----------
    model : Path or str
        A file, or the name of one of :func:`available_models`.

    Raises
    ------
    Sd2Error
        When there is none, or it is damaged or does not fit together.

    Examples
    --------
    >>> import sd2core as sd2
    >>> model = sd2.load_model("denoiser")
    >>> model.card.model, model.card.axis.bins
    ('s4', 32)
    """
    path = find_model(model)
    card, shapes = _read_header(path)
    DENOISERS.check_installed(card.model, card.package, path)

    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.denoise.registry import build

    def built() -> Denoiser:
        return build(card.model, card.axis.bins, card.maps, card.more, **card.options)

    network = read_network(path, built, card.model, shapes, _EXPECTED)
    return TrainedDenoiser(network, card)


def find_model(model: Path | str) -> Path:
    """File of a model that is given by path or by name.

    Raises Sd2Error if there is no such model.
    """
    path = as_path(model)
    check_regular(path)
    if path.is_file():
        return path
    if path.is_dir():
        inside = sorted(path.glob(f"*{SUFFIX}"))
        remedy = f"It holds {inside[0]}" if inside else ""
        raise Sd2Error(f"The model {path} is a folder", _EXPECTED, remedy)
    if path.name != str(model) or path.suffix == SUFFIX:
        raise Sd2Error(f"The model file {path} does not exist", _EXPECTED, "Check the path")
    files = _known_files()
    if str(model) in files:
        return files[str(model)]
    names = ", ".join(files)
    raise Sd2Error(
        f"There is no model called {model!r}",
        f"one of {names}, or the path of a model file" if names else "the path of a model file",
        "" if names else "Train one with `sd2 train`",
    )


def available_models() -> list[ModelCard]:
    """Cards of the bundled and the user's models; damaged files are left out."""
    return readable(_known_files().values(), describe_model)


def readable(paths: Iterable[Path], describe: Callable[[Path], Card]) -> list[Card]:
    """Cards of model files; damaged ones are left out."""
    cards = []
    for path in paths:
        try:
            cards.append(describe(path))
        except (Sd2Error, OSError):
            continue
    return cards


def user_models_folder() -> Path:
    """Folder of the user's models; it may not exist yet."""
    return user_data("models")


def _known_files() -> dict[str, Path]:
    own = sorted(user_models_folder().glob(f"*{SUFFIX}"))
    # Of one name, the user's own is meant.
    return {path.stem: path for path in [*bundled_files(f"{MAP_MODEL}*{SUFFIX}"), *own]}


def _read_header(path: Path) -> tuple[ModelCard, Shapes]:
    header, shapes = read_header(path, _EXPECTED)
    if header.get("format") == "sd2-classifier":
        raise Sd2Error(f"{path} is a classifier", "a denoiser", "Use it with `sd2 classify apply`")
    return ModelCard.from_json(header, path), shapes
