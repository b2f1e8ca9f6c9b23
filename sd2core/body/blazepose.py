"""The two networks that find a person and 39 points on them in a picture.

What goes in and comes out of the networks is that of BlazePose (Bazarevsky et al., 2020);
the files are those of :mod:`sd2core.body.landmark_models`, run by LiteRT.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.roi import CROP_PX, Floats, Pixels, Roi
from sd2core.body.track import MIRRORED
from sd2core.errors import Sd2Error

Singles = NDArray[np.float32]

POINTS = 39
"""The 33 landmarks, two that say where to look next, and four that are not used."""
CENTRE, RIM = 33, 34
"""The middle of the hips, and a point on the circle around the whole person."""
CLOSE_UP = 0.9
"""The second look at a frame takes a smaller square than the first."""

_DETECTOR_PX = 224
_FOUND = 0.5
_STRIDES = (8, 16, 32, 32, 32)
_ANCHORS_PER_CELL = 2
_CELL_PX = 4
_REFINE_CELLS = 3
_REFINE_FROM = 0.5
_DISAGREEMENT = 0.04
_CHATTER = threading.Lock()
_MIRRORED = list(MIRRORED)


@dataclass(frozen=True, eq=False)
class Detection:
    """A person found in a whole picture, with a score from 0.5 to 1."""

    roi: Roi
    score: float


@dataclass(frozen=True, eq=False)
class Pose:
    """Output of the landmark network for one square of a picture."""

    image_px: Floats  # (39, 2) in the picture: LANDMARKS, CENTRE, RIM, four unused
    depth_px: Floats  # (33,) behind the hips, at the scale of the picture
    world_m: Floats  # (33, 3) from the middle of the hips; x right, y down, z away
    visibility: Floats  # (33,) from 0 to 1: the point is seen
    presence: Floats  # (33,) from 0 to 1: the point is inside the picture
    confidence: float  # that there is a person in the square, from 0 to 1
    mask: Singles  # (256, 256) that a pixel of the square shows the person, from 0 to 1
    roi: Roi

    @property
    def next_roi(self) -> Roi:
        """Square in which the person is expected in the next picture."""
        return Roi.around(self.image_px[CENTRE], self.image_px[RIM])


class PoseDetector:
    """Person detector for whole pictures; ``path`` is that of ``pose_detection.tflite``."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        self._network = _Network(path, threads)

    def people(self, picture: Pixels) -> list[Detection]:
        """People in an RGB picture (height, width, 3), the surest first."""
        return self.look(picture)[0]

    def look(self, picture: Pixels, square: Roi | None = None) -> tuple[list[Detection], float]:
        """Detect people; return them and the highest score of any place.

        With ``square``, only that upright part of the picture is searched: people less than about
        two fifths as high as the searched part are not found.
        """
        height, width = picture.shape[:2]
        if square is None:
            square = Roi(width / 2.0, height / 2.0, float(max(width, height)))
        crop = square.cut(picture, _DETECTOR_PX)
        boxes, logits = self._network.run(crop.astype(np.float32) / np.float32(127.5) - 1)
        scores = _sigmoid(logits[0, :, 0])
        kept = np.flatnonzero(scores >= _FOUND)
        raw = boxes[0, kept].astype(np.float64) / _DETECTOR_PX  # (n, 12)
        places = np.concatenate([raw[:, :2], raw[:, 4:8]], axis=1)
        places += np.tile(self._anchors[kept], 3)
        corner = np.array([square.centre_x_px, square.centre_y_px]) - square.size_px / 2.0
        detections = []
        for rows in _same_person(places[:, :2], raw[:, 2:4], scores[kept]):
            weights = scores[kept[rows]]
            middle = weights @ places[rows] / weights.sum()
            middle = square.size_px * middle + np.tile(corner, 3)
            detections.append(Detection(Roi.around(middle[2:4], middle[4:6]), float(weights[0])))
        return detections, float(scores.max())

    @cached_property
    def _anchors(self) -> Floats:
        """Middle of every cell of every layer as parts of the square, (2254, 2)."""
        layers = []
        for stride in _STRIDES:
            cells = _DETECTOR_PX // stride
            y, x = np.mgrid[:cells, :cells]
            layers.append((np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) / cells)
        return np.repeat(np.concatenate(layers), _ANCHORS_PER_CELL, axis=0)


