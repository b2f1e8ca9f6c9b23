"""A shaded picture of the body, without OpenGL: what the sample's camera sees.

Pinhole camera at the origin of the camera frame; a vertex (x, y, z) is drawn at
pixel coordinates (cx + f x / z, cy + f y / z), so that a mesh laid over the picture
lies exactly on the person.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, uniform_filter

from sd2core.body.camera import PinholeCamera
from sd2core.body.model import Body, vertex_normals
from sd2core.figures.surface import Frame, find_visible_triangles
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import worker_count, workers
from sd2core.numerics.raster import rasterise
from sd2core.progress import Progress, silent
from tools.build_sample.clothing import Clothes, linear, srgb

Singles = NDArray[np.float32]

_CAPTION_MARGIN_PX = 12
_OVERSAMPLING = 2
_LIGHT_PIXELS = 640
_SHADOW_SLACK_M = 0.012
"""So that a surface does not shade itself."""


@dataclass(frozen=True)
class Camera(PinholeCamera):
    """A pinhole camera some way above the floor."""

    above_floor_m: float = 1.1  # Height of the optical axis.


@dataclass(frozen=True)
class Studio:
    """The room and its light; colours are sRGB from 0 to 1."""

    wall_m: float = 3.5  # Depth of the wall behind the person.
    wall: tuple[float, float, float] = (0.84, 0.845, 0.84)
    floor: tuple[float, float, float] = (0.60, 0.55, 0.50)
    skirting: tuple[float, float, float] = (0.90, 0.90, 0.89)
    key: tuple[float, float, float] = (-0.70, -0.72, -0.95)
    fill: tuple[float, float, float] = (0.9, -0.2, -0.7)
    rim: tuple[float, float, float] = (0.75, -0.55, 0.75)
    key_power: float = 1.7  # Brightness of the light from one side.
    fill_power: float = 0.30  # From the other side.
    ambient: float = 0.20  # From everywhere.
    sky: float = 0.28  # From above.
    key_colour: tuple[float, float, float] = (1.0, 0.965, 0.91)  # Linear.
    shadow_m: float = 3.2  # Width of the region in which the key light throws shadows.
    shadow_depth_m: float = 2.2  # Depth of that region.
    noise: float = 0.0  # Standard deviation of the camera's noise at mid-grey, as a share of white.


class Renderer:
    """Renderer of one body in one room; the same picture for the same vertices.

    The body gives the faces. The clothes are those of this surface; by default a T-shirt and
    trousers sewn for the body's rest shape, which must be the bundled one.
    """

    def __init__(
        self,
        body: Body,
        camera: Camera | None = None,
        studio: Studio | None = None,
        clothes: Clothes | None = None,
    ) -> None:
        self.body = body
        self.camera = camera or Camera()
        self.studio = studio or Studio()
        self.clothes = clothes or Clothes.of(body)
        self._offsets = _disc(12, 2.6)

    def frame(self, vertices_m: NDArray[np.float64], seed: int = 0) -> NDArray[np.uint8]:
        """Picture of one frame, (height, width, 3), sRGB.

        Vertices, (V, 3), are in the camera frame, all in front of the camera. The seed is that of
        the camera's noise, if the studio has any.
        """
        shadow = self.light_buffer(vertices_m)
        picture = self.background(shadow)  # (H, W, 3) linear
        colours, coverage = self.person(vertices_m, shadow)
        picture = picture * (1.0 - coverage[..., None]) + colours
        picture = srgb(_tone(picture))
        if self.studio.noise > 0:
            noise = np.random.default_rng(seed).standard_normal(picture.shape, dtype=np.float32)
            # Shot noise: brighter is noisier in light, about equally so after the gamma.
            picture = np.clip(picture + np.float32(self.studio.noise) * noise, 0.0, 1.0)
        picture = stamp(picture, "Simulated")
        # Half a step of fixed dither, or the wall's gradient shows bands.
        return (picture * 255.0 + self._dither[..., None]).astype(np.uint8)

    def frames(
        self, mesh: MeshSequence, seed: int = 0, progress: Progress = silent
    ) -> Iterator[NDArray[np.uint8]]:
        """Pictures of a moving body, several at once; the noise of each has a seed of its own."""

        def draw(frame: int) -> NDArray[np.uint8]:
            return self.frame(mesh.frame(frame).astype(np.float64), seed + frame)

        step = worker_count()
        progress(0, mesh.frame_count)
        yield draw(0)  # alone: it fills what all frames share
        for start in range(1, mesh.frame_count, step):
            progress(start, mesh.frame_count)
            yield from workers().map(draw, range(start, min(start + step, mesh.frame_count)))

    def person(self, vertices_m: NDArray[np.float64], shadow: Singles) -> tuple[Singles, Singles]:
        """Linear colours times coverage, and coverage, at picture resolution."""
        n = _OVERSAMPLING
        height, width = n * self.camera.height, n * self.camera.width
        faces, whole = self.body.faces, Frame(0.0, 0.0, width, height, n)
        seen = find_visible_triangles(vertices_m, faces, self.camera, whole)
        normals = vertex_normals(vertices_m, faces)
        values = seen.interpolated(np.hstack([vertices_m, normals, self.clothes.attributes]))
        colours = np.zeros((height, width, 3), np.float32)
        colours[seen.shown] = self._shade(values[:, :3], values[:, 3:6], values[:, 6:], shadow)
        return _shrunk(colours, n), _shrunk(seen.shown.astype(np.float32), n)

    def _shade(
        self, positions: Singles, normals: Singles, attributes: Singles, shadow: Singles
    ) -> Singles:
        albedo, gloss = self.clothes.colours(attributes)  # linear (N, 3), (N,)
        studio, normals, view = self.studio, _units(normals), _units(-positions)
        key, fill, rim = (
            _unit(direction).astype(np.float32)
            for direction in (studio.key, studio.fill, studio.rim)
        )
        lit = lit_share(*self._seen_by_light(positions), shadow, self._offsets)
        # Wrapped diffuse light: softer than Lambert at the terminator, as skin and cloth are.
        key_light = np.clip((normals @ key + 0.15) / 1.15, 0.0, None) * lit
        fill_light = np.clip((normals @ fill + 0.3) / 1.3, 0.0, None)
        sky = 0.5 - 0.5 * normals[:, 1]
        light = (
            studio.key_power * key_light[:, None] * np.array(studio.key_colour, np.float32)
            + studio.fill_power * fill_light[:, None] * np.array([0.86, 0.93, 1.0], np.float32)
            + (studio.ambient + studio.sky * sky)[:, None] * np.array([0.95, 0.98, 1.0], np.float32)
        )
        facing = np.clip(_dots(normals, view), 0.0, 1.0)
        edge = (1.0 - facing) ** 3 * np.clip(normals @ rim, 0.0, 1.0)
        half = _units(key + view)
        highlight = np.clip(_dots(normals, half), 0.0, 1.0) ** 28 * lit * gloss
        colours: Singles = (
            albedo * light + 0.55 * edge[:, None] * (0.25 + albedo) + 0.22 * highlight[:, None]
        )
        return colours

    @cached_property
    def _light_axes(self) -> NDArray[np.float64]:
        """Right, up and towards the light, in rows.

        Up, not down: the light's image is mirrored, so the triangles that face away
        from the light are drawn into it, and a lit surface cannot shade itself.
        """
        towards = _unit(self.studio.key)
        right = _unit(tuple(np.cross(towards, [0.0, 1.0, 0.0])))
        return np.stack([right, np.cross(towards, right), towards])

    def _seen_by_light(self, positions: NDArray[np.floating]) -> tuple[Singles, Singles]:
        """Pixels in the light's image, and nearness to it in metres."""
        centre = np.array([0.0, self.camera.above_floor_m - 0.95, self.studio.shadow_depth_m])
        # Kept in its own precision: the matrix product of mixed types is slow.
        axes = self._light_axes.astype(positions.dtype)
        seen = (positions - centre.astype(positions.dtype)) @ axes.T
        scale = _LIGHT_PIXELS / self.studio.shadow_m
        points = seen[..., :2] * scale + _LIGHT_PIXELS / 2
        return points.astype(np.float32), seen[..., 2].astype(np.float32)

    def light_buffer(self, vertices_m: NDArray[np.float64]) -> Singles:
        """Nearness of what the lamp sees first, for shadows, seen from the lamp (P, P)."""
        points, nearness = self._seen_by_light(vertices_m)
        buffer = np.full((_LIGHT_PIXELS, _LIGHT_PIXELS), -1e9, np.float32)
        owner = np.full(buffer.shape, -1, np.int32)
        rasterise(points, nearness, self.body.faces, buffer, owner)
        return buffer

    def background(self, shadow: Singles) -> Singles:
        """The empty room with the person's soft shadow, linear (H, W, 3)."""
        silhouette = (shadow > -1e8).astype(np.float64)
        for _ in range(3):
            silhouette = uniform_filter(silhouette, 19, mode="constant")
        shade = map_coordinates(silhouette, self._room_in_light, order=1).astype(np.float32)
        picture: Singles = self._room * (1.0 - 0.42 * shade[..., None])
        return picture

    @cached_property
    def _rays(self) -> NDArray[np.float64]:
        """Directions of the picture's pixels with z = 1, (H, W, 3)."""
        camera = self.camera
        y, x = np.mgrid[: camera.height, : camera.width] + 0.5
        return np.stack(
            [
                (x - camera.width / 2) / camera.focal_px,
                (y - camera.height / 2) / camera.focal_px,
                np.ones_like(x),
            ],
            axis=-1,
        )

    @cached_property
    def _room_points(self) -> NDArray[np.float64]:
        """Point of the empty room that each pixel shows, (H, W, 3) in metres."""
        down = np.maximum(self._rays[..., 1], 1e-9)
        depth = np.minimum(self.camera.above_floor_m / down, self.studio.wall_m)
        return self._rays * depth[..., None]

    @cached_property
    def _room(self) -> Singles:
        """The empty room in linear light, (H, W, 3)."""
        studio, points = self.studio, self._room_points
        height = self.camera.above_floor_m - points[..., 1]
        on_floor = points[..., 2] < studio.wall_m - 1e-6
        pixel_m = studio.wall_m / self.camera.focal_px
        skirting = np.clip((0.075 - height) / pixel_m + 0.5, 0.0, 1.0) * ~on_floor
        colours = linear(studio.wall) * np.ones_like(points)
        colours += skirting[..., None] * (linear(studio.skirting) - colours)
        colours = np.where(on_floor[..., None], linear(studio.floor), colours)
        # A pool of light on the wall, upper left, fading towards the corners.
        away = np.hypot((points[..., 0] + 0.35) / 2.6, (height - 1.5) / 1.9)
        glow = 0.60 + 0.46 * np.exp(-(away**2))
        corner = np.exp(-np.abs(height) / 0.10) * ~on_floor
        near_wall = np.exp(-(studio.wall_m - points[..., 2]) / 0.22) * on_floor
        colours *= (glow * (1.0 - 0.10 * corner - 0.30 * near_wall))[..., None]
        return colours.astype(np.float32)

    @cached_property
    def _room_in_light(self) -> Singles:
        """Row and column of each pixel of the room in the light's image, (2, H, W)."""
        points, _ = self._seen_by_light(self._room_points)
        points = np.clip(points - 0.5, 0, _LIGHT_PIXELS - 1.001)
        return np.asarray(points[..., ::-1].transpose(2, 0, 1))

    @cached_property
    def _dither(self) -> Singles:
        shape = (self.camera.height, self.camera.width)
        return np.random.default_rng(1).random(shape, dtype=np.float32)


