"""Small videos whose frames carry their own number in their pixels."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

BITS = 8


def picture(number: int, width: int, height: int) -> NDArray[np.uint8]:
    """Black and white bars, one per bit of the number: they survive lossy coding."""
    bar = width // BITS
    image = np.full((height, width, 3), 128, np.uint8)
    for bit in range(BITS):
        image[:, bit * bar : (bit + 1) * bar] = 235 if number >> bit & 1 else 16
    return image


def number_in(image: NDArray[np.uint8]) -> int:
    """Read the number back from the middle of each bar."""
    bar = image.shape[1] // BITS
    centres = [bit * bar + bar // 2 for bit in range(BITS)]
    row = image[image.shape[0] // 2, :, 1].astype(int)
    return sum(int(row[x - 1 : x + 2].mean() > 128) << bit for bit, x in enumerate(centres))


def write_video(
    path: Path,
    frames: int = 40,
    *,
    codec: str = "libx264",
    size: tuple[int, int] = (128, 64),
    rate: int = 30,
    times_ms: Sequence[int] | None = None,
    options: dict[str, str] | None = None,
    rotation: int | None = None,
    pixels: str = "yuv420p",
    container_options: dict[str, str] | None = None,
    aspect: Fraction | None = None,
    metadata: dict[str, str] | None = None,
) -> Path:
    """Encode numbered frames, evenly at ``rate`` or at ``times_ms``."""
    with av.open(str(path), "w", options=container_options or {}) as container:
        container.metadata.update(metadata or {})
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height = size
        stream.pix_fmt = pixels
        if times_ms is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        if aspect is not None:
            stream.codec_context.sample_aspect_ratio = aspect
        if rotation is not None:
            stream.set_display_rotation(rotation)
        for number in range(frames):
            frame = av.VideoFrame.from_ndarray(picture(number, *size), format="rgb24")
            frame.pts = number if times_ms is None else times_ms[number]
            frame.time_base = Fraction(1, rate if times_ms is None else 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
