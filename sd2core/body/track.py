"""Landmarks of one person through a video: what is found, before a body is fitted."""

from __future__ import annotations

from dataclasses import dataclass

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
        Where each landmark is in the picture (also outside it); NaN in empty frames.
    depth_px : float32 array, shape (T, 33)
        The landmark model's own depth behind the hips at the scale of the picture,
        in pixels; weak. NaN in empty frames.
    world_m : float32 array, shape (T, 33, 3)
        The landmark model's own place from the middle of the hips, x right, y down,
        z away; its depth is weak. NaN in empty frames.
    visibility : float32 array, shape (T, 33)
        From 0 (hidden or outside the picture) to 1; 0 in empty frames.
    confidence : float32 array, shape (T,)
        How sure the model is that there is a person; 0 where it found none.
    present : bool array, shape (T,)
        False in empty frames: no person, and the gap too long to be bridged.
    bridged : bool array, shape (T,)
        Frames without a person, interpolated from their neighbours.
    silhouette_frames : intp array, shape (K,)
        Frames of which the model's mask is kept.
    silhouettes : uint8 array, shape (K, h, w)
        How sure the model is that a pixel shows the person, 0 to 255, of the whole
        picture made smaller.
    notes : tuple of str
        What was found and repaired: swapped sides, outliers, gaps.
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
