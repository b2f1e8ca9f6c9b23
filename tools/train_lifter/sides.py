"""Training of the network that tells which parts of the body are mirrored, in torch."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch

from sd2core.body.lifter_features import features
from sd2core.body.network import Network
from sd2core.body.sides import FORMAT, SIDED_PARTS, VERSION, free_of_place
from sd2core.progress import Progress, silent
from tools.train_lifter.emulate import emulated
from tools.train_lifter.network import TemporalNetwork, random_network, trained
from tools.train_lifter.swaps import Known, known_of, spoilt, varied
from tools.train_lifter.training import TrainingArrays


@dataclass(frozen=True)
class SidesRecipe:
    """Settings of the training."""

    width: int = 96
    dilations: tuple[int, ...] = (1, 2, 4, 8, 4, 2, 1)
    dropout: float = 0.1
    steps: int = 4000
    emulated_share: float = 0.5
    batch: int = 24
    frames: tuple[int, int] = (32, 80)
    rate: float = 1.5e-3
    seed: int = 0


def train_sides(
    known: TrainingArrays,
    recipe: SidesRecipe,
    progress: Progress = silent,
) -> tuple[Network, dict[str, Any]]:
    """Train the network on takes into which mirrored stretches are put; also its provenance."""
    torch.manual_seed(recipe.seed)
    rng = np.random.default_rng(recipe.seed)
    learnt = [known_of(take) for take in known.takes]
    inputs = np.concatenate([features(free_of_place(one.seen)) for one in learnt[:200]])
    begun = random_network(inputs, recipe.width, recipe.dilations, len(SIDED_PARTS))
    network = TemporalNetwork(begun, recipe.dropout)
    walks = (*known.captured, *known.walks)

    def lost() -> torch.Tensor:
        frames = int(rng.integers(recipe.frames[0], recipe.frames[1] + 1))
        drawn = []
        for _ in range(recipe.batch):
            if walks and known.emulator is not None and rng.random() < recipe.emulated_share:
                seen = emulated(rng, known.emulator, walks[int(rng.integers(len(walks)))]).seen
                clean = np.zeros((len(seen.sure), len(SIDED_PARTS)), np.float32)
                one = Known(seen, clean, np.ones_like(clean))
            else:
                one = learnt[int(rng.integers(len(learnt)))]
            drawn.append(spoilt(rng, varied(rng, one, frames)))
        seen_as = np.stack([features(free_of_place(one.seen)) for one in drawn])
        return torch.nn.functional.binary_cross_entropy_with_logits(
            network(torch.from_numpy(seen_as)),
            torch.from_numpy(np.stack([one.mirrored for one in drawn])),
            torch.from_numpy(np.stack([one.weight for one in drawn])),
        )

    exported = trained(network, recipe.steps, recipe.rate, lost, progress)
    return exported, {
        "format": FORMAT,
        "version": VERSION,
        "provenance": {
            "recipe": asdict(recipe),
            "takes": len(known.takes),
            "walks": len(known.walks),
            "captured": len(known.captured),
        },
    }
