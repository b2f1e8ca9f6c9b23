"""Training of the lifter, in torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.body.lifter import (
    FORMAT,
    KINDS,
    LOG_SIGMA,
    OUTPUTS,
    POINTS,
    SPREADS,
    STANDING,
    VERSION,
    Lifter,
    by_landmark,
    spread,
    symmetric,
)
from sd2core.body.lifter_features import RATE_HZ
from sd2core.body.network import Network
from sd2core.body.track import LANDMARKS
from sd2core.mocap.body_motion import BodyMotion
from sd2core.progress import Progress, silent
from tools.train_lifter.emulate import (
    Batch,
    Emulator,
    Example,
    Walk,
    batch,
    captured_walks,
    emulated,
    example,
    random_walks,
    varied,
)
from tools.train_lifter.fits import repaired
from tools.train_lifter.network import (
    TemporalNetwork,
    random_network,
    save_network,
    trained,
)
from tools.train_lifter.takes import Take

Singles = NDArray[np.float32]

_WEIGHTS = dict.fromkeys(("shoulder", "hip", "elbow", "knee", "wrist", "ankle"), 2.0) | (
    dict.fromkeys(("pinky", "index", "thumb", "heel", "foot_index"), 1.5)
)
_FACE_WEIGHT = 0.5
_BODY = [row for row, name in enumerate(LANDMARKS) if name.split(".")[0] in _WEIGHTS]
_SPREADS_WEIGHT = 0.05
_STANDING_WEIGHT = 0.05


@dataclass(frozen=True)
class Recipe:
    """Settings of the training."""

    width: int = 192
    dilations: tuple[int, ...] = (1, 2, 4, 8, 16, 4, 1)
    dropout: float = 0.1
    steps: int = 9000  # of optimisation
    # Of every batch: simulated and real motion without pictures; the rest is drawn takes.
    emulated_share: float = 0.15
    captured_share: float = 0.35
    batch: int = 24
    frames: int = 80  # of each example
    rate: float = 1.0e-3  # of learning, at its highest
    # Weights of the losses; ``change`` is that of the depths' differences over 1, 2 and 4 frames.
    velocity: float = 1.0
    spread: float = 1.5
    depth: float = 4.0
    across: float = 4.0
    root: float = 2.0
    change: float = 0.3
    walks: int = 1500  # motions to emulate, of either kind
    seed: int = 0


@dataclass(frozen=True, eq=False)
class TrainingArrays:
    """What a lifter is trained and calibrated on."""

    takes: Sequence[Take]  # repaired
    kept: Sequence[Take]
    """Of other people, or other motion, as they are; they calibrate the spreads."""
    emulator: Emulator | None = None
    walks: Sequence[Walk] = ()
    captured: Sequence[Walk] = ()


def make_arrays(
    takes: Sequence[Take],
    kept: Sequence[Take],
    motions: Sequence[BodyMotion],
    recipe: Recipe,
) -> TrainingArrays:
    """Drawn takes, and emulated motion whose errors follow them."""
    emulator = Emulator(takes)
    return TrainingArrays(
        takes,
        kept,
        emulator,
        random_walks(emulator, recipe.walks, recipe.seed),
        captured_walks(emulator, motions, recipe.walks, recipe.seed) if motions else (),
    )


def train(
    known: TrainingArrays,
    recipe: Recipe,
    progress: Progress = silent,
    start: Lifter | None = None,
) -> Lifter:
    """Train a lifter; deterministic for the same material, recipe, machine and threads.

    Parameters
    ----------
    start : Lifter, optional
        What to go on from, whose width counts; otherwise random weights.
    """
    torch.manual_seed(recipe.seed)
    rng = np.random.default_rng(recipe.seed)
    learnt = [example(take) for take in known.takes]
    if start is not None:
        begun = start.network
    else:
        features = np.concatenate([batch([one]).features[0] for one in learnt[:200]])
        begun = random_network(features, recipe.width, recipe.dilations, OUTPUTS)
    network = TemporalNetwork(begun, recipe.dropout)

    def lost() -> torch.Tensor:
        drawn = _drawn(rng, learnt, known, recipe)
        return loss(network(torch.from_numpy(drawn.features)), drawn, recipe)

    exported = trained(network, recipe.steps, recipe.rate, lost, progress)
    return Lifter(
        exported,
        calibration(exported, [example(repaired(take)) for take in known.kept]),
        np.zeros(2 + POINTS, np.float32),
        {
            "recipe": asdict(recipe),
            "takes": len(known.takes),
            "kept": len(known.kept),
            "walks": len(known.walks),
            "captured": len(known.captured),
            "start": None if start is None else dict(start.provenance),
        },
    )


def _drawn(
    rng: np.random.Generator, learnt: Sequence[Example], known: TrainingArrays, recipe: Recipe
) -> Batch:
    chosen = []
    frames = int(rng.integers(recipe.frames // 2, recipe.frames + 1))
    for _ in range(recipe.batch):
        kind = rng.random() - recipe.captured_share
        walks = known.captured if kind < 0.0 else known.walks
        if walks and known.emulator is not None and kind < recipe.emulated_share:
            one = emulated(rng, known.emulator, walks[int(rng.integers(len(walks)))])
        else:
            one = learnt[int(rng.integers(len(learnt)))]
        chosen.append(varied(rng, one, frames))
    return batch(chosen)


def loss(out: torch.Tensor, truth: Batch, recipe: Recipe) -> torch.Tensor:
    """The loss; spreads learn from errors, but errors not from spreads."""
    weights = torch.from_numpy(landmark_weights())
    rest = out[..., 2 : STANDING.start].unflatten(-1, (KINDS, POINTS))
    root, depth, velocity, across, size, standing = (torch.from_numpy(part) for part in truth[1:])
    root_error = out[..., 0] - root
    depth_error = rest[..., 0, :] - depth
    centre = torch.exp(out[..., :1].detach()) / size[:, None, None] * _rate(out[..., :1])
    velocity_error = rest[..., 2, :] + _rate(rest[..., 0, :]) + centre - velocity
    across_error = rest[..., 4:6, :].transpose(-1, -2) - across
    estimated, true = (_deviation(one) for one in (velocity + velocity_error, velocity))
    change = sum(
        (_huber((depth_error[:, k:] - depth_error[:, :-k]) * 30.0 / k, 1.0) * weights).mean()
        for k in (1, 2, 4)
    )
    parts = (
        recipe.velocity * (_huber(velocity_error, 0.6) * weights).mean(),
        recipe.spread * _huber(estimated - true, 0.3).mean(),
        recipe.depth * (_huber(depth_error, 0.15) * weights).mean(),
        recipe.across * (_huber(across_error, 0.1) * weights[:, None]).mean(),
        recipe.root * _huber(root_error, 0.2).mean(),
        recipe.change * change,
        _STANDING_WEIGHT
        * torch.nn.functional.binary_cross_entropy_with_logits(out[..., STANDING], standing),
        _SPREADS_WEIGHT
        * (
            _likelihood(root_error, out[..., 1]).mean()
            + _likelihood(depth_error, rest[..., 1, :]).mean()
            + _likelihood(velocity_error, rest[..., 3, :]).mean()
            + _likelihood(across_error, rest[..., 6, :, None]).mean()
        ),
    )
    return torch.stack([torch.as_tensor(part) for part in parts]).sum()


def landmark_weights() -> Singles:
    """Weights of the landmarks, mean 1."""
    weights = [_WEIGHTS.get(name.split(".")[0], _FACE_WEIGHT) for name in LANDMARKS]
    return np.array(weights, np.float32) / np.float32(np.mean(weights))


def _rate(values: torch.Tensor) -> torch.Tensor:
    """Rate of change of (N, T, n), as :func:`sd2core.body.lifter_features.rate`."""
    inner = (values[:, 2:] - values[:, :-2]) / 2.0
    ends = values[:, 1:2] - values[:, :1], values[:, -1:] - values[:, -2:-1]
    return RATE_HZ * torch.cat([ends[0], inner, ends[1]], dim=1)


def _deviation(velocities: torch.Tensor) -> torch.Tensor:
    """Standard deviation of the landmarks' velocities within each frame, (N, T).

    A mean of what is possible moves too little, and so would the Doppler map of it.
    """
    return torch.sqrt(velocities[..., _BODY].var(dim=-1) + 1e-4)


def _huber(error: torch.Tensor, knee: float) -> torch.Tensor:
    return torch.nn.functional.huber_loss(
        error, torch.zeros_like(error), reduction="none", delta=knee
    )


def _likelihood(error: torch.Tensor, log_sigma: torch.Tensor) -> torch.Tensor:
    """Negative logarithm of a normal density, of errors taken as given.

    Beyond its limits a spread keeps its gradient: where it had none, it never came back.
    """
    limited = log_sigma + (log_sigma.clamp(*LOG_SIGMA) - log_sigma).detach()
    return limited + 0.5 * (error.detach() * torch.exp(-limited)) ** 2


def calibration(network: Network, kept: Sequence[Example]) -> Singles:
    """Offsets of the logarithms of spreads with which 68 % of errors lie within."""
    ratios = []
    for one in kept:
        truth, out = batch([one]), symmetric(network, one.seen)
        rest = by_landmark(out)
        error = [
            (rest[:, 0] - truth.depth[0])[None],
            (rest[:, 2] - truth.velocity[0])[None],
            rest[:, 4:6].swapaxes(0, 1) - truth.across[0].transpose(2, 0, 1),
        ]
        root = np.abs(out[:, 0] - truth.root[0]) / spread(out[:, 1])
        ratios.append(
            [root, *(np.abs(e) / spread(rest[:, k]) for e, k in zip(error, SPREADS, strict=True))]
        )
    added = np.zeros(OUTPUTS, np.float32)
    roots, *others = zip(*ratios, strict=True)
    added[1] = _covering(np.concatenate(roots))
    for kind, own in zip(SPREADS, others, strict=True):
        first = 2 + kind * POINTS
        added[first : first + POINTS] = _covering(np.concatenate(own, axis=1).reshape(-1, POINTS))
    return added


def _covering(ratios: NDArray[np.floating]) -> NDArray[np.floating]:
    """Logarithm of what 68 % of the rows of ratios (n, ...) are below."""
    return np.asarray(np.log(np.maximum(np.quantile(ratios, 0.68, axis=0), 1e-3)))


def save_lifter(lifter: Lifter, path: Path) -> None:
    """Write a lifter, its weights in half precision."""
    meta = {"format": FORMAT, "version": VERSION, "provenance": dict(lifter.provenance)}
    more = {"calibration": lifter.calibration, "fit_law": lifter.fit_law}
    save_network(lifter.network, path, meta, more)