def _tone(picture: Singles) -> Singles:
    """Roll off what is brighter than white."""
    knee = np.float32(0.8)
    over = np.maximum(picture - knee, 0.0)
    return np.minimum(picture, knee) + over / (1.0 + over / (1.0 - knee))


def _dots(left: Singles, right: Singles) -> Singles:
    """Dot products of rows."""
    products: Singles = np.einsum("ni,ni->n", left, right)
    return products


def _units(vectors: Singles) -> Singles:
    """Rows of length 1."""
    lengths: Singles = np.sqrt(_dots(vectors, vectors))
    return np.divide(vectors, lengths[:, None], dtype=np.float32)


def _unit(direction: tuple[float, ...]) -> NDArray[np.float64]:
    vector = np.asarray(direction, dtype=np.float64)
    return vector / np.linalg.norm(vector)


def _shrunk(picture: Singles, factor: int) -> Singles:
    """Mean over blocks of pixels."""
    total = picture[::factor, ::factor].copy()
    for k in range(1, factor * factor):
        total += picture[k // factor :: factor, k % factor :: factor]
    total /= factor * factor
    return total


def _disc(count: int, radius: float) -> Singles:
    """Evenly spread points in a disc (a sunflower)."""
    k = np.arange(count) + 0.5
    r = radius * np.sqrt(k / count)
    angle = k * np.pi * (3.0 - np.sqrt(5.0))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1).astype(np.float32)


