"""Prepared blocks of frames: all data that do not depend on the sensor, under a byte budget."""

from __future__ import annotations

import copy
import itertools
import math
import threading
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.doppler import vid2doppler
from sd2core.doppler.histogram import Counting, Frames
from sd2core.doppler.moving import MovingVertices, find_moving, still_bins
from sd2core.doppler.moving_kernels import facing_counts_kernel
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.made_vertices import unshifted
from sd2core.mesh.sequence import MeshSequence, refuse_missing
from sd2core.mesh.walls import Wall
from sd2core.numerics.byte_budget import ByteBudget
from sd2core.numerics.precision import single_is_enough
from sd2core.options.bounds import RANGE_EXPONENT
from sd2core.scattering import amplitude, visibility
from sd2core.scattering.behind_things import Hiding
from sd2core.scattering.trajectory import Trajectory
from sd2core.scattering.velocity import moments

_BLOCK_BYTES = 16 << 20
_MIN_FRAMES = 8
_KNOTS_AT_ONCE = 16
_NUMBERS = itertools.count()


@dataclass(frozen=True, eq=False)
class Block:
    """Prepared frames ``start`` to ``stop`` of a clip."""

    index: int
    start: int
    stop: int
    frames: Frames
    first_knot: int  # number, in the whole clip, of the first knot in "frames.positions"
    reach_m: float  # largest of their coordinates


