"""Errors of a real inertial sensor: constant bias, white noise, a limited range."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np

from sd2core.body.rotations import Floats
from sd2core.imu.signals import InertialSignals
from sd2core.options.inertial import SensorErrors
from sd2core.sensor import Vector


def with_errors(signals: InertialSignals, errors: SensorErrors) -> InertialSignals:
    """Signals of a sensor with these errors: bias and noise, then the range; as they are with none.

    Samples at a rate f get noise of a standard deviation of density · √(f/2) (IEEE Std 952,
    one-sided).

    Examples
    --------
    >>> import numpy as np
    >>> rest = InertialSignals(np.arange(3) / 100, np.full((3, 3), 9.81), np.zeros((3, 3)))
    >>> with_errors(rest, SensorErrors(acceleration_range_mps2=2.0)).acceleration_mps2[0]
    array([2., 2., 2.])
    """
    stated = {one.name: getattr(errors, one.name) for one in fields(SensorErrors)}
    stated = {name: value for name, value in stated.items() if value and np.any(value)}
    if not stated.keys() - {"seed"}:
        return signals
    noise = np.random.default_rng(errors.seed).standard_normal((2, len(signals.times_s), 3))
    scale = math.sqrt(signals.rate_hz / 2)

    def spoilt(
        ideal: Floats, bias: Vector | None, density: float | None, drawn: Floats, most: float | None
    ) -> Floats:
        found = ideal + np.asarray(bias or (0.0, 0.0, 0.0)) + (density or 0.0) * scale * drawn
        return found if most is None else np.clip(found, -most, most)

    return replace(
        signals,
        acceleration_mps2=spoilt(
            signals.acceleration_mps2,
            errors.acceleration_bias_mps2,
            errors.acceleration_noise,
            noise[0],
            errors.acceleration_range_mps2,
        ),
        turn_rate_radps=spoilt(
            signals.turn_rate_radps,
            errors.turn_rate_bias_radps,
            errors.turn_rate_noise,
            noise[1],
            errors.turn_rate_range_radps,
        ),
        meta=signals.meta | {"errors": stated},
    )
