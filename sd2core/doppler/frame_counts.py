"""Counts of prepared frames for one sensor place: visible vertices, weights, bins.

What comes by way of walls is counted like the direct echoes, path by path, and added.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import histogram, vid2doppler
from sd2core.doppler.expected import SIGMA_FACTOR, count_expected, sigma_bins
from sd2core.doppler.histogram import Counts, Scatterers, counting_of
from sd2core.doppler.masks import Quality, Visibility, VisibilityMasks, position_of
from sd2core.doppler.moving import MovingVertices
from sd2core.doppler.moving_kernels import marked_counts_kernel
from sd2core.doppler.prepared import Block, PreparedMesh
from sd2core.mesh.walls import Wall
from sd2core.scattering.amplitude import range_weight
from sd2core.scattering.echo_paths import EchoPath, echo_paths, mean_distance_m
from sd2core.sensor import VirtualSensor


class FrameCounts:
    """Counts of the frames of a prepared mesh, block by block, for any sensor place."""

    def __init__(self, prepared: PreparedMesh) -> None:
        self.prepared = prepared
        self.mesh = prepared.mesh
        self.options = prepared.options
        self.counting = counting_of(prepared.options)
        self.masks = VisibilityMasks(prepared, self.counting)
        around = prepared.mesh.surroundings
        self._walls = () if around is None else around.walls
        self._by_way_of = {
            wall: VisibilityMasks(prepared, self.counting, wall) for wall in self._walls
        }

    def hide_by(self, others: tuple[PreparedMesh, ...]) -> None:
        """Let other bodies of the scene hide this one."""
        for masks in (self.masks, *self._by_way_of.values()):
            masks.others = others

    def paths(self, sensor: VirtualSensor) -> list[EchoPath]:
        """Ways of the echoes to a sensor; the first is the direct one."""
        return echo_paths(sensor, self._walls)

    def blocks_between(self, start: int, stop: int) -> list[tuple[int, int, int]]:
        """Blocks of frames ``start`` to ``stop``: number, first and last (exclusive) frame."""
        size = self.prepared.block_frames
        return [
            (index, max(start, index * size), min(stop, (index + 1) * size))
            for index in range(start // size, (stop - 1) // size + 1)
        ]

    def count(
        self,
        block: Block,
        rows: slice,
        sensor: VirtualSensor,
        visibility: Visibility,
        into: Counts,
        totals: NDArray[np.float64],
        parts: NDArray[np.uint8] | None = None,
        *,
        shares: bool = True,
    ) -> Quality:
        """Count some of a block's frames; returns the visibility that was used.

        Parameters
        ----------
        block : Block
            Of the prepared mesh.
        rows : slice
            Its n frames that are counted; start and stop are given.
        sensor : VirtualSensor
            Where it stands and looks.
        visibility : {"none", "facing", "depth", "exact", "frozen"}
            What is wished for.
        into : Counts
            Of n frames; written, zero at first.
        totals : float64 ndarray, (n,)
            Written: what the counts are shares of.
        parts : uint8 ndarray, (V,), optional
            Part of the body of every vertex, to count them apart; by default all together.
        shares : bool
            False if the number of visible vertices may be left out.
        """
        totals[:] = self.totals(block, rows)
        direct, *by_walls = self.paths(sensor)
        quality = self._count_path(block, rows, direct, visibility, into, parts, shares=shares)
        for path in by_walls:
            _, of_parts, bins = into.histogram.shape
            added = Counts.empty(len(totals), bins, of_parts)
            used = self._count_path(block, rows, path, visibility, added, parts, shares=False)
            into.histogram[:] += path.share * added.histogram
            quality = "facing" if used == "facing" else quality
        return quality

    def _count_path(
        self,
        block: Block,
        rows: slice,
        path: EchoPath,
        visibility: Visibility,
        into: Counts,
        parts: NDArray[np.uint8] | None,
        *,
        shares: bool,
    ) -> Quality:
        """Count what comes on one path, as :meth:`count` does."""
        prepared, ends = self.prepared, self.prepared.sensor(path.ends_m)
        moving = prepared.moving(block, self.counting)
        if moving is not None and not moving.hold_from(ends):
            moving = None
        if moving is None:
            block = prepared.whole(block)
        scatterers, quality = self.scatterers(block, rows, path, visibility, parts, moving)
        if moving is None:
            self._count_all(block, rows, path, scatterers, into)
        else:
            # The other vertices lie in emptied bins.
            duration_s = block.frames.duration_s[rows]
            histogram.count(moving, rows.start, duration_s, ends, self.counting, scatterers, into)
            if shares:
                if scatterers.mask is not None:
                    marked_counts_kernel(scatterers.mask, prepared.stands_for, into.visible)
                elif scatterers.normals is not None:
                    prepared.count_facing(block, rows, ends[0], into.visible)
                else:
                    into.visible[:] = self.mesh.represented_count
        if self.options.range_law == "frame":
            into.histogram[:] *= self.frame_law(block, rows, path)[:, None, None]
        return quality

    def _count_all(
        self, block: Block, rows: slice, path: EchoPath, scatterers: Scatterers, into: Counts
    ) -> None:
        """Count all vertices of some of a block's frames."""
        place, known = self.prepared.sensor(path.ends_m), self.mesh.uncertainty
        frames = block.frames.rows(rows)
        if self.prepared.spreads and known is not None:
            sigma = SIGMA_FACTOR * self.sigma_bins(block, rows, path)
            limb = known.vertex_limb
            count_expected(frames, place, self.counting, scatterers, sigma, limb, into)
        elif self.options.velocity == "vid2doppler":
            velocity = self.prepared.velocities_vid2doppler(block, rows, place)
            edges_mps = self.options.axis.edges_mps
            vid2doppler.count(frames, velocity, edges_mps, place, self.counting, scatterers, into)
        else:
            paths, duration_s = frames.paths(), frames.duration_s
            histogram.count(paths, 0, duration_s, place, self.counting, scatterers, into)

    def prepare(self, index: int, occluded: bool) -> None:
        """Make all that counting a block takes and that no sensor changes."""
        prepared = self.prepared
        block = prepared.counted(index, self.counting, points=occluded)
        moving = prepared.moving(block, self.counting)
        facing = self.mesh.faces is not None
        # What is occluded is found among all vertices.
        whole = moving is not None and occluded
        self._scatterers(block, slice(None), None, facing and not whole, None, moving)
        if whole:
            prepared.normals(block)
        if prepared.spreads:
            prepared.limb_places(block)
        self.totals(block, slice(0, 0))
        if self.options.range_law == "frame":
            prepared.middles(block)

    def sigma_bins(self, block: Block, rows: slice, path: EchoPath) -> NDArray[np.float64]:
        """Deviation of each limb's velocity on a path in bins, (n, limbs)."""
        known, places_m = self.mesh.uncertainty, self.prepared.limb_places(block)[rows]
        assert known is not None
        return sigma_bins(known, path.ends_m, places_m, block.start + rows.start, self.options.axis)

    def totals(self, block: Block, rows: slice) -> NDArray[np.float64]:
        """Totals that the counts of some of a block's frames are shares of, (n,)."""
        if self.options.weight != "count":
            return self.prepared.surface(block)[rows]
        return np.full(rows.stop - rows.start, float(self.mesh.represented_count))

    def frame_law(self, block: Block, rows: slice, path: EchoPath) -> NDArray[np.float64]:
        """Range law of some of a block's frames, (n,); ones where it applies to each vertex."""
        options = self.options
        if options.range_law != "frame":
            return np.ones(rows.stop - rows.start)
        middles = self.prepared.middles(block)[rows].T
        range_m = mean_distance_m(middles, self.prepared.sensor(path.ends_m))
        return range_weight(range_m, options.range_exponent, options.reference_range_m).astype(
            np.float64
        )

    def scatterers(
        self,
        block: Block,
        rows: slice,
        path: EchoPath,
        visibility: Visibility,
        parts: NDArray[np.uint8] | None,
        moving: MovingVertices | None = None,
    ) -> tuple[Scatterers, Quality]:
        """Scatterers of some of a block's frames, and the visibility that was used.

        Parameters
        ----------
        block : Block
            Of the prepared mesh.
        rows : slice
            Its n frames.
        path : EchoPath
            Of those to the sensor.
        visibility : {"none", "facing", "depth", "exact", "frozen"}
            What is wished for.
        parts : uint8 ndarray, (V,), or None
            Part of the body of every vertex; None: all together.
        moving : MovingVertices, optional
            With it normals and areas are those of what moves in all of the block's frames.
        """
        mask, quality = self.masks.for_rows(block, rows, path.sensor.position_m, visibility)
        if path.wall is not None:
            mask, quality = self._seen_twice(block, rows, path.wall, path.ends_m, mask, quality)
        facing = mask is None and quality == "facing"
        scatterers = self._scatterers(block, rows, mask, facing, parts, moving)
        return replace(scatterers, path=path), quality

    def _seen_twice(
        self,
        block: Block,
        rows: slice,
        wall: Wall,
        ends_m: NDArray[np.float64],
        mask: NDArray[np.uint8] | None,
        quality: Quality,
    ) -> tuple[NDArray[np.uint8] | None, Quality]:
        """Mask, and its quality, of what sensor and image see before a wall.

        ``mask`` and ``quality`` are those of the sensor. None: nothing is behind the wall, and
        counting tests the rest by itself.
        """
        place_m, image_m = map(position_of, ends_m)
        masks, before = self._by_way_of[wall], self.prepared.before_wall(block, wall)
        also, quality = masks.for_rows(block, rows, image_m, quality, mask)
        if mask is None or also is None:
            if before is None or quality == "none":
                return None if before is None else before[rows], quality
            mask = self.masks.facing(block, rows, place_m)
            also = self.masks.facing(block, rows, image_m)
        both = mask & also
        return both if before is None else both & before[rows], quality

    def _scatterers(
        self,
        block: Block,
        rows: slice,
        mask: NDArray[np.uint8] | None,
        facing: bool,
        parts: NDArray[np.uint8] | None,
        moving: MovingVertices | None,
    ) -> Scatterers:
        prepared, weight = self.prepared, self.options.weight
        rows = rows if moving is None else slice(None)
        vectors = prepared.area_vectors
        return Scatterers(
            normals=prepared.normals(block, moving)[rows] if facing else None,
            mask=mask,
            areas=prepared.areas(block, moving)[rows] if weight == "area" else None,
            area_vectors=vectors(block, moving)[rows] if weight == "projected" else None,
            vertex_counts=prepared.multiplicity,
            parts=parts,
        )
