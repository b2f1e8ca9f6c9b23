"""Training step of four S4 layers, 64 × 72 × 32, H = 128, N = 64, beside the published algorithms.

On the CPU each has one thread and a process of its own, as a training has: pages of memory that are
given back and fetched again count, and one would leave the other its own. They step in turn, and
processor time is what counts.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from statistics import median
from typing import Any

import pytest
import torch
from published_kernels import PublishedDiagonal, PublishedLayer, PublishedLegs
from torch import Tensor, nn

from sd2core.denoise.causal_models import S4Denoiser
from sd2core.train.machine import keep_freed_memory

CHANNELS, STATE_SIZE, LAYERS = 128, 64, 4
BATCH, LENGTH, BINS = 64, 72, 32
WARMING, ROUNDS = 8, 60

Step = Callable[[], None]


class Published(nn.Module):
    def __init__(self, kernel: str) -> None:
        super().__init__()
        made = {"legs": PublishedLegs, "diagonal": PublishedDiagonal}[kernel]
        kernels = [made(CHANNELS, STATE_SIZE, LENGTH) for _ in range(LAYERS)]
        self.lift = nn.Linear(BINS, CHANNELS)
        self.layers = nn.Sequential(*(PublishedLayer(one, CHANNELS) for one in kernels))
        self.head = nn.Linear(CHANNELS, BINS)

    def forward(self, x: Tensor) -> Tensor:
        return self.head(self.layers(self.lift(x)))


def training_step(network: nn.Module) -> Step:
    optimiser = torch.optim.AdamW(network.parameters(), 1e-3, fused=True)
    given, wanted = torch.randn(2, BATCH, LENGTH, BINS)

    def step() -> None:
        optimiser.zero_grad()
        (network(given) - wanted).square().mean().sqrt().backward()
        optimiser.step()

    return step


def ours(kernel: Any) -> Step:
    keep_freed_memory()  # as a training does
    return training_step(
        S4Denoiser(BINS, channels=CHANNELS, depth=LAYERS, state_size=STATE_SIZE, kernel=kernel)
    )


def published(kernel: str) -> Step:
    return training_step(Published(kernel))


def bare_arithmetic(_: str) -> Step:
    """Mixing, convolution and activations with their derivatives, and nothing else.

    No arrangement of the rest takes a step below this. The published step has all of it but the
    product for the convolution.
    """
    keep_freed_memory()
    weight, both = torch.randn(2 * CHANNELS, CHANNELS), torch.randn(2 * CHANNELS, BATCH * LENGTH)
    signal, matrix = (torch.randn(CHANNELS, rows, LENGTH) for rows in (BATCH, LENGTH))
    frames = signal.view(CHANNELS, -1)

    def step() -> None:
        for _ in range(LAYERS):
            torch.mm(weight, frames)
            torch.mm(weight.t(), both)
            torch.mm(both, frames.t())
            torch.bmm(signal, matrix)
            torch.bmm(signal, matrix.transpose(1, 2))
            torch.bmm(signal.transpose(1, 2), signal)
            torch.sigmoid(signal)
            torch.ops.aten.gelu_backward(signal, nn.functional.gelu(signal))

    return step


def answer(pipe: Connection, make: Callable[[str], Step], kernel: str) -> None:
    """Take a step when told to, and tell its seconds."""
    torch.set_num_threads(1)
    step = make(kernel)
    while pipe.recv():
        begun_s = time.process_time()
        step()
        pipe.send(time.process_time() - begun_s)


@contextmanager
def process(make: Callable[[str], Step], kernel: str) -> Iterator[Connection]:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    worker = context.Process(target=answer, args=(there, make, kernel), daemon=True)
    worker.start()
    there.close()
    yield here
    here.send(False)
    worker.join()


def in_turn_s(kernel: str) -> list[tuple[float, ...]]:
    """Seconds of every round: ours, published, bare arithmetic."""
    with ExitStack() as stack:
        made = (ours, published, bare_arithmetic)
        pipes = [stack.enter_context(process(make, kernel)) for make in made]
        spent = []
        for _ in range(WARMING + ROUNDS):
            for pipe in pipes:
                pipe.send(True)
                spent.append(pipe.recv())
    rounds = list(zip(spent[::3], spent[1::3], spent[2::3], strict=True))
    return rounds[WARMING:]


@pytest.mark.benchmark(group="state spaces, training step")
@pytest.mark.parametrize(("kernel", "least"), [("legs", 2.0), ("diagonal", 1.7)])
def test_training_step(
    benchmark: Any, kernel: str, least: float, capsys: pytest.CaptureFixture[str]
) -> None:
    rounds = benchmark.pedantic(in_turn_s, args=(kernel,), rounds=1)
    best = [1e3 * min(times) for times in zip(*rounds, strict=True)]
    usual = [1e3 * median(times) for times in zip(*rounds, strict=True)]
    ratio = median(theirs / here for here, theirs, _ in rounds)
    with capsys.disabled():
        for name, (here, theirs, bare) in (("best", best), ("median", usual)):
            print(
                f"\n{kernel}, {name}: {here:.0f} ms, as published {theirs:.0f} ms, "
                f"{theirs / here:.2f} times; bare arithmetic {bare:.0f} ms",
                end="",
            )
        print(f"; median of the ratios {ratio:.2f}")
    assert ratio >= least


@pytest.mark.benchmark(group="state spaces, training step")
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
@pytest.mark.parametrize("kernel", ["legs", "diagonal"])
def test_training_step_on_a_gpu(
    benchmark: Any, kernel: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with torch.device("cuda"):
        steps = [make(kernel) for make in (ours, published)]

    def in_turn() -> list[list[float]]:
        spent: list[list[float]] = [[], []]
        for _ in range(WARMING + ROUNDS):
            for step, times in zip(steps, spent, strict=True):
                begun_s = time.perf_counter()
                step()
                torch.cuda.synchronize()
                times.append(time.perf_counter() - begun_s)
        return spent

    here, theirs = (1e3 * min(times) for times in benchmark.pedantic(in_turn, rounds=1))
    with capsys.disabled():
        print(
            f"\n{kernel} on {torch.cuda.get_device_name()}: {here:.1f} ms, "
            f"as published {theirs:.1f} ms, {theirs / here:.1f} times"
        )
