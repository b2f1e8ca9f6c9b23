"""Random clothes: regions of the body's surface, and their colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body
from tools.build_sample.clothing import EYES, LIPS, WHITES, Clothes, linear

Singles = NDArray[np.float32]

REGIONS = ("skin", "trousers", "shirt", "shoes", "hair", "brows", "whites", "eyes", "lips")
"""Regions in order of painting: later ones cover earlier ones."""

_SKINS = ((0.95, 0.80, 0.72), (0.86, 0.68, 0.56), (0.70, 0.50, 0.38), (0.48, 0.33, 0.25))
_HAIRS = ((0.10, 0.08, 0.07), (0.30, 0.20, 0.14), (0.62, 0.48, 0.30), (0.65, 0.65, 0.65))


@dataclass(frozen=True, eq=False)
class Wardrobe:
    """Clothes of one surface."""

    fields: Singles  # (V, 8), positive inside REGIONS but the first
    palette: Singles  # (9, 3), linear colours of the regions
    texture: Singles  # (2, V), how much lighter or darker shirt and trousers are at every vertex


def random_wardrobe(rng: np.random.Generator, body: Body) -> Wardrobe:
    """Random clothes: sleeves from none to long, trousers from short to long."""
    points = body.vertices_m
    scale = body.stature_m / 1.75
    height = -points[:, 1]
    limbs = vertex_limbs(body)
    of = {name: limbs == number for number, name in enumerate(LIMBS)}
    heads, index = body.skeleton.heads_m, body.skeleton.index
    fields = Clothes.of(body).fields.copy()  # the face and the shoes are taken over
    arms = np.zeros(len(points), bool)
    along = np.zeros(len(points))
    for side in "LR":
        shoulder, elbow, wrist = (
            heads[index[f"{bone}.{side}"]] for bone in ("upperarm01", "lowerarm01", "wrist")
        )
        upper, lower = elbow - shoulder, wrist - elbow
        first, second = float(np.linalg.norm(upper)), float(np.linalg.norm(lower))
        on_upper = (points - shoulder) @ upper / first
        on_lower = first + (points - elbow) @ lower / second
        below = of[f"forearm.{side}"] | of[f"hand.{side}"]
        mine = below | of[f"upper_arm.{side}"]
        along[mine] = np.where(below, on_lower, on_upper)[mine]
        arms |= mine
    sleeve = rng.choice([0.02, 0.19, 0.26, 0.52, 0.55], p=[0.1, 0.3, 0.15, 0.15, 0.3]) * scale
    hem = (height - rng.uniform(0.78, 1.0) * scale).astype(np.float32)
    collar = (rng.uniform(1.44, 1.52) * scale - height).astype(np.float32)
    shirt = np.where(arms, (sleeve - along).astype(np.float32), np.minimum(hem, collar))
    shirt[of["head"]] = np.minimum(collar[of["head"]], 0.0)
    leg = rng.choice([0.07, 0.3, 0.52], p=[0.7, 0.1, 0.2]) * scale
    trousers = np.minimum(height - leg, 1.08 * scale - height)
    fields[:, 0] = np.where(arms, -1.0, trousers)
    fields[:, 1] = shirt
    if rng.random() < 0.1:
        fields[:, 3] = -1.0  # bald
    skin = np.array(_SKINS[rng.integers(len(_SKINS))]) * rng.uniform(0.85, 1.1)
    hair = np.array(_HAIRS[rng.integers(len(_HAIRS))]) * rng.uniform(0.7, 1.2)
    shirt_colour, trousers_colour, shoes = rng.uniform(0.03, 0.97, (3, 3))
    for cloth in (shirt_colour, trousers_colour):
        if rng.random() < 0.4:  # dark or light without colour
            cloth[:] = rng.uniform(0.05, 0.95) + rng.normal(0.0, 0.03, 3)
    if rng.random() < 0.06:
        shirt_colour[:] = skin + rng.normal(0.0, 0.05, 3)
    colours = [skin, trousers_colour, shirt_colour, shoes, hair, hair, WHITES, EYES, LIPS]
    palette = np.stack([linear(tuple(np.clip(c, 0.02, 0.98))) for c in colours])
    return Wardrobe(
        np.ascontiguousarray(fields, np.float32),
        palette.astype(np.float32),
        np.stack([_texture(rng, points), _texture(rng, points)]),
    )


def _texture(rng: np.random.Generator, points: NDArray[np.float64]) -> Singles:
    """Plain, stripes or patches on a surface, about 1."""
    kind = rng.choice(["plain", "stripes", "patches"], p=[0.7, 0.15, 0.15])
    if kind == "plain":
        return np.ones(len(points), np.float32)
    waves = rng.standard_normal((1 if kind == "stripes" else 4, 3))
    waves *= 2.0 * np.pi / rng.uniform(0.06, 0.25) / np.linalg.norm(waves, axis=1, keepdims=True)
    pattern = np.sin(points @ waves.T + rng.uniform(0.0, 2.0 * np.pi, len(waves))).mean(axis=1)
    if kind == "stripes":
        pattern = np.tanh(4.0 * pattern)
    return (1.0 + rng.uniform(0.1, 0.4) * pattern).clip(0.2, 1.8).astype(np.float32)
