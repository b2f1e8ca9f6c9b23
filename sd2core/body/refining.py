"""Second pass over a video: every frame again, in the smoothed square around the person.

Frames do not depend on one another here, so several threads share them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import CLOSE_UP, Pose, PoseLandmarker
from sd2core.body.person_selection import FOUND
from sd2core.body.roi import CROP_PX, Pixels, Roi
from sd2core.io.video import VideoReader

Singles = NDArray[np.float32]

SILHOUETTE_PX = 256
"""Longer side of a silhouette."""

_STRAYED = 0.25
_AHEAD_BYTES = 128 * 2**20
"""Memory of pictures that wait for a thread."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Results of the second pass for N successive frames."""

    image_px: Singles  # (N, 33, 2); NaN, as the next two, where the person was not found
    depth_px: Singles  # (N, 33)
    world_m: Singles  # (N, 33, 3)
    visibility: Singles  # (N, 33)
    confidence: Singles  # (N,); 0 where the person was not found
    silhouette_frames: NDArray[np.intp]  # (K,) of the whole video
    silhouettes: NDArray[np.uint8]  # (K, h, w)


class Refiner:
    """Landmark search by several threads, one for each landmarker; a context manager."""

    def __init__(self, landmarkers: Sequence[PoseLandmarker]) -> None:
        self._free: SimpleQueue[PoseLandmarker] = SimpleQueue()
        for landmarker in landmarkers:
            self._free.put(landmarker)
        self._threads = len(landmarkers)
        self._pool = ThreadPoolExecutor(self._threads, thread_name_prefix="sd2-landmarks")

    def __enter__(self) -> Refiner:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def stretch(
        self,
        video: VideoReader,
        start: int,
        rois: Sequence[Roi | None],
        kept: frozenset[int],
        seen: Callable[[int, Pose | None], None],
    ) -> Stretch:
        """Landmarks of the frames from ``start`` on, one for each of ``rois`` (None: no person).

        The silhouettes of the frames in ``kept`` are kept. ``seen`` is called with each frame and
        its result, in order; it may raise ``Cancelled``.
        """
        frames = len(rois)
        found = Stretch(
            image_px=np.full((frames, 33, 2), np.nan, np.float32),
            depth_px=np.full((frames, 33), np.nan, np.float32),
            world_m=np.full((frames, 33, 3), np.nan, np.float32),
            visibility=np.zeros((frames, 33), np.float32),
            confidence=np.zeros(frames, np.float32),
            silhouette_frames=np.empty(0, np.intp),
            silhouettes=np.empty((0, *silhouette_shape(video)), np.uint8),
        )
        numbers, masks = [], []
        for number, pose in enumerate(self._poses(video, start, rois)):
            if pose is not None:
                found.image_px[number] = pose.image_px[:33]
                found.depth_px[number] = pose.depth_px
                found.world_m[number] = pose.world_m
                found.visibility[number] = pose.visibility * pose.presence
                found.confidence[number] = pose.confidence
                if start + number in kept:
                    numbers.append(start + number)
                    masks.append(_silhouette(pose, video))
            seen(start + number, pose)
        if not masks:
            return found
        return Stretch(
            **vars(found)
            | {"silhouette_frames": np.array(numbers, np.intp), "silhouettes": np.stack(masks)}
        )

    def _poses(
        self, video: VideoReader, start: int, rois: Sequence[Roi | None]
    ) -> Iterator[Pose | None]:
        """Poses in order; few pictures are in memory at once, and fewer where they are large."""
        room = _AHEAD_BYTES // (3 * video.width * video.height)
        ahead = max(min(2 * self._threads, room), 1)
        waiting: deque[Future[Pose | None] | None] = deque()
        for number, roi in enumerate(rois):
            if roi is None:
                waiting.append(None)
            else:
                waiting.append(self._pool.submit(self._look, video.read(start + number), roi))
            if len(waiting) > ahead:
                yield _outcome(waiting.popleft())
        while waiting:
            yield _outcome(waiting.popleft())

    def _look(self, picture: Pixels, roi: Roi) -> Pose | None:
        landmarker = self._free.get()
        try:
            close = roi.scaled(CLOSE_UP)
            pose = landmarker.on_both_sides(close.cut(picture), close)
        finally:
            self._free.put(landmarker)
        there = pose.next_roi
        away = np.hypot(there.centre_x_px - roi.centre_x_px, there.centre_y_px - roi.centre_y_px)
        # Another person in the square is not the one who was followed.
        return pose if pose.confidence >= FOUND and away < _STRAYED * roi.size_px else None


def _outcome(waiting: Future[Pose | None] | None) -> Pose | None:
    return None if waiting is None else waiting.result()


def silhouette_shape(video: VideoReader) -> tuple[int, int]:
    """Rows and columns of the silhouettes of a video."""
    scale = min(SILHOUETTE_PX / max(video.width, video.height), 1.0)
    return max(round(scale * video.height), 1), max(round(scale * video.width), 1)


def _silhouette(pose: Pose, video: VideoReader) -> NDArray[np.uint8]:
    """Mask of a square, drawn into the picture made smaller."""
    import cv2

    rows, columns = silhouette_shape(video)
    shrink = np.diag([columns / video.width, rows / video.height])
    matrix = shrink @ pose.roi.matrix(CROP_PX)
    # OpenCV counts from the centre of the first pixel.
    matrix[:, 2] += matrix[:, :2] @ [0.5, 0.5] - 0.5
    mask = np.rint(255.0 * pose.mask).astype(np.uint8)
    return np.asarray(cv2.warpAffine(mask, matrix, (columns, rows), flags=cv2.INTER_LINEAR))
