"""Errors of a real inertial sensor: constant bias, white noise, a limited range."""

from __future__ import annotations

import math
from dataclasses import asdict, astuple, dataclass, replace

import numpy as np

from sd2core.body.rotations import Floats
from sd2core.errors import Sd2Error
from sd2core.imu.signals import InertialSignals
from sd2core.sensor import Vector

_NOTHING: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SensorErrors:
    """Errors of a sensor as data sheets state them.

    Parameters
    ----------
    acceleration_bias_mps2, turn_rate_bias_radps : tuple of 3 floats
        Added to every sample, along x, y, z.
    acceleration_noise, turn_rate_noise : float
        Densities of white noise, in m/s²/√Hz and rad/s/√Hz: samples at a rate f get a standard
        deviation of density · √(f/2) (IEEE Std 952, one-sided).
    acceleration_range_mps2, turn_rate_range_radps : float
        Largest magnitude that each axis shows; what is beyond is clipped.
    seed : int
        Of the noise.

    Raises
    ------
    Sd2Error
        When a number cannot be.

    Examples
    --------
    >>> import numpy as np
    >>> rest = InertialSignals(np.arange(3) / 100, np.full((3, 3), 9.81), np.zeros((3, 3)))
    >>> SensorErrors(acceleration_range_mps2=2.0).applied(rest).acceleration_mps2[0]
    array([2., 2., 2.])
    """

    acceleration_bias_mps2: Vector = _NOTHING
    turn_rate_bias_radps: Vector = _NOTHING
    acceleration_noise: float = 0.0
    turn_rate_noise: float = 0.0
    acceleration_range_mps2: float = math.inf
    turn_rate_range_radps: float = math.inf
    seed: int = 0

    def __post_init__(self) -> None:
        biases = (*self.acceleration_bias_mps2, *self.turn_rate_bias_radps)
        noises = (self.acceleration_noise, self.turn_rate_noise)
        ranges = (self.acceleration_range_mps2, self.turn_rate_range_radps)
        if (
            not all(map(math.isfinite, (*biases, *noises)))
            or min(noises) < 0
            or not all(one > 0 for one in ranges)
            or self.seed < 0
        ):
            raise Sd2Error(
                f"The errors of the sensor are {', '.join(map(str, astuple(self)))}",
                "finite biases, noise of 0 or more, ranges above 0 and a seed of 0 or more",
            )

    def applied(self, signals: InertialSignals) -> InertialSignals:
        """Signals of a sensor with these errors: bias and noise, then the range."""
        noise = np.random.default_rng(self.seed).standard_normal((2, len(signals.times_s), 3))
        scale = math.sqrt(signals.rate_hz / 2)
        usual = asdict(SensorErrors())
        stated = {name: value for name, value in asdict(self).items() if value != usual[name]}

        def spoilt(values: Floats, bias: Vector, drawn: Floats, most: float) -> Floats:
            return np.clip(values + np.asarray(bias) + drawn, -most, most)

        return replace(
            signals,
            acceleration_mps2=spoilt(
                signals.acceleration_mps2,
                self.acceleration_bias_mps2,
                self.acceleration_noise * scale * noise[0],
                self.acceleration_range_mps2,
            ),
            turn_rate_radps=spoilt(
                signals.turn_rate_radps,
                self.turn_rate_bias_radps,
                self.turn_rate_noise * scale * noise[1],
                self.turn_rate_range_radps,
            ),
            meta=signals.meta | {"errors": stated},
        )
