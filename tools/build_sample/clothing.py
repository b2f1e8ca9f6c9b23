"""Clothes of the simulated body: colour regions as signed distances on its rest shape.

A border is where a field changes sign; interpolated within triangles it is a
smooth line, however coarse the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Skeleton

Singles = NDArray[np.float32]

SKIN = (0.80, 0.61, 0.50)
HAIR = (0.23, 0.175, 0.145)
SHIRT = (0.13, 0.40, 0.56)
TROUSERS = (0.20, 0.215, 0.25)
SHOES = (0.86, 0.86, 0.85)
LIPS = (0.66, 0.42, 0.37)
EYES = (0.24, 0.17, 0.14)
WHITES = (0.90, 0.88, 0.86)

_HEM_M = 0.93
_SHOE_M = 0.085

Colour = tuple[float, float, float]
Pattern = Literal["plain", "stripes", "checks"]


@dataclass(frozen=True)
class Outfit:
    """Colours (sRGB, 0 to 1) and lengths of clothes, on the bundled body."""

    skin: Colour = SKIN
    hair: Colour = HAIR
    shirt: Colour = SHIRT
    trousers: Colour = TROUSERS
    shoes: Colour = SHOES
    pattern: Pattern = "plain"  # Pattern of the shirt.
    second: Colour = WHITES  # The pattern's other colour.
    period_m: float = 0.08  # Distance after which the pattern repeats.
    # From the shoulder along the arm: 0.03 leaves the arm bare, 0.19 is a T-shirt, 0.5 reaches the
    # wrist.
    sleeve_m: float = 0.19
    trousers_from_m: float = 0.0  # Height of their lower end: 0 is long, 0.5 ends above the knee.


@dataclass(frozen=True, eq=False)
class Clothes:
    """Fields of one surface."""

    # Positive inside, (V, 8): trousers, shirt, shoes, hair, brows, whites of the eyes, irises,
    # lips; metres for the first four.
    fields: Singles
    places_m: Singles  # Vertices at rest, (V, 3), on which a pattern is printed.
    outfit: Outfit = field(default_factory=Outfit)

    @classmethod
    def of(cls, body: Body, outfit: Outfit | None = None) -> Clothes:
        """Dress the bundled body.

        The body has the bundled shape: borders are sewn for it. A shaped body of the same surface
        wears the same clothes, vertex by vertex.
        """
        outfit = outfit or Outfit()
        # All lengths are metres on this body's rest shape, fitted by looking at pictures.
        p = body.vertices_m
        height = -p[:, 1]
        skeleton = body.skeleton
        arm = _share_of(body, ("upperarm", "lowerarm", "wrist", "finger", "metacarpal"))
        hem = height - _HEM_M
        neck = skeleton.heads_m[skeleton.index["neck01"]]
        # A crew neck: a ball around the root of the neck is bare, and all above.
        collar = np.linalg.norm(p - neck - np.array([0.0, 0.004, -0.022]), axis=1) - 0.088
        neckline = np.minimum(collar, 0.3 * (0.5 - _share_of(body, ("neck02", "neck03", "head"))))
        sleeve = np.maximum(outfit.sleeve_m - _along_arm(skeleton, p), 0.25 * (0.5 - arm))
        head = skeleton.heads_m[skeleton.index["head"]]
        z = p[:, 2] - head[2]
        above = height + head[1]
        hair = (above - 0.055 + 0.62 * z) / 1.2
        eye = np.abs(p[:, 0]) - skeleton.heads_m[skeleton.index["eye.L"], 0]
        eye_height = height + skeleton.heads_m[skeleton.index["eye.L"], 1]
        front = (-z - 0.03) * 40.0
        brows = 1.0 - (eye / 0.021) ** 2 - ((eye_height - 0.0175 + 4.0 * eye**2) / 0.0045) ** 2
        whites = 1.0 - (eye / 0.0145) ** 2 - ((eye_height + 0.0004) / 0.0043) ** 2
        eyes = 1.0 - (eye / 0.0068) ** 2 - (eye_height / 0.0062) ** 2
        lips = 1.0 - (p[:, 0] / 0.024) ** 2 - ((eye_height + 0.071) / 0.0075) ** 2
        # Shoes end what reaches the floor.
        legs = height - outfit.trousers_from_m if outfit.trousers_from_m > _SHOE_M else -hem
        fields = [
            np.minimum(np.minimum(-hem, 0.5 - arm), legs),
            np.minimum(np.minimum(hem, neckline), sleeve),
            _SHOE_M - height,
            hair,
            np.minimum(brows, front),
            np.minimum(whites, front),
            np.minimum(np.minimum(eyes, whites), front),
            np.minimum(lips, front),
        ]
        return cls(np.stack(fields, axis=1).astype(np.float32), p.astype(np.float32), outfit)

    @property
    def attributes(self) -> Singles:
        """Vertex attributes that :meth:`colours` takes interpolated within triangles, (V, K)."""
        if self.outfit.pattern == "plain":
            return self.fields
        return np.concatenate([self.fields, self.places_m], axis=1)

    def colours(self, attributes: Singles) -> tuple[Singles, Singles]:
        """Linear colour (N, 3) and gloss (N,) at interpolated :attr:`attributes` (N, K)."""
        outfit = self.outfit
        colours = np.tile(linear(outfit.skin), (len(attributes), 1))
        gloss = np.full(len(attributes), 0.6, np.float32)
        painted = (
            (7, LIPS, 0.8),
            (5, WHITES, 0.5),
            (6, EYES, 1.0),
            (4, outfit.hair, 0.2),
            (3, outfit.hair, 0.35),
            (0, outfit.trousers, 0.05),
            (1, outfit.shirt, 0.08),
            (2, outfit.shoes, 0.4),
        )
        for region, colour, shine in painted:
            inside = attributes[:, region] > 0.0
            colours[inside] = linear(colour)
            gloss[inside] = shine
            if region == 1 and outfit.pattern != "plain":
                odd = inside.copy()
                odd[inside] = self._in_second(attributes[inside, len(self.fields[0]) :])
                colours[odd] = linear(outfit.second)
        return colours, gloss

    def _in_second(self, places_m: Singles) -> NDArray[np.bool_]:
        """Share of a pattern's second colour at each point, (N,)."""
        halves = np.floor(places_m * np.float32(2.0 / self.outfit.period_m)).astype(np.int64)
        cells = halves[:, 1] if self.outfit.pattern == "stripes" else halves.sum(axis=1)
        odd: NDArray[np.bool_] = cells % 2 == 1
        return odd


