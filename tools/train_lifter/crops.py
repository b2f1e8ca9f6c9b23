"""Drawing people fast, straight into the square that the landmark network sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.roi import CROP_PX, Roi
from sd2core.numerics.compiled import compiled
from sd2core.numerics.raster import rasterise
from tools.train_lifter.wardrobe import Wardrobe

Singles = NDArray[np.float32]
Pixels = NDArray[np.uint8]

_OVERSAMPLING = 2
_GAMMA_STEPS = 1024


@dataclass(frozen=True)
class Look:
    """Light, lens and noise of one take.

    Parameters
    ----------
    lights : tuple of (direction, strength)
        Towards the lights, camera frame, unit vectors.
    blur_px : float
        Standard deviation in the picture's pixels.
    noise : float
        Standard deviation in grey levels.
    quality : int
        Of JPEG, for the blocks of a compressed video; 0 for none.
    """

    lights: tuple[tuple[tuple[float, float, float], float], ...]
    ambient: float
    exposure: float
    blur_px: float
    noise: float
    quality: int


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
        side = CROP_PX * _OVERSAMPLING
        self._buffer = np.empty((side, side), np.float32)
        self._owner = np.empty((side, side), np.int32)
        shade = np.arange(_GAMMA_STEPS) / (_GAMMA_STEPS - 1)
        self._srgb = (255.0 * shade ** (1.0 / 2.2)).astype(np.uint8)

    def crop(self, vertices_m: Singles, roi: Roi) -> Pixels:
        """Crop of one frame as the landmark network sees it, (256, 256, 3) RGB.

        Parameters
        ----------
        vertices_m : float32 array, shape (V, 3)
            Camera frame, all in front of the camera.
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
        self._buffer.fill(0.0)
        self._owner.fill(-1)
        nearness = (1.0 / ahead).astype(np.float32)
        rasterise(points, nearness, self._faces, self._buffer, self._owner)
        fine = cv2.resize(roi.cut(self._background), (side, side), interpolation=cv2.INTER_LINEAR)
        paint(
            points,
            nearness,
            self._faces,
            self._owner,
            self._wardrobe.fields,
            self._wardrobe.texture,
            self._wardrobe.palette,
            self._light(vertices_m),
            self._srgb,
            fine,
        )
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

    def _light(self, vertices_m: Singles) -> Singles:
        """Light on every vertex."""
        normals = _normals(vertices_m, self._faces)
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


def _normals(vertices_m: Singles, faces: NDArray[np.int32]) -> Singles:
    """Unit normals of vertices, (V, 3)."""
    normals = np.zeros_like(vertices_m)
    add_normals(vertices_m, faces, normals)
    length = np.sqrt(np.einsum("vi,vi->v", normals, normals))
    return np.asarray(normals / np.maximum(length, 1e-12)[:, None])


@compiled
def add_normals(vertices: Singles, faces: NDArray[np.int32], normals: Singles) -> None:
    """Add to every vertex (V, 3) the area normals of its faces (F, 3)."""
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = (
            vertices[j, 0] - vertices[i, 0],
            vertices[j, 1] - vertices[i, 1],
            vertices[j, 2] - vertices[i, 2],
        )
        bx, by, bz = (
            vertices[k, 0] - vertices[i, 0],
            vertices[k, 1] - vertices[i, 1],
            vertices[k, 2] - vertices[i, 2],
        )
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        for v in (i, j, k):
            normals[v, 0] += nx
            normals[v, 1] += ny
            normals[v, 2] += nz


@compiled
def paint(
    points: Singles,
    nearness: Singles,
    faces: NDArray[np.int32],
    owner: NDArray[np.int32],
    fields: Singles,
    texture: Singles,
    palette: Singles,
    light: Singles,
    srgb: NDArray[np.uint8],
    picture: Pixels,
) -> None:
    """Colour every pixel that a triangle owns.

    Parameters
    ----------
    points, nearness, faces, owner
        As :func:`sd2core.simulate.raster.rasterise` takes and leaves them.
    fields : float32 array, shape (V, 8)
    texture : float32 array, shape (2, V)
    palette : float32 array, shape (9, 3)
        See :class:`Wardrobe`.
    light : float32 array, shape (V,)
    srgb : uint8 array, shape (N,)
        Grey level of linear light from 0 to 1.
    picture : uint8 array, shape (H, W, 3)
        Updated.
    """
    height, width = owner.shape
    top = srgb.shape[0] - 1
    for r in range(height):
        y = np.float32(r + 0.5)
        for c in range(width):
            f = owner[r, c]
            if f < 0:
                continue
            x = np.float32(c + 0.5)
            i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
            x0, y0 = points[i, 0] - x, points[i, 1] - y
            x1, y1 = points[j, 0] - x, points[j, 1] - y
            x2, y2 = points[k, 0] - x, points[k, 1] - y
            w0 = (x1 * y2 - x2 * y1) * nearness[i]
            w1 = (x2 * y0 - x0 * y2) * nearness[j]
            w2 = (x0 * y1 - x1 * y0) * nearness[k]
            inverse = np.float32(1.0) / (w0 + w1 + w2)
            w0, w1, w2 = w0 * inverse, w1 * inverse, w2 * inverse
            region = 0
            for a in range(fields.shape[1]):
                inside = w0 * fields[i, a] + w1 * fields[j, a] + w2 * fields[k, a]
                # The iris lies in the white of the eye.
                if inside > 0.0 and (a != 6 or region == 6):
                    region = a + 1
            bright = w0 * light[i] + w1 * light[j] + w2 * light[k]
            if region == 1 or region == 2:
                pattern = texture[2 - region]
                bright *= w0 * pattern[i] + w1 * pattern[j] + w2 * pattern[k]
            for colour in range(3):
                value = palette[region, colour] * bright
                picture[r, c, colour] = srgb[min(max(int(value * top), 0), top)]


def compile_kernels() -> None:
    """Call every kernel of this module once."""
    faces = np.array([[0, 1, 2]], np.int32)
    points = np.array([[0, 0], [0, 2], [2, 0]], np.float32)
    vertices = np.zeros((3, 3), np.float32)
    add_normals(vertices, faces, vertices.copy())
    paint(
        points,
        np.ones(3, np.float32),
        faces,
        np.zeros((1, 1), np.int32),
        np.ones((3, 8), np.float32),
        np.ones((2, 3), np.float32),
        np.ones((9, 3), np.float32),
        np.ones(3, np.float32),
        np.zeros(2, np.uint8),
        np.zeros((1, 1, 3), np.uint8),
    )
