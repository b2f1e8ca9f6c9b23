"""Small sources whose values are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sd2core.datasets.source import Source
from sd2core.maps import DopplerMap, LimbMaps, MapKind
from sd2core.mesh.vertex_parts import JOINTS, PARTS, QUANTITIES
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

AXIS = VelocityAxis(8, 2.0)
LABELS = ("background", "left-to-right", "up-to-down")
CLASSES = {"left-to-right": "horizontal", "up-to-down": "vertical"}


def source(
    recording: str = "r1",
    subject: str = "anna",
    *,
    placement: int = 0,
    frames: int = 100,
    kinds: Sequence[MapKind] = ("synthetic", "denoised"),
    rate_hz: float = 30.0,
    times_s: np.ndarray | None = None,
    present: np.ndarray | None = None,
    label: np.ndarray | None = None,
    null_bins: tuple[int, ...] = (),
    limbs: bool = False,
) -> Source:
    """Random maps; the same arguments give the same values. Limb maps are of whole numbers."""
    rng = np.random.default_rng([*recording.encode(), *subject.encode(), placement, frames])
    clock = Timebase.regular(frames, rate_hz) if times_s is None else Timebase(times_s)
    maps = {
        kind: DopplerMap(
            rng.random((AXIS.bins, frames), np.float32),
            AXIS,
            clock,
            kind,
            unit="share of vertices" if kind == "synthetic" else "power",
            null_bins=null_bins,
            meta={"kind": kind, "per_frame": list(range(frames))},
            present=present,
        )
        for kind in kinds
    }
    if limbs:
        split = rng.integers(0, 100, (len(PARTS), AXIS.bins, frames)).astype(np.float32)
        moves = rng.normal(size=(len(JOINTS), len(QUANTITIES), frames)).astype(np.float32)
        maps["synthetic"] = replace(
            maps["synthetic"], values=split.sum(axis=0), limbs=LimbMaps(PARTS, split, moves)
        )
    if label is None:
        label = rng.integers(0, 3, frames).astype(np.int16)
    return Source(
        subject,
        recording,
        placement,
        VirtualSensor((0.1 * placement, 0.0, 0.0), azimuth_deg=5.0 * placement),
        maps,
        label,
        LABELS,
        CLASSES,
        target_m=(0.0, 0.0, 2.0),
        provenance={"from": recording},
    )