def srgb(light: Singles) -> Singles:
    """The sRGB values (0 to 1) of linear light, by the plain power 1 / 2.2."""
    return np.clip(light, 0.0, 1.0) ** np.float32(1.0 / 2.2)


def linear(colour: tuple[float, float, float]) -> Singles:
    """Linear light of sRGB values, by the plain power 2.2."""
    return (np.asarray(colour, dtype=np.float32) ** np.float32(2.2)).astype(np.float32)


def _share_of(body: Body, prefixes: tuple[str, ...]) -> NDArray[np.float64]:
    """Weight of the bones with these names at every vertex, (V,)."""
    chosen = np.array([name.startswith(prefixes) for name in body.skeleton.names])
    share: NDArray[np.float64] = (body.weights * chosen[body.bones]).sum(axis=1)
    return share


def _along_arm(skeleton: Skeleton, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance from the nearer shoulder along its upper arm, (V,)."""
    shoulder = skeleton.heads_m[skeleton.index["upperarm01.L"]]
    elbow = skeleton.heads_m[skeleton.index["lowerarm01.L"]]
    towards = (elbow - shoulder) / np.linalg.norm(elbow - shoulder)
    mirrored = points * np.where(points[:, :1] < 0, np.array([[-1.0, 1.0, 1.0]]), 1.0)
    along: NDArray[np.float64] = (mirrored - shoulder) @ towards
    return along
