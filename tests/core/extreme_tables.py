"""The corners of what can be asked for, and references that round (nearly) nothing."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

DIGITS = 60
"""Of the decimal arithmetic: what it rounds is far below a double's last digit."""

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899")

DISTANCES_M = (1e-3, 0.03, 1.0, 2.2, 300.0, 1e4, 1e6)
SPEEDS_MPS = (1e-9, 1e-3, 0.125, 2.0, 30.0, 300.0)
RATES_HZ = (1.0, 30.0, 1e4)
SCALES_M = (1e-3, 1.0, 1e3)
OFFSETS_M = (0.0, 1e6)
PLACES = ("before", "on", "inside", "behind")


@dataclass(frozen=True)
class Scene:
    """Points on a ball that all move at one speed, each in a direction of its own.

    Parameters
    ----------
    distance_m : float
        From the sensor to the ball's surface (where ``place`` is before or behind).
    place : {"before", "on", "inside", "behind"}
        The sensor is on the camera's side, on a vertex, in the middle, or beyond
        the ball.
    speed_mps, rate_hz, scale_m, offset_m : float
        ``scale_m`` is the ball's radius; ``offset_m`` its distance from the world's
        origin, along every axis.
    """

    distance_m: float = 2.2
    place: str = "before"
    speed_mps: float = 1.0
    rate_hz: float = 30.0
    scale_m: float = 1.0
    offset_m: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.place}-{self.distance_m:g}m-{self.speed_mps:g}mps-{self.rate_hz:g}Hz"
            f"-scale{self.scale_m:g}-offset{self.offset_m:g}"
        )

    @property
    def duration_s(self) -> float:
        """Between two frames before and after."""
        return 2.0 / self.rate_hz

    @property
    def sensor_m(self) -> NDArray[np.float64]:
        """In the world."""
        middle = np.full(3, self.offset_m)
        towards = np.array([0.48, 0.6, -0.64])
        away = {
            "before": self.scale_m + self.distance_m,
            "on": self.scale_m,
            "inside": 0.0,
            "behind": -(self.scale_m + self.distance_m),
        }[self.place]
        return np.asarray(middle + away * towards)

    def points(self, count: int, seed: int = 0) -> NDArray[np.float64]:
        """Middle positions, (3, count); the first one is where a sensor on the body is."""
        random = np.random.default_rng(seed)
        points = random.normal(size=(3, count))
        points *= self.scale_m / np.linalg.norm(points, axis=0)
        points += self.offset_m
        points[:, 0] = self.offset_m + self.scale_m * np.array([0.48, 0.6, -0.64])
        return points

    def step(self, count: int, seed: int = 0) -> NDArray[np.float64]:
        """Half of each point's way from one frame before to one after, (3, count)."""
        random = np.random.default_rng([seed, 1])
        step = random.normal(size=(3, count))
        step *= 0.5 * self.speed_mps * self.duration_s / np.linalg.norm(step, axis=0)
        return np.asarray(step)


def every_scene() -> list[Scene]:
    """Each value of each quantity with the others ordinary, and all corners of all."""
    scenes = [Scene(distance_m=value) for value in DISTANCES_M]
    scenes += [Scene(place=value) for value in PLACES]
    scenes += [Scene(speed_mps=value) for value in SPEEDS_MPS]
    scenes += [Scene(rate_hz=value) for value in RATES_HZ]
    scenes += [Scene(scale_m=value) for value in SCALES_M]
    scenes += [Scene(offset_m=value) for value in OFFSETS_M]
    ends: Any = itertools.product(
        *((values[0], values[-1]) for values in (DISTANCES_M, SPEEDS_MPS, RATES_HZ, SCALES_M)),
        OFFSETS_M,
    )
    for distance_m, speed_mps, rate_hz, scale_m, offset_m in ends:
        scenes += [
            Scene(distance_m, place, speed_mps, rate_hz, scale_m, offset_m)
            for place in (PLACES if distance_m == DISTANCES_M[0] else ("before",))
        ]
    return list(dict.fromkeys(scenes))


def exact_ranges(points: ArrayLike, sensor: ArrayLike) -> list[Decimal]:
    """Distance of each point (3, n) of doubles from the sensor, to :data:`DIGITS`."""
    with localcontext() as context:
        context.prec = DIGITS
        place = [Decimal(float(value)) for value in np.asarray(sensor)]
        squares = (
            sum((Decimal(p) - s) ** 2 for p, s in zip(point, place, strict=True))
            for point in np.asarray(points, np.float64).T.tolist()
        )
        return [Decimal(square).sqrt() for square in squares]


def exact_velocities(
    before: ArrayLike, after: ArrayLike, sensor: ArrayLike, duration_s: float
) -> NDArray[np.float64]:
    """Mean radial velocity from the ranges themselves, (n,), rounded once at the end."""
    with localcontext() as context:
        context.prec = DIGITS
        pairs = zip(exact_ranges(before, sensor), exact_ranges(after, sensor), strict=True)
        return np.array([float((first - last) / Decimal(duration_s)) for first, last in pairs])


def exact_phasor(turns: Decimal) -> tuple[Decimal, Decimal]:
    """Cosine and sine of a phase in turns, by their series."""
    with localcontext() as context:
        context.prec = DIGITS
        angle = (turns - turns.to_integral_value()) * 2 * PI
        cosine, sine, term = Decimal(1), Decimal(0), Decimal(1)
        for order in range(1, 80):
            term = term * angle / order
            if order % 2:
                sine += term if order % 4 == 1 else -term
            else:
                cosine += term if order % 4 == 0 else -term
        return cosine, sine


def exact_mean_phasor(phases_rad: ArrayLike) -> complex:
    """Mean of exp(j phase) over a triangle on which the phase is linear.

    Twice the second divided difference of exp (Hermite and Genocchi), as it is written;
    phases that coincide are moved 1e-20 apart.
    """
    with localcontext() as context:
        context.prec = DIGITS
        apart = Decimal("1e-20")
        phases = [
            Decimal(float(phase)) + number * apart
            for number, phase in enumerate(np.asarray(phases_rad).tolist())
        ]
        real = imaginary = Decimal(0)
        for number, phase in enumerate(phases):
            one, two = (phases[number] - phases[number - step] for step in (1, 2))
            cosine, sine = exact_phasor(phase / (2 * PI))
            real += cosine / (one * two)
            imaginary += sine / (one * two)
        # Divided by j twice: exp differentiates to j exp.
        return complex(float(-2 * real), float(-2 * imaginary))
