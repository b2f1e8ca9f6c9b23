"""Maps that NumPy makes in place of the kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from oracles import counting, surfaces
from oracles.depth_visibility import depth_visibility
from oracles.exact_visibility import exact_visibility
from oracles.expected import count_expected
from oracles.hiding import hide_behind
from sd2core.doppler import cell_uncertainty, frame_counts, histogram, masks
from sd2core.doppler.histogram import Frames, Paths
from sd2core.doppler.prepared import PreparedMesh
from sd2core.scattering import amplitude, visibility
from sd2core.scattering.visibility import facing_mask


def plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let NumPy do what the kernels would; all vertices of every frame are counted."""
    for module, name, function in (
        (masks, "exact_visibility_kernel", _exact),
        (masks, "depth_visibility_kernel", _depth),
        (masks, "facing_kernel", _facing),
        (masks, "hide_behind", hide_behind),
        (histogram, "count", _count),
        (histogram, "mark_needed", _mark_needed),
        (frame_counts, "count_expected", count_expected),
        (cell_uncertainty, "fine_histograms", counting.fine_histograms),
        (visibility, "vertex_normals_kernel", _whole(surfaces.vertex_normals)),
        (amplitude, "vertex_areas_kernel", _whole(surfaces.vertex_areas)),
        (amplitude, "vertex_area_vectors_kernel", _whole(surfaces.vertex_area_vectors)),
        (PreparedMesh, "moving", lambda *_: None),
    ):
        monkeypatch.setattr(module, name, function)


def _exact(
    points: Any, faces: Any, place: Any, needed: Any, first: int, last: int, visible: Any
) -> None:
    for t in range(first, last):
        wanted = needed[t] > 0
        visible[t][wanted] = exact_visibility(points[t], faces, place, wanted)[wanted]


def _depth(
    points: Any,
    faces: Any,
    closed: bool,
    place: Any,
    pixels: int,
    needed: Any,
    first: int,
    last: int,
    visible: Any,
) -> None:
    for t in range(first, last):
        wanted = needed[t] > 0
        seen = depth_visibility(points[t], faces, closed, place, pixels, wanted)
        visible[t][wanted] = seen[wanted]


def _facing(*arguments: Any) -> None:
    *numbers, visible = arguments
    points, normals = np.stack(numbers[:3]), np.stack(numbers[3:6])
    visible[:] = facing_mask(points[None], normals[None], np.array(numbers[6:]))[0]


def _whole(function: Any) -> Any:
    def kernel(points: Any, faces: Any, into: Any) -> None:
        into[:] = function(points, faces)

    return kernel


def _frames(paths: Paths, duration_s: NDArray[np.float64]) -> Frames:
    positions = paths.places.reshape(-1, 3, paths.vertices)
    return Frames(positions, paths.centre, paths.before, paths.after, duration_s)


def _count(paths: Paths, start: int, duration_s: Any, *others: Any) -> None:
    assert start == 0
    counting.count(_frames(paths, duration_s), *others)


def _mark_needed(paths: Paths, start: int, duration_s: Any, *others: Any) -> Any:
    assert start == 0
    return counting.mark_needed(_frames(paths, duration_s), *others)
