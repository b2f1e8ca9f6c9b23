"""Model files: weights and card in one safetensors file, read without executing anything."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.atomic import atomic_write
from sd2core.denoise.card import ModelCard
from sd2core.errors import Sd2Error
from sd2core.resources import bundled_files

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser

SUFFIX = ".safetensors"

DEFAULT_NAME = "denoiser"
"""Of the model that is used when none is named."""

_KEY = "sd2"
_LONGEST_HEADER = 4 << 20
_EXPECTED = "a model file (.safetensors) written by `sd2 train`"


def save_model(path: Path, trained: TrainedDenoiser) -> ModelCard:
    """Write a model to one file, in one step.

    Parameters
    ----------
    path : Path
        Ends in ``.safetensors``.
    trained : TrainedDenoiser

    Returns
    -------
    ModelCard
        As it is in the file.

    Raises
    ------
    Sd2Error
        When the name ends otherwise, or the card holds what JSON cannot.
    """
    from safetensors.torch import save

    from sd2core.denoise.model import parameter_count

    path = Path(path)
    if path.suffix != SUFFIX:
        raise Sd2Error(f"The model file is {path}", f"a name that ends in {SUFFIX}")
    card = replace(trained.card, path=path, parameters=parameter_count(trained.network))
    try:
        header = json.dumps(card.to_json(), allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError) as error:
        raise Sd2Error(
            f"What is to be said about the model cannot be written ({error})",
            "text, finite numbers, lists and mappings",
        ) from error
    tensors = {
        name: tensor.detach().cpu().contiguous()
        for name, tensor in trained.network.state_dict().items()
    }
    with atomic_write(path) as stream:
        stream.write(save(tensors, {_KEY: header}))
    return card


def describe_model(path: Path) -> ModelCard:
    """What a model file says about its model; the weights stay on disk.

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
    """
    path = find_model(model)
    card, tensors = _read_header(path)

    import torch
    from safetensors import SafetensorError
    from safetensors.torch import load

    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.denoise.registry import build

    try:
        network = build(card.model, card.axis.bins, **card.options)
    except Sd2Error as error:
        raise Sd2Error(
            f"{path}: {error.found}", error.expected, "The file may be of another version"
        ) from error
    wanted = {name: list(tensor.shape) for name, tensor in network.state_dict().items()}
    _compare_shapes(path, card, tensors, wanted)
    try:
        weights = load(path.read_bytes())
    except (SafetensorError, ValueError, KeyError, RuntimeError) as error:
        raise Sd2Error(f"{path}: its weights cannot be read ({error})", _EXPECTED) from error
    if not all(torch.isfinite(tensor).all() for tensor in weights.values()):
        raise Sd2Error(
            f"{path}: its weights hold NaN or infinity", "finite numbers", "Train the model again"
        )
    network.load_state_dict(weights)
    return TrainedDenoiser(network, card)


def find_model(model: Path | str) -> Path:
    """File of a model that is given by path or by name.

    Raises
    ------
    Sd2Error
        When there is none.
    """
    path = Path(model)
    if path.is_file():
        return path
    if path.is_dir():
        raise Sd2Error(f"The model {path} is a folder", _EXPECTED)
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
    """Models that come with the program and the user's own; damaged files are left out."""
    cards = []
    for path in _known_files().values():
        try:
            cards.append(describe_model(path))
        except (Sd2Error, OSError):
            continue
    return cards


def user_models_folder() -> Path:
    """Where a user's models are found by name; it need not be there yet."""
    import platformdirs

    return Path(platformdirs.user_data_dir("sd2-studio", appauthor=False)) / "models"


def _known_files() -> dict[str, Path]:
    own = sorted(user_models_folder().glob(f"*{SUFFIX}"))
    # Of one name, the user's own is meant.
    return {path.stem: path for path in [*bundled_files(f"*{SUFFIX}"), *own]}


def _read_header(path: Path) -> tuple[ModelCard, dict[str, list[int]]]:
    """Card, and the shape of every tensor."""
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            start = stream.read(8)
            length = struct.unpack("<Q", start)[0] if len(start) == 8 else 0
            if not 2 <= length <= _LONGEST_HEADER:
                raise Sd2Error(f"{path} is no model file", _EXPECTED)
            header = stream.read(length)
    except FileNotFoundError as error:
        raise Sd2Error(f"{path} does not exist", _EXPECTED, "Check the path") from error
    except IsADirectoryError as error:
        raise Sd2Error(f"{path} is a folder", _EXPECTED) from error
    if not header.startswith(b"{"):
        raise Sd2Error(f"{path} is no model file", _EXPECTED)
    if len(header) < length:
        raise _cut_short(path, size, 8 + length)
    try:
        content = json.loads(header)
        told = content.pop("__metadata__", {})
        if not isinstance(told, Mapping) or _KEY not in told:
            raise Sd2Error(
                f"{path} is a safetensors file of another program: it does not say how its"
                " weights are to be used",
                _EXPECTED,
            )
        shapes = {name: list(map(int, entry["shape"])) for name, entry in content.items()}
        end = max((int(entry["data_offsets"][1]) for entry in content.values()), default=0)
        told = json.loads(told[_KEY])
        if not isinstance(told, dict):
            raise ValueError("not an object")
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        raise Sd2Error(f"{path}: its header is damaged ({error!r})", _EXPECTED) from error
    if size < 8 + length + end:
        raise _cut_short(path, size, 8 + length + end)
    return ModelCard.from_json(told, path), shapes


def _cut_short(path: Path, size: int, expected: int) -> Sd2Error:
    return Sd2Error(
        f"{path} is cut short: {size:,} bytes", f"{expected:,} bytes", "Copy or train it again"
    )


def _compare_shapes(
    path: Path, card: ModelCard, found: Mapping[str, Any], wanted: Mapping[str, Any]
) -> None:
    missing = [name for name in wanted if name not in found]
    unknown = [name for name in found if name not in wanted]
    if missing or unknown:
        which = f"lacks {missing[0]}" if missing else f"has {unknown[0]} in addition"
        raise Sd2Error(
            f"{path}: the weights are not those of the model {card.model} that it names; it {which}"
            f" ({len(missing)} missing, {len(unknown)} too many)",
            _EXPECTED,
        )
    for name, shape in wanted.items():
        if found[name] != shape:
            raise Sd2Error(
                f"{path}: {name} is of shape {tuple(found[name])}",
                f"{tuple(shape)}, as its options say",
            )
