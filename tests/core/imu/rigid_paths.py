"""Paths of rigid things whose accelerations and turn rates are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sd2core.imu.signals import RigidPath
from sd2core.timebase import Timebase

Place = Callable[[np.ndarray], np.ndarray]

ROTATIONS = st.integers(0, 2**32 - 1).map(
    lambda seed: Rotation.random(random_state=np.random.default_rng(seed)).as_matrix()
)
VECTORS = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)


def path_of(
    times_s: np.ndarray,
    position_m: np.ndarray,
    rotation: np.ndarray | None = None,
    present: np.ndarray | None = None,
) -> RigidPath:
    """A path; without a rotation along the world's axes."""
    turns = np.broadcast_to(np.eye(3) if rotation is None else rotation, (len(times_s), 3, 3))
    there = np.ones(len(times_s), bool) if present is None else present
    return RigidPath(Timebase(times_s), position_m, turns, there)


def even(frames: int = 240, rate_hz: float = 60.0) -> np.ndarray:
    """Times of evenly spaced frames."""
    return np.arange(frames) / rate_hz


def turntable(times_s: np.ndarray, radius_m: float, rate_radps: float) -> RigidPath:
    """A turntable about the vertical axis; the sensor's x axis points outwards, y upwards."""
    c, s = np.cos(rate_radps * times_s), np.sin(rate_radps * times_s)
    zero = np.zeros_like(c)
    turns = np.stack([c, zero, s, zero, zero - 1, zero, s, zero, -c], axis=1).reshape(-1, 3, 3)
    return path_of(times_s, radius_m * turns[:, :, 0], turns)


def wobbling(times_s: np.ndarray) -> RigidPath:
    """A smooth path on which everything changes, below 1.5 Hz."""
    place = [np.sin(w * times_s + w) / w for w in (3.0, 5.0, 7.0)]
    turns = Rotation.from_rotvec(np.stack([np.sin(w * times_s) for w in (2.0, 4.0, 6.0)], axis=1))
    return path_of(times_s, np.stack(place, axis=1), turns.as_matrix())