class PoseLandmarker:
    """Landmark network for one person in a square; ``path`` is ``pose_landmark_full.tflite``.

    Not to be used by two threads at once: make one for each. It releases the GIL.
    """

    def __init__(self, path: Path, threads: int = 1) -> None:
        self._network = _Network(path, threads)

    def in_picture(self, picture: Pixels, roi: Roi) -> Pose:
        """Landmarks of the person in a square of an RGB picture (height, width, 3)."""
        return self.on_crop(roi.cut(picture), roi)

    def on_crop(self, crop: Pixels, roi: Roi) -> Pose:
        """Landmarks of the person in a crop (256, 256, 3), RGB, cut from ``roi`` of a picture."""
        points, flag, mask, heat, world = self._network.run(
            crop.astype(np.float32) * np.float32(1.0 / 255.0)
        )
        rows = points.reshape(POINTS, 5).astype(np.float64)
        image = _refined(rows[:, :2], heat[0])
        turned = roi.matrix()
        axes = turned[:, :2] / np.hypot(*turned[:, 0])
        metres = world.reshape(POINTS, 3)[:33].astype(np.float64)
        metres[:, :2] = metres[:, :2] @ axes.T
        return Pose(
            image_px=image @ turned[:, :2].T + turned[:, 2],
            depth_px=rows[:33, 2] * (roi.size_px / CROP_PX),
            world_m=metres,
            visibility=_sigmoid(rows[:33, 3]),
            presence=_sigmoid(rows[:33, 4]),
            confidence=float(flag[0, 0]),
            mask=_sigmoid(mask[0, :, :, 0]).astype(np.float32),
            roi=roi,
        )

    def on_both_sides(self, crop: Pixels, roi: Roi) -> Pose:
        """Landmarks of the person in a crop and in its mirror image, averaged.

        The network is not symmetric: the mean has 0.7 times the jitter and a better depth, and
        takes twice as long. Where the two differ by much more than 4 % of the square, one of
        them has taken one hand for the other, and only the first counts.
        """
        one = self.on_crop(crop, roi)
        two = _unmirrored(self.on_crop(np.ascontiguousarray(crop[:, ::-1]), _upright(roi)), roi)
        apart = np.hypot(*(one.image_px - two.image_px).T) / (_DISAGREEMENT * roi.size_px)
        share = 0.5 * np.exp(-(apart**2))  # (39,)
        body = share[:33]
        return replace(
            one,
            image_px=_mean(one.image_px, two.image_px, share),
            depth_px=_mean(one.depth_px, two.depth_px, body),
            world_m=_mean(one.world_m, two.world_m, body),
            visibility=_mean(one.visibility, two.visibility, body),
            presence=_mean(one.presence, two.presence, body),
            confidence=0.5 * (one.confidence + two.confidence),
            mask=0.5 * (one.mask + two.mask),
        )


class _Network:
    """One file, run by LiteRT."""

    def __init__(self, path: Path, threads: int) -> None:
        try:
            from ai_edge_litert.interpreter import Interpreter
        except ImportError as error:
            raise Sd2Error(
                f"The landmark models cannot run here ({error})",
                "the package ai-edge-litert, which there is for Linux, Windows and Macs with"
                " Apple's own processors",
                "Import a mesh that another machine made",
            ) from error
        with _without_chatter():
            self._interpreter: Any = Interpreter(str(path), num_threads=threads)
            self._interpreter.allocate_tensors()
        self._input = self._interpreter.get_input_details()[0]["index"]
        # "Identity", "Identity_1", ...: in the order of their names.
        details = sorted(self._interpreter.get_output_details(), key=lambda each: each["name"])
        self._outputs = [each["index"] for each in details]

    def run(self, picture: Singles) -> list[Singles]:
        self._interpreter.set_tensor(self._input, picture[None])
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(index) for index in self._outputs]


