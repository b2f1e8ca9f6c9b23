"""Points that things around a body hide from a sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.things import Surroundings
from sd2core.numerics.compiled import kernels_ready
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.exact_plain import exact_visibility


def hide_behind(
    surroundings: Surroundings,
    points: NDArray[Any],
    origin_m: NDArray[np.float64],
    sensor: NDArray[np.float64],
    seen: NDArray[np.uint8],
) -> None:
    """Set ``seen`` to 0 for the points of one frame that a thing hides.

    A second test beside that of the body itself, and always exact: the pixels of a depth buffer
    are as fine with a table beside the body as without.

    Parameters
    ----------
    surroundings : Surroundings
        Of the scene.
    points : float array, shape (3, V)
        Relative to ``origin_m``.
    origin_m : float64 array, shape (3,)
        In the camera frame.
    sensor : float64 array, shape (3,)
        In the frame of the points.
    seen : uint8 array, shape (V,)
        Written where it is 1; others are not tested.
    """
    if not seen.any():
        return
    count = points.shape[1]
    things = (surroundings.vertices_m - origin_m).T
    both = np.concatenate([points, things], axis=1).astype(np.float32)
    faces = surroundings.faces + np.int32(count)
    needed = np.zeros((1, both.shape[1]), np.uint8)
    needed[0, :count] = seen
    if not kernels_ready():
        seen[:] = exact_visibility(both, faces, sensor, needed[0] > 0)[:count]
        return
    visible = np.zeros_like(needed)
    exact_visibility_kernel(both[None], faces, sensor, needed, 0, 1, visible)
    seen[:] = visible[0, :count]
