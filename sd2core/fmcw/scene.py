"""Scene of an FMCW radar: facets of a moving mesh."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence, refuse_missing
from sd2core.mesh.things import Surface
from sd2core.mesh.walls import Wall
from sd2core.radar_config import RadarConfig
from sd2core.scattering.behind_things import may_hide
from sd2core.scattering.facets import facets_before, points_behind, visible_facets
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

_BLOCK_FRAMES = 64


FacetsSeen = NDArray[np.bool_] | Literal["facing", "exact"]


def radar_times_s(timebase: Timebase, config: RadarConfig) -> NDArray[np.float64]:
    """Times of the radar frames that fit into a clip, from its first frame on."""
    step_s = config.frame_repetition_s
    span_s = float(timebase.times_s[-1]) - timebase.start_s
    steps = np.arange(int(span_s / step_s + 1e-6) + 1, dtype=np.float64)
    return timebase.start_s + steps * step_s


class MeshScene:
    """Moving mesh, which has faces, as seen by one radar.

    ``visibility``, (T, F), marks per mesh frame the facets that nothing hides from the sensor;
    ``"exact"`` finds them frame by frame as they are asked for, ``"facing"`` takes all whose normal
    points towards it. What stands around the mesh, and ``others`` beside it, hide facets in either
    case; of the mesh's own others it knows nothing (:class:`~sd2core.fmcw.wave.WaveScene` does).
    ``walls`` are those that the sensor is before.
    """

    def __init__(
        self,
        mesh: MeshSequence,
        config: RadarConfig,
        sensor: VirtualSensor,
        visibility: FacetsSeen = "facing",
    ) -> None:
        if mesh.faces is None:
            raise Sd2Error(
                f"{mesh.source or 'The mesh'} has no faces",
                "a surface: a radar signal is computed from facets",
                "Give the faces (--faces)",
            )
        expected = (mesh.frame_count, len(mesh.faces))
        if not isinstance(visibility, str) and visibility.shape != expected:
            raise Sd2Error(
                f"The visibility has shape {visibility.shape}",
                f"{expected}: one truth value per mesh frame and face",
            )
        self.mesh = mesh
        self.config = config
        self.sensor = sensor
        self.visibility = visibility
        self.others: tuple[MeshScene, ...] = ()
        around, place = mesh.surroundings, np.asarray(sensor.position_m)
        every = () if around is None else around.walls
        self.walls = tuple(wall for wall in every if wall.before_m(place) > 0)
        self._faces = mesh.faces
        self._first = 0
        self._block = np.empty((0, mesh.vertex_count, 3))
        self._reading = threading.Lock()

    def is_present(self, time_s: float) -> bool:
        """True if there is a person in the mesh frames around an instant, and no gap between."""
        presence, around = self.mesh.presence, list(self._around(time_s))
        return bool(presence.measured[around].all()) and len({*presence.first[around]}) == 1

    def moving(self, time_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Vertices at an instant and their velocity, (V, 3) each; from any thread."""
        half_s = self.mesh.timebase.frame_duration_s
        first, last = (float(self.mesh.times_s[frame]) for frame in self._stretch(time_s))
        before, after = max(time_s - half_s, first), min(time_s + half_s, last)
        position = self._vertices(time_s)
        velocity = np.zeros_like(position)
        if after > before:
            velocity = (self._vertices(after) - self._vertices(before)) / (after - before)
        return position, velocity

    def visible(self, time_s: float) -> NDArray[np.bool_] | None:
        """Mask of the facets that nothing hides, (F,); None if only the facing test applies."""
        around = self.mesh.surroundings
        hiding = [around.surface] if around is not None and around.things else []
        if others := self._others_at(time_s):
            own, place_m = _box(self.surface(time_s)), np.array(self.sensor.position_m)
            hiding += [one for one in others if may_hide(_box(one), own, place_m)]
        if not hiding and isinstance(self.visibility, str) and self.visibility == "facing":
            return None
        place, vertices_m = self.sensor.position_m, self._nearest(time_s)
        seen = np.ones(len(self._faces), np.bool_)
        if not isinstance(self.visibility, str):
            seen = np.asarray(self.visibility[self._number_of(time_s)])
        elif self.visibility == "exact":
            seen = visible_facets(vertices_m, self._faces, place)
        for surface in hiding:
            seen = seen & facets_before(vertices_m, self._faces, place, surface)
        return seen

    def seen(self, time_s: float) -> dict[Wall | None, NDArray[np.bool_] | None]:
        """Masks of the facets that nothing hides: directly, and by way of each wall."""
        direct = self.visible(time_s)
        masks: dict[Wall | None, NDArray[np.bool_] | None] = {None: direct}
        for wall in self.walls:
            masks[wall] = self._seen_by_way_of(wall, time_s, direct)
        return masks

    def _seen_by_way_of(
        self, wall: Wall, time_s: float, direct: NDArray[np.bool_] | None
    ) -> NDArray[np.bool_] | None:
        """What of that which the sensor sees its image behind a wall sees, too."""
        around = self.mesh.surroundings
        others = self._others_at(time_s)
        if around is None or (direct is None and not others):
            return direct
        seen = np.ones(len(self._faces), np.bool_) if direct is None else direct
        vertices_m = self._nearest(time_s)
        image_m = wall.mirrored(np.asarray(self.sensor.position_m))
        body = None
        if not (isinstance(self.visibility, str) and self.visibility == "facing"):
            seen = seen & visible_facets(vertices_m, self._faces, image_m)
            body = vertices_m, self._faces
        surface = around.by_way_of(wall, body, others)
        return seen & facets_before(vertices_m, self._faces, image_m, surface)

    def _others_at(self, time_s: float) -> list[Surface]:
        """Surfaces of the others who are there at an instant."""
        return [other.surface(time_s) for other in self.others if other.is_present(time_s)]

    def surface(self, time_s: float) -> Surface:
        """Vertices (V, 3) and faces in the mesh frame nearest to an instant."""
        return self._nearest(time_s), self._faces

    def hidden_by_bodies(self, time_s: float, points_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Points (n, 3) that this body or another hides at an instant, (n,)."""
        hidden = np.zeros(len(points_m), np.bool_)
        for body in (self, *self.others):
            if body.is_present(time_s):
                hidden |= points_behind(*body.surface(time_s), self.sensor.position_m, points_m)
        return hidden

    def between(self, times_s: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.float64], ...]]:
        """Interpolate vertices and velocity at some times, on a smooth path through the frames.

        Cubic Hermite with the central differences of the frames (Catmull-Rom);
        straight on before the first and after the last frame of the stretch with a person
        in it that the middle of the times lies in.
        """
        times = self.mesh.times_s
        if len(times) == 1:
            yield from map(self.moving, times_s)
            return
        first, last = self._stretch(0.5 * float(times_s[0] + times_s[-1]))
        known_s = np.clip(times_s, times[first], times[last])
        for time_s, beyond_s in zip(known_s, times_s - known_s, strict=True):
            left = int(np.clip(np.searchsorted(times, time_s) - 1, first, last - 1))
            step_s = times[left + 1] - times[left]
            u = (time_s - times[left]) / step_s
            a, b = self._frame(left), self._frame(left + 1)
            slope_a, slope_b = step_s * self._slope(left), step_s * self._slope(left + 1)
            change = b - a
            bend = slope_a + slope_b - 2.0 * change
            turn = change - slope_a - bend
            position = a + u * (slope_a + u * (turn + u * bend))
            velocity = (slope_a + u * (2.0 * turn + 3.0 * u * bend)) / step_s
            yield position + beyond_s * velocity, velocity

    def _slope(self, index: int) -> NDArray[np.float64]:
        """Central difference of the frames around one, one-sided at the ends."""
        presence, times = self.mesh.presence, self.mesh.times_s
        low, high = max(index - 1, presence.first[index]), min(index + 1, presence.last[index])
        return (self._frame(high) - self._frame(low)) / (times[high] - times[low])

    def _stretch(self, time_s: float) -> tuple[int, int]:
        """First and last mesh frame of the part with a person that an instant lies in."""
        presence, frame = self.mesh.presence, next(iter(self._around(time_s)))
        return int(presence.first[frame]), int(presence.last[frame])

    def _number_of(self, time_s: float) -> int:
        """Number of the mesh frame nearest to an instant."""
        first, last = self._stretch(time_s)
        return min(max(self.mesh.timebase.nearest_frame(time_s), first), last)

    def _nearest(self, time_s: float) -> NDArray[np.float64]:
        return self._frame(self._number_of(time_s))

    def _around(self, time_s: float) -> dict[int, float]:
        """Interpolate linearly at an instant: one or two mesh frames and their weights."""
        times = self.mesh.times_s
        if len(times) == 1:
            return {0: 1.0}
        right = int(np.clip(np.searchsorted(times, time_s), 1, len(times) - 1))
        share = float(
            np.clip((time_s - times[right - 1]) / (times[right] - times[right - 1]), 0, 1)
        )
        # Within rounding of a frame's time that frame is meant.
        if share < 1e-6 or share > 1 - 1e-6:
            return {right - 1 if share < 0.5 else right: 1.0}
        return {right - 1: 1.0 - share, right: share}

    def _vertices(self, time_s: float) -> NDArray[np.float64]:
        around = self._around(time_s).items()
        return np.sum([share * self._frame(frame) for frame, share in around], axis=0)

    def _frame(self, index: int) -> NDArray[np.float64]:
        with self._reading:
            if not self._first <= index < self._first + len(self._block):
                # A few frames back, because a velocity reaches back.
                first = max(index - 4, 0)
                stop = min(first + _BLOCK_FRAMES, self.mesh.frame_count)
                block = self.mesh.read(first, stop).astype(np.float64)
                refuse_missing(block, first, self.mesh.source)
                self._first, self._block = first, block
            return self._block[index - self._first]


def _box(surface: Surface) -> NDArray[np.float64]:
    """Lowest and highest corner, (2, 3)."""
    return np.stack([surface[0].min(axis=0), surface[0].max(axis=0)])
