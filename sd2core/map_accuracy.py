"""How far a synthetic map may be from the truth: one figure, of the body and of the arithmetic."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sd2core.progress import Progress, silent

if TYPE_CHECKING:
    from sd2core.doppler.synthesizer import Synthesizer
    from sd2core.sensor import VirtualSensor

BODY_FACTOR = 1.0
"""Factor on the body's share, by which the figure covers the true error of most fitted clips."""

_STRETCHES, _FRAMES = 16, 16
"""Of a long clip so many stretches of so many frames are looked at."""

_LEAST_PERCENT = 1e-3


@dataclass(frozen=True)
class MapAccuracy:
    """Relative L1 of a smoothed synthetic map: as text ``±38 %: body 37, arithmetic 7.5``.

    Parameters
    ----------
    body : float, optional
        Expected error that follows from how badly the mesh says its velocities to be known, as a
        share. None: it says nothing, or that they are exact.
    arithmetic : float, optional
        Error of the plan by which the map was counted, against exact counting, as a share.
        None: it was not measured.

    Examples
    --------
    >>> from sd2core.map_accuracy import MapAccuracy
    >>> print(MapAccuracy(body=0.37, arithmetic=0.075))
    ±38 %: body 37, arithmetic 7.5
    >>> print(MapAccuracy(arithmetic=0.031))
    ±3.1 %
    """

    body: float | None = None
    arithmetic: float | None = None

    @classmethod
    def of(cls, meta: Mapping[str, Any]) -> MapAccuracy:
        """Accuracy that a map's metadata state."""
        return cls(meta.get("body_error_l1"), meta.get("plan_error_l1"))

    @property
    def total(self) -> float | None:
        """Root of the sum of the squares of both; None if neither is known."""
        known = [part for part in (self.body, self.arithmetic) if part is not None]
        return math.hypot(*known) if known else None

    def __str__(self) -> str:
        if self.total is None:
            return ""
        words = percent(self.total)
        words = words if words.startswith("<") else f"±{words}"
        if self.body is None:
            return words
        parts = {"body": self.body, "arithmetic": self.arithmetic}
        told = [f"{name} {percent(of)[:-2]}" for name, of in parts.items() if of is not None]
        return f"{words}: {', '.join(told)}"


def body_error(
    maker: Synthesizer,
    sensor: VirtualSensor,
    *,
    frames: tuple[int, int] | None = None,
    progress: Progress = silent,
) -> float | None:
    """Expected relative L1 between a synthesizer's map and the true body's, after smoothing.

    Each cell deviates normally, as :meth:`~sd2core.Synthesizer.uncertainty` says; the expected
    absolute deviations are added up and divided by the sum of the expected map. Of more than 256
    frames 16 stretches of 16 are looked at. None if the mesh does not say how badly its velocities
    are known, or says that they are exact.
    """
    from scipy.special import erf

    if maker.mesh.uncertainty is None:
        return None
    start, stop = frames or (0, maker.mesh.frame_count)
    spans = [(start, stop)]
    if stop - start > _STRETCHES * _FRAMES:
        firsts = np.linspace(start, stop - _FRAMES, _STRETCHES).astype(int).tolist()
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


def percent(share: float) -> str:
    """A share with two figures; whole above 10 %, and not more than a map can tell below.

    It is infinite where an empty map changes.
    """
    value = 100 * share
    if value == 0:
        return "0 %"
    if value == float("inf"):
        return "∞ %"
    if value < _LEAST_PERCENT:
        return f"<{_LEAST_PERCENT:g} %"
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"
