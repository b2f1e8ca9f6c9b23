"""People in random clothes, drawn fast into the square that the landmark network sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body, vertex_normals
from sd2core.body.roi import CROP_PX, Roi
from sd2core.figures.surface import VisibleTriangles
from sd2core.numerics.raster import rasterise
from tools.build_sample.clothing import EYES, LIPS, WHITES, Clothes, linear

Singles = NDArray[np.float32]
Pixels = NDArray[np.uint8]

_OVERSAMPLING = 2
_GAMMA_STEPS = 1024

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


@dataclass(frozen=True)
class Look:
    """Light, lens and noise of one take."""

    # Towards the lights, camera frame, unit vectors.
    lights: tuple[tuple[tuple[float, float, float], float], ...]
    ambient: float
    exposure: float
    blur_px: float  # standard deviation in the picture's pixels
    noise: float  # standard deviation in grey levels
    quality: int  # of JPEG, for the blocks of a compressed video; 0 for none


def random_look(rng: np.random.Generator) -> Look:
    """Light from above and the front mostly."""
    lights = []
    for strength in (rng.uniform(0.45, 1.0), rng.uniform(0.0, 0.4)):
        direction = rng.normal([0.0, -0.6, -0.9], [0.6, 0.4, 0.3])
        x, y, z = (direction / np.linalg.norm(direction)).tolist()
        lights.append(((x, y, z), float(strength)))
    return Look(
        tuple(lights),
        ambient=float(rng.uniform(0.22, 0.5)),
        exposure=float(rng.uniform(0.75, 1.2)),
        blur_px=float(rng.choice([0.0, rng.uniform(0.3, 0.9)])),
        noise=float(rng.choice([0.0, rng.uniform(1.0, 5.0)])),
        quality=int(rng.choice([0, int(rng.integers(40, 92))])),
    )


def random_background(rng: np.random.Generator, width: int, height: int) -> Pixels:
    """A room of no particular kind: gradients, blotches, rectangles, noise; (H, W, 3)."""
    import cv2

    corners = rng.uniform(0.0, 255.0, (2, 2, 3))
    if rng.random() < 0.75:
        corners = rng.uniform(40.0, 245.0) + 0.2 * (corners - corners.mean())
    picture = cv2.resize(
        corners.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR
    )
    for _ in range(rng.integers(0, 2)):
        cells = int(rng.integers(3, 40))
        blotches = rng.normal(0.0, rng.uniform(3.0, 18.0), (cells, cells, 3)).astype(np.float32)
        picture += cv2.resize(blotches, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(int(rng.integers(0, 8) * (rng.random() < 0.6))):
        x, y = rng.integers(0, width), rng.integers(0, height)
        w, h = rng.integers(8, width // 2), rng.integers(8, height // 2)
        shade = rng.uniform(20.0, 240.0)
        colour = [float(c) for c in shade + rng.uniform(0.0, 0.5) * rng.uniform(-128.0, 128.0, 3)]
        cv2.rectangle(picture, (int(x), int(y)), (int(x + w), int(y + h)), colour, -1)
    return np.clip(picture, 0, 255).astype(np.uint8)


class Furniture(NamedTuple):
    """Things that stand before the person: their picture (H, W, 3), and where they are (H, W)."""

    picture: Pixels
    mask: Pixels


def random_furniture(
    rng: np.random.Generator, places_px: NDArray[np.float64], width: int, height: int
) -> Furniture:
    """A box that hides legs or a side of the person, as a table or a chair does.

    Parameters
    ----------
    places_px : array, shape (T, 33, 2)
        Of the landmarks.
    """
    mask = np.zeros((height, width), np.uint8)
    low, high = np.percentile(places_px.reshape(-1, 2), [5.0, 95.0], axis=0)
    across, up = high - low
    if rng.random() < 0.7:  # on the floor
        top = low[1] + rng.uniform(0.45, 0.9) * up
        left = low[0] + rng.uniform(-0.5, 0.6) * across
        box = left, top, left + rng.uniform(0.3, 1.2) * across, float(height)
    else:
        left = low[0] + rng.uniform(-0.1, 0.9) * across
        box = left, 0.0, left + rng.uniform(0.05, 0.2) * across, float(height)
    x0, y0, x1, y1 = (int(value) for value in np.clip(box, 0, [width, height, width, height]))
    mask[y0:y1, x0:x1] = 255
    return Furniture(random_background(rng, width, height), mask)


class CropPainter:
    """Draws one dressed body into squares of one camera's picture.

    Parameters
    ----------
    faces : int32 array, shape (F, 3)
    background : uint8 array, shape (height, width, 3)
    rng : numpy.random.Generator
        For the noise.
    furniture : Furniture, optional
        Before the body.
    """

    def __init__(
        self,
        faces: NDArray[np.int32],
        wardrobe: Wardrobe,
        camera: PinholeCamera,
        look: Look,
        background: Pixels,
        rng: np.random.Generator,
        furniture: Furniture | None = None,
    ) -> None:
        self._furniture = furniture
        self._faces = np.ascontiguousarray(faces, np.int32)
        self._wardrobe = wardrobe
        self._camera = camera
        self._look = look
        self._background = background
        self._rng = rng
        shade = np.arange(_GAMMA_STEPS) / (_GAMMA_STEPS - 1)
        self._srgb = (255.0 * shade ** (1.0 / 2.2)).astype(np.uint8)

    def crop(self, vertices_m: Singles, roi: Roi) -> Pixels:
        """Crop of a frame as the landmark network sees it, (256, 256, 3) RGB.

        Vertices (V, 3) are in the camera frame, all in front of the camera.
        """
        import cv2

        side = CROP_PX * _OVERSAMPLING
        matrix = roi.matrix(side)
        ahead = np.maximum(vertices_m[:, 2], 0.05)
        picture_px = (
            self._camera.focal_px * vertices_m[:, :2] / ahead[:, None] + self._camera.centre_px
        )
        inverse = np.linalg.inv(matrix[:, :2])
        points = ((picture_px - matrix[:, 2]) @ inverse.T).astype(np.float32)
        nearness, owner = (1.0 / ahead).astype(np.float32), np.full((side, side), -1, np.int32)
        rasterise(points, nearness, self._faces, np.zeros(owner.shape, np.float32), owner)
        seen = VisibleTriangles(owner, points, nearness, self._faces)
        fine = cv2.resize(roi.cut(self._background), (side, side), interpolation=cv2.INTER_LINEAR)
        fine[seen.shown] = self._painted(seen, vertices_m)
        if self._furniture is not None:
            picture, mask = (
                cv2.resize(roi.cut(layer), (side, side), interpolation=cv2.INTER_LINEAR)
                for layer in self._furniture
            )
            np.copyto(fine, picture, where=(mask > 127)[..., None])
        crop = cv2.resize(fine, (CROP_PX, CROP_PX), interpolation=cv2.INTER_AREA)
        crop = self._filmed(crop, roi.size_px / CROP_PX)
        self._blacken(crop, roi)
        return crop

    def _painted(self, seen: VisibleTriangles, vertices_m: Singles) -> Pixels:
        """Colours (N, 3) of the pixels that the body covers."""
        clothes = self._wardrobe
        light = self._light(vertices_m)[:, None]
        values = seen.interpolated(np.hstack([clothes.fields, clothes.texture.T, light]))
        inside, bright = values[:, :8] > 0.0, values[:, 10]
        inside[:, 6] &= inside[:, 5]  # the iris lies in the white of the eye
        regions = (inside * np.arange(1, 9)).max(axis=1)
        for cloth, texture in ((REGIONS.index("shirt"), 8), (REGIONS.index("trousers"), 9)):
            bright[regions == cloth] *= values[regions == cloth, texture]
        top = len(self._srgb) - 1
        shades = (clothes.palette[regions] * bright[:, None] * top).astype(np.intp)
        return np.asarray(self._srgb[shades.clip(0, top)])

    def _light(self, vertices_m: Singles) -> Singles:
        """Light on every vertex."""
        normals = vertex_normals(vertices_m.astype(np.float64), self._faces).astype(np.float32)
        light = np.full(len(vertices_m), self._look.ambient, np.float32)
        for direction, strength in self._look.lights:
            cosine = normals @ np.array(direction, np.float32)
            light += np.float32(strength) * np.clip((cosine + 0.15) / 1.15, 0.0, None)
        return np.asarray(light * self._look.exposure, np.float32)

    def _filmed(self, crop: Pixels, pixels: float) -> Pixels:
        """With the blur, noise and blocks of a camera; ``pixels`` of the picture per crop's."""
        import cv2

        look = self._look
        if look.blur_px > 0.1 * pixels:
            crop = cv2.GaussianBlur(crop, (0, 0), look.blur_px / pixels)
        if look.noise:
            noise = self._rng.standard_normal(crop.shape, dtype=np.float32)
            noisy = crop + noise * np.float32(look.noise)
            crop = np.clip(noisy, 0, 255).astype(np.uint8)
        if look.quality:
            _, packed = cv2.imencode(".jpg", crop, [cv2.IMWRITE_JPEG_QUALITY, look.quality])
            crop = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
        return crop

    def _blacken(self, crop: Pixels, roi: Roi) -> None:
        """Black outside the picture, in place."""
        matrix = roi.matrix()
        at = np.arange(CROP_PX) + 0.5
        size = (self._camera.width, self._camera.height)
        for axis in (0, 1):
            along = matrix[axis, 0] * at[None, :] + matrix[axis, 1] * at[:, None] + matrix[axis, 2]
            crop[(along < 0.0) | (along > size[axis])] = 0
