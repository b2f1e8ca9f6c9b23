"""Doppler map to which columns are added."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from sd2core.maps import DopplerMap
from sd2core.timebase import Timebase


def extended(doppler: DopplerMap, columns: Iterable[tuple[float, Sequence[float]]]) -> DopplerMap:
    """Map with columns at its end, each a time in seconds and the values of its bins.

    Those that are not later than the last, or of another number of bins, are left out; without any
    it is the same map.
    """
    times_s, values = [float(doppler.times_s[-1])], []
    for time_s, column in columns:
        if time_s > times_s[-1] and len(column) == doppler.axis.bins:
            times_s.append(time_s)
            values.append(np.array(column, np.float32))
    if not values:
        return doppler
    return replace(
        doppler,
        values=np.column_stack([doppler.values, *values]),
        timebase=Timebase(np.concatenate([doppler.times_s, times_s[1:]])),
        present=None,
    )
