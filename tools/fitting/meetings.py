"""Videos of people of known places who meet in one room, drawn one behind the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Skeleton
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.simulate.gait import Path as Way
from sd2core.simulate.gait import gait
from sd2core.simulate.limbs import arm_length_m
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion
from tools.build_sample.clothing import Clothes, srgb
from tools.build_sample.render import Camera, Renderer, _tone
from tools.fitting.cast import ROOMS, Person

FRAMES_PER_S = 10
CAMERA = Camera(320, 240, 260.0, above_floor_m=1.1)
Floats = NDArray[np.float64]

OUT_M = 2.6
"""Way to the side after which nothing of a person is in the picture."""


@dataclass(frozen=True)
class Part:
    """Part of a person: across the picture they go along ``x_m``, and turn by ``yaw_deg``."""

    person: Person
    times_s: tuple[float, ...]
    x_m: tuple[float, ...]  # at those times, positive to the right
    away_m: float  # from the camera
    yaw_deg: tuple[float, ...] | None = None  # at those times; 0 faces the camera
    sits: bool = False  # facing the camera, moving their arms


@dataclass(frozen=True)
class Actor:
    """A person of a scene, ready to be drawn."""

    drawer: Renderer
    vertices_m: NDArray[np.float32]  # (T, V, 3)
    points_px: Floats  # (T, 33, 2)
    away_m: float


@lru_cache(maxsize=1)
def _space() -> ShapeSpace:
    return ShapeSpace()


def actor(part: Part, frames: int, room: str) -> Actor:
    """A person who walks and turns as their part says."""
    space, shape = _space(), part.person.shape(_space())
    skeleton, body = space.skeleton(shape), space.load("low", shape)
    times = np.arange(frames) / FRAMES_PER_S
    rotations, move = (_sitting if part.sits else _walking)(part, skeleton, times)
    place = np.array([0.0, CAMERA.above_floor_m, part.away_m])
    transforms = skeleton.transforms(rotations, move + place)
    studio = replace(ROOMS[room], wall_m=4.8, shadow_m=6.0, shadow_depth_m=3.0, noise=0.012)
    drawer = Renderer(body, CAMERA, studio, Clothes.of(Body.load("low"), part.person.outfit))
    points = CAMERA.project(KeypointSpace(space).of(shape).positions(transforms))
    return Actor(drawer, pose_vertices(body, transforms), points, part.away_m)


def _sitting(part: Part, skeleton: Skeleton, times_s: Floats) -> tuple[Floats, Floats]:
    """Rotations and places of one who sits and talks with their hands."""
    deed = Deed("sit", (STYLES["talk"], STYLES["wave"]), still=False)
    rng = np.random.default_rng(round(100.0 * part.away_m))
    motion = random_motion(rng, skeleton, part.person.stature_m, times_s, deed)
    return motion.rotations, motion.translation_m + np.array([part.x_m[0], 0.0, 0.0])


def _walking(part: Part, skeleton: Skeleton, times: Floats) -> tuple[Floats, Floats]:
    """Rotations and places of one who walks across the picture."""
    x = np.array(part.x_m)
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    yaw = part.yaw_deg
    if yaw is None:  # where they go; who stands faces the camera
        yaw = (0.0,) * len(x)
    motion = gait(
        skeleton,
        times,
        Way(
            lambda t: np.interp(t, part.times_s, along),
            lambda t: np.interp(t, part.times_s, yaw),
        ),
        arm_length_m(skeleton) / arm_length_m(_space().base_skeleton),
    )
    # The way of the gait leads to the camera; here it leads across.
    forward = -motion.translation_m[:, 2]
    across = np.interp(times, part.times_s, x) - np.interp(times, part.times_s, along) + forward
    move = np.stack([across, motion.translation_m[:, 1], motion.translation_m[:, 0]], axis=1)
    return motion.rotations, move


def pictures(actors: Sequence[Actor]) -> Iterator[NDArray[np.uint8]]:
    """The scene, the nearest person in front."""
    return (picture for picture, _ in scenes(actors))


def scenes(actors: Sequence[Actor]) -> Iterator[tuple[NDArray[np.uint8], Floats]]:
    """Pictures, and the share of each actor that nobody hides in them, (A,)."""
    far_to_near = sorted(range(len(actors)), key=lambda row: -actors[row].away_m)
    layers = [actors[row] for row in far_to_near]
    for frame in range(len(actors[0].vertices_m)):
        seen = [each.vertices_m[frame] for each in layers]
        shadows = [each.drawer.light_buffer(part) for each, part in zip(layers, seen, strict=True)]
        picture = layers[0].drawer.background(np.maximum.reduce(shadows))
        drawn = []
        for each, part, shadow in zip(layers, seen, shadows, strict=True):
            colours, coverage = each.drawer.person(part, shadow)
            picture = picture * (1.0 - coverage[..., None]) + colours
            drawn.append(coverage)
        shares, free = np.zeros(len(actors)), np.ones(picture.shape[:2])
        for row, coverage in zip(far_to_near[::-1], drawn[::-1], strict=True):
            shares[row] = (free * coverage).sum() / max(float(coverage.sum()), 1.0)
            free *= 1.0 - coverage
        noise = np.random.default_rng(frame).standard_normal(picture.shape, dtype=np.float32)
        bright = np.clip(srgb(_tone(picture)) + 0.012 * noise, 0.0, 1.0)
        yield (bright * 255.0).astype(np.uint8), shares
