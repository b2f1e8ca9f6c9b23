"""Second pass over a video: the person again, in the smoothed square around them.

Fifteen frames a second are looked at, and those in between where something moves fast; the others
follow by cubics (docs/decisions/0049). Frames do not depend on one another here, so several threads
share them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray

from sd2core.body.blazepose import CLOSE_UP, Pose, PoseLandmarker
from sd2core.body.landmark_repair import on_cubics
from sd2core.body.person_selection import FOUND
from sd2core.body.roi import CROP_PX, Pixels, Roi, apart_px
from sd2core.body.tracking import looked_at
from sd2core.io.video import VideoReader

Singles = NDArray[np.float32]

SILHOUETTE_PX = 256
"""Longer side of a silhouette."""

_STRAYED = 0.25
_STEP_S = 1.0 / 15.0
_FAST_PER_S = 0.6
"""Change of a landmark's velocity in a fifteenth of a second, in squares per second (20 m/s²), from
where on the frames in between are looked at."""
_VISIBLE = 0.5
_AHEAD_BYTES = 128 * 2**20
"""Memory of pictures that wait for a thread."""


@dataclass(frozen=True, eq=False)
class RefinedFrames:
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
    ) -> RefinedFrames:
        """Landmarks of successive frames.

        Parameters
        ----------
        video : VideoReader
            Read forwards.
        start : int
            First frame.
        rois : sequence of Roi or None
            Square around the person in each frame from ``start`` on; None: no person.
        kept : frozenset of int
            Frames of the whole video whose silhouettes are kept.
        seen : callable
            Called with each frame, in order, and what was seen in it, None where it is not looked
            at now; may raise ``Cancelled``.
        """
        frames = len(rois)
        times_s = video.timebase.times_s[start : start + frames]
        first = np.zeros(frames, bool)
        first[looked_at(times_s, _STEP_S)] = True
        first[[frame - start for frame in kept if start <= frame < start + frames]] = True
        refined = RefinedFrames(
            image_px=np.full((frames, 33, 2), np.nan, np.float32),
            depth_px=np.full((frames, 33), np.nan, np.float32),
            world_m=np.full((frames, 33, 3), np.nan, np.float32),
            visibility=np.zeros((frames, 33), np.float32),
            confidence=np.zeros(frames, np.float32),
            silhouette_frames=np.empty(0, np.intp),
            silhouettes=np.empty((0, *silhouette_shape(video)), np.uint8),
        )
        numbers, masks = [], []
        between: dict[int, Future[Pixels]] = {}
        waiting: deque[tuple[int, Future[Pose | None] | None]] = deque()

        def settle(number: int, looking: Future[Pose | None] | None) -> None:
            pose = None if looking is None else looking.result()
            if pose is not None:
                _write(refined, number, pose)
                if start + number in kept:
                    numbers.append(start + number)
                    masks.append(_silhouette(pose, video))
            seen(start + number, pose)

        # Few pictures are in memory at once, and fewer where they are large.
        room = _AHEAD_BYTES // (3 * video.width * video.height)
        ahead = max(min(2 * self._threads, room), 1)
        for number, roi in enumerate(rois):
            looking = None
            if roi is not None:
                picture = video.read(start + number)
                if first[number]:
                    looking = self._pool.submit(self._look, picture, roi)
                else:
                    between[number] = self._pool.submit(roi.scaled(CLOSE_UP).cut, picture)
            waiting.append((number, looking))
            if len(waiting) > ahead:
                settle(*waiting.popleft())
        while waiting:
            settle(*waiting.popleft())
        self._fill(refined, times_s, first, rois, between)
        if not masks:
            return refined
        return RefinedFrames(
            **vars(refined)
            | {"silhouette_frames": np.array(numbers, np.intp), "silhouettes": np.stack(masks)}
        )

    def _fill(
        self,
        refined: RefinedFrames,
        times_s: NDArray[np.float64],
        first: NDArray[np.bool_],
        rois: Sequence[Roi | None],
        between: dict[int, Future[Pixels]],
    ) -> None:
        """Landmarks of the frames in between: looked at where something moves fast, or cubics."""
        known = np.flatnonzero(first)
        sizes_px = [np.nan if roi is None else roi.size_px for roi in rois]
        slow = ~fast_looks(
            times_s[known],
            refined.image_px[known],
            refined.visibility[known],
            np.array(sizes_px)[known],
        )
        numbers = np.array(list(between), np.intp)
        before = np.searchsorted(known, numbers) - 1
        calm = slow[before] & slow[before + 1]
        looking = {
            number: self._pool.submit(self._look_closely, between[number].result(), roi)
            for number in numbers[~calm].tolist()
            if (roi := rois[number]) is not None
        }
        numbers, before = numbers[calm], before[calm]
        for values in (refined.image_px, refined.depth_px, refined.world_m, refined.visibility):
            values[numbers] = on_cubics(times_s, values, ~first)[numbers]
        np.clip(refined.visibility, 0.0, 1.0, out=refined.visibility)
        sure = refined.confidence[known]
        refined.confidence[numbers] = np.minimum(sure[before], sure[before + 1])
        for number, pose in looking.items():
            if (seen := pose.result()) is not None:
                _write(refined, number, seen)

    def _look(self, picture: Pixels, roi: Roi) -> Pose | None:
        return self._look_closely(roi.scaled(CLOSE_UP).cut(picture), roi)

    def _look_closely(self, crop: Pixels, roi: Roi) -> Pose | None:
        landmarker = self._free.get()
        try:
            pose = landmarker.on_both_sides(crop, roi.scaled(CLOSE_UP))
        finally:
            self._free.put(landmarker)
        # Another person in the square is not the one who was followed.
        stayed = apart_px(pose.next_roi, roi) < _STRAYED * roi.size_px
        return pose if pose.confidence >= FOUND and stayed else None


def _write(refined: RefinedFrames, number: int, pose: Pose) -> None:
    refined.image_px[number] = pose.image_px[:33]
    refined.depth_px[number] = pose.depth_px
    refined.world_m[number] = pose.world_m
    refined.visibility[number] = pose.visibility * pose.presence
    refined.confidence[number] = pose.confidence


def fast_looks(
    times_s: NDArray[np.float64],
    image_px: Singles,
    visibility: Singles,
    sizes_px: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Looks (K,) at which a landmark that is seen moves fast.

    So are those at both ends, and next to a frame without the person.

    Parameters
    ----------
    times_s : float64 ndarray, (K,)
        Times of the frames looked at.
    image_px : float32 ndarray, (K, 33, 2)
        Landmarks in the picture; NaN without the person.
    visibility : float32 ndarray, (K, 33)
        Below 0.5 a landmark does not count.
    sizes_px : float64 ndarray, (K,)
        Sides of the squares around the person.
    """
    fast = np.ones(len(times_s), bool)
    if len(times_s) > 2:
        moved_px = np.diff(image_px, axis=0)  # (K - 1, 33, 2)
        rates = moved_px / np.diff(times_s)[:, None, None]
        changes = np.linalg.norm(np.diff(rates, axis=0), axis=-1) / sizes_px[1:-1, None]
        hidden = (visibility[1:-1] < _VISIBLE) & np.isfinite(changes)
        fast[1:-1] = ~((changes < _FAST_PER_S) | hidden).all(axis=1)
    return fast


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
