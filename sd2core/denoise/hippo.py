"""The HiPPO-LegS matrix, and the form in which its kernel is computed.

Sources: A. Gu, T. Dao, S. Ermon, A. Rudra, C. Ré, "HiPPO: Recurrent memory with optimal
polynomial projections" (2020), theorem 2 and appendix D.3; A. Gu, K. Goel, C. Ré, "Efficiently
modeling long sequences with structured state spaces" (2022), equation 2 and theorem 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error


def legs_matrices(state_size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """HiPPO-LegS in its own (dense, real) basis: x′ = A x + B u.

    A[n, k] = −√((2n + 1)(2k + 1)) below the diagonal, −(n + 1) on it and 0 above, and
    B[n] = √(2n + 1). The SD² paper prints A without its minus sign; that system has eigenvalues
    1 … N instead of −1 … −N, and its kernel grows past 1e48.

    Returns
    -------
    A : (N, N) float64
    B : (N,) float64
    """
    order = np.arange(state_size)
    root = np.sqrt(2 * order + 1.0)
    matrix = -np.tril(root[:, None] * root[None, :], -1) - np.diag(order + 1.0)
    return matrix, root


@dataclass(frozen=True, eq=False)
class NormalForm:
    """A = V (Λ − p pᵀ) V*, one of each conjugate pair of Λ kept.

    Attributes
    ----------
    poles : (N/2,) complex128
        Λ: every real part is −1/2, imaginary parts positive and ascending.
    low_rank : (N/2,) float64
        p = V* P with P[n] = √(n + 1/2). The phases of V are chosen so that it is real and
        positive, which makes the form unique.
    inputs : (N/2,) complex128
        V* B, which is √2 p.
    basis : (N, N/2) complex128
        The columns of V that belong to `poles`; orthonormal.
    """

    poles: NDArray[np.complex128]
    low_rank: NDArray[np.float64]
    inputs: NDArray[np.complex128]
    basis: NDArray[np.complex128]


@lru_cache(maxsize=16)
def legs_normal_form(state_size: int) -> NormalForm:
    """HiPPO-LegS as a normal matrix less one of rank one, in double precision.

    A + P Pᵀ is −1/2 plus a skew-symmetric matrix, so the basis that diagonalises it is unitary
    and loses nothing, while A itself has eigenvectors too ill-conditioned for any use.

    Parameters
    ----------
    state_size : int
        N, even, so that the poles come in conjugate pairs.
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
    form = NormalForm(
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
