"""Which vertices a sensor sees: found block by block, kept, and reused while dragging."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.compiled import kernels_ready
from sd2core.doppler import histogram, vid2doppler
from sd2core.doppler.histogram import Counting
from sd2core.doppler.prepared import Block, PreparedMesh
from sd2core.scattering import exact_plain
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.visibility import facing_kernel, facing_mask

Visibility = Literal["none", "facing", "exact", "frozen"]
"""``frozen``: the last exact visibility, kept while the sensor is dragged."""

Quality = Literal["none", "facing", "exact", "frozen"]

Position = tuple[float, float, float]

_PLACES_KEPT = 4


@dataclass(eq=False)
class _BlockMask:
    """Exact visibility of one block's frames from one place.

    ``visible`` (n, V) holds the facing test where visibility cannot change the
    map; ``done`` (n,) says which frames have been worked out.
    """

    visible: NDArray[np.uint8]
    done: NDArray[np.bool_]


class VisibilityMasks:
    """Visibility of a mesh from any place; what is exact is kept in the mesh's byte budget.

    Calls may come from several threads. Facing and exact visibility need faces.

    Parameters
    ----------
    prepared : PreparedMesh
    counting : Counting
        Decides which vertices cannot change the map.
    """

    def __init__(self, prepared: PreparedMesh, counting: Counting) -> None:
        self._prepared = prepared
        self._counting = counting
        live = np.ones(counting.bins + 1, np.uint8)
        live[list(prepared.options.null_bins)] = 0
        live[-1] = 0
        self._live = live
        # Newest first, per block.
        self._exact_at: dict[int, tuple[Position, ...]] = {}

    def for_rows(
        self, block: Block, rows: slice, position_m: Position, visibility: Visibility
    ) -> tuple[NDArray[np.uint8] | None, Quality]:
        """Mask for counting some of a block's frames, and the visibility that it stands for.

        Returns
        -------
        mask : uint8 array, shape (n, V), or None
            None for ``none`` and ``facing``: counting judges those by itself.
        quality : {"none", "facing", "frozen", "exact"}
            ``facing`` where ``frozen`` was asked for and nothing is kept.
        """
        if visibility == "exact":
            return self._exact(block, rows, position_m), "exact"
        if visibility == "frozen":
            mask = self._frozen(block.index, rows)
            return mask, "facing" if mask is None else "frozen"
        return None, visibility

    def for_frame(
        self, block: Block, local: int, position_m: Position, visibility: Visibility
    ) -> tuple[NDArray[np.bool_], Quality]:
        """Visibility of every vertex of a block's frame, bool (V,), and how it was found.

        Exact also where it cannot change the map.
        """
        rows = slice(local, local + 1)
        place = self._prepared.sensor(position_m)
        if visibility == "exact":
            visible = np.empty((1, self._prepared.mesh.vertex_count), np.uint8)
            self._test(_points(block, rows), place, np.ones_like(visible), visible)
            return visible[0] > 0, "exact"
        mask, quality = self.for_rows(block, rows, position_m, visibility)
        if quality == "none":
            return np.ones(self._prepared.mesh.vertex_count, bool), quality
        if mask is None:
            mask = _facing(_points(block, rows), self._prepared.normals(block)[rows], place)
        return mask[0] > 0, quality

    def kept(self, index: int, rows: slice, position_m: Position) -> NDArray[np.uint8] | None:
        """Exact mask of a block's frames from this place, uint8 (n, V), if all are in memory."""
        mask: _BlockMask | None = self._prepared.budget.get(("mask", index, position_m))
        return mask.visible[rows] if mask is not None and mask.done[rows].all() else None

    def _frozen(self, index: int, rows: slice) -> NDArray[np.uint8] | None:
        """The newest exact mask in which these rows are complete.

        Not simply the newest: a drag that goes on cancels what its pause began.
        """
        for position_m in self._exact_at.get(index, ()):
            mask = self.kept(index, rows, position_m)
            if mask is not None:
                return mask
        return None

    def _exact(self, block: Block, rows: slice, position_m: Position) -> NDArray[np.uint8]:
        """Exact mask of these rows, kept or worked out now."""
        mask = self._block_mask(block, position_m)
        others = [place for place in self._exact_at.get(block.index, ()) if place != position_m]
        self._exact_at[block.index] = (position_m, *others[: _PLACES_KEPT - 1])
        if not mask.done[rows].all():
            place, points = self._prepared.sensor(position_m), _points(block, rows)
            visible = _facing(points, self._prepared.normals(block)[rows], place)
            self._test(points, place, self._needed(block, rows, place), visible)
            mask.visible[rows] = visible
            mask.done[rows] = True
        return mask.visible[rows]

    def _block_mask(self, block: Block, position_m: Position) -> _BlockMask:
        """Exact visibility from a place, as far as it has been worked out."""

        def make() -> tuple[_BlockMask, int]:
            frames = block.stop - block.start
            visible = np.zeros((frames, self._prepared.mesh.vertex_count), np.uint8)
            return _BlockMask(visible, np.zeros(frames, bool)), visible.nbytes

        mask: _BlockMask = self._prepared.budget.get_or_make(
            ("mask", block.index, position_m), make
        )
        return mask

    def _needed(self, block: Block, rows: slice, place: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Which vertices' visibility can change the map, uint8 (n, V)."""
        options = self._prepared.options
        if options.velocity == "vid2doppler":
            velocity = self._prepared.velocities_vid2doppler(block, rows, place)
            edges_mps = options.axis.edges_mps
            return self._live[vid2doppler.place_in_bins(velocity, edges_mps, self._counting)[0]]
        mark = histogram.mark_needed if kernels_ready() else histogram.mark_needed_plain
        return mark(block.frames.rows(rows), place, self._counting, self._live)

    def _test(
        self,
        points: NDArray[np.float32],
        place: NDArray[np.float64],
        needed: NDArray[np.uint8],
        visible: NDArray[np.uint8],
    ) -> None:
        """Write the exact visibility of the needed vertices into ``visible``."""
        faces = self._prepared.faces
        assert faces is not None  # the Synthesizer refuses to ask it of a point cloud
        if kernels_ready():
            exact_visibility_kernel(points, faces, place, needed, 0, len(points), visible)
            return
        for t in np.flatnonzero(needed.any(axis=1)):
            wanted = needed[t] > 0
            seen = exact_plain.exact_visibility(points[t], faces, place, wanted)
            visible[t][wanted] = seen[wanted]


def _points(block: Block, rows: slice) -> NDArray[np.float32]:
    """Positions of these frames in single precision, (n, 3, V)."""
    return block.frames.positions[block.frames.centre[rows]].astype(np.float32, copy=False)


def _facing(
    points: NDArray[np.float32], normals: NDArray[np.int8], place: NDArray[np.float64]
) -> NDArray[np.uint8]:
    if not kernels_ready():
        return facing_mask(points, normals, place)
    sx, sy, sz = place.astype(np.float32)
    visible = np.empty((len(points), points.shape[2]), np.uint8)
    for (x, y, z), (nx, ny, nz), row in zip(points, normals, visible, strict=True):
        facing_kernel(x, y, z, nx, ny, nz, sx, sy, sz, row)
    return visible