@contextmanager
def _without_chatter() -> Iterator[None]:
    """Keep LiteRT from writing to standard error while it starts."""
    with _CHATTER:
        try:
            kept = os.dup(2)
        except OSError:  # closed
            yield
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            os.close(nowhere)


def _upright(roi: Roi) -> Roi:
    """Square of the same size that is the whole picture: points are those of the crop."""
    return Roi(roi.size_px / 2.0, roi.size_px / 2.0, roi.size_px)


def _unmirrored(pose: Pose, roi: Roi) -> Pose:
    """Landmarks found in a mirror image, turned back into those of the square."""
    turned = roi.matrix()
    turn = turned[:, :2] / (roi.size_px / CROP_PX)
    points = pose.image_px[[*_MIRRORED, *range(33, POINTS)]] * [-1.0, 1.0] + [roi.size_px, 0.0]
    points = points @ turn.T + turned[:, 2]
    metres = pose.world_m[_MIRRORED] * [-1.0, 1.0, 1.0]
    metres[:, :2] = metres[:, :2] @ turn.T
    return Pose(
        image_px=points,
        depth_px=pose.depth_px[_MIRRORED],
        world_m=metres,
        visibility=pose.visibility[_MIRRORED],
        presence=pose.presence[_MIRRORED],
        confidence=pose.confidence,
        mask=pose.mask[:, ::-1],
        roi=roi,
    )


def _mean(one: Floats, two: Floats, share: Floats) -> Floats:
    """Weighted mean of rows, ``share`` (up to a half) of the second."""
    share = share.reshape(-1, *(1,) * (one.ndim - 1))
    return (1.0 - share) * one + share * two


def _same_person(centres: Floats, sizes: Floats, scores: Floats) -> list[NDArray[np.intp]]:
    """Group boxes by person: those that overlap the surest one, then the next."""
    left = np.argsort(-scores, kind="stable")
    people = []
    while left.size:
        best = left[0]
        low = np.maximum(centres[left] - sizes[left] / 2, centres[best] - sizes[best] / 2)
        high = np.minimum(centres[left] + sizes[left] / 2, centres[best] + sizes[best] / 2)
        shared = np.prod(np.clip(high - low, 0.0, None), axis=1)
        areas = np.prod(sizes[left], axis=1)
        same = shared > 0.3 * (areas + np.prod(sizes[best]) - shared)
        same[0] = True
        people.append(left[same])
        left = left[~same]
    return people


def _refined(points_px: Floats, heat: Singles) -> Floats:
    """Points (39, 2) of the crop moved to the mean of the heat map (64, 64, 39) around them."""
    cells = np.floor(points_px / _CELL_PX).astype(np.intp)
    steps = np.arange(-_REFINE_CELLS, _REFINE_CELLS + 1)
    columns = cells[:, 0, None, None] + steps[None, None, :]  # (39, 1, 7)
    rows = cells[:, 1, None, None] + steps[None, :, None]  # (39, 7, 1)
    side = heat.shape[0]
    inside = (columns >= 0) & (columns < side) & (rows >= 0) & (rows < side)
    logits = heat[
        np.clip(rows, 0, side - 1), np.clip(columns, 0, side - 1), np.arange(POINTS)[:, None, None]
    ]
    weights = np.where(inside, _sigmoid(logits), 0.0)  # (39, 7, 7)
    total = weights.sum(axis=(1, 2))
    own = (cells >= 0).all(axis=1) & (cells < side).all(axis=1)
    sure = own & (weights.max(axis=(1, 2)) >= _REFINE_FROM)
    total = np.where(sure, total, 1.0)
    x = (weights * columns).sum(axis=(1, 2)) / total
    y = (weights * rows).sum(axis=(1, 2)) / total
    return np.where(sure[:, None], np.stack([x, y], axis=1) * _CELL_PX, points_px)


def _sigmoid(logits: NDArray[np.floating]) -> Floats:
    return 0.5 + 0.5 * np.tanh(0.5 * logits.astype(np.float64))
