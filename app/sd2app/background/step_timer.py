"""Time a few training steps on random values, under the conditions of a background run.

Run as ``python -u -m sd2app.background.step_timer MODEL BATCH_SIZE`` for a denoiser, and as
``… classifier MODEL FEATURES WIDTH`` for a classifier; prints one JSON line.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from typing import Any

from sd2core.processes import lower_priority

CLASSIFIER = "classifier"
_BINS = 32
_WARM_UP, _TIMED = 1, 4
_VALIDATION = 1.1
"""Factor for the validation, which runs the network forward only."""


def main() -> int:
    """Lower the priority, then time."""
    lower_priority()
    first, *rest = sys.argv[1:]
    took_s = (
        _of_classifier(rest[0], rest[1], int(rest[2]))
        if first == CLASSIFIER
        else _of_denoiser(first, int(rest[0]))
    )
    median_s = sorted(took_s)[_TIMED // 2]
    print(json.dumps({"step_s": _VALIDATION * median_s}), flush=True)
    return 0


def _of_denoiser(model: str, batch_size: int) -> Sequence[float]:
    """Times of the steps after the warm-up."""
    import torch

    from sd2core.denoise.registry import build
    from sd2core.pairs.segments import LENGTH
    from sd2core.train.config import MachineConfig, TrainingConfig
    from sd2core.train.machine import device_of
    from sd2core.train.optimiser import optimiser_of

    torch.set_num_threads(1)
    device = device_of(MachineConfig())
    network = build(model, _BINS).to(device).train()
    optimiser = optimiser_of(network, TrainingConfig())
    values = torch.rand(batch_size, LENGTH, _BINS, device=device)
    took_s = []
    for _ in range(_WARM_UP + _TIMED):
        began_s = time.perf_counter()
        loss = (network(values) - values).square().mean().sqrt()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        loss.item()  # waits for a GPU
        took_s.append(time.perf_counter() - began_s)
    return took_s[_WARM_UP:]


def _of_classifier(model: str, features: str, width: int) -> Sequence[float]:
    """Step times of the training itself, on a batch of clips as long as its windows."""
    import numpy as np

    from sd2core.classify.data import Clip, ClipSet
    from sd2core.classify.training import TrainOptions, train
    from sd2core.sensor import VelocityAxis

    options = TrainOptions(
        model=model,
        features=features,  # type: ignore[arg-type]
        options={"width": width},
        steps=_WARM_UP + _TIMED + 1,
    )
    classes = ("background", "horizontal", "vertical")
    rng = np.random.default_rng(0)
    shape = (options.window_frames, _BINS)
    clips = tuple(
        Clip(
            "somebody",
            f"{number}",
            "synthetic",
            rng.random(shape, np.float32),
            rng.integers(len(classes), size=shape[0]).astype(np.int8),
        )
        for number in range(options.batch)
    )
    ends_s: list[float] = []

    def watch(event: dict[str, Any]) -> None:
        if event["event"] == "step":
            ends_s.append(float(event["elapsed_s"]))

    train(clips, (), ClipSet(VelocityAxis(_BINS), (), 30.0, classes, clips), options, watch=watch)
    return np.diff(ends_s)[_WARM_UP:].tolist()


if __name__ == "__main__":
    sys.exit(main())
