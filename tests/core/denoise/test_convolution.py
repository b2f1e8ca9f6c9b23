from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from sd2core.denoise.s4_functions import (
    by_product,
    by_transform,
    convolution,
    mix_gated,
    normalise,
)

Way = Callable[..., Tensor]


def random(*shape: int, seed: int = 1) -> Tensor:
    made = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, dtype=torch.float64, generator=made)


@pytest.mark.parametrize("way", [by_product, by_transform, convolution])
@pytest.mark.parametrize("length", [1, 2, 7, 72, 150])
def test_convolution_is_the_sum_it_says(way: Way, length: int) -> None:
    signal, kernel = random(3, 17, length), random(3, length, seed=2)
    found = way(signal, kernel).numpy()
    for channel in range(3):
        for row in (0, 16):
            true = np.convolve(signal[channel, row], kernel[channel])[:length]
            np.testing.assert_allclose(found[channel, row], true, atol=1e-12 * length)


@pytest.mark.parametrize("way", [by_product, by_transform, convolution])
@pytest.mark.parametrize("length", [1, 2, 7, 72, 150])
def test_a_kernel_that_looks_ahead_is_one_of_the_reversed_signal(way: Way, length: int) -> None:
    signal, kernel, ahead = random(3, 17, length), random(3, length, seed=2), random(3, length)
    true = way(signal, kernel) + way(signal.flip(-1), ahead).flip(-1)
    torch.testing.assert_close(way(signal, kernel, ahead), true, rtol=1e-11, atol=1e-11)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("way", [by_product, by_transform])
@pytest.mark.parametrize("length", [1, 2, 9])
@pytest.mark.parametrize("kernels", [1, 2])
def test_derivatives_of_the_convolution(way: Way, length: int, kernels: int) -> None:
    given = random(2, 3, length), *(random(2, length, seed=2 + at) for at in range(kernels))
    assert torch.autograd.gradcheck(way, tuple(one.requires_grad_() for one in given))


@pytest.mark.parametrize("way", [by_product, by_transform])
@pytest.mark.parametrize("length", [1, 2, 72, 143, 1000])
def test_derivatives_are_those_of_a_plain_convolution(way: Way, length: int) -> None:
    signal, kernel = random(3, 4, length).requires_grad_(), random(3, length, seed=2)
    kernel.requires_grad_()
    gradient = random(3, 4, length, seed=3)
    padded = torch.nn.functional.pad(signal.transpose(0, 1), (length - 1, 0))
    plain = torch.nn.functional.conv1d(padded, kernel.flip(1)[:, None], groups=3).transpose(0, 1)
    found = way(signal, kernel)
    torch.testing.assert_close(found, plain)
    wanted = torch.autograd.grad(plain, (signal, kernel), gradient)
    for one, true in zip(
        torch.autograd.grad(found, (signal, kernel), gradient), wanted, strict=True
    ):
        torch.testing.assert_close(one, true, rtol=1e-10, atol=1e-10)


def test_an_error_in_one_channel_stays_there() -> None:
    # Rows of neighbouring channels touch in memory where diagonals are summed.
    signal, kernel = random(3, 16, 5), random(3, 5, seed=2).requires_grad_()
    gradient = random(3, 16, 5, seed=3)
    gradient[1] = float("inf")
    (by_kernel,) = torch.autograd.grad(by_product(signal, kernel), kernel, gradient)
    assert by_kernel[[0, 2]].isfinite().all()


def test_norm_is_that_of_layer_norm() -> None:
    signal = random(6, 4, 5).requires_grad_()
    last = signal.permute(1, 2, 0)
    true = torch.nn.functional.layer_norm(last, (6,)).permute(2, 0, 1)
    normed, passed = normalise(signal)
    torch.testing.assert_close(normed, true)
    assert torch.equal(passed, signal)
    assert torch.autograd.gradcheck(normalise, (signal,))


@pytest.mark.parametrize("dropped", [False, True])
def test_mixing_is_what_its_formula_says(dropped: bool) -> None:
    signal, residual = random(3, 2, 5), random(3, 2, 5, seed=2)
    weight, bias = random(6, 3, seed=3), random(6, seed=4)
    share = torch.tensor([[[0.0], [2.0]]] * 3).double() if dropped else None
    active = torch.nn.functional.gelu(signal) * (1.0 if share is None else share)
    last = torch.nn.functional.linear(active.permute(1, 2, 0), weight, bias)
    true = residual + torch.nn.functional.glu(last).permute(2, 0, 1)
    torch.testing.assert_close(mix_gated(signal, residual, weight, bias, share), true)
    inputs = [values.requires_grad_() for values in (signal, residual, weight, bias)]
    assert torch.autograd.gradcheck(lambda *given: mix_gated(*given, share), inputs)
