"""What the loop of a training costs beside its steps."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from pytest_benchmark.fixture import BenchmarkFixture
from small_pairs import write_pairs

from sd2core.denoise.registry import build
from sd2core.options.training import (
    DataConfig,
    MachineConfig,
    ModelConfig,
    TrainConfig,
    TrainingConfig,
)
from sd2core.sensor import VelocityAxis
from sd2core.train.denoiser_loop import DenoiserLoop
from sd2core.train.start import begin
from sd2core.train.steps import optimiser_of

BATCH, LENGTH, BINS = 64, 72, 8
TINY: dict[str, Any] = {"channels": 4, "depth": 1}


def bare_steps_s(config: TrainConfig, steps: int) -> np.ndarray:
    """Processor seconds of forward, backward, clipping and AdamW on tensors that are there."""
    network = build(config.model.name, BINS, **config.model.options)
    optimiser = optimiser_of(network, config.training)
    inputs, targets = torch.rand(2, BATCH, LENGTH, BINS)
    spent = []
    for _ in range(steps):
        begun_s = time.thread_time()
        optimiser.zero_grad()
        ((network(inputs) - targets).square().mean() + 1e-12).sqrt().backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        spent.append(time.thread_time() - begun_s)
    return np.array(spent)


def test_the_loop_costs_little(
    benchmark: BenchmarkFixture,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Between two steps: gathering a batch, chance, rate, control file, epochs."""
    pairs = write_pairs(tmp_path / "p.zarr", takes=40, frames=450, axis=VelocityAxis(BINS, 2.0))
    config = TrainConfig(
        DataConfig(pairs=(pairs,)),
        ModelConfig(name="gru", options=TINY),
        TrainingConfig(epochs=30, checkpoint_s=1e4),
        MachineConfig(device="cpu", threads=1),
    )
    starts_s: list[float] = []
    before = DenoiserLoop.step

    def noted(self: DenoiserLoop) -> None:
        starts_s.append(time.thread_time())
        before(self)

    monkeypatch.setattr(DenoiserLoop, "step", noted)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        benchmark.pedantic(begin, (config, tmp_path / "run"), rounds=1)
        loop_s = np.diff(starts_s)
        bare_s = bare_steps_s(config, len(loop_s))
    finally:
        torch.set_num_threads(threads)
    overhead_ms = 1e3 * (np.median(loop_s) - np.median(bare_s))
    with capsys.disabled():
        print(
            f"\n{len(loop_s)} steps of 64 × 72 × 8: {1e3 * np.median(loop_s):.1f} ms of the"
            f" processor each, bare {1e3 * np.median(bare_s):.1f} ms: {overhead_ms:.1f} ms beside"
        )
    assert overhead_ms < 5.0