def stamp(picture: Singles, word: str) -> Singles:
    """Picture (H, W, 3; sRGB 0 to 1) with a word and its shadow in the lower right corner."""
    import cv2

    height, width = int(picture.shape[0]), int(picture.shape[1])
    ink = np.zeros((height, width), np.uint8)
    size, _ = cv2.getTextSize(word, cv2.FONT_HERSHEY_SIMPLEX, 0.45, 1)
    place = (width - size[0] - _CAPTION_MARGIN_PX, height - _CAPTION_MARGIN_PX)
    cv2.putText(ink, word, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, 255, 1, cv2.LINE_AA)
    share = (ink / np.float32(255.0))[..., None]
    stamped = picture * (1.0 - 0.35 * np.roll(share, (1, 1), axis=(0, 1)))
    return np.asarray(stamped + 0.85 * share * (1.0 - stamped))


def lit_share(points: Singles, nearness: Singles, buffer: Singles, offsets: Singles) -> Singles:
    """Share of a light that reaches points, (N,), from the light's depth buffer.

    Parameters
    ----------
    points : float32 array, shape (N, 2)
        In pixels of the light's image.
    nearness : float32 array, shape (N,)
    buffer : float32 array, shape (P, P)
    offsets : float32 array, shape (S, 2)
        Where around each point to look, in pixels: the light's softness.
    """
    lit = np.zeros(len(points), np.float32)
    nearer = nearness + np.float64(_SHADOW_SLACK_M)
    for offset in offsets:
        columns, rows = (points + offset).astype(np.intp).T
        inside = (np.minimum(rows, columns) >= 0) & (np.maximum(rows, columns) < len(buffer))
        lit[~inside] += 1.0
        lit[inside] += nearer[inside] >= buffer[rows[inside], columns[inside]]
    return lit / np.float32(len(offsets))
