"""People and rooms of the clips of known motion: shapes, clothes, light."""

from __future__ import annotations

from dataclasses import dataclass

from sd2core.body.shape import BodyShape, ShapeSpace
from tools.build_sample.clothing import Outfit
from tools.build_sample.render import Studio

_PHENOTYPES = ("gender", "muscle", "weight", "proportions")


@dataclass(frozen=True)
class Person:
    """One simulated person."""

    phenotypes: tuple[float, float, float, float]  # from 0 to 1, see _PHENOTYPES
    stature_m: float
    outfit: Outfit

    def shape(self, space: ShapeSpace) -> BodyShape:
        """Shape of this person."""
        phenotypes = dict(zip(_PHENOTYPES, self.phenotypes, strict=True))
        return BodyShape(space.coefficients(**phenotypes), self.stature_m)


PEOPLE = {
    "ada": Person((0.95, 0.45, 0.40, 0.7), 1.64, Outfit()),
    "bo": Person(
        (0.05, 0.70, 0.50, 0.5),
        1.83,
        Outfit(
            skin=(0.52, 0.36, 0.27),
            hair=(0.09, 0.08, 0.08),
            shirt=(0.75, 0.20, 0.17),
            trousers=(0.16, 0.19, 0.30),
            pattern="stripes",
            second=(0.88, 0.86, 0.82),
            period_m=0.09,
        ),
    ),
    "chen": Person(
        (0.40, 0.40, 0.30, 0.4),
        1.72,
        Outfit(
            hair=(0.12, 0.10, 0.10),
            # Hardly darker than the wall behind.
            shirt=(0.72, 0.72, 0.70),
            trousers=(0.42, 0.38, 0.32),
            shoes=(0.15, 0.15, 0.16),
            sleeve_m=0.50,
        ),
    ),
    "dora": Person(
        (0.90, 0.35, 0.80, 0.5),
        1.58,
        Outfit(
            skin=(0.86, 0.69, 0.60),
            hair=(0.55, 0.40, 0.24),
            shirt=(0.24, 0.42, 0.28),
            trousers=(0.36, 0.33, 0.34),
            pattern="checks",
            second=(0.14, 0.17, 0.22),
            period_m=0.11,
            sleeve_m=0.03,
        ),
    ),
    "emil": Person(
        (0.10, 0.55, 0.85, 0.3),
        1.78,
        Outfit(
            skin=(0.70, 0.51, 0.40),
            hair=(0.36, 0.34, 0.33),
            shirt=(0.13, 0.13, 0.15),
            trousers=(0.11, 0.11, 0.13),
            shoes=(0.25, 0.16, 0.11),
            sleeve_m=0.50,
        ),
    ),
    "femi": Person(
        (0.60, 0.80, 0.45, 0.8),
        1.90,
        Outfit(
            skin=(0.38, 0.26, 0.20),
            hair=(0.07, 0.06, 0.06),
            shirt=(0.90, 0.72, 0.20),
            trousers=(0.55, 0.50, 0.42),
            trousers_from_m=0.52,
        ),
    ),
}
"""Six people between 1.58 and 1.90 m, in plain, striped and checked clothes."""

ROOMS = {
    "studio": Studio(),
    "window": Studio(
        wall=(0.74, 0.77, 0.80),
        floor=(0.42, 0.36, 0.31),
        key=(-1.0, -0.25, -0.35),
        fill=(0.9, -0.2, -0.7),
        key_power=2.0,
        fill_power=0.12,
        ambient=0.14,
        sky=0.16,
        key_colour=(0.92, 0.97, 1.0),
    ),
    "evening": Studio(
        wall=(0.56, 0.50, 0.44),
        floor=(0.34, 0.27, 0.23),
        skirting=(0.62, 0.57, 0.52),
        key=(0.55, -0.95, -0.60),
        key_power=1.0,
        fill_power=0.16,
        ambient=0.12,
        sky=0.14,
        key_colour=(1.0, 0.86, 0.66),
    ),
    "office": Studio(
        wall=(0.80, 0.82, 0.80),
        floor=(0.50, 0.52, 0.55),
        key=(-0.15, -1.0, -0.45),
        key_power=1.05,
        fill_power=0.35,
        ambient=0.34,
        sky=0.42,
        key_colour=(0.97, 1.0, 0.98),
    ),
}
"""Light from one side, a window, a warm lamp, and from the ceiling."""