@dataclass(eq=False)
class PreparedMesh:
    """Mesh as the kernels take it, block by block.

    One that was put elsewhere is prepared where it was before: its origin alone moves.
    """

    mesh: MeshSequence
    options: SynthesisOptions
    budget: ByteBudget
    asked_frames: int | None = None  # in a block; by default some megabytes of them
    block_frames: int = field(init=False)
    reach_m: float = field(init=False)  # largest coordinate in the first frame
    origin_m: NDArray[np.float64] = field(init=False)  # of the prepared positions
    # Places from which visibility was found, by block and options.
    places: dict[Hashable, list[Any]] = field(init=False, default_factory=dict)
    number: int = field(init=False)  # the same for all that share its blocks, and for no other

    def __post_init__(self) -> None:
        self._still, by_m = unshifted(self.mesh)
        self._reading = threading.Lock()
        self.number = next(_NUMBERS)
        self._compatible = self.options.velocity == "vid2doppler"
        self._trajectory = Trajectory(
            self.mesh.times_s,
            self.options.oversampling,
            self.options.trajectory_smoothing_s,
            self.mesh.presence,
        )
        self._knot_times_s = self._trajectory.knot_times_s
        # The faces a kernel gets must be plain memory: a read-only or mapped
        # array is another type to the compiler, and would be compiled for again.
        self.faces = None if self.mesh.faces is None else np.array(self.mesh.faces, np.int32)
        counts = self.mesh.vertex_counts
        self.multiplicity = None if counts is None else counts.astype(np.float32)
        alone = np.ones(self.mesh.vertex_count, np.float32)
        self.stands_for = alone if self.multiplicity is None else self.multiplicity
        # Points are kept around the clip's own origin, in single precision where that
        # is enough (see _positions), so that large coordinates cost nothing. The origin
        # is a number that the mesh's own precision has. The compatible rule works on the
        # numbers as they come, so that its bin edges fall where that tool's do.
        points = self._still.frame(0).astype(np.float64)
        self.reach_m = float(np.abs(points).max())
        self._middle_m = np.zeros(3)
        if not self._compatible:
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            finite = np.where(np.isfinite(middle), middle, 0.0)
            self._middle_m = finite.astype(self.mesh.vertices.dtype).astype(np.float64)
        self.origin_m = self._middle_m + by_m
        per_frame = self.mesh.vertex_count * 12 * self.options.oversampling
        # Several blocks with their normals must fit, or each would push out the other.
        bytes_per_block = min(_BLOCK_BYTES, self.budget.limit_bytes // 8)
        usual = max(_MIN_FRAMES, bytes_per_block // per_frame)
        self.block_frames = self.asked_frames or usual

    def shared(self, mesh: MeshSequence, options: SynthesisOptions) -> PreparedMesh | None:
        """Same blocks, in the same budget, for other options or things, or for the mesh elsewhere.

        None for another mesh, and if the options need other knots or have other bin widths, on
        which the precision of a block depends.
        """
        still, by_m = unshifted(mesh)
        if still.vertices is not self._still.vertices or still.faces is not self._still.faces:
            return None
        for name in ("oversampling", "trajectory_smoothing_s", "velocity"):
            if getattr(options, name) != getattr(self.options, name):
                return None
        if options.axis.bin_width_mps != self.options.axis.bin_width_mps:
            return None
        other = copy.copy(self)
        other.mesh, other.options = mesh, options
        other.origin_m = self._middle_m + by_m
        return other

    @property
    def stand(self) -> Hashable:
        """Key that all with the same blocks in the same place share, and no other."""
        return self.number, *self.origin_m.tolist()

    @property
    def spreads(self) -> bool:
        """True if vertices are spread over bins, so that all count wherever they are."""
        return self.options.count == "expected" and self.mesh.uncertainty is not None

    @property
    def closed(self) -> bool:
        """True if the mesh is a closed surface; computed when a depth buffer first needs it."""
        faces = self._faces()
        return self.budget.get_or_make("closed", lambda: (visibility.encloses(faces), 0))

    @property
    def block_count(self) -> int:
        """Number of blocks in the clip."""
        return -(-self.mesh.frame_count // self.block_frames)

    def sensor(self, position_m: ArrayLike) -> NDArray[np.float64]:
        """Place of a sensor, or ends of a path (..., 3), in the frame of the prepared positions."""
        return np.asarray(position_m, np.float64) - self.origin_m

    def span(self, index: int) -> tuple[int, int]:
        """First frame of a block and the one after its last."""
        start = index * self.block_frames
        return start, min(start + self.block_frames, self.mesh.frame_count)

    def has(self, index: int) -> bool:
        """True if a block is in memory, or what moves of it."""
        return self.pairs_moving(index) is not None or self.budget.get(("block", index)) is not None

    def block(self, index: int) -> Block:
        """Prepared positions, from memory or read now."""

        def make() -> tuple[Block, int]:
            block = self._prepare(index)
            return block, block.frames.positions.nbytes

        return self.budget.get_or_make(("block", index), make)

    def counted(self, index: int, counting: Counting, *, points: bool = False) -> Block:
        """Block for counting: without positions where only what moves is counted.

        With ``points``, those of its frames are kept while they are at hand; otherwise, the
        normals of what moves.
        """

        def make() -> tuple[tuple[Block | None], int]:
            whole = self._read(index)
            moving = self.moving(whole, counting)
            if moving is None or (points and self.options.oversampling == 1):
                self.budget.put(("block", index), whole, whole.frames.positions.nbytes)
            if moving is None:
                return (None,), 0
            if points and self.options.oversampling > 1:
                self._kept("points", whole, self._points)
            elif not points and self.faces is not None:
                self.normals(whole, moving)
            frames = replace(whole.frames, positions=whole.frames.positions[:0].copy())
            return (replace(whole, frames=frames),), 0

        kept: tuple[Block | None] = self.budget.get_or_make(self._moving_key("sparse", index), make)
        return kept[0] or self.block(index)

    def whole(self, block: Block) -> Block:
        """Block with its positions."""
        return block if len(block.frames.positions) else self.block(block.index)

    def points(self, block: Block) -> NDArray[Any]:
        """Positions in the middle of a block's frames, (n, 3, V)."""
        if len(block.frames.positions) or self.options.oversampling == 1:
            return self._points(self.whole(block))
        return self._kept("points", block, lambda block: self._points(self._read(block.index)))

    def near_points(
        self, block: Block, rows: slice
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """Vertices of some of a block's frames in single precision, relative to a point near them.

        Returns the vertices (n, 3, V) and that point for each frame, float64 (n, 3), which is
        zero if the block is in single precision.
        """
        if len(block.frames.positions) or self.options.oversampling == 1:
            points = self._points(self.whole(block), rows)  # of a few frames no more are copied
        else:
            points = self.points(block)[rows]
        place_m = np.zeros((len(points), 3))
        if points.dtype == np.float64:
            place_m = 0.5 * (points.min(axis=2) + points.max(axis=2))
            points = points - place_m[:, :, None]
        return np.ascontiguousarray(points, np.float32), place_m

    def hiding(
        self, start: int, stop: int, wall: Wall | None = None
    ) -> Iterator[tuple[int, int, Hiding]]:
        """Surface in the middle of some frames of the clip, block by block, with these frames.

        Of a body with faces, without those that are wholly behind a wall.
        """
        assert self.faces is not None

        def ends(block: Block) -> NDArray[np.float64]:
            points = self.points(block)
            return np.stack([points.min(axis=2), points.max(axis=2)], axis=1)

        while start < stop:
            index, local = divmod(start, self.block_frames)
            block, last = self.block(index), min(stop, self.span(index)[1])
            rows = slice(local, local + last - start)
            points, around_m = self.near_points(block, rows)
            before = None if wall is None else self.before_wall(block, wall)
            yield (
                start,
                last,
                Hiding(
                    points,
                    around_m + self.origin_m,
                    self.faces,
                    self._kept("boxes", block, ends)[rows, None] + self.origin_m,
                    None if before is None else before[rows],
                ),
            )
            start = last

    def normals(self, block: Block, moving: MovingVertices | None = None) -> NDArray[np.int8]:
        """Vertex normals of a block's frames, int8 (n, 3, V).

        With ``moving`` those of what moves, as :meth:`MovingVertices.of` orders them.
        """

        def few(block: Block, moving: MovingVertices) -> NDArray[np.int8]:
            return moving.normals(self._at_frames(block), self._faces())

        return self._kept("normals", block, self._normals, moving, few)

    def count_facing(
        self, block: Block, rows: slice, place_m: NDArray[np.float64], visible: NDArray[np.float64]
    ) -> None:
        """Set the number of vertices that face the sensor.

        Parameters
        ----------
        block, rows
            The n frames.
        place_m : float64 ndarray, (3,)
            Of the sensor, in the frame of the prepared positions.
        visible : float64 ndarray, (n,)
            Written.
        """
        points, normals = self.points(block), self.normals(block)
        place = place_m.astype(points.dtype)
        facing_counts_kernel(points, normals, self.stands_for, rows.start, place, visible)

    def areas(self, block: Block, moving: MovingVertices | None = None) -> NDArray[np.float32]:
        """Vertex areas of a block's frames in m², float32 (n, V), or of what moves."""
        return self._kept("areas", block, self._areas, moving)

    def area_vectors(
        self, block: Block, moving: MovingVertices | None = None
    ) -> NDArray[np.float32]:
        """Vertex area vectors of a block's frames in m², float32 (n, 3, V), or of what moves."""
        return self._kept("area vectors", block, self._area_vectors, moving)

    def surface(self, block: Block) -> NDArray[np.float64]:
        """Area of the whole surface in each of a block's frames in m², float64 (n,)."""
        # Vertex areas are kept where they are counted, and only there.
        areas = self.areas if self.options.weight == "area" else self._areas
        return self._kept(
            "surface", block, lambda block: areas(block).sum(axis=1, dtype=np.float64)
        )

    def middles(self, block: Block) -> NDArray[np.float64]:
        """Mean vertex of each of a block's frames, float64 (n, 3)."""
        return self._kept("middles", block, self._middles)

    def limb_places(self, block: Block) -> NDArray[np.float64]:
        """Mean vertex of every limb with an uncertainty, in the camera's frame, (n, L, 3)."""
        return self._kept("limb places", block, self._limb_places) + self.origin_m

    def before_wall(self, block: Block, wall: Wall) -> NDArray[np.uint8] | None:
        """Vertices of a block's frames that are before a wall, uint8 (n, V); None: all are."""

        def make() -> tuple[tuple[NDArray[np.uint8] | None], int]:
            at_origin_m = float(wall.before_m(self.origin_m))
            before = np.stack([at_origin_m > wall.outward @ one for one in self.points(block)])
            return (None,) if before.all() else (before.astype(np.uint8),), before.size

        plane = wall.distance_m, wall.azimuth_deg, wall.elevation_deg
        return self.budget.get_or_make(("before", plane, self.stand, block.index), make)[0]

    def moving(self, block: Block, counting: Counting) -> MovingVertices | None:
        """Vertices of a block that can enter a kept bin; None where counting all is as fast."""
        still = still_bins(counting.bins, self.options.null_bins)
        if self._compatible or self.spreads or still <= 0:
            return None

        def make() -> tuple[tuple[MovingVertices | None], int]:
            whole = block if len(block.frames.positions) else self._read(block.index)
            moving = find_moving(whole.frames, whole.reach_m, counting, still)
            return (moving,), 0 if moving is None else moving.nbytes

        return self.budget.get_or_make(self._moving_key("moving", block.index), make)[0]

    def pairs_moving(self, index: int) -> int | None:
        """Number of pairs of a frame and a vertex that moves in a block.

        None where that is not known yet, or all count.
        """
        kept = self.budget.get(self._moving_key("moving", index))
        return None if kept is None or kept[0] is None else kept[0].pairs

    def _moving_key(self, what: str, index: int) -> Hashable:
        # Blocks are shared by options with the same bin width.
        return what, "moving", self.options.axis.bins, self.options.null_bins, self.spreads, index

    def velocities_vid2doppler(
        self, block: Block, rows: slice, ends: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Vid2Doppler's velocities of some of a block's frames on a path, (n, V)."""
        each = [
            vid2doppler.velocities(
                block.frames.positions,
                block.first_knot,
                block.start + rows.start,
                block.start + rows.stop,
                self.mesh.frame_count,
                end,
                self.mesh.timebase.frames_per_s,
                self.mesh.presence,
            )
            for end in ends
        ]
        return each[0] if len(each) == 1 else 0.5 * (each[0] + each[1])

    def _kept(
        self,
        what: str,
        block: Block,
        make: Callable[[Block], NDArray[Any]],
        moving: MovingVertices | None = None,
        few: Callable[[Block, MovingVertices], NDArray[Any]] | None = None,
    ) -> NDArray[Any]:
        """Derived array of a block, or its part of what moves, from memory or computed now.

        That part is taken from the whole, unless ``few`` makes it where the whole is not known.
        """

        def sized() -> tuple[NDArray[Any], int]:
            if moving is None:
                made = make(block)
            elif (every := self.budget.get((what, block.index))) is not None:
                made = moving.of(every)
            else:
                made = moving.of(make(block)) if few is None else few(block, moving)
            return made, made.nbytes

        key = (what, block.index) if moving is None else self._moving_key(what, block.index)
        return self.budget.get_or_make(key, sized)

    def _normals(self, block: Block) -> NDArray[np.int8]:
        return self._by(visibility.vertex_normals_kernel, block, np.int8, 3)

    def _area_vectors(self, block: Block) -> NDArray[np.float32]:
        return self._by(amplitude.vertex_area_vectors_kernel, block, np.float32, 3)

    def _middles(self, block: Block) -> NDArray[np.float64]:
        share = self.stands_for / self.stands_for.sum(dtype=np.float64)
        return np.stack([points @ share for points in self.points(block)])

    def _limb_places(self, block: Block) -> NDArray[Any]:
        known = self.mesh.uncertainty
        assert known is not None
        limb, count = known.vertex_limb, len(known.limbs)
        member = np.zeros((len(limb), count), np.float32)
        member[np.arange(len(limb)), limb] = 1.0
        member /= np.maximum(member.sum(axis=0), 1.0)
        return (self.points(block) @ member).transpose(0, 2, 1)

    def _areas(self, block: Block) -> NDArray[np.float32]:
        return self._by(amplitude.vertex_areas_kernel, block, np.float32)

    def _by(self, kernel: Any, block: Block, precision: Any, *axes: int) -> NDArray[Any]:
        """What a kernel makes of the surface in a block's frames, (n, *axes, V)."""
        points = self._at_frames(block)
        made = np.empty((len(points), *axes, points.shape[2]), precision)
        kernel(points, self._faces(), made)
        return made

    def _faces(self) -> NDArray[np.int32]:
        if self.faces is None:
            raise ValueError("a point cloud has neither normals nor areas")
        return self.faces

    def _at_frames(self, block: Block) -> NDArray[np.float32]:
        """Vertices of the block's own frames relative to each body, float32 (n, 3, V)."""
        return self.near_points(block, slice(None))[0]

    def _points(self, block: Block, rows: slice = slice(None)) -> NDArray[Any]:
        """Vertices of a block with positions; a copy where they are a part of them."""
        first, last = block.frames.centre[rows][[0, -1]].tolist()
        return np.ascontiguousarray(
            block.frames.positions[first : last + 1 : self.options.oversampling]
        )

    def _read(self, index: int) -> Block:
        """Block with its positions, from memory or read now and not kept."""
        return self.budget.get(("block", index)) or self._prepare(index)

    def _prepare(self, index: int) -> Block:
        start, stop = self.span(index)
        every = self.options.oversampling
        if self._compatible:
            reach_before, reach_after = vid2doppler.REACH_BEFORE, vid2doppler.REACH_AFTER
        else:
            reach_before = reach_after = every // 2 + every % 2
        first = max(start * every - reach_before, 0)
        last = min((stop - 1) * every + reach_after + 1, len(self._knot_times_s))
        centre = np.arange(start, stop) * every
        between = moments(self._knot_times_s, centre, every, self.mesh.presence)
        positions, reach_m = self._positions(first, last, between.duration_s)
        return Block(
            index,
            start,
            stop,
            Frames(
                positions,
                centre - first,
                between.before - first,
                between.after - first,
                between.duration_s,
            ),
            first,
            reach_m,
        )

    def _positions(
        self, first: int, last: int, duration_s: NDArray[np.float64]
    ) -> tuple[NDArray[Any], float]:
        """Knots ``first`` to ``last`` around the clip's origin, (knots, 3, V), and their extent.

        In single precision where that is enough for velocities over ``duration_s``.
        """
        low, high = self._trajectory.frames_needed(first, last)
        with self._reading:
            vertices = self._still.read(low, high)
        precision: Any = np.float32
        if self._compatible and (vertices.dtype != np.float32 or self._trajectory.smoothing_s > 0):
            precision = np.float64
        positions, reach_m = self._around_origin(vertices, low, first, last, precision)
        if not math.isfinite(reach_m):
            refuse_missing(vertices, low, self.mesh.source)
        measured = duration_s[duration_s > 0]
        if self._compatible or single_is_enough(
            extent_m=reach_m,
            size_m=float((positions[0].max(axis=1) - positions[0].min(axis=1)).max()),
            duration_s=float(measured.min(initial=np.inf)),
            bin_width_mps=self.options.axis.bin_width_mps,
            range_exponent=RANGE_EXPONENT.high,
            nearest_range_m=amplitude.NEAREST_RANGE_M,
        ):
            return positions, reach_m
        return self._around_origin(vertices, low, first, last, np.float64)

    def _around_origin(
        self, vertices: NDArray[Any], low: int, first: int, last: int, precision: Any
    ) -> tuple[NDArray[Any], float]:
        """Knots ``first`` to ``last`` less their own origin, (knots, 3, V), and their extent.

        The extent is the largest coordinate. Vertices are those of the frames from ``low``.
        """
        positions = np.empty((last - first, 3, self.mesh.vertex_count), precision)
        reach_m = 0.0
        # A few at a time, which stay in a core's own cache.
        for start in range(first, last, _KNOTS_AT_ONCE):
            stop = min(start + _KNOTS_AT_ONCE, last)
            a, b = self._trajectory.frames_needed(start, stop)
            knots = self._trajectory.knots(vertices[a - low : b - low], a, start, stop)
            origin = self._middle_m.astype(knots.dtype)
            into = positions[start - first : stop - first]
            # What single precision cannot even hold is infinite in it, and then not enough.
            with np.errstate(over="ignore"):
                for axis in range(3):
                    np.subtract(
                        knots[:, :, axis], origin[axis], out=into[:, axis], casting="same_kind"
                    )
            # Missing coordinates stay missing here.
            reach_m = float(np.max([reach_m, into.max(), -into.min()]))
        return positions, reach_m
