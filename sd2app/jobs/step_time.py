"""Time a few steps of training on random values, as a run beside the window would take them.

Run as ``python -u -m sd2app.jobs.step_time MODEL BATCH_SIZE``; prints one JSON line.
"""

from __future__ import annotations

import json
import sys
import time

from sd2app.jobs.background import give_way

_BINS = 32
_WARM_UP, _TIMED = 1, 4
_VALIDATION = 1.1
"""A sixth of the segments is validated on besides, forward only."""


def main() -> int:
    """Give way, then time."""
    give_way()
    import torch

    from sd2core.denoise.registry import build
    from sd2core.segments import LENGTH
    from sd2core.train.config import MachineConfig, TrainingConfig
    from sd2core.train.machine import device_of
    from sd2core.train.optimiser import optimiser_of

    model, batch_size = sys.argv[1], int(sys.argv[2])
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
    median_s = sorted(took_s[_WARM_UP:])[_TIMED // 2]
    print(json.dumps({"step_s": _VALIDATION * median_s}), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
