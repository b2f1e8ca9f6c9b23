"""What a synthesizer answers, besides maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.masks import Quality


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of a synthetic Doppler map.

    Parameters
    ----------
    values : float32 array, shape (bins, n)
    raw : float64 array, shape (bins, n)
        The same before any smoothing, with nulled bins emptied.
    visible_share : float32 array, shape (n,)
        Share of all vertices that the sensor sees; of a decimated mesh, of the
        vertices that the kept ones stand for. Vertices that cannot change
        the map (in nulled bins) are judged by the facing test.
    beyond_share : float32 array, shape (n,)
        Share of those whose velocity lies beyond the axis.
    quality : {"none", "facing", "depth", "frozen", "exact"}
        The weakest visibility that was used: ``frozen`` falls back to facing
        where no depth or exact visibility is kept.
    processor_s : float
        Processor time that visibility and counting took, all threads together.
    """

    values: NDArray[np.float32]
    raw: NDArray[np.float64]
    visible_share: NDArray[np.float32]
    beyond_share: NDArray[np.float32]
    quality: Quality
    processor_s: float = 0.0


@dataclass(frozen=True, eq=False)
class FrameScattering:
    """What a sensor gets back from one frame.

    Parameters
    ----------
    velocity_mps : float32 array, shape (V,)
        Radial velocity, positive when approaching.
    range_m : float32 array, shape (V,)
        Distance from the sensor.
    visible : bool array, shape (V,)
    quality : {"none", "facing", "depth", "frozen", "exact"}
        How ``visible`` was found.
    """

    velocity_mps: NDArray[np.float32]
    range_m: NDArray[np.float32]
    visible: NDArray[np.bool_]
    quality: Quality
