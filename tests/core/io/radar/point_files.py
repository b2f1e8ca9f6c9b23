"""Tables of the points of a body that walks to and fro."""

from __future__ import annotations

from pathlib import Path

import numpy as np

STEP_MPS, FRAME_S, FRAMES, POINTS = 0.125, 0.1, 200, 12
NAMES = ("frame", "x", "y", "z", "doppler", "intensity")


def velocity_mps(frame: np.ndarray) -> np.ndarray:
    """Velocity of the body, positive when approaching: multiples of the radar's step."""
    return STEP_MPS * np.rint(10.0 * np.sin(2.0 * np.pi * frame / 50.0))


def walk(sign: int = 1, frames: np.ndarray | None = None) -> np.ndarray:
    """Points of a body that walks to and fro, (P, 6) as NAMES; ``sign`` 1: receding is positive."""
    rng = np.random.default_rng(3)
    numbers = np.arange(FRAMES) if frames is None else frames
    steps = velocity_mps(np.arange(numbers.max() + 1))
    distance = 4.0 - np.cumsum(steps) * FRAME_S
    frame = np.repeat(numbers, POINTS)
    place = rng.normal(0.0, 0.05, (len(frame), 3)) + np.stack(
        [0.2 * distance[frame], np.sqrt(0.96) * distance[frame], np.zeros(len(frame))], axis=1
    )
    doppler = -sign * velocity_mps(frame)
    intensity = rng.integers(5, 90, len(frame)).astype(float)
    return np.column_stack([frame, place, doppler, intensity])


def write_csv(
    path: Path, table: np.ndarray, titles: tuple[str, ...] = NAMES, by: str = ","
) -> Path:
    lines = [by.join(titles)] if titles else []
    lines += [by.join(f"{value:.6g}" for value in row) for row in table]
    path.write_text("\n".join(lines) + "\n")
    return path
