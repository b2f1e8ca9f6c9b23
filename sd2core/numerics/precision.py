"""Limits of single precision for positions and velocities (docs/decisions/0013)."""

from __future__ import annotations

ROUNDING = 2.0**-24
"""Half the distance of 1 to the next number in single precision."""

SHARE_OF_A_BIN = 0.01
"""Allowed rounding error of a velocity, as a share of a Doppler bin."""

SHARE_OF_THE_BODY = 1e-5
"""Allowed rounding error of a body's shape, as a share of its size: 0.02 mm of a person."""

SHARE_OF_A_WEIGHT = 0.01
"""Allowed rounding error of a vertex's weight by the range law, as a share of it."""

_STEPS = 12.0
"""Roundings that add up in the difference of two ranges, in parts of the largest
coordinate. Seen: up to 8.3 among 10^6 random places, 1.3 in the root mean square."""


def velocity_error_mps(extent_m: float, duration_s: float) -> float:
    """Error of a radial velocity by single precision.

    A range computed from coordinates of up to ``extent_m``, counted from the origin that positions
    are kept around, is wrong by a few roundings of that size, wherever the sensor is: the distance
    to it changes by no more than the coordinates do, and what a far sensor adds is taken off before
    (:mod:`sd2core.doppler.kernels`). ``duration_s`` lies between the two ranges.
    """
    return _STEPS * ROUNDING * extent_m / duration_s


def stored_velocity_error_mps(reach_m: float, duration_s: float) -> float:
    """Error of a velocity if coordinates of up to ``reach_m`` are stored in single precision."""
    return 2.0 * ROUNDING * reach_m / duration_s


def keeps_shape(extent_m: float, size_m: float) -> bool:
    """True if single precision keeps the shape of a body so far from the origin.

    ``size_m`` is the largest extent of the body itself; 0 for a point, which has no shape.
    """
    return size_m == 0 or ROUNDING * extent_m <= SHARE_OF_THE_BODY * size_m


def single_is_enough(
    extent_m: float,
    size_m: float,
    duration_s: float,
    bin_width_mps: float,
    range_exponent: float,
    nearest_range_m: float,
) -> bool:
    """True if positions may be kept, and vertices counted, in single precision.

    Parameters
    ----------
    extent_m : float
        Largest coordinate, counted from the origin that positions are kept around.
    size_m : float
        Largest extent of the body itself, at one moment; 0 for a point without a shape.
    duration_s : float
        Shortest time between two positions that a velocity is measured over.
    bin_width_mps : float
        Of the Doppler axis.
    range_exponent : float
        Of the range law: the weight's relative error is this many times the range's.
    nearest_range_m : float
        Shorter ranges count as this in the range law.
    """
    range_error_m = velocity_error_mps(extent_m, 1.0)
    return (
        range_error_m <= SHARE_OF_A_BIN * bin_width_mps * duration_s
        and keeps_shape(extent_m, size_m)
        and range_exponent * range_error_m <= SHARE_OF_A_WEIGHT * nearest_range_m
    )
