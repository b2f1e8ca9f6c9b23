"""The eye of the scene: orbit, pan, zoom, framing and exact projection; no VTK.

Pixels are those of the widget (device independent), x right, y down from the
top left corner. The world is x right, y down, z forward, so the view's up is −y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]

_STEEPEST_DEG = 89.5
_NEAREST_M = 0.05
_IN_FRONT_M = 0.01
"""Depth from which something is in front of the eye."""
_FARTHEST_M = 500.0
_ORBIT_DEG_PER_PX = 0.35
_MIN_PX_PER_M = 4.0
_FARTHEST_DRAG_M = 60.0

Surface = tuple[NDArray[np.floating], NDArray[np.int32]]
"""Vertices (V, 3), metres, and triangles (F, 3)."""
Preset = Literal["overview", "camera", "sensor", "side", "top"]
"""Ready-made views."""


@dataclass(frozen=True)
class Margins:
    """Pixels to keep free when framing."""

    left: float = 24.0
    top: float = 24.0
    right: float = 24.0
    bottom: float = 24.0


@dataclass(frozen=True)
class EyePose:
    """Pose of the virtual camera that looks at ``focus`` from ``distance_m``."""

    focus: tuple[float, float, float] = (0.0, 0.0, 2.0)  # point that the eye turns around, metres
    azimuth_deg: float = 0.0  # to the right of +z
    elevation_deg: float = 0.0  # above the horizon
    distance_m: float = 5.0
    angle_deg: float = 30.0  # vertical opening angle
    size_px: tuple[float, float] = (640.0, 480.0)  # of the picture

    @cached_property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Unit vectors right, down and forward of the picture."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        cosine = math.cos(elevation)
        forward = np.array(
            [math.sin(azimuth) * cosine, -math.sin(elevation), math.cos(azimuth) * cosine]
        )
        right = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
        return right, np.cross(forward, right), forward

    @cached_property
    def position(self) -> Vector:
        """Position of the eye, metres."""
        return np.asarray(self.focus) - self.distance_m * self.axes[2]

    def orbited(self, dx_px: float, dy_px: float) -> EyePose:
        """Pose turned around the focus by a drag; the vertical stays vertical."""
        elevation = self.elevation_deg - _ORBIT_DEG_PER_PX * dy_px
        return replace(
            self,
            azimuth_deg=(self.azimuth_deg + _ORBIT_DEG_PER_PX * dx_px + 180.0) % 360.0 - 180.0,
            elevation_deg=min(max(elevation, -_STEEPEST_DEG), _STEEPEST_DEG),
        )

    def panned(self, dx_px: float, dy_px: float) -> EyePose:
        """Pose shifted so that the focus follows the drag."""
        right, down, _ = self.axes
        scale = self.distance_m / self.pixels_per_tangent
        focus = np.asarray(self.focus) - scale * (dx_px * right + dy_px * down)
        return replace(self, focus=triple(focus))

    def zoomed(self, factor: float, x_px: float, y_px: float) -> EyePose:
        """Pose at ``factor`` times the distance; the point under the pointer stays in place."""
        distance = min(max(self.distance_m * factor, _NEAREST_M), _FARTHEST_M)
        across = self.ray(x_px, y_px) - self.axes[2]
        focus = np.asarray(self.focus) + (self.distance_m - distance) * across
        return replace(self, focus=triple(focus), distance_m=distance)

    @cached_property
    def pixels_per_tangent(self) -> float:
        """Pixels per metre of width at one metre of depth."""
        return 0.5 * self.size_px[1] / math.tan(math.radians(self.angle_deg) / 2)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pixels and depth of points, (n, 3); what lies behind the eye is NaN, NaN, depth."""
        relative = np.atleast_2d(np.asarray(points, np.float64)) - self.position
        x, y, depth = (relative @ axis for axis in self.axes)
        scale = self.pixels_per_tangent / np.where(depth > 1e-6, depth, np.nan)
        width, height = self.size_px
        return np.stack([width / 2 + scale * x, height / 2 + scale * y, depth], axis=1)

    def ray(self, x_px: float, y_px: float) -> Vector:
        """Direction from the eye through a pixel, with a forward part of one."""
        right, down, forward = self.axes
        across, downward = self.tangents(x_px, y_px)
        return forward + across * right + downward * down

    def tangents(self, x_px: float, y_px: float) -> Vector:
        """Offset of a pixel from the middle of the picture, at one metre of depth."""
        return (np.array([x_px, y_px]) - np.array(self.size_px) / 2) / self.pixels_per_tangent

    def nearest(
        self, points: NDArray[np.floating], x_px: float, y_px: float, within_px: float
    ) -> int | None:
        """Number of the point (n, 3) that is nearest to a pixel, if it is within reach."""
        x, y, depth = self.project(points).T
        away = np.where(depth > _IN_FRONT_M, np.hypot(x - x_px, y - y_px), np.inf)
        return int(away.argmin()) if away.min(initial=np.inf) <= within_px else None

    def metres_per_pixel(self, point: ArrayLike) -> float:
        """Size of a pixel at a point's depth; infinite behind the eye."""
        depth = float((np.asarray(point, np.float64) - self.position) @ self.axes[2])
        return depth / self.pixels_per_tangent if depth > 1e-6 else math.inf

    def foremost(self, surface: Surface, x_px: float, y_px: float) -> tuple[float, int] | None:
        """Depth of a surface at a pixel, and the nearest corner of the triangle there; None beside.

        By areas in homogeneous coordinates, as triangles may reach behind the eye.
        """
        vertices, faces = surface
        tangents, relative = self.tangents(x_px, y_px), vertices - self.position
        x, y, depth = (relative @ axis for axis in self.axes)
        x, y = x - tangents[0] * depth, y - tangents[1] * depth  # the pixel's ray is at 0, 0
        a, b, c = faces.T
        # Of two corners and the ray, by the third corner: of one sign where it goes through.
        areas = np.stack([x[i] * y[j] - x[j] * y[i] for i, j in ((b, c), (c, a), (a, b))])
        inside = (areas >= 0).all(axis=0) | (areas <= 0).all(axis=0)
        rows = np.flatnonzero(inside & areas.any(axis=0))
        weights = areas[:, rows] / areas[:, rows].sum(axis=0)
        depths = (weights * depth[faces[rows].T]).sum(axis=0)
        depths[depths <= _IN_FRONT_M] = np.inf
        if not np.isfinite(depths.min(initial=np.inf)):
            return None
        corners = faces[rows[depths.argmin()]]
        ahead = np.where(depth[corners] > 0, depth[corners], np.nan)
        nearest = np.nanargmin(np.hypot(x[corners], y[corners]) / ahead)
        return float(depths.min()), int(corners[nearest])

    def framed(self, points: ArrayLike, margins: Margins) -> EyePose:
        """Pose of the same direction, as near as all points fit inside the margins."""
        points = np.atleast_2d(np.asarray(points, np.float64))
        centre = points.mean(axis=0)
        x, y, z = ((points - centre) @ axis for axis in self.axes)
        width, height = self.size_px
        room_x = self._room(width, margins.left, margins.right)
        room_y = self._room(height, margins.top, margins.bottom)
        distance = max(
            _least_distance(x, z, *room_x),
            _least_distance(y, z, *room_y),
            2.0 * _NEAREST_M - float(z.min()),
        )
        right, down, _ = self.axes
        shift = _offset(x, z, *room_x, distance) * right + _offset(y, z, *room_y, distance) * down
        return replace(self, focus=triple(centre + shift), distance_m=distance)

    def _room(self, size: float, before: float, after: float) -> tuple[float, float]:
        """Tangents of the free picture on either side of its middle."""
        least = 0.1 * size
        before, after = max(size / 2 - before, least), max(size / 2 - after, least)
        return before / self.pixels_per_tangent, after / self.pixels_per_tangent


