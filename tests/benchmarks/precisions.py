"""What single precision gets wrong, and what double costs: measured for benchmark and page."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from oracles.counting import relative_range

from sd2core.doppler import PRESETS, Synthesizer, prepared
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.precision import SHARE_OF_A_BIN, velocity_error_mps
from sd2core.scattering.velocity import radial_velocity
from sd2core.sensor import VelocityAxis, VirtualSensor

CAMERA = VirtualSensor()
AWAY_M = (0.0, 10.0, 100.0, 1e3, 1e4)


@dataclass(frozen=True)
class Wrong:
    """Error of the worst vertex's velocity so far from the clip's origin, in bins."""

    away_m: float
    predicted: float
    single: float
    double: float

    @property
    def used(self) -> str:
        """The precision that such a place is counted in."""
        return "single" if self.predicted <= SHARE_OF_A_BIN else "double"


@dataclass(frozen=True)
class Cost:
    """Shortest time for a whole clip in each precision, in ms per frame, all cores."""

    what: str
    single_ms: float
    double_ms: float

    @property
    def ratio(self) -> float:
        """Double to single."""
        return self.double_ms / self.single_ms


def errors(mesh: MeshSequence) -> list[Wrong]:
    """Two frames of the mesh, moved away, against extended precision."""
    axis, start = VelocityAxis(), mesh.frame_count // 2
    duration_s = float(mesh.times_s[start + 2] - mesh.times_s[start])
    before, after = (mesh.frame(k).T.astype(np.float64) for k in (start, start + 2))
    middle = before.mean(axis=1, keepdims=True)
    found = []
    for away_m in AWAY_M:
        offset = away_m * np.array([[0.6], [0.0], [0.8]]) - middle
        ends = before + offset, after + offset
        sensor = (offset + middle).ravel() - np.array([0.0, 0.0, 2.2])
        one, two = (end.astype(np.longdouble) for end in ends)
        truth = radial_velocity(one, two, sensor, duration_s)
        extent_m = max(float(np.abs(end).max()) for end in ends)
        in_bins = (
            error_mps / axis.bin_width_mps
            for error_mps in (
                velocity_error_mps(extent_m, duration_s),
                _error_mps(np.float32, ends, sensor, duration_s, truth),
                _error_mps(np.float64, ends, sensor, duration_s, truth),
            )
        )
        found.append(Wrong(away_m, *in_bins))
    return found


def _error_mps(
    precision: Any,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    sensor: NDArray[np.float64],
    duration_s: float,
    truth: NDArray[Any],
) -> float:
    first, last = (relative_range(end.astype(precision), sensor) for end in ends)
    return float(np.abs((first - last).astype(np.float64) / duration_s - truth).max())


def in_both_precisions(mesh: MeshSequence) -> tuple[Synthesizer, Synthesizer]:
    """The mesh as it is counted, and with double precision forced on it; all is ready."""
    single = _ready(mesh)
    with patch.object(prepared, "single_is_enough", lambda **_: False):
        double = _ready(mesh)
    for maker, precision in ((single, np.float32), (double, np.float64)):
        assert maker.prepared.block(0).frames.positions.dtype == precision
    return single, double


def _ready(mesh: MeshSequence) -> Synthesizer:
    maker = Synthesizer(mesh, PRESETS["paper"])
    maker.prepare()
    maker.map(CAMERA)  # its masks are kept
    maker.map(CAMERA, visibility="facing")  # and its normals
    return maker


def costs(makers: tuple[Synthesizer, Synthesizer], rounds: int = 8) -> list[Cost]:
    """A whole clip counted in three ways, the two precisions in turns."""
    moves = itertools.count(1)

    def moved(maker: Synthesizer) -> Any:
        return maker.map(VirtualSensor((1e-3 * next(moves), 0.0, 0.0)))

    ways: dict[str, Callable[[Synthesizer], Any]] = {
        "mask kept": lambda maker: maker.map(CAMERA),
        "facing test": lambda maker: maker.map(CAMERA, visibility="facing"),
        "exact, sensor moved": moved,
    }
    found = []
    for what, work in ways.items():
        spent = np.array([[_spent_ms(work, maker) for maker in makers] for _ in range(rounds)])
        single_ms, double_ms = (spent.min(axis=0) / makers[0].mesh.frame_count).tolist()
        found.append(Cost(what, single_ms, double_ms))
    return found


def _spent_ms(work: Callable[[Synthesizer], Any], maker: Synthesizer) -> float:
    start = time.perf_counter()
    work(maker)
    return 1e3 * (time.perf_counter() - start)
