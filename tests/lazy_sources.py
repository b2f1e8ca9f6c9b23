"""Data sets of sources that are made already, and not only when they are needed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets import writing
from sd2core.datasets.source import LazySource, Source
from sd2core.datasets.writing import Written


def lazily(source: Source) -> LazySource:
    """A source as the writer takes it."""
    return LazySource(source.key, lambda _: source, lambda: made_of(source), source.outline)


def made_of(source: Source) -> str:
    """Hash of maps, labels, signals and sensor."""
    sums = hashlib.sha256()
    about = [source.sensor.as_dict(), source.labels, dict(source.classes), source.spans]
    sums.update(json.dumps(about).encode())
    arrays = [source.label, source.times_s]
    for one in source.maps.values():
        split = () if one.limbs is None else (one.limbs.values, one.limbs.kinematics)
        arrays += [one.values, one.present_mask, *split]
    arrays += [signals.channels for signals in source.imu.values()]
    for array in arrays:
        sums.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    sums.update(json.dumps([*source.maps, *source.imu]).encode())
    return sums.hexdigest()


def write_dataset(
    out: Path, sources: Iterable[Source | LazySource], *how: Any, **more: Any
) -> Written:
    """Write sources of either kind."""
    lazy = [lazily(one) if isinstance(one, Source) else one for one in sources]
    return writing.write_dataset(out, lazy, *how, **more)
