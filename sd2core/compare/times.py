"""Bringing meshes onto common times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.trajectory import cubic_weights
from sd2core.timebase import Timebase

_SAME_S = 1e-4
"""Frames nearer than this are the same frame: file formats round times."""

_FEWEST = 4


def common_times(meshes: Sequence[MeshSequence], reference: int = 0) -> NDArray[np.float64]:
    """The reference's frame times within the stretch that all meshes cover.

    Raises
    ------
    Sd2Error
        When fewer than four frames are left.
    """
    times = meshes[reference].times_s
    first = max(float(mesh.times_s[0]) for mesh in meshes) - _SAME_S
    last = min(float(mesh.times_s[-1]) for mesh in meshes) + _SAME_S
    within: NDArray[np.float64] = times[(times >= first) & (times <= last)]
    if len(within) < _FEWEST:
        spans = ", ".join(f"{mesh.times_s[0]:.2f} to {mesh.times_s[-1]:.2f} s" for mesh in meshes)
        raise Sd2Error(
            f"The meshes have {len(within)} frames in common ({spans})",
            f"{_FEWEST} or more",
            "Give meshes of the same video; --fps places the frames of a file that has no times",
        )
    return within


def at_times(mesh: MeshSequence, times_s: NDArray[np.float64]) -> tuple[MeshSequence, bool]:
    """A mesh at other times within its own, in memory.

    Parameters
    ----------
    times_s : float64 array, shape (n,)

    Returns
    -------
    MeshSequence
    bool
        Whether anything was interpolated: by the cubic through two frames with
        the tangents of their neighbours.

    Notes
    -----
    The vertices of frames without a person mean nothing, nor do those interpolated
    next to them; the mesh that is returned says which these are.
    """
    own = mesh.times_s
    nearest = np.abs(own[:, None] - times_s[None, :]).argmin(axis=0)
    if np.abs(own[nearest] - times_s).max() <= _SAME_S:
        start, stop = int(nearest[0]), int(nearest[-1]) + 1
        vertices = mesh.read(start, stop)[nearest - start]
        there = None if mesh.present is None else mesh.present[nearest]
        return _replaced(mesh, vertices, times_s, there, nearest), False
    frames = np.clip(np.searchsorted(own, times_s, side="right") - 1, 0, len(own) - 2)
    # Between two frames there is a person where both of them have one.
    there = mesh.presence.there[frames] & mesh.presence.there[frames + 1]
    vertices = np.empty((len(times_s), mesh.vertex_count, 3), np.float64)
    for row, (time_s, frame) in enumerate(zip(times_s, frames, strict=True)):
        # Only frames of the same stretch: past its end a person is somewhere else.
        begin, end = int(mesh.presence.first[frame]), int(mesh.presence.last[frame]) + 1
        inside = float(np.clip(time_s, own[begin], own[end - 1]))
        first, weights = cubic_weights(own[begin:end], inside, int(frame) - begin)
        stretch = mesh.read(begin + first, begin + first + len(weights)).astype(np.float64)
        vertices[row] = np.tensordot(weights, stretch, 1)
    return _replaced(mesh, vertices, times_s, there, nearest), True


def _replaced(
    mesh: MeshSequence,
    vertices: NDArray[np.floating],
    times_s: NDArray[np.float64],
    present: NDArray[np.bool_] | None,
    nearest: NDArray[np.intp],
) -> MeshSequence:
    known = None if mesh.uncertainty is None else mesh.uncertainty.of_frames(nearest)
    return replace(
        mesh, vertices=vertices, timebase=Timebase(times_s), present=present, uncertainty=known
    )
