"""Convolution kernels of structured state spaces, exact for every step size and length.

Sources: A. Gu, T. Dao, S. Ermon, A. Rudra, C. Ré, "HiPPO: Recurrent memory with optimal
polynomial projections" (2020), theorem 2 and appendix D.3; A. Gu, K. Goel, C. Ré, "Efficiently
modeling long sequences with structured state spaces" (2022), equation 2 and theorem 1, "S4";
A. Gu, A. Gupta, K. Goel, C. Ré, "On the parameterization and initialization of diagonal state
space models" (2022), "S4D".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from sd2core.denoise.s4_functions import (
    damping_circle,
    held_exponential,
    nplr_terms,
    vandermonde_product,
    woodbury_quotient,
)
from sd2core.errors import Sd2Error


class StateMatrix(NamedTuple):
    """A = V (Λ − p pᵀ) V* and V* B, all (…, N/2); of every conjugate pair one is kept."""

    poles: Tensor  # Λ, complex, real parts negative.
    low_rank: Tensor  # p, real. Any p can be made real by turning the phases of the basis.
    inputs: Tensor  # V* B, complex.


def legs_kernel(
    C: Tensor, dt: Tensor | float, length: int, matrix: StateMatrix | None = None
) -> Tensor:
    """Kernel of S4: k[l] = C Āˡ B̄ of A and B as in `legs_matrices`, discretised bilinearly.

    Ā = (I − Δ/2 A)⁻¹ (I + Δ/2 A) and B̄ = (I − Δ/2 A)⁻¹ Δ B (Gu et al. 2022, S4, equation 3).

    Parameters
    ----------
    C : (H, N) or (N,) float32 or float64
        In the dense basis of A and B. N is even.
    dt : (H,) or () float
        Δ, above 0.
    matrix : StateMatrix, optional
        Learned matrix in place of HiPPO-LegS, in the basis V of its normal form, where C is C V.

    Returns
    -------
    (H, length) or (length,), of the type of C.
    """
    if matrix is None:
        matrix = legs_state_matrix(C.shape[-1], C.device)
    return nplr_kernel(matrix, to_normal_basis(C), dt, length, C.dtype)


def nplr_kernel(
    matrix: StateMatrix,
    C: Tensor,
    dt: Tensor | float,
    length: int,
    precision: torch.dtype | None = None,
) -> Tensor:
    """Kernel of any normal matrix less one of rank one, discretised bilinearly.

    With z for the shift by one frame and R = (1 − Δ/2 Λ − z (1 + Δ/2 Λ))⁻¹ (Gu et al. 2022,
    S4, appendix C.3: generating function and Woodbury's identity, with P = Q = p and 1 + z left
    in the numerator)::

        Σ k[l] zˡ = a − (1 + z) b c / (1 + (1 + z) d)
        a = Δ C R B,  b = C R p,  c = Δ²/2 pᵀ R B,  d = Δ/2 pᵀ R p

    R is diagonal, so a … d are sums of powers of (1 + Δ/2 λ) / (1 − Δ/2 λ). S4 evaluates the
    quotient at the roots of unity, which gives a kernel that wraps around and must be cured with
    C (I − Āᴸ); here the four series are divided as series (`woodbury_quotient`), and no node,
    no Āᴸ and no wrapped kernel occurs. All of it is in double precision.

    Parameters
    ----------
    C : (…, N/2) complex64 or complex128
        In the basis of `matrix`.
    dt : (…) float

    Returns
    -------
    (…, length) of type ``precision``, by default float32 or float64 by the type of C.
    """
    precision = precision or C.real.dtype
    check_length(length)
    dt = torch.as_tensor(dt, dtype=torch.float64, device=C.device)[..., None]
    everything = (matrix.poles, matrix.low_rank, matrix.inputs, C, dt)
    shape = torch.broadcast_shapes(*(values.shape for values in everything))
    states = shape[-1]

    def rows(values: Tensor, precision: torch.dtype) -> Tensor:
        return values.to(precision).expand(shape).reshape(-1, states)

    ratios, weights = nplr_terms(
        rows(matrix.poles, torch.complex128),
        rows(matrix.low_rank, torch.float64),
        rows(matrix.inputs, torch.complex128),
        rows(C, torch.complex128),
        dt.expand(*shape[:-1], 1).reshape(-1, 1),
    )
    points, radius = damping_circle(length, precision)
    series = vandermonde_product(radius * ratios, weights, length)
    kernel = woodbury_quotient(series, points, radius)
    return kernel.to(precision).reshape(*shape[:-1], length)


def diagonal_kernel(A: Tensor, B: Tensor, C: Tensor, dt: Tensor | float, length: int) -> Tensor:
    """Kernel of S4D: k[l] = 2 Re Σₙ C[n] Āˡ[n] B̄[n], zero-order hold.

    Ā = exp(Δ A), B̄ = (exp(Δ A) − 1) / A · B (Gu et al. 2022, S4D: zero-order hold), whose
    limit Δ B is taken at A → 0.

    Parameters
    ----------
    A, B, C : (H, N/2) or (N/2,) complex64 or complex128
        One of each conjugate pair, hence the 2 Re; Re A ≤ 0.
    dt : (H,) or () float
        Δ, above 0.
    length : int
        Frames of the kernel, at least 1.

    Returns
    -------
    (H, length) or (length,), float32 or float64 by the type of C.
    """
    check_length(length)
    precision = C.real.dtype
    dt = torch.as_tensor(dt, dtype=torch.float64, device=C.device)[..., None]
    grown, held = held_exponential(dt * A.to(torch.complex128))
    weights = (C.to(torch.complex128) * B) * (dt * held)
    poles = grown.expand(weights.shape)
    states = weights.shape[-1]
    kernel = vandermonde_product(poles.reshape(-1, states), weights.reshape(-1, 1, states), length)
    return kernel.to(precision).reshape(*weights.shape[:-1], length)


def check_length(length: int) -> None:
    """Refuse a length below 1."""
    if length < 1:
        raise Sd2Error(
            found=f"a kernel of length {length}",
            expected="at least one frame",
            remedy="Give a recording with frames.",
        )


def legs_state_matrix(state_size: int, device: torch.device | str | None = None) -> StateMatrix:
    """Normal-plus-low-rank form of HiPPO-LegS as complex128 tensors."""
    form = legs_nplr(state_size)
    return StateMatrix(
        torch.tensor(form.poles, device=device),
        torch.tensor(form.low_rank, device=device),
        torch.tensor(form.inputs, device=device),
    )


def to_normal_basis(C: Tensor) -> Tensor:
    """Change C from the dense basis to the normal one, C V: (…, N) real → (…, N/2) complex128."""
    form = legs_nplr(C.shape[-1])
    basis = torch.view_as_real(torch.tensor(form.basis, device=C.device)).flatten(1)  # (N, N)
    return torch.view_as_complex((C.double() @ basis).unflatten(-1, (-1, 2)))


def legs_matrices(state_size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """HiPPO-LegS in its own (dense, real) basis: x′ = A x + B u; A is (N, N), B is (N,).

    A[n, k] = −√((2n + 1)(2k + 1)) below the diagonal, −(n + 1) on it and 0 above, and
    B[n] = √(2n + 1) (Gu et al. 2022, S4, equation 2). The SD² paper prints A without its minus
    sign; that system has eigenvalues 1 … N instead of −1 … −N, and its kernel grows past 1e48.
    """
    order = np.arange(state_size)
    root = np.sqrt(2 * order + 1.0)
    matrix = -np.tril(root[:, None] * root[None, :], -1) - np.diag(order + 1.0)
    return matrix, root


@dataclass(frozen=True, eq=False)
class NPLR:
    """Normal-plus-low-rank form A = V (Λ − p pᵀ) V*, one of each conjugate pair of Λ kept."""

    # Λ, (N/2,): every real part is −1/2, imaginary parts positive and ascending.
    poles: NDArray[np.complex128]
    # p = V* P, (N/2,), with P[n] = √(n + 1/2). The phases of V are chosen so that it is real and
    # positive, which makes the form unique.
    low_rank: NDArray[np.float64]
    inputs: NDArray[np.complex128]  # V* B, (N/2,), which is √2 p.
    basis: NDArray[np.complex128]  # Columns of V that belong to `poles`, (N, N/2); orthonormal.


@lru_cache(maxsize=16)
def legs_nplr(state_size: int) -> NPLR:
    """HiPPO-LegS of an even size N as a normal matrix less one of rank one, in double precision.

    A + P Pᵀ is −1/2 plus a skew-symmetric matrix, so the basis that diagonalises it is unitary
    and loses nothing, while A itself has eigenvectors too ill-conditioned for any use.
    """
    if state_size < 2 or state_size % 2:
        raise Sd2Error(
            found=f"a state of size {state_size}",
            expected="an even size of 2 or more: the poles come in conjugate pairs",
            remedy="Take the next even size.",
        )
    matrix, inputs = legs_matrices(state_size)
    low_rank = np.sqrt(np.arange(state_size) + 0.5)
    skew = matrix + np.outer(low_rank, low_rank) + 0.5 * np.eye(state_size)
    skew = 0.5 * (skew - skew.T)
    frequencies, vectors = np.linalg.eigh(-1j * skew)
    kept = slice(state_size // 2, None)
    vectors = _orthonormal_with_conjugates(vectors[:, kept])
    projected = vectors.conj().T @ low_rank
    basis = vectors * (projected / np.abs(projected))
    form = NPLR(
        poles=-0.5 + 1j * frequencies[kept],
        low_rank=np.abs(projected),
        inputs=basis.conj().T @ inputs,
        basis=basis,
    )
    for values in (form.poles, form.low_rank, form.inputs, form.basis):
        values.flags.writeable = False
    return form


def _orthonormal_with_conjugates(vectors: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Half of a unitary basis whose other half is its conjugate, to the last digit.

    `eigh` knows nothing of conjugates: at N = 256 the slowest vector and its conjugate are
    orthogonal to 1e-12 only. √2 times real and imaginary parts should be an orthogonal matrix;
    one Newton step towards the nearest squares the error.
    """
    real = np.sqrt(2.0) * np.hstack((vectors.real, vectors.imag))
    real = real @ (1.5 * np.eye(len(real)) - 0.5 * real.T @ real)
    half = vectors.shape[1]
    return (real[:, :half] + 1j * real[:, half:]) / np.sqrt(2.0)
