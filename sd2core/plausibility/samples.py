"""An inertial sensor's samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

_USUAL_HZ = (10.0, 10_000.0)
_GRAVITY_MPS2 = 9.81
_USUAL_MPS2 = (7.0, 13.0)
_FASTEST_TURN_RADPS = 70.0
"""Twice what usual gyroscopes reach."""
_UNITS = {"g": 1 / _GRAVITY_MPS2, "thousandths of g, or cm/s²": 1000 / _GRAVITY_MPS2}


def judge_inertial(
    times_s: NDArray[np.float64],
    acceleration_mps2: NDArray[np.float64],
    turn_rate_radps: NDArray[np.float64],
) -> list[Sd2Error]:
    """Findings on the rate of samples, gravity and turn rates.

    Parameters
    ----------
    times_s : float64 array, shape (N,)
    acceleration_mps2, turn_rate_radps : float64 arrays, shape (N, 3)
        NaN where not known.
    """
    findings = []
    slowest, fastest = _USUAL_HZ
    if len(times_s) > 1:
        rate_hz = 1.0 / float(np.median(np.diff(times_s)))
        if not slowest <= rate_hz <= fastest:
            findings.append(
                Sd2Error(
                    f"The sensor gives {rate_hz:.3g} samples per second",
                    f"{slowest:g} to {fastest:,g}",
                    "Look at the unit of its times",
                )
            )
    strength = np.linalg.norm(acceleration_mps2, axis=1)
    strength = strength[np.isfinite(strength)]
    if strength.size:
        findings += _judge_gravity(float(np.median(strength)))
    turns = np.linalg.norm(turn_rate_radps, axis=1)
    fastest_turn = float(np.max(turns, where=np.isfinite(turns), initial=0.0))
    if fastest_turn > _FASTEST_TURN_RADPS:
        findings.append(
            Sd2Error(
                f"The sensor turns at up to {fastest_turn:,.0f} rad/s",
                f"below {_FASTEST_TURN_RADPS:g} rad/s",
                "These are probably degrees per second: state the unit in the heading",
            )
        )
    return findings


def _judge_gravity(usual_mps2: float) -> list[Sd2Error]:
    low, high = _USUAL_MPS2
    if low <= usual_mps2 <= high:
        return []
    cause = "Look at the unit of its accelerations"
    if usual_mps2 < 0.1 * low:
        cause = "Gravity was probably taken away already, or they are in another unit"
    for unit, factor in _UNITS.items():
        if low * factor <= usual_mps2 <= high * factor:
            cause = f"These are probably in {unit}: state the unit in the heading"
    return [
        Sd2Error(
            f"Accelerations are of {usual_mps2:.3g} m/s² typically",
            f"about {_GRAVITY_MPS2:g} m/s², which is gravity",
            cause,
        )
    ]
