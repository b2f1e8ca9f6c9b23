from __future__ import annotations

import subprocess
import sys

import pytest

# Pages that the system had to fetch, of each of the last steps of a training.
FETCHED = """
import resource, torch
from sd2core.denoise.causal_models import S4Denoiser
from sd2core.train.machine import keep_freed_memory

keep_freed_memory()
torch.set_num_threads(1)
model, x = S4Denoiser(32, kernel="diagonal"), torch.randn(64, 72, 32)
for step in range(24):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    model(x).square().mean().backward()
    if step >= 12:
        print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is done")
def test_a_training_step_uses_the_memory_of_the_last() -> None:
    run = subprocess.run(
        [sys.executable, "-c", FETCHED], capture_output=True, text=True, check=True
    )
    fetched = sorted(map(int, run.stdout.split()))
    # Of some 20,000 pages (80 MB) that a step uses.
    assert fetched[len(fetched) // 2] <= 100
