"""Sentences on inertial sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2app.imu.model import ImuModel
from sd2app.widgets.time_axis import clock_text
from sd2core.imu.signals import InertialSignals

AXES = ("x", "y", "z")
_NEAR_S = 0.05
"""Farthest sample whose values are read at a time."""


def status_parts(model: ImuModel) -> list[str]:
    """How the lines were made, or why there are none; the first parts matter most."""
    parts, signals = [], model.signals
    if signals is not None:
        parts.append(f"simulated, low pass {signals.meta['cutoff_hz']:.3g} Hz")
    elif model.current is not None:
        parts.append(model.problem or "being computed…")
    if model.measured is not None and model.file is not None:
        parts += [f"{model.file_words}: {model.file.name}", f"from {clock_text(model.offset_s)}"]
    return parts


def reading_lines(model: ImuModel, time_s: float) -> tuple[str, ...]:
    """Time, then acceleration and turn rate of each sensor; nothing where there are none."""
    lines = []
    if model.signals is not None:
        lines += _values_at("simulated", model.signals, time_s)
    if model.measured is not None:
        lines += _values_at(model.file_words, model.measured, time_s - model.shift_s)
    return (clock_text(time_s), *lines) if lines else ()


def _values_at(name: str, signals: InertialSignals, time_s: float) -> list[str]:
    """Acceleration and turn rate of the sample nearest to a time, if one is near."""
    times_s, after = signals.times_s, int(np.searchsorted(signals.times_s, time_s))
    beside = [at for at in (after - 1, after) if 0 <= at < len(times_s)]
    nearest = min(beside, key=lambda at: abs(times_s[at] - time_s))
    if abs(times_s[nearest] - time_s) > _NEAR_S:
        return []
    acceleration, turn_rate = signals.acceleration_mps2[nearest], signals.turn_rate_radps[nearest]
    if not np.isfinite([acceleration, turn_rate]).all():
        return [f"{name}: not known"]
    return [f"{name}: {_axes(acceleration, 1)} m/s²", f"{_axes(turn_rate, 2)} rad/s"]


def _axes(values: NDArray[np.float64], decimals: int) -> str:
    """Values with their signs, in the order of the axes."""
    return "  ".join(
        f"{axis} {value:+.{decimals}f}".replace("-", "−")
        for axis, value in zip(AXES, values.tolist(), strict=True)
    )
