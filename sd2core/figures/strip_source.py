"""Source, options and choice of frames of a strip."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.bounds import STRIP_FRAMES
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from sd2core.io.video import VideoReader
    from sd2core.recording.recording import Recording

Row = Literal["video", "mesh", "overlay"]
ROWS: tuple[Row, ...] = get_args(Row)
Colour = Literal["plain", "velocity"]

_RANGE = re.compile(r"(\d*):(\d*)(?::(\d+))?")
_EXPECTED = "frame numbers such as 0,15,30 or a range such as 0:90:15 (from, to, step)"


@dataclass(frozen=True)
class StripOptions:
    """Options of a strip."""

    rows: tuple[Row, ...] = ("video", "mesh")  # "overlay" is the mesh over the video
    as_dots: bool = False  # vertices instead of the surface
    colour: Colour = "velocity"  # velocity is radial, towards the sensor
    v_max_mps: float = 2.0  # end of the colour scale of velocity
    whole: bool = False  # the whole picture instead of what is around the body
    columns: int = 10  # pictures side by side; more frames go below

    def __post_init__(self) -> None:
        unknown = [row for row in self.rows if row not in ROWS]
        if unknown or not self.rows or len(set(self.rows)) < len(self.rows):
            raise Sd2Error(
                f"The rows are {', '.join(self.rows) or 'none'}", f"of {', '.join(ROWS)}"
            )
        if not (self.v_max_mps > 0 and self.columns > 0):
            raise Sd2Error(
                f"v_max is {self.v_max_mps}, columns are {self.columns}", "positive numbers"
            )


@dataclass(frozen=True, eq=False)
class StripSource:
    """Video and mesh that a strip is drawn of, both seen by ``camera``."""

    video: VideoReader | None
    mesh: MeshSequence | None
    camera: PinholeCamera
    sensor: VirtualSensor = field(default_factory=VirtualSensor)  # velocities are towards it
    simulated: bool = False  # there was no camera
    name: str = ""  # of the recording or file, for provenance

    @classmethod
    def of(
        cls, recording: Recording, video: VideoReader | None, mesh: MeshSequence | None, name: str
    ) -> StripSource:
        """Source from a recording, its parts opened by the caller.

        Parameters
        ----------
        recording : Recording
            Gives the focal length, the sensor, and whether it is simulated.
        video : VideoReader or None
            Without one the camera's picture has 640 × 480 pixels.
        mesh : MeshSequence or None
        name : str
            Of the recording, for provenance and errors.
        """
        width, height = (video.width, video.height) if video is not None else (640, 480)
        focal_px = recording.focal_px(width, height)
        camera = PinholeCamera.default(width, height)
        if focal_px is not None:
            camera = PinholeCamera(width, height, focal_px)
        return cls(video, mesh, camera, recording.sensor, recording.simulated, name)

    @property
    def clock(self) -> Timebase:
        """Frames are counted on the video's clock, or the mesh's where there is no video."""
        part = self.video or self.mesh
        assert part is not None
        return part.timebase


def check_strip(source: StripSource, frames: Sequence[int], options: StripOptions) -> None:
    """Refuse what cannot be drawn."""
    if len(frames) not in STRIP_FRAMES:
        raise Sd2Error(f"A strip of {len(frames)} frames", f"{STRIP_FRAMES.words} of them")
    for frame in frames:
        if not 0 <= frame < len(source.clock):
            raise Sd2Error(f"There is no frame {frame}", f"frames 0 to {len(source.clock) - 1}")
    for row in options.rows:
        if row != "mesh" and source.video is None:
            raise Sd2Error(f"{source.name} has no video", f"a video, for the row {row}")
        if row != "video" and source.mesh is None:
            raise Sd2Error(f"{source.name} has no mesh", f"a mesh, for the row {row}")


def parse_frames(text: str, total: int) -> list[int]:
    """Read ``0,15,30`` or ``0:90:15``, or several of either, in the order given.

    Ranges are half-open; what is left out is the start, the end (``total``), or 1. Raises
    Sd2Error if the text cannot be read, is empty, or names a frame that is not there.
    """
    frames: list[int] = []
    for part in text.replace(" ", "").split(","):
        if part.isascii() and part.isdigit():
            frames.append(int(part))
            continue
        match = _RANGE.fullmatch(part)
        if match is None or match[3] == "0":
            raise Sd2Error(f"The frames are {text!r}", _EXPECTED)
        start = int(match[1] or 0)
        stop = min(int(match[2] or total), total)
        frames.extend(range(start, stop, int(match[3] or 1)))
    for frame in frames:
        if frame >= total:
            raise Sd2Error(f"There is no frame {frame}", f"frames from 0 to {total - 1}")
    if not frames:
        raise Sd2Error(f"There are no frames in {text!r}", _EXPECTED)
    return frames


def spread_frames(count: int, total: int) -> list[int]:
    """``count`` frames spread evenly over all, the first and the last among them."""
    return np.unique(np.linspace(0, total - 1, min(count, total)).round().astype(int)).tolist()


def frames_around(frame: int, count: int, step: int, total: int) -> list[int]:
    """``count`` frames, ``step`` apart, ``frame`` in their middle; none outside the clip.

    Parameters
    ----------
    frame : int
    count, step : int
        1 or more; of an even count one frame more follows than precedes.
    total : int
        Frames of the clip.
    """
    first = frame - step * ((count - 1) // 2)
    return [k for k in range(first, first + step * count, step) if 0 <= k < total]
