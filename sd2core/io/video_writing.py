"""Writing of pictures to a video file."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

_TICKS_PER_S = 90_000
"""Clock of videos with explicit times: 11 microseconds, which every player knows."""

HEADS_COVERED = "SD2 Studio: heads are covered"
"""Comment in the file of a video in which they are."""


def write_video(
    path: Path,
    frames: Iterable[NDArray[np.uint8]],
    frames_per_s: int,
    size: tuple[int, int],
    *,
    times_s: NDArray[np.float64] | None = None,
    **how: Any,
) -> None:
    """Encode sRGB pictures as H.264 in MP4; raises as :class:`VideoEncoder`.

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
    **how
        Quality, speed and comment, as of :class:`VideoEncoder`.
    """
    ticks = frames_per_s if times_s is None else _TICKS_PER_S
    with VideoEncoder(path, frames_per_s, size, ticks_per_s=ticks, **how) as encoder:
        for number, picture in enumerate(frames):
            time_s = number / frames_per_s if times_s is None else float(times_s[number])
            encoder.add(picture, time_s)


class VideoEncoder(AbstractContextManager["VideoEncoder"]):
    """H.264 in MP4, picture by picture.

    Raises Sd2Error if this build of PyAV has no H.264 encoder.

    Parameters
    ----------
    file : Path or file open for writing
        A file that grows is cut into pieces of half a second, each of which is whole.
    frames_per_s : float
        Half of this many are between key frames.
    size : (int, int)
        Width and height in pixels, both even.
    crf : int
        Constant rate factor of x264: lower is better; 18 is hard to tell from the source.
    preset : str
        Of x264: a slower one makes a smaller file.
    ticks_per_s : int
        Times are rounded to these.
    grows : bool
        True for a file that can be read up to the last second however writing ends.
    comment : str
        What the file says of itself.
    """

    def __init__(
        self,
        file: Path | Any,
        frames_per_s: float,
        size: tuple[int, int],
        *,
        crf: int = 21,
        preset: str = "slow",
        ticks_per_s: int = _TICKS_PER_S,
        grows: bool = False,
        comment: str = "",
    ) -> None:
        import av

        try:
            av.Codec("libx264", "w")
        except ValueError as error:
            raise Sd2Error(
                "This build of PyAV cannot encode H.264 (libx264)",
                "the wheels of PyAV from the package index",
                "Install it again with: pip install --force-reinstall av",
            ) from error
        flags = "frag_keyframe+empty_moov+default_base_moof" if grows else "+faststart"
        options = {"movflags": flags} | ({"flush_packets": "1"} if grows else {})
        self._container = av.open(
            str(file) if isinstance(file, Path) else file, "w", format="mp4", options=options
        )
        if comment:
            self._container.metadata["comment"] = comment
        rate = Fraction(frames_per_s).limit_denominator(1001)
        self._stream = self._container.add_stream("libx264", rate=rate)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        # A key frame every half second: scrubbing decodes few frames.
        self._stream.options = {
            "preset": preset,
            "crf": str(crf),
            "g": str(max(int(frames_per_s) // 2, 1)),
            "threads": "1",
        } | ({"tune": "zerolatency"} if grows else {})
        self._ticks_per_s = ticks_per_s
        self._stream.codec_context.time_base = Fraction(1, ticks_per_s)

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, picture: NDArray[np.uint8], time_s: float) -> None:
        """Encode an sRGB picture, (height, width, 3), that is shown from a time on."""
        import av

        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        # Without this, players guess the matrix from the picture's size.
        frame = frame.reformat(format="yuv420p", dst_colorspace="ITU601")
        frame.pts = round(time_s * self._ticks_per_s)
        frame.time_base = Fraction(1, self._ticks_per_s)
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Write what is left, and the end of the file."""
        self._container.mux(self._stream.encode(None))
        self._container.close()
