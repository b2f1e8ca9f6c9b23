from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.body.solve import Normal


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 7), st.integers(1, 4))
def test_step_is_the_least_squares_solution(seed: int, frames: int, unknowns: int) -> None:
    """Against a dense solution of the same residuals."""
    rng = np.random.default_rng(seed)
    normal = Normal.zeros(frames, unknowns)
    rows, values = [], []

    def dense(first: int, parts: list[tuple[int, np.ndarray]], residual: np.ndarray) -> None:
        for number, value in enumerate(residual):
            row = np.zeros((frames, unknowns))
            for at, derivative in parts:
                row[first + at] = derivative[first, number]
            rows.append(row.ravel())
            values.append(value)

    for span in ([0], [0, 1], [0, 2], [0, 1, 2]):
        count = frames - span[-1]
        if count < 1:
            continue
        residual = rng.standard_normal((count, 3 + unknowns))
        parts = [(at, rng.standard_normal((count, 3 + unknowns, unknowns))) for at in span]
        normal.add(residual, parts)
        for first in range(count):
            dense(first, parts, residual[first])
    smooth = rng.standard_normal((max(frames - 2, 0), unknowns))
    weights = [(at, rng.standard_normal(smooth.shape)) for at in (0, 1, 2)]
    normal.add_diagonal(smooth, weights)
    full = [(at, value[:, :, None] * np.eye(unknowns)) for at, value in weights]
    for first in range(len(smooth)):
        dense(first, full, smooth[first])
    expected = np.linalg.lstsq(np.array(rows), -np.array(values), rcond=None)[0]
    found = normal.step(0.0)
    assert found.ravel() == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_damping_shortens_the_step() -> None:
    normal = Normal.zeros(1, 2)
    normal.add(np.array([[2.0, 4.0]]), [(0, np.diag([1.0, 2.0])[None])])
    np.testing.assert_allclose(normal.step(0.0), [[-2.0, -2.0]])
    np.testing.assert_allclose(normal.step(1.0), [[-1.0, -1.0]])
