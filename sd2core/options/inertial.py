"""Options of inertial sensors."""

from __future__ import annotations

import math
from typing import Annotated

from sd2core.options.kinds import NotNegative, Positive, Vector
from sd2core.options.records import Group, OptionError, OptionRecord, Place


class SensorErrors(OptionRecord):
    """Errors of a sensor as data sheets state them.

    Parameters
    ----------
    acceleration_bias_mps2 : X,Y,Z
        constant error of the accelerometer, in m/s²
    acceleration_noise : DENSITY
        density of its white noise, in m/s²/√Hz
    acceleration_range_mps2 : LARGEST
        its range, plus and minus, in m/s²; what is beyond is clipped
    turn_rate_bias_radps : X,Y,Z
        constant error of the gyroscope, in rad/s
    turn_rate_noise : DENSITY
        density of its white noise, in rad/s/√Hz
    turn_rate_range_radps : LARGEST
        its range, plus and minus, in rad/s; what is beyond is clipped
    seed : N
        seed of the noise
    """

    GROUP = Group("sensor errors", "none by default")

    acceleration_bias_mps2: Annotated[Vector | None, Place(("--acc-bias",))] = None
    acceleration_noise: Annotated[NotNegative | None, Place(("--acc-noise",))] = None
    acceleration_range_mps2: Annotated[Positive | None, Place(("--acc-range",))] = None
    turn_rate_bias_radps: Annotated[Vector | None, Place(("--gyr-bias",))] = None
    turn_rate_noise: Annotated[NotNegative | None, Place(("--gyr-noise",))] = None
    turn_rate_range_radps: Annotated[Positive | None, Place(("--gyr-range",))] = None
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        biases = (*(self.acceleration_bias_mps2 or ()), *(self.turn_rate_bias_radps or ()))
        if self.seed < 0 or not all(map(math.isfinite, biases)):
            bias = f" and a bias of {', '.join(map(str, biases))}" if biases else ""
            raise OptionError(
                f"The sensor has a seed of {self.seed}{bias}",
                "finite biases and a seed of 0 or more",
            )