def _least_distance(x: Vector, z: Vector, low: float, high: float) -> float:
    # Inside the picture: -low (z + t) <= x - a <= high (z + t) for every point.
    # Adding both bounds on the eye's offset a leaves the distance t.
    return float((np.max(x - high * z) + np.max(-x - low * z)) / (low + high))


def _offset(x: Vector, z: Vector, low: float, high: float, distance: float) -> float:
    least = float(np.max(x - high * z)) - high * distance
    most = low * distance - float(np.max(-x - low * z))
    return 0.5 * (least + most)


def triple(values: Vector) -> tuple[float, float, float]:
    """Three numbers of an array."""
    return (float(values[0]), float(values[1]), float(values[2]))


def drag_in_view(start: ArrayLike, pose: EyePose, x_px: float, y_px: float) -> Vector:
    """Point at which the pointer's ray meets the plane through ``start`` along the picture."""
    depth = float((np.asarray(start, np.float64) - pose.position) @ pose.axes[2])
    return pose.position + depth * pose.ray(x_px, y_px)


def drag_level(start: ArrayLike, pose: EyePose, x_px: float, y_px: float) -> Vector | None:
    """Point at which the pointer's ray meets the level plane through ``start``; None if far off."""
    ray, height = pose.ray(x_px, y_px), float(np.asarray(start)[1] - pose.position[1])
    if abs(ray[1]) < 1e-6 or not _NEAREST_M <= height / ray[1] <= _FARTHEST_DRAG_M:
        return None
    return pose.position + height / ray[1] * ray


def drag_along(
    start: ArrayLike, direction: ArrayLike, pose: EyePose, x_px: float, y_px: float
) -> Vector | None:
    """Point of a line through ``start`` whose picture is nearest to the pointer.

    None where there is no good answer: the line points at the eye, or the
    pointer is at its vanishing point.
    """
    right, down, forward = pose.axes
    start = np.asarray(start, np.float64)
    unit = np.asarray(direction, np.float64)
    length = float(np.linalg.norm(unit))
    depth = float((start - pose.position) @ forward)
    if length < 1e-9 or depth < 1e-6:
        return None
    unit = unit / length
    flat = np.array([(start - pose.position) @ right, (start - pose.position) @ down])
    slope = np.array([unit @ right, unit @ down])
    climb = float(unit @ forward)
    heading = slope / depth - flat * climb / depth**2  # of the line's picture, at its start
    if np.linalg.norm(heading) * pose.pixels_per_tangent < _MIN_PX_PER_M:
        return None
    heading /= np.linalg.norm(heading)
    wanted = float(pose.tangents(x_px, y_px) @ heading)
    # heading . (flat + s slope) / (depth + s climb) = wanted, solved for s
    divisor = float(slope @ heading) - wanted * climb
    if abs(divisor) < 1e-9:
        return None
    amount = (wanted * depth - float(flat @ heading)) / divisor
    if not _NEAREST_M <= depth + amount * climb <= _FARTHEST_DRAG_M:
        return None
    return start + amount * unit
