from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from dense_kernels import dense_diagonal_kernel, dense_legs_kernel, hippo_legs
from numpy.typing import NDArray
from torch import Tensor

from sd2core.denoise.s4_functions import held_exponential
from sd2core.denoise.s4_kernel import (
    StateMatrix,
    diagonal_kernel,
    legs_kernel,
    legs_matrices,
    legs_nplr,
    legs_state_matrix,
    nplr_kernel,
)
from sd2core.errors import Sd2Error

STEPS = (1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
# 6e-8 is the rounding of the result; 5e-6 and 1e-10 are what would do.
TOLERANCE = {torch.float32: 2e-7, torch.float64: 5e-11}
GRID = [
    (4, 1),
    (4, 16384),
    (16, 2),
    (16, 100),
    (64, 1),
    (64, 72),
    (64, 2304),
    pytest.param(64, 16384, marks=pytest.mark.slow),
    (256, 2),
    pytest.param(256, 72, marks=pytest.mark.slow),
    pytest.param(256, 2304, marks=pytest.mark.slow),
    pytest.param(256, 16384, marks=pytest.mark.slow),
]


@pytest.fixture(autouse=True)
def seeded() -> Iterator[None]:
    with torch.random.fork_rng():
        torch.manual_seed(23)
        yield


def apart(found: Tensor, true: NDArray[np.longdouble]) -> float:
    """Of the largest value."""
    return float(np.abs(found.detach().numpy() - true).max() / np.abs(true).max())


@pytest.mark.parametrize(("state_size", "length"), GRID)
def test_legs_kernel_is_the_dense_definition(state_size: int, length: int) -> None:
    C = torch.randn(len(STEPS), state_size)
    dt = torch.tensor(STEPS)
    found = {
        torch.float32: legs_kernel(C, dt, length),
        torch.float64: legs_kernel(C.double(), dt.double(), length),
    }
    for channel in range(len(STEPS)):
        true = dense_legs_kernel(C[channel].numpy(), float(dt[channel]), length)
        for precision, kernels in found.items():
            assert kernels.dtype == precision
            assert apart(kernels[channel], true) <= TOLERANCE[precision], STEPS[channel]


@pytest.mark.parametrize(("state_size", "length"), GRID)
def test_diagonal_kernel_is_the_definition(state_size: int, length: int) -> None:
    pairs = state_size // 2
    B, C = torch.randn(2, len(STEPS), pairs, dtype=torch.complex64)
    A = torch.complex(-torch.rand(len(STEPS), pairs), torch.pi * torch.arange(pairs).expand_as(B))
    A[:, 0] = 0.0  # an integrator: the limit of (exp(Δ A) − 1) / A
    dt = torch.tensor(STEPS)
    wide = [values.to(torch.complex128) for values in (A, B, C)]
    found = {
        torch.float32: diagonal_kernel(A, B, C, dt, length),
        torch.float64: diagonal_kernel(*wide, dt.double(), length),
    }
    for channel in range(len(STEPS)):
        parts = [values[channel].numpy() for values in (A, B, C)]
        true = dense_diagonal_kernel(*parts, float(dt[channel]), length)
        for precision, kernels in found.items():
            assert kernels.dtype == precision
            assert apart(kernels[channel], true) <= TOLERANCE[precision], STEPS[channel]


def test_small_steps_give_legendre_polynomials() -> None:
    # exp(A t) B = √(2n + 1) Pₙ(2 exp(−t) − 1) exp(−t) (Gu et al. 2020): the memory of the past,
    # on an exponential scale, in orthogonal polynomials. With A's sign turned it would explode.
    order, dt, length = 7, 1e-3, 3000
    C = torch.zeros(16, dtype=torch.float64)
    C[order] = 1.0
    found = legs_kernel(C, torch.tensor(dt, dtype=torch.float64), length) / dt
    t = (np.arange(length) + 0.5) * dt
    polynomial = np.polynomial.legendre.Legendre.basis(order)(2 * np.exp(-t) - 1)
    assert apart(found, np.sqrt(2 * order + 1) * polynomial * np.exp(-t)) < 2e-3


@pytest.mark.parametrize("state_size", [2, 4, 64, 256])
def test_normal_form_is_hippo_legs(state_size: int) -> None:
    form = legs_nplr(state_size)
    A, B = (values.astype(np.float64) for values in hippo_legs(state_size))
    given_A, given_B = legs_matrices(state_size)
    np.testing.assert_allclose(given_A, A, rtol=1e-15)
    np.testing.assert_allclose(given_B, B, rtol=1e-15)
    V = np.concatenate((form.basis, form.basis.conj()), 1)
    poles = np.concatenate((form.poles, form.poles.conj()))
    p = V @ np.concatenate((form.low_rank, form.low_rank))
    size = np.abs(A).max()
    np.testing.assert_allclose(V.conj().T @ V, np.eye(state_size), atol=1e-12)
    np.testing.assert_allclose((V * poles) @ V.conj().T - np.outer(p, p), A, atol=1e-13 * size)
    inputs = np.concatenate((form.inputs, form.inputs.conj()))
    np.testing.assert_allclose(V @ inputs, B, atol=1e-12 * np.abs(B).max())


def test_one_channel_and_shared_steps() -> None:
    C = torch.randn(5, 8, dtype=torch.float64)
    dt = torch.rand(5, dtype=torch.float64)
    many = legs_kernel(C, dt, 20)
    assert many.shape == (5, 20)
    one = legs_kernel(C[2], dt[2], 20)
    assert one.shape == (20,)
    torch.testing.assert_close(one, many[2])
    torch.testing.assert_close(legs_kernel(C, float(dt[2]), 20)[2], one)
    A = -torch.rand(4, dtype=torch.complex128)
    B, D = torch.randn(2, 4, dtype=torch.complex128)
    many = diagonal_kernel(A, B, D, dt, 20)
    assert many.shape == (5, 20)
    torch.testing.assert_close(diagonal_kernel(A, B, D, dt[2], 20), many[2])


@pytest.mark.parametrize("length", [1, 72, 2304])
def test_a_shorter_kernel_is_the_beginning_of_a_longer(length: int) -> None:
    C, dt = torch.randn(3, 64, dtype=torch.float64), torch.tensor([1e-3, 0.1, 5.0]).double()
    longer = legs_kernel(C, dt, length + 311)[:, :length]
    shorter = legs_kernel(C, dt, length)
    assert float((longer - shorter).abs().max() / shorter.abs().max()) < 1e-10


@pytest.mark.parametrize("precision", [torch.float32, torch.float64])
@pytest.mark.parametrize("length", [1, 72, 600])
def test_no_step_is_too_small_or_too_large(precision: torch.dtype, length: int) -> None:
    dt = torch.logspace(-12, 8, 41, dtype=precision).requires_grad_()
    C = torch.randn(41, 64, dtype=precision, requires_grad=True)
    kernel = legs_kernel(C, dt, length)
    found = [kernel, *torch.autograd.grad(kernel.square().sum(), (C, dt))]
    A = torch.complex(-torch.ones(32, dtype=precision), torch.arange(32, dtype=precision))
    A.requires_grad_()
    D = torch.view_as_complex(torch.randn(41, 32, 2, dtype=precision)).requires_grad_()
    kernel = diagonal_kernel(A, torch.ones_like(A), D, dt, length)
    found += [kernel, *torch.autograd.grad(kernel.square().sum(), (A, D, dt))]
    for values in found:
        assert values.isfinite().all()


@pytest.mark.one_in(3)
@pytest.mark.parametrize("length", [1, 2, 9, 40])
def test_derivatives_of_the_low_rank_kernel(length: int) -> None:
    pairs = 3
    poles = torch.complex(-torch.rand(2, pairs), 3 * torch.randn(2, pairs)).to(torch.complex128)
    low_rank = torch.randn(2, pairs, dtype=torch.float64)
    B, C = torch.randn(2, 2, pairs, dtype=torch.complex128)
    dt = torch.tensor([0.03, 1.3], dtype=torch.float64)
    inputs = [values.clone().requires_grad_() for values in (poles, low_rank, B, C, dt)]

    def made(poles: Tensor, low_rank: Tensor, B: Tensor, C: Tensor, dt: Tensor) -> Tensor:
        return nplr_kernel(StateMatrix(poles, low_rank, B), C, dt, length)

    assert torch.autograd.gradcheck(made, inputs)
    C = torch.randn(2, 6, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda C, dt: legs_kernel(C, dt, length), (C, inputs[-1]))


@pytest.mark.parametrize("length", [1, 2, 9, 40])
def test_derivatives_of_the_diagonal_kernel(length: int) -> None:
    A = torch.complex(-torch.rand(2, 3), 3 * torch.randn(2, 3)).to(torch.complex128)
    A[0, 0] = -1e-5  # where (exp(Δ A) − 1) / A is a series
    B, C = torch.randn(2, 2, 3, dtype=torch.complex128)
    dt = torch.tensor([0.03, 1.3], dtype=torch.float64)
    inputs = [values.clone().requires_grad_() for values in (A, B, C, dt)]
    assert torch.autograd.gradcheck(lambda *given: diagonal_kernel(*given, length), inputs)


@pytest.mark.parametrize("size", [0.0099, 0.0101, 1.0])  # by series, by quotient
def test_the_held_exponential_has_its_derivative(size: float) -> None:
    x = size * torch.exp(1j * torch.linspace(0, 2 * torch.pi, 9, dtype=torch.float64))
    (found,) = torch.autograd.grad(held_exponential(x.requires_grad_())[1], x, torch.ones_like(x))
    wide = x.detach().numpy().astype(np.clongdouble)
    true = ((wide - 1) * np.exp(wide) + 1) / wide**2
    np.testing.assert_allclose(found.resolve_conj().numpy().conj(), true, rtol=1e-11)


def test_a_pole_that_forgets_at_once_has_derivatives() -> None:
    # 1 + Δ/2 λ = 0: every power but the first vanishes, and a logarithm would not exist.
    poles = torch.full((1, 2), -2.0, dtype=torch.complex128, requires_grad=True)
    low_rank = torch.zeros(1, 2, dtype=torch.float64, requires_grad=True)
    ones = torch.ones(1, 2, dtype=torch.complex128)
    dt = torch.ones(1, dtype=torch.float64)

    def made(poles: Tensor, low_rank: Tensor) -> Tensor:
        return nplr_kernel(StateMatrix(poles, low_rank, ones), ones, dt, 6)

    assert torch.autograd.gradcheck(made, (poles, low_rank))


def test_odd_states_and_no_frames_are_refused() -> None:
    with pytest.raises(Sd2Error, match="even"):
        legs_kernel(torch.randn(2, 5), torch.ones(2), 10)
    with pytest.raises(Sd2Error, match="length 0"):
        legs_kernel(torch.randn(2, 4), torch.ones(2), 0)
    ones = torch.ones(2, dtype=torch.complex64)
    with pytest.raises(Sd2Error, match="length 0"):
        diagonal_kernel(-ones, ones, ones, torch.tensor(1.0), 0)


def test_the_bundled_matrix_is_the_default() -> None:
    C, dt = torch.randn(3, 16), torch.rand(3)
    given = legs_kernel(C, dt, 30, legs_state_matrix(16))
    assert torch.equal(given, legs_kernel(C, dt, 30))
