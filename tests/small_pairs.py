"""Pairs that a small model learns in seconds: the radar sees a moving ridge, the input its blur."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sd2core.maps import LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, PARTS, QUANTITIES
from sd2core.pairs.store import PairWriter, Take
from sd2core.sensor import VelocityAxis

BINS = 8
AXIS = VelocityAxis(BINS, 2.0)
LABELS = ("background", "swipe")


def ridge(frames: int, seed: int, gain: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Input (frames, bins), target likewise, label: a slow oscillation of the peak."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames) / 30.0
    centre = 1.5 * np.sin(2 * np.pi * time * rng.uniform(0.4, 0.6) + rng.uniform(0, 6))
    distance = AXIS.centres_mps[None] - centre[:, None]
    target = np.exp(-((distance / 0.4) ** 2))
    seen = np.exp(-(((distance - 0.6) / 0.8) ** 2)) + 0.02 * rng.random((frames, BINS))
    label = (np.abs(centre) > 1.0).astype(np.int8)
    return (gain * seen).astype(np.float32), (gain * target).astype(np.float32), label


def take(subject: str, name: str, frames: int, seed: int, placement: int = 0) -> Take:
    synthetic, radar, label = ridge(frames, seed)
    return Take(
        subject=subject,
        name=name,
        synthetic=synthetic,
        radar=radar,
        times_s=np.arange(frames) / 30.0,
        label=label,
        sensor_position_m=np.array([0.0, 0.0, 0.5 * placement]),
        placement=placement,
    )


def split(whole: Take) -> Take:
    """Return the take with limb maps: every part has a share of the map."""
    rng = np.random.default_rng(len(whole.times_s))
    shares = rng.dirichlet(np.ones(len(PARTS)))
    values = shares[:, None, None] * whole.synthetic.T
    moves = rng.normal(size=(len(JOINTS), len(QUANTITIES), len(whole.times_s)))
    return replace(whole, limbs=LimbMaps(PARTS, values, moves.astype(np.float32)))


def write_pairs(
    path: Path,
    subjects: tuple[str, ...] = ("s1", "s2", "s3"),
    *,
    takes: int = 2,
    frames: int = 150,
    kind: str = "simulated",
    null_bins: tuple[int, ...] = (),
    rate_hz: float = 30.0,
    axis: VelocityAxis = AXIS,
    labels: tuple[str, ...] = LABELS,
    placements: int = 1,
    limbs: bool = False,
    made_by: str = "a test",
    **provenance: object,
) -> Path:
    writer = PairWriter(
        path,
        kind=kind,  # type: ignore[arg-type]
        axis=axis,
        null_bins=null_bins,
        frame_rate_hz=rate_hz,
        labels=labels,
        provenance={"made_by": made_by, **provenance},
        parts=PARTS if limbs else (),
    )
    seed = 0
    for subject in subjects:
        for number in range(takes):
            for placement in range(placements):
                one = take(subject, f"t{number}", frames, seed, placement)
                writer.append(split(one) if limbs else one)
                seed += 1
    return path
