"""What comes by way of a wall, vertex by vertex and segment by segment, to compare maps with.

No images: the point of the wall where a wave is mirrored is found from the heights above it, and
each part of the way is tested against every triangle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.walls import Wall
from sd2core.scattering.beam import angles_deg, one_way, sensor_axes
from sd2core.sensor import VirtualSensor

Point = NDArray[np.float64]


def bounce(wall: Wall, one: Point, other: Point) -> Point:
    """Point of the wall at which a wave from one point to another is mirrored."""
    normal = wall.outward
    high, low = wall.distance_m - one @ normal, wall.distance_m - other @ normal
    foot, other_foot = one + high * normal, other + low * normal
    return np.asarray(foot + high / (high + low) * (other_foot - foot))


def free(start: Point, end: Point, triangles: NDArray[np.float64]) -> bool:
    """True if no triangle (F, 3, 3) crosses the segment, its ends left out."""
    a, way = triangles[:, 0], end - start
    edge, other = triangles[:, 1] - a, triangles[:, 2] - a
    across = np.cross(way, other)
    volume = (edge * across).sum(axis=1)
    parallel = np.abs(volume) < 1e-12
    volume[parallel] = 1.0
    u = ((start - a) * across).sum(axis=1) / volume
    turned = np.cross(start - a, edge)
    v, along = turned @ way / volume, (turned * other).sum(axis=1) / volume
    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 1e-5) & (along < 1 - 1e-5)
    return not (inside & ~parallel).any()


def echoes_by_way_of(
    wall: Wall, mesh: MeshSequence, sensor: VirtualSensor, frame: int, exponent: float
) -> NDArray[np.float64]:
    """Velocities and powers (V, 2) by way of a wall in a frame that has one on either side.

    Powers are in units of what a vertex sends back directly over 1 m; those that are not seen
    are 0.
    """
    place = np.asarray(sensor.position_m)
    duration_s = mesh.times_s[frame + 1] - mesh.times_s[frame - 1]
    before, now, after = (mesh.frame(frame + k).astype(np.float64) for k in (-1, 0, 1))
    around = mesh.surroundings
    assert mesh.faces is not None
    assert around is not None
    surfaces = [now[mesh.faces], around.vertices_m[around.faces]]
    triangles = np.concatenate(surfaces)

    def lengths(point: Point) -> tuple[float, float]:
        at = bounce(wall, place, point)
        by_wall = np.linalg.norm(at - place) + np.linalg.norm(point - at)
        return float(np.linalg.norm(point - place)), float(by_wall)

    found = np.zeros((len(now), 2))
    for v, point in enumerate(now):
        nearer = sum(lengths(before[v])) - sum(lengths(after[v]))
        found[v, 0] = 0.5 * nearer / duration_s
        at = bounce(wall, place, point)
        if wall.distance_m - point @ wall.outward <= 0:
            continue
        if not all(free(*legs, triangles) for legs in ((point, place), (point, at), (at, place))):
            continue
        direct, by_wall = lengths(point)
        power = 2.0 * 10 ** (-wall.loss_db / 10) * (1.0 / (direct * by_wall)) ** (exponent / 2)
        if sensor.beam is not None:
            for towards in (point, at):
                angles = angles_deg(sensor_axes(sensor), (towards - place)[:, None])
                power *= one_way(sensor.beam, *angles)[0]
        found[v, 1] = power
    return found
