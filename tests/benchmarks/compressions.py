"""Which compression serves learning, and whether the input should be added to the answer.

Trains a small recurrent network for a short while in every way, on all subjects of a set
of pairs but the last, and measures on the last. It prints the table of
``docs/decisions/0024``::

    sd2 pairs mars mars_subject1 mars_subject4 --out mars.zarr
    python tests/benchmarks/compressions.py mars.zarr --seeds 3
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from sd2core.denoise.causal_models import GruDenoiser
from sd2core.denoise.metrics import map_error, mean_velocity_error, peak_error, stands_out
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.pairs.segments import cut, segment_starts
from sd2core.pairs.store import PairSet, read_pairs

HALF, THIRD, QUARTER = 1 / 2, 1 / 3, 1 / 4
WAYS = (
    (HALF, HALF, "alone"),
    (THIRD, THIRD, "alone"),
    (QUARTER, QUARTER, "alone"),
    (QUARTER, HALF, "alone"),
    (1.0, HALF, "alone"),
    (1.0, 1.0, "alone"),
    (HALF, HALF, "learnt gain from 0"),
    (HALF, HALF, "input at first"),
)
BATCH = 16
RATE = 2e-3


class Added(nn.Module):
    """A network's answer and the input, times one learnt gain per bin."""

    def __init__(self, network: GruDenoiser, input_at_first: bool) -> None:
        super().__init__()
        self.network = network
        self.gain = nn.Parameter(torch.full((network.bins,), float(input_at_first)))
        if input_at_first:
            nn.init.zeros_(network.head.weight)
            nn.init.zeros_(network.head.bias)

    def forward(self, values: Tensor) -> Tensor:
        return self.network(values) + self.gain * values


class Row(NamedTuple):
    """Errors of the peak velocity where it stands out, of the mean velocity, of the map."""

    peak_mae_mps: float
    peak_sd_mps: float
    mean_mae_mps: float
    mean_correlation: float
    relative_l1: float


def learn(
    pairs: PairSet, scaling: Scaling, way: str, seed: int, epochs: int
) -> GruDenoiser | Added:
    """Train on all takes."""
    inputs, targets = [], []
    for take in pairs.takes:
        starts = segment_starts(len(take.synthetic), overlap=36)
        inputs.append(cut(scaling.input.compress(take.synthetic), starts))
        targets.append(cut(scaling.target.compress(take.radar), starts))
    x, y = (torch.from_numpy(np.concatenate(parts)) for parts in (inputs, targets))
    torch.manual_seed(seed)
    network: GruDenoiser | Added = GruDenoiser(pairs.axis.bins, channels=64)
    if way != "alone":
        network = Added(network, way == "input at first")
    steps = epochs * max(1, len(x) // BATCH)
    optimiser = torch.optim.AdamW(network.parameters(), RATE)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, RATE, total_steps=steps, pct_start=0.1
    )
    for _ in range(steps):
        chosen = torch.randint(len(x), (BATCH,))
        loss = (network(x[chosen]) - y[chosen]).square().mean().sqrt()
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        schedule.step()
    return network.eval()


def measure(pairs: PairSet, scaling: Scaling, network: nn.Module | None) -> Row:
    """Errors on all takes; None is no denoising."""
    estimates, targets, moving = [], [], []
    for take in pairs.takes:
        values = scaling.input.compress(take.synthetic)
        if network is not None:
            with torch.no_grad():
                values = network(torch.from_numpy(values)[None])[0].numpy()
        energies = scaling.target.expand(values)
        energies[:, list(pairs.null_bins)] = 0.0
        estimates.append(energies)
        targets.append(take.radar)
        moving.append(stands_out(take.radar, pairs.null_bins))
    estimate, target = np.concatenate(estimates), np.concatenate(targets)
    frames = np.concatenate(moving)
    peak = peak_error(estimate, target, pairs.axis, frames)
    mean = mean_velocity_error(estimate, target, pairs.axis, frames)
    cells = map_error(estimate, target, Compression(1.0), pairs.null_bins)
    return Row(peak.mae_mps, peak.sd_mps, mean.mae_mps, mean.correlation, cells.relative_l1)


def rows(path: Path, seeds: int, epochs: int) -> Iterator[str]:
    """Lines of the table, as they are measured."""
    pairs = read_pairs(path)
    learnt, judged = pairs.of(pairs.subjects[:-1]), pairs.of(pairs.subjects[-1:])
    yield "| input | target | answer | peak MAE, σ (m/s) | mean MAE (m/s) | correlation | map L1 |"
    yield "|---|---|---|---|---|---|---|"
    for input_exponent, target_exponent, way in WAYS:
        scaling = Scaling.fitted(
            [take.synthetic for take in learnt.takes],
            [take.radar for take in learnt.takes],
            pairs.null_bins,
            input_exponent=input_exponent,
            target_exponent=target_exponent,
        )
        if (input_exponent, target_exponent, way) == WAYS[0]:
            yield line("", "", "no denoising", [measure(judged, scaling, None)])
        found = [
            measure(judged, scaling, learn(learnt, scaling, way, seed, epochs))
            for seed in range(seeds)
        ]
        yield line(f"{input_exponent:.2g}", f"{target_exponent:.2g}", way, found)


def line(input_exponent: str, target_exponent: str, way: str, found: list[Row]) -> str:
    """Means over seeds, and how far the first error varies with them."""
    mean = Row(*np.mean(found, axis=0))
    spread = f" ± {np.std([row.peak_mae_mps for row in found]):.3f}" if len(found) > 1 else ""
    return (
        f"| {input_exponent} | {target_exponent} | {way}"
        f" | {mean.peak_mae_mps:.3f}{spread}, {mean.peak_sd_mps:.3f}"
        f" | {mean.mean_mae_mps:.3f} | {mean.mean_correlation:.2f} | {mean.relative_l1:.2f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("pairs", type=Path, metavar="PAIRS")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--epochs", type=int, default=40)
    options = parser.parse_args()
    torch.set_num_threads(1)
    for text in rows(options.pairs, options.seeds, options.epochs):
        print(text, flush=True)


if __name__ == "__main__":
    main()
