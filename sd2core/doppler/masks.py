"""Visibility masks of a mesh, computed block by block, kept, and reused while dragging."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import histogram, vid2doppler
from sd2core.doppler.histogram import Counting, Paths
from sd2core.doppler.prepared import Block, PreparedMesh
from sd2core.mesh.things import Surroundings, before_wall
from sd2core.mesh.walls import Wall
from sd2core.scattering.behind_things import Hiding, hide_behind
from sd2core.scattering.depth import depth_visibility_kernel
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.visibility import facing_kernel

Visibility = Literal["none", "facing", "depth", "exact", "frozen"]
"""``frozen``: depth or exact visibility of the nearest place that is kept, while dragging."""

Quality = Literal["none", "facing", "depth", "exact", "frozen"]

Occlusion = Literal["depth", "exact"]
"""Visibility with occlusion; its masks are kept."""

Position = tuple[float, float, float]

Place = Position
"""Place of a sensor in the frame of the prepared positions: a body that is moved takes its own
frame along."""

_PLACES_KEPT = 4


@dataclass(eq=False)
class _BlockMask:
    """Depth or exact visibility of one block's frames from one place.

    ``visible`` (n, V) holds the facing test where visibility cannot change the
    map; ``done`` (n,) marks the frames that have been computed. With a stride only
    the frames that serve their neighbours ever are.
    """

    visible: NDArray[np.uint8]
    done: NDArray[np.bool_]


class VisibilityMasks:
    """Visibility of a mesh from any place; masks are kept in the mesh's byte budget.

    Calls may come from several threads. All visibility but none needs faces. ``counting``
    determines the vertices that cannot change the map. What stands around the mesh, and
    ``others`` beside it, hide vertices in depth and exact visibility; ``none`` and ``facing`` know
    nothing of them.

    With a ``wall`` places are those of images behind it, and what lies on the way from the wall to
    the sensor hides vertices, too. It does not tell those behind the wall.
    """

    def __init__(
        self, prepared: PreparedMesh, counting: Counting, wall: Wall | None = None
    ) -> None:
        self._prepared = prepared
        self._counting = counting
        self._wall = wall
        around = prepared.mesh.surroundings
        self._walls = () if around is None else around.walls
        self._things = _things(around, wall)
        live = np.ones(counting.bins + 1, np.uint8)
        if not prepared.spreads:
            live[list(prepared.options.null_bins)] = 0
        # The last entry, beyond the axis, stays live: dropped vertices change no bin,
        # but the share that is reported of them is to be right.
        self._live = live
        self._stride = prepared.options.mask_stride
        self.others: tuple[PreparedMesh, ...] = ()  # bodies of the scene that may hide this one

    def for_rows(
        self,
        block: Block,
        rows: slice,
        position_m: Position,
        visibility: Visibility,
        among: NDArray[np.uint8] | None = None,
    ) -> tuple[NDArray[np.uint8] | None, Quality]:
        """Mask for counting some of a block's frames, and the visibility that was used.

        Parameters
        ----------
        block : Block
            Of the prepared mesh.
        rows : slice
            Its n frames.
        position_m : tuple of 3 float
            Place of the sensor in the camera frame.
        visibility : {"none", "facing", "depth", "exact", "frozen"}
            What is wished for; ``frozen`` becomes ``facing`` if no mask is kept.
        among : uint8 ndarray, (n, V), optional
            Vertices that count at all, always the same from the same place; others need not be
            tested.

        Returns
        -------
        mask : uint8 ndarray, (n, V), or None
            None for ``none`` and ``facing``, which counting tests by itself.
        quality : str
            Visibility that was used.
        """
        place = position_of(self._prepared.sensor(position_m))
        if visibility == "exact" or visibility == "depth":
            return self._compute(block, rows, place, visibility, among), visibility
        if visibility == "frozen":
            mask = self._frozen(block, rows, place)
            return mask, "facing" if mask is None else "frozen"
        return None, visibility

    def for_frame(
        self, block: Block, local: int, position_m: Position, visibility: Visibility
    ) -> tuple[NDArray[np.bool_], Quality]:
        """Visibility of every vertex of a block's frame, bool (V,), and the test that was used.

        Depth and exact also where they cannot change the map. With a stride, that of
        the frame whose visibility serves this one.

        Parameters
        ----------
        block : Block
            Of the prepared mesh.
        local : int
            Number of the frame in the block.
        position_m : tuple of 3 float
            Place of the sensor in the camera frame.
        visibility : {"none", "facing", "depth", "exact", "frozen"}
            What is wished for; ``frozen`` becomes ``facing`` if no mask is kept.
        """
        rows = slice(local, local + 1)
        place = self._prepared.sensor(position_m)
        if visibility == "exact" or visibility == "depth":
            visible = np.empty((1, self._prepared.mesh.vertex_count), np.uint8)
            serving = int(self._serving(block.start + local))
            home, row = divmod(serving, self._prepared.block_frames)
            its = block if home == block.index else self._counted(home)
            view = self._view(its, slice(row, row + 1), place)
            every = np.ones_like(visible)
            self._test_alone(view, every, visible, visibility)
            if self._wall is None:
                self._hide(view, lambda: every, visible)
            return visible[0] > 0, visibility
        mask, quality = self.for_rows(block, rows, position_m, visibility)
        if quality == "none":
            return np.ones(self._prepared.mesh.vertex_count, bool), quality
        if mask is None:
            mask = self.facing(block, rows, position_m)
        return mask[0] > 0, quality

    def facing(self, block: Block, rows: slice, position_m: Position) -> NDArray[np.uint8]:
        """Vertices of some of a block's frames that face a place, uint8 (n, V)."""
        view = self._view(block, rows, self._prepared.sensor(position_m))
        return _facing(view, self._prepared.normals(block)[rows])

    def kept(
        self, index: int, rows: slice, place: Place, occlusion: Occlusion, alone: bool = False
    ) -> NDArray[np.uint8] | None:
        """Mask of a block's frames from this place, uint8 (n, V), if all are in memory.

        Parameters
        ----------
        index : int
            Number of the block.
        rows : slice
            Its n frames.
        place : tuple of 3 float
            Of the sensor; no other one will do.
        occlusion : {"depth", "exact"}
            Kind of mask.
        alone : bool
            True for what the body itself hides, whatever stands around it.
        """
        if self._stride == 1:
            mask: _BlockMask | None = self._prepared.budget.get(
                self._key(occlusion, index, place, alone)
            )
            return mask.visible[rows] if mask is not None and mask.done[rows].all() else None
        served = []
        serving, which = np.unique(self._serving(self._frames(index, rows)), return_inverse=True)
        for frame in serving.tolist():
            home, local = divmod(frame, self._prepared.block_frames)
            mask = self._prepared.budget.get(self._key(occlusion, home, place, alone))
            if mask is None or not mask.done[local]:
                return None
            served.append(mask.visible[local])
        return np.stack(served)[which]

    def _key(self, occlusion: Occlusion, index: int, place: Place, alone: bool = False) -> Hashable:
        # Prepared blocks, and with them the budget, may serve several options: those with the
        # same masks share them. Which vertices are tested depends on the bins they fall into.
        options = self._prepared.options
        pixels = options.depth_resolution if occlusion == "depth" else None
        needed = options.axis, options.null_bins, options.beyond, self._prepared.spreads
        around = self._prepared.mesh.surroundings
        hiding: tuple[Hashable, ...] = ()
        if self._walls or (self._has_others and not alone):
            hiding = (
                self._prepared.stand,
                alone
                or (None if around is None else around.digest, *(one.stand for one in self.others)),
            )
        return (
            *("mask", occlusion, pixels, self._stride, needed, hiding, self._walls, self._wall),
            *(index, place),
        )

    def _places(self, index: int) -> list[tuple[Occlusion, Place]]:
        """Places where masks of a block were made, the newest first."""
        options = self._prepared.options
        kind = options.depth_resolution, self._stride, self._prepared.spreads, options.axis
        return self._prepared.places.setdefault((*kind, self._wall, index), [])

    def _frames(self, index: int, rows: slice) -> NDArray[np.intp]:
        """Numbers of some of a block's frames in the clip."""
        return np.arange(rows.start, rows.stop) + self._prepared.span(index)[0]

    def _serving(self, frames: NDArray[np.intp] | int) -> NDArray[np.intp]:
        """Nearest frames whose visibility serves these: every n-th of the clip.

        Midway it is the later one. The last one may serve more than half a stride. Where that
        frame is separated by frames without a person, the last frame before them serves.
        """
        every = self._stride
        last = (self._prepared.mesh.frame_count - 1) // every * every
        nearest = np.minimum((np.asarray(frames) + every // 2) // every * every, last)
        presence = self._prepared.mesh.presence
        if presence.whole:
            return nearest
        return np.clip(nearest, presence.first[frames], presence.last[frames])

    def _frozen(self, block: Block, rows: slice, place: Place) -> NDArray[np.uint8] | None:
        """Complete mask of these rows that was made nearest to this place.

        Its error grows with the distance (docs/decisions/0010); of equally near ones
        the newest. Not all are complete: a drag that goes on cancels what its pause began.
        """
        kept = self._places(block.index)
        for occlusion, near in sorted(kept, key=lambda here: math.dist(here[1], place)):
            mask = self.kept(block.index, rows, near, occlusion)
            if mask is not None:
                return mask
            # What moved hides something else; what the body hides itself is known.
            alone = self.kept(block.index, rows, near, occlusion, alone=True)
            if alone is None:
                continue
            if near == place:
                return self._compute(block, rows, place, occlusion, None)
            visible = alone.copy()
            view = self._view(block, rows, np.asarray(place))
            self._hide(view, lambda: self._needed(block, rows, np.asarray(place)), visible)
            return visible
        return None

    def _compute(
        self,
        block: Block,
        rows: slice,
        place: Place,
        occlusion: Occlusion,
        among: NDArray[np.uint8] | None,
    ) -> NDArray[np.uint8]:
        """Mask of these rows, kept or computed now."""
        here, places = (occlusion, place), self._places(block.index)
        places[:] = (here, *[one for one in places if one != here][: _PLACES_KEPT - 1])
        if self._stride > 1:
            frames = self._serving(self._frames(block.index, rows))
            serving, which = np.unique(frames, return_inverse=True)
            masks = [self._serving_mask(frame, place, occlusion) for frame in serving.tolist()]
            return np.stack(masks)[which]

        def needed() -> NDArray[np.uint8]:
            marked = self._needed(block, rows, np.asarray(place))
            return marked if among is None else marked & among

        return self._mask(block, rows, place, occlusion, needed)

    def _mask(
        self,
        block: Block,
        rows: slice,
        place: Place,
        occlusion: Occlusion,
        needed: Callable[[], NDArray[np.uint8]],
    ) -> NDArray[np.uint8]:
        """Mask of these rows, uint8 (n, V): what the body hides, which is kept, and then others.

        ``needed`` marks the vertices that are tested.
        """
        mask = self._block_mask(block.index, place, occlusion)
        if mask.done[rows].all():
            return mask.visible[rows]
        view = self._view(block, rows, np.asarray(place))
        alone, apart = mask, self._wall is None and self._has_others
        if apart:
            alone = self._block_mask(block.index, place, occlusion, alone=True)
        needed = functools.cache(needed)
        if not alone.done[rows].all():
            visible, marked = _facing(view, self._prepared.normals(block)[rows]), needed()
            self._test_alone(view, marked, visible, occlusion)
            alone.visible[rows], alone.done[rows] = visible, True
        if apart:
            visible = alone.visible[rows].copy()
            self._hide(view, needed, visible)
            mask.visible[rows], mask.done[rows] = visible, True
        return mask.visible[rows]

    @property
    def _has_others(self) -> bool:
        """True if there is something around the body that may hide it."""
        return self._prepared.mesh.surroundings is not None or bool(self.others)

    def _serving_mask(self, frame: int, place: Place, occlusion: Occlusion) -> NDArray[np.uint8]:
        """Mask of one frame that serves its neighbours, uint8 (V,).

        The vertices that can change the map in any frame it serves are tested, also across
        block boundaries.
        """
        home, local = divmod(frame, self._prepared.block_frames)
        mask = self._block_mask(home, place, occlusion)
        if mask.done[local]:  # its block need not be in memory
            return mask.visible[local]
        first = max(frame - self._stride, 0)

        def needed() -> NDArray[np.uint8]:
            around = np.arange(first, min(frame + self._stride, self._prepared.mesh.frame_count))
            served = around[self._serving(around) == frame]
            marked = np.zeros((1, self._prepared.mesh.vertex_count), np.uint8)
            for index in np.unique(served // self._prepared.block_frames).tolist():
                start, stop = self._prepared.span(index)
                low, high = max(int(served[0]), start), min(int(served[-1]) + 1, stop)
                rows = slice(low - start, high - start)
                served_from = self._needed(self._counted(index), rows, np.asarray(place))
                marked |= served_from.max(axis=0)
            return marked

        rows = slice(local, local + 1)
        return self._mask(self._counted(home), rows, place, occlusion, needed)[0]

    def _view(self, block: Block, rows: slice, place: NDArray[np.float64]) -> _View:
        points, around_m = self._prepared.near_points(block, rows)
        first = block.start + rows.start
        return _View(points, place - around_m, self._prepared.origin_m + around_m, first)

    def _counted(self, index: int) -> Block:
        return self._prepared.counted(index, self._counting, points=True)

    def _block_mask(
        self, index: int, place: Place, occlusion: Occlusion, *, alone: bool = False
    ) -> _BlockMask:
        """Mask of a block from a place, as far as it has been computed."""

        def make() -> tuple[_BlockMask, int]:
            start, stop = self._prepared.span(index)
            visible = np.zeros((stop - start, self._prepared.mesh.vertex_count), np.uint8)
            return _BlockMask(visible, np.zeros(stop - start, bool)), visible.nbytes

        return self._prepared.budget.get_or_make(self._key(occlusion, index, place, alone), make)

    def _needed(self, block: Block, rows: slice, place: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Mark the vertices whose visibility can change the map, uint8 (n, V)."""
        needed = [self._needed_on(block, rows, ends) for ends in self._ends(place)]
        return needed[0] if len(needed) == 1 else np.bitwise_or.reduce(needed)

    def _ends(self, place: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Ends of the paths, (1 or 2, 3), that the view from a place is of."""
        place_m = place + self._prepared.origin_m

        def with_image(wall: Wall) -> NDArray[np.float64]:
            return np.stack([place, self._prepared.sensor(wall.mirrored(place_m))])

        if self._wall is not None:
            return [with_image(self._wall)]
        before = [with_image(wall) for wall in self._walls if wall.before_m(place_m) > 0]
        return [place[None], *before]

    def _needed_on(self, block: Block, rows: slice, ends: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Mark the vertices whose visibility can change what comes on one path, uint8 (n, V)."""
        options = self._prepared.options
        if options.velocity == "vid2doppler":
            velocity = self._prepared.velocities_vid2doppler(block, rows, ends)
            edges_mps = options.axis.edges_mps
            return self._live[vid2doppler.place_in_bins(velocity, edges_mps, self._counting)[0]]
        moving = self._prepared.moving(block, self._counting)
        if moving is not None and moving.hold_from(ends):
            paths: Paths = moving
            start, duration_s = rows.start, block.frames.duration_s[rows]
        else:
            frames = self._prepared.whole(block).frames.rows(rows)
            paths, start, duration_s = frames.paths(), 0, frames.duration_s
        return histogram.mark_needed(paths, start, duration_s, ends, self._counting, self._live)

    def _test_alone(
        self,
        view: _View,
        needed: NDArray[np.uint8],
        visible: NDArray[np.uint8],
        occlusion: Occlusion,
    ) -> None:
        """Set ``visible`` of the needed vertices, as if nothing stood around; by a wall, all."""
        self._test_body(view, needed, visible, occlusion)
        if self._wall is not None:
            self._hide_by_way_of(self._wall, view, needed, visible)

    def _hide(
        self, view: _View, needed: Callable[[], NDArray[np.uint8]], visible: NDArray[np.uint8]
    ) -> None:
        """Set ``visible`` to 0 of what things hide, and of the needed vertices that others hide."""
        # Of all vertices: what hides them is soon looked at, and the share that is seen is right.
        for thing in self._things:
            view.hide(thing, visible, visible)
        if self.others:
            marked = needed()
            for other in self.others:
                self._hide_behind_body(other, view, marked, visible)

    def _hide_by_way_of(
        self, wall: Wall, view: _View, needed: NDArray[np.uint8], visible: NDArray[np.uint8]
    ) -> None:
        """Set ``visible`` to 0 where something is in the way to a wall, or from it to the sensor.

        Where visibility is not needed, too: no share is reported of what comes by a wall.
        """
        visible &= needed
        # The sensor's image sees images as the sensor sees what they are images of.
        image = view.mirrored(wall)
        self._hide_behind_body(self._prepared, image, needed, visible)
        for seen in (view, image):
            for thing in self._things:
                seen.hide(thing, needed, visible)
            for other in self.others:
                self._hide_behind_body(other, seen, needed, visible)

    def _hide_behind_body(
        self,
        other: PreparedMesh,
        view: _View,
        needed: NDArray[np.uint8],
        visible: NDArray[np.uint8],
    ) -> None:
        """Set ``visible`` of the needed vertices to 0 where another body hides them."""
        wall = None if other is self._prepared else self._wall
        first, present = view.first, other.mesh.presence.present
        for start, stop, hiding in other.hiding(first, first + len(visible), wall):
            rows = slice(start - first, stop - first)
            asked = needed[rows] & present[start:stop, None]
            view.rows(rows).hide(hiding, asked, visible[rows])

    def _test_body(
        self,
        view: _View,
        needed: NDArray[np.uint8],
        visible: NDArray[np.uint8],
        occlusion: Occlusion,
    ) -> None:
        """Set ``visible`` of the needed vertices that the body itself does not hide."""
        faces = self._prepared.faces
        assert faces is not None  # the Synthesizer refuses to ask it of a point cloud
        points, pixels = view.points, self._prepared.options.depth_resolution
        closed = occlusion == "depth" and self._prepared.closed
        for first, last in view.stretches():
            place = view.places_m[first]
            if occlusion == "exact":
                exact_visibility_kernel(points, faces, place, needed, first, last, visible)
            else:
                depth_visibility_kernel(
                    points, faces, closed, place, pixels, needed, first, last, visible
                )


@dataclass(frozen=True, eq=False)
class _View:
    """Vertices (n, 3, V) and sensor (n, 3) of some frames, relative to a point near each body."""

    points: NDArray[np.float32]
    places_m: NDArray[np.float64]
    origins_m: NDArray[np.float64]  # these points, in the camera frame, (n, 3)
    first: int  # number of the first frame in the clip

    def mirrored(self, wall: Wall) -> _View:
        """Image behind a wall."""
        turn = np.eye(3) - 2.0 * np.outer(wall.outward, wall.outward)
        points = turn.astype(np.float32) @ self.points
        return _View(points, self.places_m @ turn, wall.mirrored(self.origins_m), self.first)

    def rows(self, rows: slice) -> _View:
        """View of some of these frames."""
        first = self.first + rows.start
        return _View(self.points[rows], self.places_m[rows], self.origins_m[rows], first)

    def hide(self, hiding: Hiding, needed: NDArray[np.uint8], visible: NDArray[np.uint8]) -> None:
        """Set ``visible`` of the needed vertices to 0 where a surface hides them, (n, V)."""
        hide_behind(hiding, self.points, self.origins_m, self.places_m, needed, visible)

    def stretches(self) -> list[tuple[int, int]]:
        """Half-open runs of frames in which the sensor does not move."""
        if (self.places_m == self.places_m[0]).all():
            return [(0, len(self.points))]
        return [(t, t + 1) for t in range(len(self.points))]


def _things(around: Surroundings | None, wall: Wall | None) -> list[Hiding]:
    """All things as one surface, or what is before a wall of them; none if there are none."""
    if around is None or not around.things:
        return []
    surface = around.surface if wall is None else before_wall(wall, *around.surface)
    return [Hiding.still(*surface, around.boxes_m)]


def position_of(place_m: NDArray[np.float64]) -> Position:
    """Place (3,) as plain numbers."""
    x, y, z = place_m.tolist()
    return x, y, z


def _facing(view: _View, normals: NDArray[np.int8]) -> NDArray[np.uint8]:
    visible = np.empty((len(view.points), view.points.shape[2]), np.uint8)
    for t, (points, place) in enumerate(zip(view.points, view.places_m, strict=True)):
        (x, y, z), (nx, ny, nz), (sx, sy, sz) = points, normals[t], place.astype(np.float32)
        facing_kernel(x, y, z, nx, ny, nz, sx, sy, sz, visible[t])
    return visible
