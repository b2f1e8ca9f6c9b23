"""Vertices that are made from those of another mesh whenever frames are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


class MadeVertices:
    """Vertices (T, V, 3) of frames that a function makes when they are asked for.

    Parameters
    ----------
    shape : tuple of 3 int
    dtype : numpy dtype
        Of what is made.
    make : callable
        Takes numbers of frames (n,), at least one, and gives their vertices (n, V, 3).
    """

    def __init__(
        self,
        shape: tuple[int, int, int],
        dtype: Any,
        make: Callable[[NDArray[np.intp]], NDArray[Any]],
    ) -> None:
        self.shape, self.dtype, self._make = shape, np.dtype(dtype), make

    def __getitem__(self, key: Any) -> NDArray[Any]:
        frames, *rest = key if isinstance(key, tuple) else (key,)
        rows = np.arange(self.shape[0])[frames]
        if not rows.size:
            return np.empty((*rows.shape, *self.shape[1:]), self.dtype)[(slice(None), *rest)]
        made = self._make(np.atleast_1d(rows)).astype(self.dtype, copy=False)
        if rows.ndim == 0:
            one: NDArray[Any] = made[0][tuple(rest)]
            return one
        part: NDArray[Any] = made[(slice(None), *rest)]
        return part

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)
