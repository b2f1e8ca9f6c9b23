"""Landmarks of one person through a video, before a body is fitted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.vertex_parts import other_side
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

LANDMARK = {name: number for number, name in enumerate(LANDMARKS)}
"""Number of a landmark by its name."""

MIRRORED = tuple(LANDMARKS.index(other_side(name)) for name in LANDMARKS)
"""For every landmark the one on the other side."""

TORSO_CORNERS = tuple(
    LANDMARKS.index(name) for name in ("shoulder.L", "shoulder.R", "hip.L", "hip.R")
)
"""Landmarks whose mean is the body's centre."""

PER_FRAME = ("image_px", "depth_px", "world_m", "visibility", "confidence", "present", "bridged")
"""Arrays of a track that have a row for every frame, besides its times."""

PART_FRAMES = 3600
"""Longer clips (two minutes at 30 frames/s) are worked on in parts of this length.

What has to be known of the whole clip is then taken from so many frames of it.
"""

_MARGIN_FRAMES = 300


def parts(frames: int) -> Iterator[tuple[int, int]]:
    """Start and stop of the parts of a clip, of nearly equal length."""
    count = max(-(-frames // PART_FRAMES), 1)
    edges = [frames * number // count for number in range(count + 1)]
    yield from pairwise(edges)


def with_margin(start: int, stop: int, frames: int) -> tuple[int, int]:
    """Start and stop of a part of a clip with the frames around it that it is repaired with."""
    return max(start - _MARGIN_FRAMES, 0), min(stop + _MARGIN_FRAMES, frames)


@dataclass(frozen=True, eq=False, kw_only=True)
class LandmarkTrack:
    """33 landmarks of one person in T frames of a video."""

    timebase: Timebase
    width: int  # of the upright picture, in pixels
    height: int
    image_px: NDArray[np.float32]
    """Landmarks in the picture (also outside it), (T, 33, 2); NaN in empty frames."""
    depth_px: NDArray[np.float32]
    """The landmark model's own depth behind the hips at the scale of the picture, (T, 33), in
    pixels; weak. NaN in empty frames."""
    world_m: NDArray[np.float32]
    """The landmark model's own place from the middle of the hips, x right, y down, z away, (T, 33,
    3); its depth is weak. NaN in empty frames."""
    visibility: NDArray[np.float32]
    """From 0 (hidden or outside the picture) to 1, (T, 33); 0 in empty frames."""
    confidence: NDArray[np.float32]
    """Of the model that there is a person, (T,); 0 where it found none."""
    present: NDArray[np.bool_]
    """False in empty frames, (T,): no person, and the gap too long to be bridged."""
    bridged: NDArray[np.bool_]
    """Frames without a person, interpolated from their neighbours, (T,)."""
    silhouette_frames: NDArray[np.intp]  # (K,), frames whose mask is kept
    silhouettes: NDArray[np.uint8]
    """Confidence that a pixel shows the person, 0 to 255, of the whole picture made smaller; (K,
    h, w)."""
    notes: tuple[str, ...] = ()  # sentences about repairs: swapped sides, outliers, gaps

    def __len__(self) -> int:
        return len(self.timebase)

    def part(self, start: int, stop: int) -> LandmarkTrack:
        """Frames ``start`` to ``stop`` as a track of their own, with the same notes."""
        kept = (self.silhouette_frames >= start) & (self.silhouette_frames < stop)
        return LandmarkTrack(
            timebase=Timebase(self.timebase.times_s[start:stop]),
            width=self.width,
            height=self.height,
            silhouette_frames=self.silhouette_frames[kept] - start,
            silhouettes=self.silhouettes[kept],
            notes=self.notes,
            **{name: getattr(self, name)[start:stop] for name in PER_FRAME},
        )
