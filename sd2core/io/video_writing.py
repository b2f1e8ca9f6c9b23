"""Writing of pictures to a video file."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

_TICKS_PER_S = 90_000
"""Clock of videos with explicit times: 11 microseconds, which every player knows."""


def write_video(
    path: Path,
    frames: Iterable[NDArray[np.uint8]],
    frames_per_s: int,
    size: tuple[int, int],
    *,
    times_s: NDArray[np.float64] | None = None,
    crf: int = 21,
    preset: str = "slow",
) -> None:
    """Encode sRGB pictures as H.264 in MP4.

    Parameters
    ----------
    path : Path
    frames : iterable of uint8 arrays, shape (height, width, 3)
        Taken one by one.
    frames_per_s : int
        Frame k is shown at ``k / frames_per_s``; half of this many are between key frames.
    size : (int, int)
        Width and height in pixels, both even.
    times_s : float64 array, shape (frames,), optional
        Times of the frames instead, the first of which is 0.
    crf : int
        Constant rate factor of x264: lower is better; 18 is hard to tell from the source.
    preset : str
        Of x264: a slower one makes a smaller file.

    Raises
    ------
    Sd2Error
        If this build of PyAV has no H.264 encoder.
    """
    import av

    try:
        av.Codec("libx264", "w")
    except ValueError as error:
        raise Sd2Error(
            "This build of PyAV cannot encode H.264 (libx264)",
            "the wheels of PyAV from the package index",
            "Install it again with: pip install --force-reinstall av",
        ) from error
    ticks = frames_per_s if times_s is None else _TICKS_PER_S
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=frames_per_s)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        # A key frame every half second: scrubbing decodes few frames.
        stream.options = {
            "preset": preset,
            "crf": str(crf),
            "g": str(max(frames_per_s // 2, 1)),
            "threads": "1",
        }
        stream.codec_context.time_base = Fraction(1, ticks)
        for number, picture in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            # Without this, players guess the matrix from the picture's size.
            frame = frame.reformat(format="yuv420p", dst_colorspace="ITU601")
            frame.pts = number if times_s is None else round(float(times_s[number]) * ticks)
            frame.time_base = Fraction(1, ticks)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
