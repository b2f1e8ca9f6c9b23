"""Space that a body takes up during a clip, and how well sensors around it cover it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.radar_config import RadarConfig
from sd2core.sensor import Vector, VirtualSensor

_SAMPLED_FRAMES = 100
_SAMPLED_VERTICES = 200
_FASTEST_SHARE = 0.01
_STRETCHES, _READ_BYTES = 200, 64 << 20


@dataclass(frozen=True, eq=False)
class SensorCoverage:
    """Distances and velocities of the body as seen from each of N sensors."""

    inside: NDArray[np.bool_]  # (N,); the sensor is in the box around the body at some time
    farthest_m: NDArray[np.float64]  # largest distance to a corner of that box at any time
    fastest_mps: NDArray[np.float64]
    """Radial velocity, without its sign, that 1 % of the vertices exceed in some frame."""

    def problems(self, radar: RadarConfig) -> dict[str, NDArray[np.bool_]]:
        """Masks of sensors in the body, and that see part of it too far or too fast for a radar."""
        return {
            "inside": self.inside,
            "out_of_range": self.farthest_m > radar.range_max_m,
            "aliasing": self.fastest_mps > radar.v_max_mps,
        }

    def beyond(self, radar: RadarConfig) -> NDArray[np.bool_]:
        """Mask of sensors that are unsuitable for any of these reasons."""
        return np.logical_or.reduce(list(self.problems(radar).values()))


@dataclass(frozen=True, eq=False)
class BodyExtent:
    """Places of a body in up to 100 frames with a person, spread over the clip, and its motion."""

    target_m: Vector
    """Point at which sensors aim: the mean over time of the median vertex, which lies in the torso
    however the limbs move."""
    low_m: NDArray[np.float64]  # (n, 3), corners of the box around the body
    high_m: NDArray[np.float64]
    mesh: MeshSequence

    @classmethod
    def of(cls, mesh: MeshSequence) -> BodyExtent:
        """Extent of the body in a clip, which is read frame by frame.

        Raises Sd2Error if no frame has a person.
        """
        valid = np.flatnonzero(mesh.presence.present)
        if not len(valid):
            raise Sd2Error(
                f"{mesh.source or 'The mesh'} has a person in no frame",
                "a person to place sensors around",
            )
        picked = valid[np.linspace(0, len(valid) - 1, min(len(valid), _SAMPLED_FRAMES)).astype(int)]
        middle, low, high = np.empty((3, len(picked), 3))
        for row, frame in enumerate(picked.tolist()):
            vertices = mesh.frame(frame)
            middle[row] = np.median(vertices, axis=0)
            low[row], high[row] = vertices.min(axis=0), vertices.max(axis=0)
        x, y, z = middle.mean(axis=0).tolist()
        return cls((x, y, z), low, high, mesh)

    @cached_property
    def _motion(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Places and velocities, (n, k, 3), in the fastest frames of 200 stretches or more."""
        mesh, passed_s = self.mesh, np.diff(self.mesh.times_s)
        stride = -(-mesh.vertex_count // _SAMPLED_VERTICES)
        sampled = len(range(0, mesh.vertex_count, stride))
        count = max(_STRETCHES, mesh.frame_count * mesh.vertex_count * 12 // _READ_BYTES)
        points, velocity = np.zeros((2, count, sampled, 3), np.float32)
        for row, part in enumerate(np.array_split(np.arange(len(passed_s)), count)):
            if len(part := part[mesh.presence.last[part] > part]):
                block, at = mesh.read(int(part[0]), int(part[-1]) + 2)[:, ::stride], part - part[0]
                moved = (block[at + 1] - block[at]) / passed_s[part, None, None]
                fastest = _all_but_fastest(np.linalg.norm(moved, axis=2)).argmax()
                points[row], velocity[row] = block[at[fastest]], moved[fastest]
        return points, velocity

    def surrounds(self, sensor: VirtualSensor) -> bool:
        """True if the sensor is in the box around the body, in one of the frames."""
        position = np.asarray(sensor.position_m)
        within = (self.low_m < position) & (position < self.high_m)  # (frames, 3)
        return bool(within.all(axis=1).any())

    def coverage(
        self, sensors: Sequence[VirtualSensor], progress: Progress = silent
    ) -> SensorCoverage:
        """Coverage of the body by sensors; the clip is read once, for whatever sensors."""
        inside = np.zeros(len(sensors), dtype=bool)
        farthest_m, fastest_mps = np.zeros((2, len(sensors)))
        points_m, velocity_mps = self._motion
        for number, sensor in enumerate(sensors):
            progress(number, len(sensors))
            position = np.asarray(sensor.position_m)
            inside[number] = self.surrounds(sensor)
            corner = np.maximum(np.abs(self.low_m - position), np.abs(self.high_m - position))
            farthest_m[number] = np.linalg.norm(corner, axis=1).max()
            sight_m = points_m - position.astype(np.float32)
            range_m = np.sqrt(np.einsum("nki,nki->nk", sight_m, sight_m))
            radial_mps = np.abs(np.einsum("nki,nki->nk", velocity_mps, sight_m))
            radial_mps /= np.maximum(range_m, 1e-9)
            fastest_mps[number] = _all_but_fastest(radial_mps).max()
        progress(len(sensors), len(sensors))
        return SensorCoverage(inside, farthest_m, fastest_mps)


def _all_but_fastest(speed: NDArray[np.floating]) -> NDArray[np.floating]:
    """Of each frame's vertices (n, k) the speed that 1 % are above, (n,)."""
    rank = int(np.ceil((1.0 - _FASTEST_SHARE) * speed.shape[1])) - 1
    return np.partition(speed, rank, axis=1)[:, rank]


def notes_on(
    mesh: MeshSequence, sensor: VirtualSensor, radar: RadarConfig | None = None
) -> tuple[str, ...]:
    """Sentences on a sensor in the box around a body, and on what of one folds for a radar."""
    notes = []
    for person, body in zip(mesh.persons, mesh.bodies, strict=True):
        if not body.presence.present.any():
            continue
        extent = BodyExtent.of(body)
        whose = f" of {person}" if mesh.others else ""
        if extent.surrounds(sensor):
            notes.append(
                f"The sensor stands in the box around the body{whose}: what is nearest outweighs"
                " all else."
            )
        if radar is None:
            continue
        seen = extent.coverage((sensor,))  # which reads the whole clip
        problems = seen.problems(radar)
        if problems["out_of_range"][0]:
            turned = ", and velocities have the wrong sign" if radar.sampling == "real" else ""
            notes.append(
                f"The body{whose} is up to {seen.farthest_m[0]:.1f} m away: beyond"
                f" {radar.range_max_m:.1f} m this radar's beat frequencies fold, so that it seems"
                f" to be nearer{turned}."
            )
        if problems["aliasing"][0]:
            notes.append(
                f"The body{whose} is as fast as {seen.fastest_mps[0]:.1f} m/s: beyond"
                f" {radar.v_max_mps:.1f} m/s this radar's velocities fold."
            )
    return tuple(notes)
