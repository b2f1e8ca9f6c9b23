"""Short videos of simulated people, made of few rendered pictures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import BodyShape, ShapeSpace
from tools.build_sample.render import Camera, Renderer
from tools.build_sample.swipes import posed, swipes

CAMERA = Camera(320, 240, 300.0)
DISTANCE_M = 2.6
STEP_S = 1.0 / 15.0
FRAMES = 12
_FROM_S = 0.6

ONE_BY_ONE = ((65, 194), (227, 449), (505, 695), (744, 870), (922, 1200), (1236, 1361))
"""Frames of the real video in which each of six people is in the picture, give or take five."""

Picture = NDArray[np.uint8]


@lru_cache(maxsize=1)
def swiping() -> tuple[list[Picture], NDArray[np.float64]]:
    """A body that swipes: pictures every :data:`STEP_S`, and its landmarks (T, 33, 2)."""
    body = Body.load("low")
    space = ShapeSpace()
    place = np.array([0.0, CAMERA.above_floor_m, DISTANCE_M])
    motion = swipes(body.skeleton, _FROM_S + STEP_S * np.arange(FRAMES))
    moved = motion.translation_m + place
    pictures = [
        _renderer().frame(posed(body, motion.rotations[[k]], moved[[k]])[0]) for k in range(FRAMES)
    ]
    base = BodyShape(np.zeros(len(space)), space.base_stature_m)
    points = (
        KeypointSpace(space).of(base).positions(body.skeleton.transforms(motion.rotations, moved))
    )
    return pictures, CAMERA.project(points)


@lru_cache(maxsize=1)
def _renderer() -> Renderer:
    return Renderer(Body.load("low"), CAMERA)


@lru_cache(maxsize=1)
def empty_room() -> Picture:
    """The same room without anybody: they are behind the camera's back."""
    pictures, _ = swiping()
    left, right = _shift(pictures[0], 100), _shift(pictures[0], -100)
    return np.where(np.arange(CAMERA.width)[None, :, None] < CAMERA.width // 2, left, right)


def _shift(picture: Picture, columns: int) -> Picture:
    index = np.clip(np.arange(picture.shape[1]) - columns, 0, picture.shape[1] - 1)
    return picture[:, index]


def person_at(room: Picture, columns: int, *, red: bool = False, nearer: float = 1.0) -> Picture:
    """A standing person pasted into a room, moved to the right, in other clothes if red.

    Who is ``nearer`` by a factor is larger by it, about the middle of the picture.
    """
    standing = swiping()[0][0]
    away = np.abs(standing.astype(int) - empty_room().astype(int)).max(axis=2)
    person = (away > 24) & (np.abs(np.arange(CAMERA.width) - CAMERA.width / 2) < 75)
    coloured = standing[..., [2, 0, 1]] if red else standing
    mask = person.astype(np.uint8)
    if nearer != 1.0:
        middle = np.array([CAMERA.width, CAMERA.height]) / 2.0
        zoom = np.column_stack([nearer * np.eye(2), (1.0 - nearer) * middle])
        size = (CAMERA.width, CAMERA.height)
        mask, coloured = (cv2.warpAffine(each, zoom, size) for each in (mask, coloured))
    moved = _shift(mask[..., None], columns)[..., 0] > 0
    return np.where(moved[..., None], _shift(coloured, columns), room)


def crossing() -> list[Picture]:
    """Two people who go past each other, one of them in red."""
    room = empty_room()
    at = np.linspace(-95, 95, 24).round().astype(int).tolist()
    return [person_at(person_at(room, -x), x, red=True) for x in at]


def film(
    path: Path,
    pictures: Iterable[Picture],
    *,
    frames_per_s: int = 15,
    times_ms: Sequence[int] | None = None,
    rotation: int | None = None,
    metadata: dict[str, str] | None = None,
) -> Path:
    """Encode pictures; frame k at ``times_ms[k]`` where given."""
    rate = 1000 if times_ms is not None else frames_per_s
    options = {"movflags": "use_metadata_tags"} if metadata else {}
    with av.open(str(path), "w", options=options) as container:
        container.metadata.update(metadata or {})
        stream = container.add_stream("libx264", rate=rate)
        stream.pix_fmt = "yuv420p"
        stream.options = {"preset": "veryfast", "crf": "18", "x264-params": "mbtree=0"}
        if rotation is not None:
            stream.set_display_rotation(rotation)
        for number, picture in enumerate(pictures):
            if number == 0:
                stream.height, stream.width = picture.shape[:2]
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts = number if times_ms is None else times_ms[number]
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path
