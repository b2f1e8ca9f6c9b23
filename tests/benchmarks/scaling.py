"""How cost and memory grow with vertices, frames and sensor places."""

from __future__ import annotations

import gc
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

BUDGET_BYTES = 512 << 20
"""The default, for prepared frames and masks: memory beyond it must not grow with the clip."""

_FPS = 30.0
_SHAPE_M = (0.25, 0.85, 0.15)


class Swaying:
    """Vertices (T, V, 3) of a body-sized ellipsoid that sways; worked out when read."""

    dtype = np.dtype(np.float32)

    def __init__(self, rest_m: NDArray[np.float64], frames: int) -> None:
        self.rest_m = rest_m
        self.shape = (frames, len(rest_m), 3)

    def __getitem__(self, key: slice) -> NDArray[np.float32]:
        times_s = np.arange(self.shape[0])[key] / _FPS
        points = np.repeat(self.rest_m[None].astype(np.float32), len(times_s), axis=0)
        # The higher, the farther it leans: velocities of all sizes at once.
        lean_m = 0.5 * np.sin(2 * np.pi * 0.5 * times_s)
        points[:, :, 2] += (lean_m[:, None] * (0.85 - points[:, :, 1])).astype(np.float32)
        return points + np.array([0.0, 0.0, 2.5], np.float32)


def body(vertices: int, frames: int, scale: float = 1.0) -> MeshSequence:
    """An ellipsoid of about so many vertices, as large as a person or so many times."""
    around = max(4, round(np.sqrt(0.5 * vertices)))
    ball = trimesh.creation.uv_sphere(radius=1.0, count=[around, around])
    rest_m = np.asarray(ball.vertices) * (scale * np.array(_SHAPE_M))
    return MeshSequence(
        Swaying(rest_m, frames),
        np.asarray(ball.faces, np.int32),
        Timebase.regular(frames, _FPS),
        "swaying ellipsoid",
    )


@dataclass(frozen=True)
class Point:
    """One size, what it cost, and the most memory that was allocated at once."""

    size: int
    seconds: float
    peak_bytes: int


@dataclass(frozen=True)
class Scaling:
    """Cost along one dimension."""

    what: str
    unit: str
    points: tuple[Point, ...]

    @property
    def growth(self) -> tuple[float, ...]:
        """How cost grows from size to size, per factor of ten."""
        pairs = zip(self.points, self.points[1:], strict=False)
        return tuple((b.seconds / a.seconds) ** (1.0 / np.log10(b.size / a.size)) for a, b in pairs)


def scalings(visibility: str) -> Iterator[Scaling]:
    """Along vertices, frames and sensor places, tenfold each step."""
    warm_up()
    options = replace(PRESETS["paper"], visibility=visibility)
    here = VirtualSensor()

    def whole_map(mesh: MeshSequence) -> Callable[[], Any]:
        return lambda: Synthesizer(mesh, options, memory_budget_bytes=BUDGET_BYTES).map(here)

    meshes = [body(count, 16) for count in (1_000, 10_000, 100_000, 1_000_000)]
    yield Scaling(
        f"vertices, {visibility}",
        "vertices",
        tuple(point(mesh.vertex_count, whole_map(mesh)) for mesh in meshes),
    )
    yield Scaling(
        f"frames, {visibility}",
        "frames",
        tuple(point(frames, whole_map(body(2_000, frames))) for frames in (300, 3_000, 30_000)),
    )

    def from_places(count: int) -> Callable[[], Any]:
        def work() -> None:
            synthesizer = Synthesizer(body(2_000, 300), options, memory_budget_bytes=BUDGET_BYTES)
            for number in range(count):
                synthesizer.map(VirtualSensor((0.01 * number, 0.0, 0.0)))

        return work

    yield Scaling(
        f"sensor places, {visibility}",
        "sensor places",
        tuple(point(count, from_places(count)) for count in (3, 30, 300)),
    )


def point(size: int, work: Callable[[], Any]) -> Point:
    """Time it twice, the second time counts; then once more for its memory."""
    seconds = []
    for _ in range(2):
        gc.collect()
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    gc.collect()
    tracemalloc.start()
    try:
        work()
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    return Point(size, min(seconds), peak_bytes)
