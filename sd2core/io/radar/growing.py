"""Captures that grow while a radar is listened to: samples and times are appended frame by frame.

A folder of three files. ``live.json`` says what samples are; ``live.samples`` holds frames, one
after the other, (channels, chirps, samples), complex ones as real and imaginary part; and
``live.index`` one :data:`ENTRY` per frame, appended after the frame's samples. A frame counts once
its entry is there, so that the capture is whole at any moment, however writing ended.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_there
from sd2core.files.numpy_files import read_words
from sd2core.files.texts import errors_in, faults_in, read_json
from sd2core.io.radar.capture import LazySamples, RadarCapture
from sd2core.radar_config import RadarConfig
from sd2core.timebase import Timebase

HEAD_NAME, SAMPLES_NAME, INDEX_NAME = "live.json", "live.samples", "live.index"

ENTRY = np.dtype(
    [
        ("time_s", "<f8"),  # since the first frame
        ("dropped", "<u4"),  # frames before this one that were received, and dropped
        ("lost", "<u4"),  # frames before this one that were sent, and not received
        ("missing_bytes", "<u4"),  # of this frame that were not received, and are zero
        ("session", "<u4"),  # counts how often writing was continued
    ]
)
"""Entry of one frame."""

Word = Literal["uint16", "int16", "float32"]
"""Converter counts around mid-scale; counts around 0 of 16 bits; or relative to full scale."""

_WORDS: dict[Word, np.dtype[Any]] = {
    "uint16": np.dtype("<u2"),
    "int16": np.dtype("<i2"),
    "float32": np.dtype("<f4"),
}
_FULL_SCALE = np.float32(2.0**15)  # of int16
_EXPECTED = f"a radar capture that `sd2 listen` wrote: {HEAD_NAME}, {SAMPLES_NAME}, {INDEX_NAME}"
_MAX_FRAMES = 3 * 10**7
_MAX_FRAME_BYTES = 2**30
_MAX_BITS = 32


class GrowingHead(BaseModel):
    """Content of ``live.json``."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["sd2-live"] = "sd2-live"
    version: Literal[1] = 1
    radar: RadarConfig
    word: Word
    full_scale_known: bool = True
    simulated: bool = False
    replayed: bool = False
    source: str = ""
    notes: tuple[str, ...] = ()
    start_unix_s: float  # wall-clock time of time 0, when it was written here
    dropped_at_ends: int = Field(default=0, ge=0)  # frames after the last one of a session

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of the stored words of one frame."""
        radar = self.radar
        parts = () if radar.sampling == "real" else (2,)
        return (radar.channels, radar.chirps_per_frame, radar.samples_per_chirp, *parts)

    @property
    def frame_bytes(self) -> int:
        """Size of the samples of one frame."""
        return self.word_type.itemsize * math.prod(self.frame_shape)

    @property
    def word_type(self) -> np.dtype[Any]:
        """Type of the stored words."""
        return _WORDS[self.word]

    @property
    def sample_type(self) -> np.dtype[Any]:
        """Type of the samples that the words stand for."""
        if self.word == "uint16":
            return np.dtype(np.uint16)
        return np.dtype(np.float32 if self.radar.sampling == "real" else np.complex64)

    def as_stored(self, samples: NDArray[Any]) -> NDArray[Any]:
        """Words of a frame's samples (channels, chirps, samples); :meth:`as_samples` turns back.

        Samples for int16 are multiples of 1/32768.
        """
        parts = np.ascontiguousarray(samples)
        if self.word != "uint16":
            parts = parts.view(np.float32)
        if self.word == "int16":
            parts = np.rint(parts * _FULL_SCALE)
        return parts.astype(self.word_type, copy=False).reshape(self.frame_shape)

    def as_samples(self, words: NDArray[Any]) -> NDArray[Any]:
        """Samples of stored words, (n, channels, chirps, samples), as a capture holds them."""
        radar = self.radar
        if self.word == "uint16":
            samples = words.astype(np.uint16, copy=False)
        else:
            parts = words.astype(np.float32)
            if self.word == "int16":
                parts /= _FULL_SCALE
            samples = parts.view(self.sample_type)
        return samples.reshape(-1, radar.channels, radar.chirps_per_frame, radar.samples_per_chirp)

    def as_capture(self, words: NDArray[Any]) -> RadarCapture:
        """Capture of one frame alone, at time 0, of its stored words."""
        return RadarCapture(
            self.as_samples(words),
            self.radar,
            Timebase([0.0]),
            full_scale_known=self.full_scale_known,
        )


def is_growing(path: Path) -> bool:
    """True if a path is the folder of such a capture, or a file of it."""
    return (folder_of(path) / HEAD_NAME).is_file()


def folder_of(path: Path) -> Path:
    """Folder of a capture by that folder or a file of it."""
    return path.parent if path.name in (HEAD_NAME, SAMPLES_NAME, INDEX_NAME) else path


def read_head(folder: Path) -> GrowingHead:
    """Read ``live.json``; Sd2Error if it is damaged."""
    path = folder / HEAD_NAME
    with errors_in(path):
        with faults_in(path, _EXPECTED):
            head = GrowingHead.model_validate(read_json(path, _EXPECTED))
        if head.frame_bytes > _MAX_FRAME_BYTES or head.radar.adc_bits > _MAX_BITS:
            raise Sd2Error(
                f"Frames have {head.frame_bytes:,} bytes, of {head.radar.adc_bits} bits",
                f"at most {_MAX_FRAME_BYTES:,} bytes, of {_MAX_BITS} bits",
            )
        if head.word == "uint16" and head.radar.sampling != "real":
            raise Sd2Error(f"It holds {head.radar.sampling} samples as uint16", "real ones")
    return head


def frame_count(folder: Path, head: GrowingHead) -> int:
    """Number of whole frames that are stored; Sd2Error if a file is missing."""
    sizes = []
    for name in (SAMPLES_NAME, INDEX_NAME):
        path = folder / name
        check_there(path, _EXPECTED, "Copy the whole folder")
        sizes.append(path.stat().st_size)
    return min(sizes[0] // head.frame_bytes, sizes[1] // ENTRY.itemsize)


def read_entries(folder: Path, frames: int) -> NDArray[Any]:
    """Map the entries of the first frames, (frames,) of :data:`ENTRY`."""
    return np.memmap(folder / INDEX_NAME, ENTRY, "r", shape=(frames,))


def load_growing(path: Path) -> RadarCapture:
    """Open what there is by now of a growing capture; frames are read as they are needed.

    Raises Sd2Error if a file is missing or damaged, or there is no whole frame yet.
    """
    folder = folder_of(path)
    head = read_head(folder)
    frames = frame_count(folder, head)
    if not 0 < frames <= _MAX_FRAMES:
        raise Sd2Error(
            f"{folder} holds {frames:,} whole frames of {head.frame_bytes:,} bytes",
            f"1 to {_MAX_FRAMES:,} frames",
        )
    entries = read_entries(folder, frames)
    with errors_in(folder / INDEX_NAME):
        timebase = Timebase(entries["time_s"])
    lost = int(entries["lost"].sum(dtype=np.int64))
    dropped = int(entries["dropped"].sum(dtype=np.int64)) + head.dropped_at_ends
    samples = folder / SAMPLES_NAME
    words = head.frame_bytes // head.word_type.itemsize

    def read(some: slice) -> NDArray[Any]:
        start, stop, _ = some.indices(frames)
        place = slice(start * words, stop * words)
        return head.as_samples(read_words(samples, head.word_type, place))

    shape = (frames, *head.frame_shape[:3])
    return RadarCapture(
        samples=LazySamples(shape, head.sample_type, read),
        config=head.radar,
        timebase=timebase,
        start_unix_s=None if head.replayed else head.start_unix_s,
        simulated=head.simulated,
        source=str(samples),
        notes=(*head.notes, *_notes(entries, lost, dropped)),
        meta={"format": "sd2-live", "source": head.source, "replayed": head.replayed},
        full_scale_known=head.full_scale_known,
        frames_missing=lost + dropped,
    )


def _notes(entries: NDArray[Any], lost: int, dropped: int) -> list[str]:
    """Sentences on missing parts of a capture, and why."""
    notes = []
    damaged = int(np.count_nonzero(entries["missing_bytes"]))
    sessions = len(np.unique(entries["session"]))
    if dropped:
        notes.append(f"Frames dropped, as this computer was too slow: {dropped:,}.")
    if lost:
        notes.append(f"Frames sent and never received, a gap in time: {lost:,}.")
    if damaged:
        missing = int(entries["missing_bytes"].sum(dtype=np.int64))
        notes.append(
            f"Frames with zeros in place of lost packets: {damaged:,}, {missing:,} bytes in all."
        )
    if sessions > 1:
        often = "once" if sessions == 2 else f"{sessions - 1} times"
        notes.append(f"Listening was stopped and continued {often}.")
    return notes
