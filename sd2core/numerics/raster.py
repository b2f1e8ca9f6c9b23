"""Triangles to pixels: a depth buffer that also keeps which triangle is in front."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled


@compiled
def rasterise(
    points: NDArray[np.float32],
    nearness: NDArray[np.float32],
    faces: NDArray[np.int32],
    buffer: NDArray[np.float32],
    owner: NDArray[np.int32],
) -> None:
    """Draw triangles that face the viewer into a depth buffer.

    Parameters
    ----------
    points : float32 array, shape (V, 2)
        Pixel coordinates x right, y down; the centre of pixel (r, c) is (c + 0.5, r + 0.5).
    nearness : float32 array, shape (V,)
        Larger is nearer, linear on the image (1/z for a pinhole).
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside, in a frame with y down.
    buffer : float32 array, shape (H, W)
        Nearness so far; updated.
    owner : int32 array, shape (H, W)
        Triangle in front; updated where one is drawn.
    """
    height, width = buffer.shape
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, y0 = points[i, 0], points[i, 1]
        x1, y1 = points[j, 0], points[j, 1]
        x2, y2 = points[k, 0], points[k, 1]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        # Outwards and y down: what is seen from the front turns the other way.
        if area >= 0.0:
            continue
        left = max(int(np.ceil(min(x0, x1, x2) - 0.5)), 0)
        right = min(int(np.floor(max(x0, x1, x2) - 0.5)), width - 1)
        top = max(int(np.ceil(min(y0, y1, y2) - 0.5)), 0)
        bottom = min(int(np.floor(max(y0, y1, y2) - 0.5)), height - 1)
        inverse = np.float32(1.0) / area
        for r in range(top, bottom + 1):
            y = np.float32(r + 0.5)
            for c in range(left, right + 1):
                x = np.float32(c + 0.5)
                b0 = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) * inverse
                b1 = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) * inverse
                b2 = np.float32(1.0) - b0 - b1
                if b0 < 0.0 or b1 < 0.0 or b2 < 0.0:
                    continue
                near = b0 * nearness[i] + b1 * nearness[j] + b2 * nearness[k]
                if near > buffer[r, c]:
                    buffer[r, c] = near
                    owner[r, c] = f


@compiled
def interpolate(
    points: NDArray[np.float32],
    nearness: NDArray[np.float32],
    faces: NDArray[np.int32],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    owner: NDArray[np.int32],
    attributes: NDArray[np.float32],
    values: NDArray[np.float32],
) -> None:
    """Attributes of vertices at pixels, correct in perspective.

    Parameters
    ----------
    rows, columns : intp array, shape (N,)
        Pixels that a triangle owns.
    owner : int32 array, shape (H, W)
    attributes : float32 array, shape (V, K)
    values : float32 array, shape (N, K)
        Filled.
    """
    for n in range(rows.shape[0]):
        f = owner[rows[n], columns[n]]
        x, y = np.float32(columns[n] + 0.5), np.float32(rows[n] + 0.5)
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, y0 = points[i, 0] - x, points[i, 1] - y
        x1, y1 = points[j, 0] - x, points[j, 1] - y
        x2, y2 = points[k, 0] - x, points[k, 1] - y
        w0 = (x1 * y2 - x2 * y1) * nearness[i]
        w1 = (x2 * y0 - x0 * y2) * nearness[j]
        w2 = (x0 * y1 - x1 * y0) * nearness[k]
        inverse = np.float32(1.0) / (w0 + w1 + w2)
        for a in range(attributes.shape[1]):
            values[n, a] = inverse * (
                w0 * attributes[i, a] + w1 * attributes[j, a] + w2 * attributes[k, a]
            )
