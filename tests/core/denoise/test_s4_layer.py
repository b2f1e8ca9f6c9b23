from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
import torch
from torch import Tensor

from sd2core.denoise.s4 import S4Layer
from sd2core.denoise.ssm import legs_kernel
from sd2core.errors import Sd2Error

KERNELS = ("legs", "diagonal")


@pytest.fixture(autouse=True)
def seeded() -> Iterator[None]:
    with torch.random.fork_rng():
        torch.manual_seed(20)
        yield


def layer_of(kernel: str, channels: int = 6, state_size: int = 16, **options: Any) -> S4Layer:
    return S4Layer(channels, state_size, kernel, **options).eval()  # type: ignore[arg-type]


def largest(values: Tensor) -> float:
    return float(values.detach().abs().max())


@pytest.mark.parametrize("kernel", KERNELS)
def test_no_frame_knows_of_later_ones(kernel: str) -> None:
    layer = layer_of(kernel)
    for batch, length in ((2, 40), (20, 40)):  # by transform and by product
        x = torch.randn(batch, length, 6)
        other = x.clone()
        other[:, 25:] += torch.randn(batch, length - 25, 6)
        apart = (layer(x) - layer(other)).abs().amax((0, 2)).detach()
        assert float(apart[:25].max()) < 2e-6
        assert float(apart[25:].min()) > 1e-2


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2, 0.1, 1.0])
def test_frame_by_frame_is_the_convolution(kernel: str, dt: float) -> None:
    layer = layer_of(kernel, 3, 64)
    with torch.no_grad():
        layer.past.log_dt.fill_(torch.log(torch.tensor(dt)))
        x = torch.randn(1, 2304, 3)
        at_once = layer(x)
        state, frames = layer.initial_state(1), []
        for t in range(x.shape[1]):
            frame, state = layer.step(x[:, t], state)
            frames.append(frame)
    assert largest(torch.stack(frames, 1) - at_once) <= 2e-5 * largest(at_once)


@pytest.mark.parametrize("kernel", KERNELS)
def test_chunks_are_the_whole(kernel: str) -> None:
    layer = layer_of(kernel)
    x = torch.randn(3, 157, 6)
    with torch.no_grad():
        state, parts = layer.initial_state(3), []
        for chunk in x.split([1, 31, 32, 0, 64, 29], 1):
            part, state = layer.chunk(chunk, state)
            parts.append(part)
        whole = layer(x)
    assert largest(torch.cat(parts, 1) - whole) < 5e-6


def test_two_directions_see_both_and_cannot_run_live() -> None:
    layer = layer_of("legs", bidirectional=True)
    x = torch.randn(1, 30, 6)
    other = x.clone()
    other[:, 20] += torch.randn(6)
    apart = (layer(x) - layer(other)).abs().amax((0, 2)).detach()
    assert float(apart.min()) > 1e-4
    with pytest.raises(Sd2Error, match="looks ahead"):
        layer.initial_state(1)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_longer_input_changes_nothing(kernel: str) -> None:
    layer = layer_of(kernel)
    before = copy.deepcopy(layer.state_dict())
    x = torch.randn(1, 30, 6)
    with torch.no_grad():
        first = layer(x)
        longer = layer(torch.cat((x, torch.randn(1, 300, 6)), 1))
        again = layer(x)
    assert torch.equal(first, again)
    assert largest(longer[:, :30] - first) < 2e-6
    for name, value in layer.state_dict().items():
        assert torch.equal(value, before[name])


def test_starts_as_hippo_legs() -> None:
    layer = layer_of("legs", 5, 64)
    with torch.no_grad():
        made = layer.past.kernel(72)
        made[:, 0] -= layer.past.skip
        true = legs_kernel(layer.past.outputs, layer.past.dt(), 72)
    assert largest(made - true) < 1e-5 * largest(true)
