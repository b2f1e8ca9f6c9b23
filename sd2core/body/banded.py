"""Least squares over time: unknowns of a frame meet only those of the next two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sd2core.body.rotations import Floats

REACH = 2
"""Frames that one residual spans, less one."""


@dataclass(eq=False)
class Normal:
    """Normal equations of a Gauss–Newton step: a symmetric matrix of n × n blocks.

    Attributes
    ----------
    blocks : list of float64 arrays
        ``blocks[k][t]`` is the block between frames t and t + k, shape (n, n), for
        k = 0, 1, 2; the one of k = 0 is symmetric.
    gradient : float64 array, shape (T, n)
        Of half the sum of squares.
    """

    blocks: list[Floats]
    gradient: Floats

    @classmethod
    def zeros(cls, frames: int, unknowns: int) -> Normal:
        """No residual yet."""
        return cls(
            [np.zeros((max(frames - k, 0), unknowns, unknowns)) for k in range(REACH + 1)],
            np.zeros((frames, unknowns)),
        )

    def add(self, residual: Floats, parts: list[tuple[int, Floats]]) -> None:
        """Add residuals that are already divided by their standard deviations.

        Parameters
        ----------
        residual : array, shape (m, R)
            R residuals for each of m first frames (0 to m - 1).
        parts : list of (int, array)
            For each frame offset o the derivative (m, R, n) by the unknowns of
            frame t + o; offsets ascend.
        """
        count = len(residual)
        for number, (at, left) in enumerate(parts):
            transposed = np.swapaxes(left, 1, 2)
            self.gradient[at : at + count] += (transposed @ residual[..., None])[..., 0]
            for other, right in parts[number:]:
                self.blocks[other - at][at : at + count] += transposed @ right

    def add_diagonal(self, residual: Floats, parts: list[tuple[int, Floats]]) -> None:
        """Add one residual per unknown that depends on that unknown alone.

        As :meth:`add` with R = n and the diagonals (m, n) of the derivatives.
        """
        count, unknowns = residual.shape
        rows = np.arange(unknowns)
        for number, (at, left) in enumerate(parts):
            self.gradient[at : at + count] += left * residual
            for other, right in parts[number:]:
                self.blocks[other - at][at : at + count, rows, rows] += left * right

    def step(self, damping: float) -> Floats:
        """The unknowns' change (T, n) that solves the equations.

        Parameters
        ----------
        damping : float
            Share of its own diagonal that is added to the matrix (Marquardt).
        """
        from scipy.linalg import solveh_banded

        frames, unknowns = self.gradient.shape
        width = min(REACH, frames - 1) * unknowns + unknowns - 1
        banded = np.zeros((width + 1, frames * unknowns), order="F")  # as LAPACK takes it
        row, column = np.mgrid[:unknowns, :unknowns]
        for apart, blocks in enumerate(self.blocks[: min(REACH, frames - 1) + 1]):
            below = row - column - apart * unknowns
            kept = below <= 0
            places = np.arange(len(blocks))[:, None] * unknowns + apart * unknowns
            banded[width + below[kept], places + column[kept]] = blocks[:, kept]
        banded[-1] *= 1.0 + damping
        solved = solveh_banded(
            banded,
            -self.gradient.ravel(),
            overwrite_ab=True,
            overwrite_b=True,
            check_finite=False,
        )
        return np.asarray(solved.reshape(frames, unknowns))
