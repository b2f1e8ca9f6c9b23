from __future__ import annotations

import numpy as np

from sd2core.simulate.limbs import elbow_position, minimum_jerk


def test_minimum_jerk_starts_and_ends_at_rest() -> None:
    assert minimum_jerk([-1.0, 0.0, 0.5, 1.0, 2.0]).tolist() == [0.0, 0.0, 0.5, 1.0, 1.0]
    step = 1e-4
    for end in (0.0, 1.0):
        around = minimum_jerk([end - step, end, end + step])
        assert np.abs(np.diff(around)).max() / step < 1e-6


def test_elbow_closes_the_triangle_on_the_poles_side() -> None:
    rng = np.random.default_rng(3)
    shoulder = rng.normal(size=(50, 3))
    line = rng.normal(size=(50, 3))
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    wrist = shoulder + line * rng.uniform(0.15, 0.5, (50, 1))
    pole = rng.normal(size=(50, 3))
    elbow = elbow_position(shoulder, wrist, 0.29, 0.26, pole)
    np.testing.assert_allclose(np.linalg.norm(elbow - shoulder, axis=1), 0.29, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(wrist - elbow, axis=1), 0.26, atol=1e-12)
    aside = elbow - shoulder - ((elbow - shoulder) * line).sum(axis=1, keepdims=True) * line
    assert ((aside * pole).sum(axis=1) > 0).all()
    np.testing.assert_allclose(
        np.einsum("ti,ti->t", np.cross(line, pole), aside), 0.0, atol=1e-12
    )  # in the plane of line and pole
