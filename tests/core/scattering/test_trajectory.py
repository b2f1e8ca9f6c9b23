from __future__ import annotations

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.scattering.trajectory import Trajectory

UNEVEN_S = np.array([0.0, 0.03, 0.07, 0.1, 0.16, 0.19, 0.23, 0.26, 0.3, 0.33, 0.4, 0.42])


def path(trajectory: Trajectory, positions: np.ndarray) -> np.ndarray:
    """All knots of one coordinate per vertex, from (T, V) to (knots, V)."""
    vertices = np.stack([positions] * 3, axis=2)
    knots = len(trajectory.knot_times_s)
    first, last = trajectory.frames_needed(0, knots)
    return trajectory.knots(vertices[first:last], first, 0, knots)[:, :, 0]


def test_untouched_by_default() -> None:
    vertices = np.random.default_rng(0).normal(size=(12, 4, 3)).astype(np.float32)
    trajectory = Trajectory(UNEVEN_S)
    assert trajectory.frames_needed(3, 7) == (3, 7)
    np.testing.assert_array_equal(trajectory.knots(vertices[3:7], 3, 3, 7), vertices[3:7])


@pytest.mark.parametrize("every", [2, 5, 8])
def test_resampling_passes_every_frame_and_follows_a_parabola(every: int) -> None:
    trajectory = Trajectory(UNEVEN_S, oversampling=every)
    assert len(trajectory.knot_times_s) == 11 * every + 1
    np.testing.assert_allclose(trajectory.knot_times_s[::every], UNEVEN_S)
    height = 2.0 + UNEVEN_S - 4.9 * UNEVEN_S**2
    fine = path(trajectory, height[:, None])[:, 0]
    np.testing.assert_allclose(fine[::every], height, atol=1e-14)
    times = trajectory.knot_times_s
    inner = slice(every, -every)  # the ends have a line's tangent, not a parabola's
    np.testing.assert_allclose(fine[inner], (2.0 + times - 4.9 * times**2)[inner], atol=1e-12)


@pytest.mark.parametrize("oversampling", [1, 3])
def test_smoothing_keeps_uniform_motion_up_to_the_ends(oversampling: int) -> None:
    trajectory = Trajectory(UNEVEN_S, oversampling, smoothing_s=0.04)
    smooth = path(trajectory, (1.0 - 1.3 * UNEVEN_S)[:, None])[:, 0]
    np.testing.assert_allclose(smooth, 1.0 - 1.3 * trajectory.knot_times_s, atol=1e-12)


def test_smoothing_is_zero_phase() -> None:
    times = np.arange(61) / 30
    bump = np.exp(-(((times - 1.0) / 0.1) ** 2))[:, None]
    smooth = path(Trajectory(times, smoothing_s=0.05), bump)[:, 0]
    np.testing.assert_allclose(smooth, smooth[::-1], atol=1e-12)
    assert smooth.argmax() == 30
    # A Gaussian smoothed by a Gaussian: variances add.
    assert smooth[30] == pytest.approx(0.1 / np.sqrt(0.1**2 + 2 * 0.05**2), rel=1e-3)


@pytest.mark.parametrize(
    ("oversampling", "smoothing_s"), [(3, 0.0), (8, 0.0), (1, 0.05), (4, 0.05)]
)
def test_stretches_join_without_a_seam(oversampling: int, smoothing_s: float) -> None:
    positions = np.random.default_rng(3).normal(size=(12, 6, 3))
    trajectory = Trajectory(UNEVEN_S, oversampling, smoothing_s)
    knots = len(trajectory.knot_times_s)
    parts = []
    for low, high in ((0, 1), (1, 4), (4, 9), (9, knots)):
        first, last = trajectory.frames_needed(low, high)
        parts.append(trajectory.knots(positions[first:last], first, low, high))
    whole = trajectory.knots(positions, 0, 0, knots)
    np.testing.assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_recordings(frames: int) -> None:
    times = np.arange(frames) / 30
    positions = np.arange(frames, dtype=float)[:, None]
    fine = path(Trajectory(times, 3, 0.1), positions)[:, 0]
    np.testing.assert_allclose(fine, np.arange(len(fine)) / 3, atol=1e-9)


@pytest.mark.parametrize("wrong", [{"oversampling": 0}, {"smoothing_s": -1.0}])
def test_nonsense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(Sd2Error):
        Trajectory(UNEVEN_S, **wrong)  # type: ignore[arg-type]
