"""A mesh at times of another clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.made_vertices import MadeVertices, read_frames
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.trajectory import cubic_weights
from sd2core.timebase import Timebase

SAME_S = 1e-4
"""Frames nearer than this are the same frame: file formats round times."""


def resample_mesh(mesh: MeshSequence, times_s: NDArray[np.float64]) -> tuple[MeshSequence, bool]:
    """A mesh at other times, read as they are asked for, and whether anything is interpolated.

    Interpolation is by the cubic through two frames with the tangents of their neighbours.
    The vertices of frames without a person, or beyond the mesh's own, mean nothing, nor do those
    interpolated next to them; the mesh that is returned says which these are.
    """
    own, presence = mesh.times_s, mesh.presence
    right = np.searchsorted(own, times_s).clip(1, max(len(own) - 1, 1))
    left, right = right - 1, right.clip(max=len(own) - 1)
    nearest = np.where(times_s - own[left] <= own[right] - times_s, left, right)
    within = (times_s >= own[0] - SAME_S) & (times_s <= own[-1] + SAME_S)
    interpolated = bool((np.abs(own[nearest] - times_s)[within] > SAME_S).any())
    frames = np.searchsorted(own, times_s, side="right").clip(1, max(len(own) - 1, 1)) - 1
    following = (frames + 1).clip(max=len(own) - 1)
    # Between two frames there is a person where both have one, and none were lost between them.
    together = presence.first[frames] == presence.first[following]
    present = presence.present[frames] & presence.present[following] & together & within

    def made(rows: NDArray[np.intp]) -> NDArray[Any]:
        ends = frames[rows]
        low = int(max(presence.first[ends].min(), ends.min() - 1))
        high = int(min(presence.last[ends].max(), ends.max() + 2)) + 1
        block = mesh.read(low, high).astype(np.float64)
        vertices = np.empty((len(rows), mesh.vertex_count, 3))
        for at, (time_s, frame) in enumerate(
            zip(times_s[rows].tolist(), ends.tolist(), strict=True)
        ):
            # Only frames of the same stretch: past its end a person is somewhere else.
            begin, end = int(presence.first[frame]), int(presence.last[frame]) + 1
            inside = min(max(time_s, float(own[begin])), float(own[end - 1]))
            first, weights = cubic_weights(own[begin:end], inside, frame - begin)
            first += begin - low
            vertices[at] = np.tensordot(weights, block[first : first + len(weights)], 1)
        return vertices

    known = None if mesh.uncertainty is None else mesh.uncertainty.of_frames(nearest)
    shape = len(times_s), mesh.vertex_count, 3
    return replace(
        mesh,
        vertices=MadeVertices(shape, np.float64, made)
        if interpolated
        else MadeVertices(
            shape, mesh.vertices.dtype, lambda rows: read_frames(mesh, nearest[rows])
        ),
        timebase=Timebase(times_s),
        present=present if interpolated else presence.present[nearest] & within,
        uncertainty=known,
        others=(),
    ), interpolated
