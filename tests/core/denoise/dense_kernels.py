"""Kernels computed as their definitions say, in the longest floats the machine has.

No normal form, no poles, no transform: the dense matrices of the papers, solved by forward
substitution and raised to powers. All of it is a contraction, so 2,000 steps lose three digits
of the nineteen (of the sixteen where there is nothing longer than a double).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Long = np.longdouble
Complex = np.clongdouble


def hippo_legs(state_size: int) -> tuple[NDArray[Long], NDArray[Long]]:
    """A and B, entry by entry as printed by Gu et al. (2022), with the minus sign."""
    matrix = np.zeros((state_size, state_size), Long)
    for n in range(state_size):
        for k in range(n):
            matrix[n, k] = -np.sqrt(Long(2 * n + 1)) * np.sqrt(Long(2 * k + 1))
        matrix[n, n] = -(n + 1)
    return matrix, np.sqrt(2 * np.arange(state_size).astype(Long) + 1)


def substituted(lower: NDArray[Long], right: NDArray[Long]) -> NDArray[Long]:
    """lower⁻¹ right, by forward substitution."""
    solution = np.zeros_like(right)
    for n in range(len(lower)):
        solution[n] = (right[n] - lower[n, :n] @ solution[:n]) / lower[n, n]
    return solution


def dense_legs_kernel(C: NDArray[Long], dt: float, length: int) -> NDArray[Long]:
    """C Āˡ B̄ for one channel, bilinear."""
    A, B = hippo_legs(len(C))
    half, unit = Long(dt) / 2, np.eye(len(C), dtype=Long)
    both = substituted(unit - half * A, np.column_stack((unit + half * A, 2 * half * B)))
    step, state = both[:, :-1], both[:, -1]
    row, rows = C.astype(Long), []
    stride = max(1, 1 << (int(np.sqrt(length)).bit_length() - 1))
    for _ in range(stride):
        rows.append(row)
        row = row @ step
    leap = step
    for _ in range(stride.bit_length() - 1):
        leap = leap @ leap
    columns = []
    for _ in range(-(-length // stride)):
        columns.append(state)
        state = leap @ state
    return (np.array(rows) @ np.array(columns).T).T.reshape(-1)[:length]


def dense_diagonal_kernel(
    A: NDArray[Complex], B: NDArray[Complex], C: NDArray[Complex], dt: float, length: int
) -> NDArray[Long]:
    """2 Re Σ C exp(l Δ A) (exp(Δ A) − 1) / A · B for one channel, zero-order hold."""
    exponent = Long(dt) * A.astype(Complex)
    half = np.sinh(exponent / 2) * np.exp(exponent / 2) * 2  # exp − 1, which does not cancel
    held = np.where(A == 0, Complex(dt), half / np.where(A == 0, 1, A))
    powers = np.exp(np.arange(length).astype(Long)[:, None] * exponent)
    return 2 * (powers @ (C * held * B)).real
