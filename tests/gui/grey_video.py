"""A small video whose frames tell their numbers."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np

FRAMES = 60
RATE = 30.0


def write_video(path: Path) -> None:
    """A grey video whose brightness is the frame number."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=int(RATE))
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        for number in range(FRAMES):
            picture = np.full((120, 160, 3), 40 + 3 * number, np.uint8)
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
