"""Choice of the person in a video, automatic or by a rectangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sd2core.body.blazepose import PoseDetector, PoseLandmarker
from sd2core.body.roi import MARGIN, Pixels, Roi
from sd2core.errors import Sd2Error
from sd2core.io.video import VideoReader
from sd2core.progress import Progress, silent

FOUND = 0.5
"""Confidence from which on there is a person."""

_SURVEYED = 12
_STEP_S = 0.5
_EVERY_FRAME_S = 20.0
_NEARLY = 0.8


@dataclass(frozen=True)
class Rectangle:
    """Rectangle that the user draws around the person, in pixels of the upright picture."""

    x_px: float
    y_px: float
    width_px: float
    height_px: float
    frame: int = 0


@dataclass(frozen=True)
class Start:
    """The person in one frame, from which they are followed both ways."""

    frame: int
    roi: Roi


def find_prominent_person(
    video: VideoReader,
    detector: PoseDetector,
    landmarker: PoseLandmarker,
    progress: Progress = silent,
) -> Start:
    """Find the most prominent person: large, near the middle, surely a person.

    Parameters
    ----------
    video : VideoReader
        Searched in a few frames first, then in more and in parts of the picture.
    detector, landmarker : PoseDetector, PoseLandmarker
        What says where people are, and how surely there is one.
    progress : Progress
        Called now and then, without a share of the work; may raise ``Cancelled``.

    Raises
    ------
    Sd2Error
        If no person is found in the whole video.
    """
    best_score = 0.0
    looked: set[int] = set()
    for frames, part in _rounds(video):
        looked.update(frames)
        squares = parts_of_picture(video.width, video.height, part)
        ranked: list[tuple[float, Start]] = []
        for frame in frames:
            picture = video.read(frame)
            for square in squares:
                progress(0, len(video))
                people, score = detector.look(picture, square)
                best_score = max(best_score, score if not people else 0.0)
                for each in people:
                    pose = landmarker.in_picture(picture, each.roi)
                    best_score = max(best_score, min(score, pose.confidence))
                    if pose.confidence >= FOUND:
                        rank = each.score * _prominence(each.roi, video.width, video.height)
                        ranked.append((rank, Start(frame, pose.next_roi)))
        if ranked:
            enough = _NEARLY * max(rank for rank, _ in ranked)
            # An early one: a video decodes forwards only.
            return next(start for rank, start in ranked if rank >= enough)
    raise Sd2Error(
        f"No person was found in {video.path} (in the best of {len(looked)} frames the model is"
        f" {100 * best_score:.0f} % sure)",
        "a video of a person, seen at 50 % or more",
        "Where there is one, mark the person in one frame"
        " (--person-box X,Y,WIDTH,HEIGHT --person-frame FRAME)",
    )


def _rounds(video: VideoReader) -> list[tuple[list[int], float]]:
    """Frames to search and the size of the parts: ever more frames, ever smaller parts."""
    frames, duration_s = len(video), float(video.timebase.times_s[-1])
    few = np.unique(np.linspace(0, frames - 1, min(frames, _SURVEYED)).round().astype(int))
    step_s = 0.0 if duration_s <= _EVERY_FRAME_S else _STEP_S
    times = video.timebase.times_s
    many, last = [], -np.inf
    for frame in range(frames):
        if times[frame] - last >= step_s:
            many.append(frame)
            last = float(times[frame])
    chosen: list[int] = few.tolist()
    return [(chosen, 1.0), (chosen, 0.5), (many, 1.0), (chosen, 0.25)]


def parts_of_picture(width: int, height: int, part: float) -> list[Roi | None]:
    """Squares of part of the longer side that cover the picture, each point two to four times."""
    if part == 1.0:
        return [None]
    size = part * max(width, height)
    x, y = (
        np.linspace(min(size, side) / 2.0, max(side - size / 2.0, side / 2.0), count)
        for side in (width, height)
        for count in [1 if side <= size else int(np.ceil(2.0 * (side - size) / size)) + 1]
    )
    return [Roi(float(column), float(row), size) for row in y for column in x]


def _prominence(roi: Roi, width: int, height: int) -> float:
    off = abs(roi.centre_x_px / width - 0.5)
    return min(roi.size_px / min(width, height), 2.0) * (1.0 - min(off, 0.8))


def find_person_in(
    rectangle: Rectangle, video: VideoReader, detector: PoseDetector, landmarker: PoseLandmarker
) -> Start:
    """Find the person in a rectangle of one frame.

    Parameters
    ----------
    rectangle : Rectangle
        Around the person, in pixels of the upright picture.
    video : VideoReader
        Only the rectangle's frame is read.
    detector, landmarker : PoseDetector, PoseLandmarker
        What says where people are, and how surely there is one.

    Raises
    ------
    Sd2Error
        If there is no such frame, the rectangle is outside the picture, or there is no person in
        it.
    """
    if not 0 <= rectangle.frame < len(video):
        raise Sd2Error(
            f"The rectangle is in frame {rectangle.frame}", f"a frame from 0 to {len(video) - 1}"
        )
    x, y, w, h = rectangle.x_px, rectangle.y_px, rectangle.width_px, rectangle.height_px
    inside = w > 0 and h > 0 and x < video.width and y < video.height and x + w > 0 and y + h > 0
    if not inside:
        raise Sd2Error(
            f"The rectangle {x:g},{y:g},{w:g},{h:g} is not in the picture",
            f"x, y, width and height in pixels of {video.width} × {video.height}",
        )
    picture = video.read(rectangle.frame)
    best = 0.0
    for roi in _squares(rectangle, picture, detector):
        pose = landmarker.in_picture(picture, roi)
        centre = pose.next_roi
        if pose.confidence >= FOUND and _within(centre, rectangle):
            return Start(rectangle.frame, pose.next_roi)
        best = max(best, pose.confidence)
    raise Sd2Error(
        f"No person was found in the rectangle of frame {rectangle.frame} (the model is"
        f" {100 * best:.0f} % sure)",
        "a rectangle around one person, head to feet",
        "Draw it in another frame, where the person is seen whole",
    )


def _squares(rectangle: Rectangle, picture: Pixels, detector: PoseDetector) -> list[Roi]:
    """Squares to search: people detected in the rectangle, then the rectangle itself."""
    x = rectangle.x_px + rectangle.width_px / 2
    y = rectangle.y_px + rectangle.height_px / 2
    size = max(rectangle.width_px, rectangle.height_px)
    around = Roi(x, y, MARGIN * size)
    # A small person shows only where a part of the picture is looked at.
    part = Roi(x, y, 1.6 * size)
    people = detector.people(picture) + detector.look(picture, part)[0]
    squares = [person.roi for person in people]
    squares = [roi for roi in squares if _within(roi, rectangle)]
    squares.sort(
        key=lambda roi: (
            np.hypot(roi.centre_x_px - x, roi.centre_y_px - y) / size
            + abs(np.log(roi.size_px / around.size_px))
        )
    )
    return [*squares, around]


def _within(roi: Roi, rectangle: Rectangle) -> bool:
    """True if the hips are in the rectangle, or nearly."""
    dx = abs(roi.centre_x_px - rectangle.x_px - rectangle.width_px / 2)
    dy = abs(roi.centre_y_px - rectangle.y_px - rectangle.height_px / 2)
    return bool(dx < 0.6 * rectangle.width_px and dy < 0.7 * rectangle.height_px)
