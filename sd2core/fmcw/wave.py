"""Beat signals of a radar and a moving mesh: the sum of the echoes on every path."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.cutting import pieces_of
from sd2core.fmcw.kernels import NEAREST_M, facet_echoes
from sd2core.fmcw.options import Antenna, Reflector, WaveOptions, paths
from sd2core.fmcw.scene import FacetsSeen, MeshScene
from sd2core.fmcw.sums import Echoes, direct, nufft
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.walls import Wall
from sd2core.radar_config import RadarConfig
from sd2core.scattering.beam import angles_deg, one_way
from sd2core.scattering.beam_kernels import beam_tables
from sd2core.scattering.facets import facets_before, visible_facets
from sd2core.sensor import VirtualSensor

GoOn = Callable[[], None]
"""Called every few ten milliseconds; raises when the result is no longer wanted."""

BeatSignal = NDArray[Any]
"""Samples (receivers, chirps, samples): float64, or complex128 where a radar samples I and Q."""

_LONGEST_PIECE_M = 0.1
"""Of a thing: over it neither its direction nor its range changes much."""

_STEADY_S = 1.0 / 30.0
"""Longest frame with one velocity; in longer ones, as of Wi-Fi, an arm turns round."""

_NO_PLANE = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class _Pieces:
    """P small triangles of things, each with corners of its own."""

    corners_m: NDArray[np.float64]  # (3 P, 3)
    faces: NDArray[np.int32]  # (P, 3)
    centres_m: NDArray[np.float64]  # (P, 3)
    # (P,), facing the sensor and hidden by no thing: directly, and by way of each wall
    seen: Mapping[Wall | None, NDArray[np.bool_]]
    phases: NDArray[np.complex128]  # (P,)


class WaveScene:
    """Moving meshes, which have faces, and radar with the wave propagation between them.

    In a scene of several bodies each is a scene of its own (``bodies``), this one the first; the
    signal is the sum of all. The sensor is the transmitter, with its boresight. ``visibility`` is
    as for :class:`~sd2core.fmcw.scene.MeshScene`; an array is of the first body, and what is seen
    of the others is found. ``seed`` is that of the random phases of a rough surface, and
    ``number`` that of a body in them.
    """

    def __init__(
        self,
        mesh: MeshSequence,
        config: RadarConfig,
        sensor: VirtualSensor,
        visibility: FacetsSeen = "facing",
        wave: WaveOptions | None = None,
        seed: int = 0,
        number: int = 0,
    ) -> None:
        self.scene = MeshScene(mesh, config, sensor, visibility)
        self.config = config
        self.wave = wave or WaveOptions()
        if sensor.beam is not None and self.wave.beam_width_deg is not None:
            raise Sd2Error(
                f"The sensor has a beam of {sensor.beam.words}, and the wave one of"
                f" {self.wave.beam_width_deg:g}°",
                "one of the two",
            )
        self._seed = seed
        self._tables = beam_tables(sensor)
        if self.scene.walls and self.wave.mirror is not None:
            raise Sd2Error("Both the scene and the wave have a mirror", "one of the two")
        self.paths = paths(sensor, config, self.wave, self.scene.walls)
        faces = mesh.faces
        assert faces is not None  # MeshScene refuses a mesh without
        self.faces = faces
        self._random: NDArray[np.complex128] | None = None
        if not self.wave.coherent:
            # Three words, so that no frame's noise has the same stream.
            words = [seed, 0, 1, *([number] if number else [])]
            self._random = np.exp(2j * np.pi * np.random.default_rng(words).random(len(faces)))
        others = "exact" if isinstance(visibility, np.ndarray) else visibility
        self.bodies: tuple[WaveScene, ...] = (
            self,
            *(
                WaveScene(
                    replace(body, surroundings=mesh.surroundings),
                    *(config, sensor, others, wave, seed, number),
                )
                for number, body in enumerate(mesh.others, 1)
            ),
        )
        scenes = [one.scene for one in self.bodies]
        for one in scenes if len(scenes) > 1 else ():
            one.others = tuple(other for other in scenes if other is not one)

    def is_present(self, time_s: float) -> bool:
        """True if anybody is there in the mesh frames on both sides of an instant."""
        return any(one.scene.is_present(time_s) for one in self.bodies)

    def frame(self, time_s: float, go_on: GoOn | None = None) -> BeatSignal:
        """Beat signal of the frame around a time, (receivers, chirps, samples).

        Zero where there is no person.
        """
        return np.sum([one._own_frame(time_s, go_on) for one in self.bodies], axis=0)

    def _own_frame(self, time_s: float, go_on: GoOn | None) -> BeatSignal:
        """Beat signal of this body alone, among the others."""
        if not self.scene.is_present(time_s):
            return self.silence()
        seen = self.scene.seen(time_s)
        rows = [
            self._signal(position, velocity, seen, chirps, go_on)
            for (position, velocity), chirps in self.bursts(time_s)
        ]
        return rows[0] if len(rows) == 1 else np.concatenate(rows, axis=1)

    def silence(self, chirps: int | None = None) -> BeatSignal:
        """Zero beat signal of a frame, or of some of its chirps, without echoes."""
        sampled = np.float64 if self.config.sampling == "real" else np.complex128
        chirps = chirps or self.config.chirps_per_frame
        return np.zeros((len(self.paths), chirps, self.config.samples_per_chirp), sampled)

    def sampled(self, total: NDArray[np.complex128]) -> BeatSignal:
        """Samples that the radar takes of a sum of phasors."""
        return total.real if self.config.sampling == "real" else total

    def bursts(self, time_s: float) -> Iterator[tuple[tuple[NDArray[np.float64], ...], int]]:
        """Yield vertices and velocities, and the number of chirps of a frame that they hold for."""
        chirps, step_s = self.config.chirps_per_frame, self.config.chirp_repetition_s
        pieces = math.ceil(2.0 * chirps * step_s / _STEADY_S)
        if self.wave.motion == "interpolated":
            pieces = chirps
        elif pieces <= 2:
            yield self.scene.moving(time_s), chirps
            return
        places = np.arange(chirps, dtype=np.float64) - 0.5 * (chirps - 1)
        parts = np.array_split(time_s + places * step_s, min(pieces, chirps))
        middles_s = np.array([part.mean() for part in parts])
        for moving, part in zip(self.scene.between(middles_s), parts, strict=True):
            yield moving, len(part)

    def echoes(
        self,
        position_m: NDArray[np.float64],
        velocity_mps: NDArray[np.float64],
        visible: NDArray[np.bool_] | None,
        receiver: int = 0,
        faces: NDArray[np.int32] | None = None,
        wall: Wall | None = None,
    ) -> Echoes:
        """Echoes of every facet on the paths to one receiver, directly or by way of a wall.

        Parameters
        ----------
        position_m, velocity_mps : float64 array, shape (V, 3)
            Of the vertices, in the middle of the frame, or at a chirp.
        visible : bool array, shape (F,), or None
            Facets that nothing hides; None: all. Of these, those that face both antennas echo.
        receiver : int
        faces : int32 array, shape (F, 3), optional
            Others than the mesh's own belong to other vertices, and are for a smooth surface: the
            phases of a rough one belong to its facets.
        wall : Wall, optional
            One of the scene's.
        """
        assert faces is None or self._random is None
        faces = self.faces if faces is None else faces
        parts = [
            self.facets(position_m, velocity_mps, faces, visible, out, back, self._random)[0]
            for out, back in self.paths[receiver][wall]
        ]
        return _joined(parts)

    def static(self, reflectors: tuple[Reflector, ...]) -> BeatSignal:
        """Beat signal of static points and of things, (receivers, chirps, samples).

        As if there were no body; see :meth:`shadow`. Things are rough, whatever the body's surface
        is: a large smooth plane would echo in one direction only.
        """
        signal = self.silence()
        if reflectors:
            for receiver, ways in enumerate(self.paths):
                parts = [
                    self._points(reflectors, *pair) for pairs in ways.values() for pair in pairs
                ]
                signal[receiver] = self.sampled(direct(_joined(parts), self.config))
        if self._pieces is not None:
            signal += self._of_pieces(self._pieces.seen[None])
        return signal

    def shadow(self, time_s: float) -> BeatSignal | None:
        """Beat signal of what bodies hide of things in the frame around a time; None if nothing.

        It is missing from the frame's signal, and part of :meth:`static`. What is hidden from the
        sensor echoes by way of no wall, either.
        """
        pieces = self._pieces
        if pieces is None:
            return None
        hidden = pieces.seen[None] & self.scene.hidden_by_bodies(time_s, pieces.centres_m)
        return self._of_pieces(hidden) if hidden.any() else None

    @cached_property
    def _pieces(self) -> _Pieces | None:
        """Surfaces of things in small pieces."""
        around = self.scene.mesh.surroundings
        if around is None or not around.things:
            return None
        triangles = pieces_of(around, min(self.config.range_resolution_m, _LONGEST_PIECE_M))
        corners = triangles.reshape(-1, 3)
        faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
        place_m = np.asarray(self.scene.sensor.position_m)
        seen: dict[Wall | None, NDArray[np.bool_]] = {}
        seen[None] = visible_facets(corners, faces, place_m)
        for wall in self.scene.walls:
            image_m, surface = wall.mirrored(place_m), around.by_way_of(wall)
            also = visible_facets(corners, faces, image_m)
            also &= facets_before(corners, faces, image_m, surface)
            seen[wall] = seen[None] & also
        turns = np.random.default_rng([self._seed, 0, 2]).random(len(faces))
        return _Pieces(corners, faces, triangles.mean(axis=1), seen, np.exp(2j * np.pi * turns))

    def _of_pieces(self, chosen: NDArray[np.bool_]) -> BeatSignal:
        """Beat signal of some pieces of things that are seen, (receivers, chirps, samples)."""
        pieces, signal = self._pieces, self.silence()
        assert pieces is not None
        corners, faces, phases = pieces.corners_m, pieces.faces, pieces.phases
        still = np.zeros_like(corners)
        for receiver, ways in enumerate(self.paths):
            parts = [
                self.facets(corners, still, faces, chosen & pieces.seen[wall], out, back, phases)[0]
                for wall, pairs in ways.items()
                for out, back in pairs
            ]
            signal[receiver] = self.sampled(nufft(_joined(parts), self.config))
        return signal

    def _signal(
        self,
        position_m: NDArray[np.float64],
        velocity_mps: NDArray[np.float64],
        seen: dict[Wall | None, NDArray[np.bool_] | None],
        chirps: int,
        go_on: GoOn | None,
    ) -> BeatSignal:
        signal = self.silence(chirps)
        for receiver in range(len(self.paths)):
            if go_on is not None:
                go_on()
            echoes = _joined(
                [
                    self.echoes(position_m, velocity_mps, visible, receiver, wall=wall)
                    for wall, visible in seen.items()
                ]
            )
            if self.wave.model == "direct":
                total = direct(echoes, self.config, chirps, go_on)
            else:
                total = nufft(echoes, self.config, self.wave.blocks, chirps)
            signal[receiver] = self.sampled(total)
        return signal

    def facets(
        self,
        position_m: NDArray[np.float64],
        velocity_mps: NDArray[np.float64],
        faces: NDArray[np.int32],
        visible: NDArray[np.bool_] | None,
        out: Antenna,
        back: Antenna,
        phases: NDArray[np.complex128] | None,
    ) -> tuple[Echoes, NDArray[np.int32]]:
        """Echoes on one path and their facets, of a rough surface with phases, or a smooth one."""
        visible = np.ones(len(faces), np.bool_) if visible is None else visible
        count = int(np.count_nonzero(visible))
        index = np.empty(count, np.int32)
        range_m, rate_mps = np.empty(count), np.empty(count)
        # Interpolated motion has every chirp's own corners.
        turning = phases is None and self.wave.motion == "constant"
        amplitude = np.empty((3 if turning else 1, count), np.complex128)
        facing = facet_echoes(
            position_m,
            velocity_mps,
            faces,
            visible,
            np.vstack([out.position_m, out.axes]),
            np.vstack([back.position_m, back.axes]),
            _plane_of(out, back),
            4.0 * np.pi / self.config.wavelength_m,
            self.wave.pattern_exponent,
            self._tables.across,
            self._tables.up,
            phases is None,
            0.5 * self.config.chirps_per_frame * self.config.chirp_repetition_s,
            index,
            range_m,
            rate_mps,
            amplitude,
        )
        strength = amplitude[:, :facing] * (out.gain * back.gain)
        if phases is not None:
            strength *= phases[index[:facing]]
        return Echoes(range_m[:facing], rate_mps[:facing], strength), index[:facing]

    def _points(self, reflectors: tuple[Reflector, ...], out: Antenna, back: Antenna) -> Echoes:
        position = np.array([reflector.position_m for reflector in reflectors])
        area = np.array([reflector.area_m2 for reflector in reflectors])
        strength = area * (out.gain * back.gain)
        range_m = np.zeros(len(area))
        for antenna in (out, back):
            away = position - antenna.position_m
            distance_m = np.linalg.norm(away, axis=1)
            range_m += 0.5 * distance_m
            near_m = np.maximum(distance_m, NEAREST_M)
            strength /= near_m
            if self.wave.pattern_exponent > 0:
                cosine = np.maximum(away @ antenna.axes[2] / near_m, 0.0)
                strength *= cosine ** (0.5 * self.wave.pattern_exponent)
            if (beam := self.scene.sensor.beam) is not None:
                strength *= np.sqrt(one_way(beam, *angles_deg(antenna.axes, away.T)))
        plane = _plane_of(out, back)
        strength *= position @ plane[:3] + plane[3] > 0
        return Echoes(range_m, np.zeros(len(area)), strength.astype(np.complex128))


def _plane_of(out: Antenna, back: Antenna) -> NDArray[np.float64]:
    """Plane that the path between two antennas is before."""
    image = out if out.plane is not None else back
    return _NO_PLANE if image.plane is None else image.plane


def _joined(parts: list[Echoes]) -> Echoes:
    return Echoes(
        np.concatenate([part.range_m for part in parts]),
        np.concatenate([part.rate_mps for part in parts]),
        np.concatenate([part.terms for part in parts], axis=1),
    )
