"""Denoising after a sensor move, and frame by frame."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import torch
from pytest_benchmark.fixture import BenchmarkFixture
from timing import spent_s

from sd2core.denoise.card import ModelCard
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import parameter_count
from sd2core.denoise.registry import MODELS as TRAINED
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

FRAMES = 450
MODELS = ("s4", "s4d", "gru", "unet", "swin")


pytestmark = pytest.mark.usefixtures("one_thread")


def denoiser(name: str) -> TrainedDenoiser:
    scaling = Scaling(Compression(0.01), Compression(0.01))
    card = ModelCard(name, {}, VelocityAxis(), (14, 15, 16), 30.0, scaling, "simulated")
    return TrainedDenoiser(build(name), card)


def synthetic_map() -> DopplerMap:
    values = np.random.default_rng(0).exponential(0.01, (32, FRAMES)).astype(np.float32)
    return DopplerMap(values, VelocityAxis(), Timebase.regular(FRAMES, 30.0), "synthetic")


def test_a_clip_at_once(benchmark: BenchmarkFixture, capsys: pytest.CaptureFixture[str]) -> None:
    doppler, rows = synthetic_map(), []
    frames = np.tile(doppler.values.T, (2, 1))
    for name in MODELS:
        model = denoiser(name)
        model.denoise(doppler)  # kernels are worked out once per model
        map_s = spent_s(partial(model.denoise, doppler), 7)
        stream, coming = model.live(), iter(frames)
        stream.step(next(coming))
        frame_s = spent_s(lambda stream=stream, coming=coming: stream.step(next(coming)), 100)
        rows.append((name, map_s, frame_s))
    benchmark.pedantic(denoiser("s4").denoise, (doppler,), rounds=5, warmup_rounds=1)
    with capsys.disabled():
        for name, map_s, frame_s in rows:
            print(
                f"\n{name}, 1 thread: {FRAMES} frames {1e3 * map_s:.1f} ms,"
                f" a frame live {1e3 * frame_s:.2f} ms",
                end="",
            )
    map_s, frame_s = rows[0][1:]
    # What a sensor drag needs: the whole clip at the cost of a few frames that come live.
    assert FRAMES * frame_s > 10 * map_s


def test_a_long_map(benchmark: BenchmarkFixture, capsys: pytest.CaptureFixture[str]) -> None:
    model = denoiser("s4")
    values = np.random.default_rng(0).exponential(0.01, (40_000, 32)).astype(np.float32)
    model.denoise_values(values[:10_000])
    short_s = spent_s(lambda: model.denoise_values(values[:10_000]), 2)
    long_s = spent_s(lambda: model.denoise_values(values), 1)
    benchmark.pedantic(model.denoise_values, (values[:10_000],), rounds=1)
    ratio = (long_s / len(values)) / (short_s / 10_000)
    with capsys.disabled():
        print(
            f"\n40,000 frames in pieces, 1 thread: {long_s:.2f} s,"
            f" {ratio:.2f} x as long per frame as 10,000"
        )
    assert ratio < 1.5


def test_models_of_equal_time(
    benchmark: BenchmarkFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    batch = torch.rand(64, 72, 32)
    fewer = {"s4-serial": {"channels": 4}, "unet": {"channels": 5}, "swin": {"channels": 16}}
    models = {name: build(name, **fewer.get(name, {})) for name in TRAINED}

    def step(name: str) -> None:
        models[name](batch).square().mean().backward()

    spent = {name: spent_s(partial(step, name), 5) for name in TRAINED}
    benchmark.pedantic(step, ("s4",), rounds=3)
    with capsys.disabled():
        for name, seconds in spent.items():
            print(
                f"\n{name}: {parameter_count(models[name]):,} parameters, a step of training"
                f" {1e3 * seconds:.0f} ms, {seconds / spent['s4']:.2f} x the S4's",
                end="",
            )
    assert max(spent.values()) < 2 * min(spent.values())
