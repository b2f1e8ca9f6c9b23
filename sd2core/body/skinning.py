"""Fast posing of a surface: linear blend skinning of many frames, compiled and on all cores.

The bundled sample is posed by ``tools.build_sample.swipes``, slot by slot in double precision,
which comes out bit for bit alike everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body
from sd2core.body.rotations import Floats
from sd2core.numerics.compiled import compiled
from sd2core.numerics.parallel import spread

_JOB_FRAMES = 8


def pose_vertices(body: Body, transforms: Floats) -> NDArray[np.float32]:
    """Vertices (T, V, 3) of a posed surface, in float32.

    ``transforms`` (T, B, 3, 4) are those of :meth:`Skeleton.transforms`.
    """
    transforms = np.require(transforms, np.float64, ["C", "W"])
    vertices = np.empty((len(transforms), len(body.vertices_m), 3), np.float32)
    # Copies in plain memory: a read-only or strided array is another type to the compiler.
    rest, weights = np.array(body.vertices_m, order="C"), np.array(body.weights, order="C")
    bones = np.array(body.bones, np.int32, order="C")
    influences = (weights > 0).sum(axis=1, dtype=np.int32)

    def fill(first: int) -> None:
        last = min(first + _JOB_FRAMES, len(transforms))
        pose_kernel(rest, bones, weights, influences, transforms, first, last, vertices)

    if len(transforms) <= _JOB_FRAMES:
        fill(0)
        return vertices
    # Taken one by one, so that what one of them raises is not lost.
    for _ in spread(fill, range(0, len(transforms), _JOB_FRAMES)):
        pass
    return vertices


@compiled
def pose_kernel(
    rest: NDArray[np.float64],
    bones: NDArray[np.int32],
    weights: NDArray[np.float64],
    influences: NDArray[np.int32],
    transforms: NDArray[np.float64],
    first: int,
    last: int,
    vertices: NDArray[np.float32],
) -> None:
    """Pose the vertices of frames ``first`` to ``last``, as :func:`pose_vertices` does.

    Parameters
    ----------
    rest : float64 ndarray, (V, 3)
        Vertices at rest, in metres.
    bones : int32 ndarray, (V, 8)
        Bones that move each vertex.
    weights : float64 ndarray, (V, 8)
        Their weights, strongest first.
    influences : int32 ndarray, (V,)
        How many of them are not zero.
    transforms : float64 ndarray, (T, B, 3, 4)
        Of the bones in all frames.
    first, last : int
        Half-open range of frames.
    vertices : float32 ndarray, (T, V, 3)
        Written, in these frames.
    """
    for t in range(first, last):
        at = transforms[t]
        for v in range(rest.shape[0]):
            x, y, z = rest[v, 0], rest[v, 1], rest[v, 2]
            px, py, pz = 0.0, 0.0, 0.0
            for slot in range(influences[v]):
                bone, weight = at[bones[v, slot]], weights[v, slot]
                px += weight * (bone[0, 0] * x + bone[0, 1] * y + bone[0, 2] * z + bone[0, 3])
                py += weight * (bone[1, 0] * x + bone[1, 1] * y + bone[1, 2] * z + bone[1, 3])
                pz += weight * (bone[2, 0] * x + bone[2, 1] * y + bone[2, 2] * z + bone[2, 3])
            vertices[t, v, 0] = px
            vertices[t, v, 1] = py
            vertices[t, v, 2] = pz
