"""Landmarks of one person through a video, before a body is fitted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sd2core.timebase import Timebase

LANDMARKS = (
    "nose",
    "eye_inner.L",
    "eye.L",
    "eye_outer.L",
    "eye_inner.R",
    "eye.R",
    "eye_outer.R",
    "ear.L",
    "ear.R",
    "mouth.L",
    "mouth.R",
    "shoulder.L",
    "shoulder.R",
    "elbow.L",
    "elbow.R",
    "wrist.L",
    "wrist.R",
    "pinky.L",
    "pinky.R",
    "index.L",
    "index.R",
    "thumb.L",
    "thumb.R",
    "hip.L",
    "hip.R",
    "knee.L",
    "knee.R",
    "ankle.L",
    "ankle.R",
    "heel.L",
    "heel.R",
    "foot_index.L",
    "foot_index.R",
)
"""The 33 landmarks of BlazePose in its order; L and R are the person's own sides."""

MIRRORED = tuple(
    LANDMARKS.index(
        name[:-1] + {"L": "R", "R": "L"}[name[-1]] if name[-2:] in (".L", ".R") else name
    )
    for name in LANDMARKS
)
"""For every landmark the one on the other side."""

TORSO_CORNERS = tuple(
    LANDMARKS.index(name) for name in ("shoulder.L", "shoulder.R", "hip.L", "hip.R")
)
"""Landmarks whose mean is the body's centre."""

PER_FRAME = (
    "image_px",
    "depth_px",
    "world_m",
    "visibility",
    "confidence",
    "present",
    "bridged",
)
"""Arrays of a track that have a row for every frame, besides its times."""

PART_FRAMES = 3600
"""Longer clips (two minutes at 30 frames/s) are worked on in parts of this length.

What has to be known of the whole clip is then taken from so many frames of it.
"""


def parts(frames: int) -> Iterator[tuple[int, int]]:
    """Start and stop of the parts of a clip, of nearly equal length."""
    count = max(-(-frames // PART_FRAMES), 1)
    edges = [frames * number // count for number in range(count + 1)]
    yield from pairwise(edges)


class Landmarks(Protocol):
    """A track of landmarks that need not be in memory as a whole; see :class:`LandmarkTrack`."""

    @property
    def timebase(self) -> Timebase:
        """Presentation times of the frames."""
        ...

    @property
    def width(self) -> int:
        """Width of the upright picture in pixels."""
        ...

    @property
    def height(self) -> int:
        """Height of the upright picture in pixels."""
        ...

    @property
    def present(self) -> NDArray[np.bool_]:
        """Frames with the person, (T,)."""
        ...

    @property
    def bridged(self) -> NDArray[np.bool_]:
        """Frames that were interpolated, (T,)."""
        ...

    @property
    def silhouette_frames(self) -> NDArray[np.intp]:
        """Frames of which the model's mask is kept, (K,)."""
        ...

    @property
    def silhouettes(self) -> NDArray[np.uint8]:
        """The masks, (K, h, w)."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about repairs."""
        ...

    def __len__(self) -> int: ...
    def part(self, start: int, stop: int) -> LandmarkTrack:
        """Frames ``start`` to ``stop`` as a track of their own."""
        ...


@dataclass(frozen=True, eq=False)
class LandmarkTrack:
    """33 landmarks of one person in every frame of a video.

    Parameters
    ----------
    timebase : Timebase
        One time per frame, T of them.
    width, height : int
        Of the upright picture, in pixels.
    image_px : float32 array, shape (T, 33, 2)
        Landmarks in the picture (also outside it); NaN in empty frames.
    depth_px : float32 array, shape (T, 33)
        The landmark model's own depth behind the hips at the scale of the picture, in pixels;
        weak. NaN in empty frames.
    world_m : float32 array, shape (T, 33, 3)
        The landmark model's own place from the middle of the hips, x right, y down, z away; its
        depth is weak. NaN in empty frames.
    visibility : float32 array, shape (T, 33)
        From 0 (hidden or outside the picture) to 1; 0 in empty frames.
    confidence : float32 array, shape (T,)
        Of the model that there is a person; 0 where it found none.
    present : bool array, shape (T,)
        False in empty frames: no person, and the gap too long to be bridged.
    bridged : bool array, shape (T,)
        Frames without a person, interpolated from their neighbours.
    silhouette_frames : intp array, shape (K,)
        Frames whose mask is kept.
    silhouettes : uint8 array, shape (K, h, w)
        Confidence that a pixel shows the person, 0 to 255, of the whole picture made smaller.
    notes : tuple of str
        Sentences about repairs: swapped sides, outliers, gaps.
    """

    timebase: Timebase
    width: int
    height: int
    image_px: NDArray[np.float32]
    depth_px: NDArray[np.float32]
    world_m: NDArray[np.float32]
    visibility: NDArray[np.float32]
    confidence: NDArray[np.float32]
    present: NDArray[np.bool_]
    bridged: NDArray[np.bool_]
    silhouette_frames: NDArray[np.intp]
    silhouettes: NDArray[np.uint8]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.timebase)

    def part(self, start: int, stop: int) -> LandmarkTrack:
        """Frames ``start`` to ``stop`` as a track of their own, with the same notes."""
        frames = slice(start, stop)
        kept = (self.silhouette_frames >= start) & (self.silhouette_frames < stop)
        cut = {name: getattr(self, name)[frames] for name in PER_FRAME}
        return replace(
            self,
            timebase=Timebase(self.timebase.times_s[frames]),
            silhouette_frames=self.silhouette_frames[kept] - start,
            silhouettes=self.silhouettes[kept],
            **cut,
        )
