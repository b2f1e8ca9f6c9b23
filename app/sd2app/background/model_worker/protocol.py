"""Messages between the window and the model process: JSON followed by binary arrays."""

from __future__ import annotations

import json
import struct
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

Message = tuple[dict[str, Any], bytes]

_LENGTHS = struct.Struct("<IQ")
"""Bytes of JSON, bytes of numbers."""


def write_message(stream: IO[bytes], content: dict[str, Any], numbers: bytes = b"") -> None:
    """Write one message."""
    text = json.dumps(content).encode()
    stream.write(_LENGTHS.pack(len(text), len(numbers)) + text)
    stream.write(numbers)
    stream.flush()


def read_message(stream: IO[bytes]) -> Message | None:
    """The next message; None where the other side is gone."""
    lengths = stream.read(_LENGTHS.size)
    if len(lengths) < _LENGTHS.size:
        return None
    text_length, number_length = _LENGTHS.unpack(lengths)
    text, numbers = stream.read(text_length), stream.read(number_length)
    if len(text) < text_length or len(numbers) < number_length:
        return None
    return json.loads(text), numbers


def packed_map(doppler: DopplerMap) -> Message:
    """Pack a map with all that a denoiser uses."""
    frames = len(doppler.timebase)
    present = np.ones(frames, bool) if doppler.present is None else doppler.present
    content = {
        "bins": doppler.axis.bins,
        "v_max_mps": doppler.axis.v_max_mps,
        "frames": frames,
        "kind": doppler.kind,
        "unit": doppler.unit,
        "null_bins": doppler.null_bins,
        "unseen_bins": doppler.unseen_bins,
        "meta": doppler.meta,
    }
    return content, doppler.times_s.tobytes() + present.tobytes() + doppler.values.tobytes()


def unpacked_map(content: dict[str, Any], numbers: bytes) -> DopplerMap:
    """Undo :func:`packed_map`."""
    frames, bins = content["frames"], content["bins"]
    times_s = np.frombuffer(numbers, np.float64, frames)
    present = np.frombuffer(numbers, np.bool_, frames, 8 * frames)
    return DopplerMap(
        values=unpacked_values(numbers, (bins, frames), 9 * frames),
        axis=VelocityAxis(bins, content["v_max_mps"]),
        timebase=Timebase(times_s),
        kind=content["kind"],
        unit=content["unit"],
        null_bins=tuple(content["null_bins"]),
        unseen_bins=tuple(content["unseen_bins"]),
        meta=content["meta"],
        present=present,
    )


def unpacked_values(numbers: bytes, shape: tuple[int, ...], offset: int = 0) -> NDArray[np.float32]:
    """Values of their own, at ``offset`` bytes."""
    count = int(np.prod(shape))
    # Copied: nothing says that the offset is a multiple of four.
    return np.frombuffer(numbers[offset : offset + 4 * count], np.float32).reshape(shape).copy()
