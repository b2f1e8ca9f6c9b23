"""Checkpoint of a run: one file that is replaced in one step, without pickle."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write, atomic_write_text
from sd2core.files.limits import check_regular

FORMAT = "sd2-checkpoint"
VERSION = 1

_KEY = "sd2"


@dataclass
class Position:
    """Position of a run: all that its continuation depends on besides the weights."""

    epoch: int = 0  # under way, from 0
    step: int = 0  # steps of this epoch that are done
    steps_done: int = 0  # in all
    elapsed_s: float = 0.0  # time of training, without pauses and without what a kill has lost
    squares: float = 0.0  # sum over the segments of this epoch of their mean square error
    segments: int = 0  # number of them
    best: dict[str, Any] | None = None
    """``epoch``, ``validation_rmse``, ``validation_mae_mps`` and ``score`` of the best epoch."""
    epochs_since_best: int = 0


@dataclass(frozen=True)
class Checkpoint:
    """Weights, optimiser moments and position of a run."""

    weights: dict[str, torch.Tensor]  # state of the model
    moments: dict[int, dict[str, torch.Tensor]]
    """State of the optimiser, by number of parameter and name."""
    position: Position
    about: dict[str, Any] = field(default_factory=dict)
    """``data_digest`` and what else must be the same to resume."""


def write_checkpoint(path: Path, record: Path, checkpoint: Checkpoint) -> None:
    """Write tensors and position into one file; ``record`` is a copy of the latter to read.

    One file, because two cannot be replaced in one step.
    """
    tensors = {f"model.{name}": tensor for name, tensor in checkpoint.weights.items()}
    for number, state in checkpoint.moments.items():
        for name, tensor in state.items():
            tensors[f"optimiser.{number}.{name}"] = tensor
    plain = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    content = {
        "format": FORMAT,
        "version": VERSION,
        "position": asdict(checkpoint.position),
        **checkpoint.about,
    }
    # Weights that are tied would be refused: safetensors wants memory of its own for each.
    data = save(
        {name: tensor.clone() for name, tensor in plain.items()}, {_KEY: json.dumps(content)}
    )
    with atomic_write(path) as stream:
        stream.write(data)
    atomic_write_text(record, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the file of :func:`write_checkpoint` onto the CPU.

    Raises Sd2Error if it is missing or damaged.
    """
    if not path.exists():
        raise Sd2Error(
            f"{path} does not exist",
            "a run that came as far as its first checkpoint",
            "Start it again in another folder",
        )
    check_regular(path)
    weights: dict[str, torch.Tensor] = {}
    moments: dict[int, dict[str, torch.Tensor]] = {}
    try:
        with safe_open(path, framework="pt") as stream:
            content = json.loads((stream.metadata() or {})[_KEY])
            for name in stream.keys():  # noqa: SIM118 (no mapping)
                kind, _, rest = name.partition(".")
                if kind == "model":
                    weights[rest] = stream.get_tensor(name)
                else:
                    number, _, part = rest.partition(".")
                    moments.setdefault(int(number), {})[part] = stream.get_tensor(name)
        if content.pop("format") != FORMAT or content.pop("version") != VERSION:
            raise ValueError(f"not {FORMAT} version {VERSION}")
        position = Position(**content.pop("position"))
    except (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise Sd2Error(
            f"{path} cannot be read ({error})", "a checkpoint that `sd2 train` wrote"
        ) from error
    return Checkpoint(weights, moments, position, content)


def moments_of(optimiser: torch.optim.Optimizer) -> dict[int, dict[str, torch.Tensor]]:
    """State of an optimiser: tensors by number of parameter."""
    state = optimiser.state_dict()["state"]
    return {number: dict(tensors) for number, tensors in state.items()}


def set_moments(
    optimiser: torch.optim.Optimizer, moments: dict[int, dict[str, torch.Tensor]]
) -> None:
    """Restore the state of an optimiser."""
    groups = optimiser.state_dict()["param_groups"]
    optimiser.load_state_dict({"state": moments, "param_groups": groups})
