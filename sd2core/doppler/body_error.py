"""How far a map is from the true body's, as badly as the mesh says its velocities to be known."""

from __future__ import annotations

import math

import numpy as np

from sd2core.doppler.synthesizer import Synthesizer
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

BODY_FACTOR = 1.17
"""Factor on the body's share; with it the figure covered the true error of 16 of 20 calibrating
clips (docs/decisions/0071)."""

_STRETCHES, _FRAMES = 8, 8
"""Of a long clip so many stretches of so many frames are looked at."""


def body_error(
    maker: Synthesizer, sensor: VirtualSensor, *, progress: Progress = silent
) -> float | None:
    """Expected relative L1 between a synthesizer's map and the true body's, after smoothing.

    Each cell deviates normally, as :meth:`~sd2core.Synthesizer.uncertainty` says; the expected
    absolute deviations are added up and divided by the sum of the expected map. Of more than 64
    frames eight stretches of eight are looked at, which tells it to a tenth. None if the mesh does
    not say how badly its velocities are known, or says that they are exact.

    Parameters
    ----------
    maker : Synthesizer
        Of the mesh and the options that the map is made with.
    sensor : VirtualSensor
        Of the map.
    progress : Progress
        Counts the stretches; may raise Cancelled.
    """
    from scipy.special import erf

    if all(body.uncertainty is None for body in maker.mesh.bodies):
        return None
    count = maker.mesh.frame_count
    spans = [(0, count)]
    if count > _STRETCHES * _FRAMES:
        firsts = np.linspace(0, count - _FRAMES, _STRETCHES).astype(int).tolist()
        spans = [(first, first + _FRAMES) for first in firsts]
    off = expected = doubt = 0.0
    for number, span in enumerate(spans):
        known = maker.uncertainty(sensor, frames=span)
        values = maker.stretch(sensor, *span, shares=False).values
        sd = known.sd.astype(np.float64)
        missed = (known.expected - values) / np.where(sd > 0, sd, 1.0)
        normal = math.sqrt(2 / math.pi) * np.exp(-0.5 * missed**2)
        off += float((sd * (normal + missed * erf(missed / math.sqrt(2)))).sum())
        expected += float(known.expected.sum(dtype=np.float64))
        doubt += float(sd.sum())
        progress(number + 1, len(spans))
    return BODY_FACTOR * off / expected if doubt > 0 and expected > 0 else None
