"""Kernels of state spaces against the published algorithms, and what a stack of layers takes.

One torch thread where one is compared with the other; H = 128 channels, N = 64. What a run
measures is printed; ratios and limits are asserted.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import pytest
import torch
from published_kernels import PublishedDiagonal, PublishedLegs
from timing import best_s
from torch import Tensor

from sd2core.denoise.causal_models import S4Denoiser
from sd2core.denoise.s4_functions import by_product, by_transform
from sd2core.denoise.s4_space import StateSpace

CHANNELS, STATE_SIZE = 128, 64
PUBLISHED = {"legs": PublishedLegs, "diagonal": PublishedDiagonal}


@contextmanager
def threads(count: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def in_turn_ms(works: list[Any], rounds: int) -> list[float]:
    """Best of each, in processor time, one after the other every round.

    With one thread that is the time it takes, and who else is at work counts less.
    """
    spent = []
    for _ in range(rounds):
        marks = [time.process_time()]
        for work in works:
            work()
            marks.append(time.process_time())
        spent.append([after - before for before, after in pairwise(marks)])
    return [1e3 * min(times) for times in zip(*spent, strict=True)]


@pytest.mark.benchmark(group="state spaces, kernels")
@pytest.mark.parametrize(
    ("kernel", "length", "least"),
    [("legs", 72, 4), ("diagonal", 72, 3), ("legs", 2304, 8), ("diagonal", 2304, 15)],
)
def test_kernel_forward_and_backward(
    benchmark: Any, kernel: str, length: int, least: float, capsys: pytest.CaptureFixture[str]
) -> None:
    space = StateSpace(CHANNELS, STATE_SIZE, kernel)  # type: ignore[arg-type]
    published = PUBLISHED[kernel](CHANNELS, STATE_SIZE, length)
    gradient = torch.randn(CHANNELS, length)

    def both_ways(made: Any, learned: list[Tensor]) -> Any:
        return lambda: torch.autograd.grad(made(), learned, gradient)

    works = [
        both_ways(lambda: space.kernel(length), list(space.parameters())),
        both_ways(published.kernel, published.learned),
    ]
    with threads(1):
        rounds = 40 if length < 500 else 6
        ours_ms, theirs_ms = benchmark.pedantic(in_turn_ms, args=(works, rounds), rounds=1)
    with capsys.disabled():
        print(
            f"\n{kernel}, {length} frames, forward and backward: {ours_ms:.1f} ms, "
            f"as published {theirs_ms:.0f} ms, {theirs_ms / ours_ms:.1f} times"
        )
    assert theirs_ms / ours_ms >= least


@pytest.mark.benchmark(group="state spaces, stack of layers")
@pytest.mark.parametrize("kernel", ["legs", "diagonal"])
def test_four_layers(benchmark: Any, kernel: Any, capsys: pytest.CaptureFixture[str]) -> None:
    stack = S4Denoiser(32, channels=CHANNELS, state_size=STATE_SIZE, kernel=kernel).eval()
    clip, frame = torch.randn(1, 450, 32), torch.randn(1, 1, 32)
    state = stack.initial_state(1)

    def live_frame() -> Tensor:
        nonlocal state
        answer, state = stack.chunk(frame, state)
        return answer

    with torch.inference_mode():
        with threads(1):
            live_frame()
            (frame_ms,) = benchmark.pedantic(in_turn_ms, args=([live_frame], 300), rounds=1)
        with threads(2):
            stack(clip)
            clip_s = best_s(lambda: stack(clip), 25)
    with capsys.disabled():
        print(
            f"\n{kernel}: one live frame {frame_ms:.2f} ms; "
            f"450 frames at once {1e3 * clip_s:.1f} ms"
        )
    assert frame_ms <= 1.0
    assert clip_s <= 40e-3


@pytest.mark.benchmark(group="state spaces, convolution")
def test_product_or_transform(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    def compared(signals: int, length: int) -> list[float]:
        signal = torch.randn(CHANNELS, signals, length, requires_grad=True)
        kernel = torch.randn(CHANNELS, length, requires_grad=True)
        gradient = torch.randn(CHANNELS, signals, length)
        return in_turn_ms(
            [
                lambda way=way: torch.autograd.grad(way(signal, kernel), (signal, kernel), gradient)
                for way in (by_product, by_transform)
            ],
            12,
        )

    with threads(1):
        sizes = [(signals, length) for signals in (1, 16, 64) for length in (72, 144, 288)]
        found = benchmark.pedantic(lambda: {size: compared(*size) for size in sizes}, rounds=1)
    with capsys.disabled():
        print("\nsignals, frames: by product, by transform, ms forward and backward")
        for (signals, length), (product, transform) in found.items():
            print(f"{signals}, {length}: {product:.1f}, {transform:.1f}")
    assert found[64, 72][0] < found[64, 72][1]
