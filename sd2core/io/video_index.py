"""Index of a video file's frames that really decode, and of their times.

A container's own frame count and duration are claims. Its packets are better:
reading them without decoding lists 162,000 presentation times in about a
second. Only decoding tells the truth at the two ends, where a cut file has
packets without a picture, so the ends of a long file are decoded, and a short
file is decoded whole.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_there
from sd2core.progress import Progress, silent

_WHOLE_MEGAPIXELS = 100.0
"""Up to this many decoded megapixels (half a second) a file is decoded whole."""

_HEAD_PACKETS = 64
_TAIL_FRAMES = 8
_MISSING_IN_TAIL = 4

_DISORDER = 0.1
"""Up to this share of frames without a time, or out of turn, is damage; more is wrong times."""

_TICKS_PER_FRAME = 4
"""On a finer grid than this any times lie near a place, and a gap proves nothing."""

_FIRST_FRAME_S = 0.1
"""A video that starts this soon has lost its first frame; a later start was meant so."""

_CLOCK = re.compile(r"(\d{1,9}):(\d{1,9}):(\d{1,9}(?:\.\d*)?)")

_LONG_STEP = 10
"""Steps of an uneven video that are this many times the typical one are noted."""


@dataclass(frozen=True, eq=False)
class FrameIndex:
    """Every frame that decodes, in the order shown."""

    keys: NDArray[np.int64]  # (T,) presentation time in ticks, or place in the file if counted
    times_s: NDArray[np.float64]  # (T,) seconds, the first frame at 0
    entry_keys: NDArray[np.int64]  # (E,) keys at which decoding can begin, also times to seek to
    counted: bool  # frames can only be found by counting from the start
    late: int  # frames that the decoder may show ahead of one: 0, unless the file is damaged
    notes: tuple[str, ...]  # contradictions to the file's own claims


@dataclass(frozen=True, eq=False)
class _Packets:
    pts: NDArray[np.int64]  # in the order of the file, those that are shown
    entry_pts: NDArray[np.int64]
    count: int
    usable: bool


def open_stream(path: Path) -> tuple[Any, Any]:
    """Open a video file; return PyAV's container and its video stream.

    Raises Sd2Error if the file is missing, is no video or holds no moving picture.
    """
    check_there(path, "a video file")
    if path.is_dir():
        raise Sd2Error(f"{path} is a folder", "a video file", "Name the file in it")
    try:
        # A file may be a playlist: it must not make the program open a connection.
        container = av.open(f"file:{path}", options={"protocol_whitelist": "file"})
    except (FFmpegError, OSError, ValueError) as error:
        raise Sd2Error(
            f"{path} cannot be read as a video ({getattr(error, 'strerror', None) or error})",
            "a complete video file such as .mp4, .mkv, .mov, .avi or .webm",
            "When it came from a copy or an aborted recording, copy or record it again",
        ) from error
    # An attached picture is the cover.
    video = container.streams.video
    streams = [s for s in video if "attached_pic" not in str(s.disposition).lower()]
    if not streams:
        container.close()
        raise Sd2Error(
            f"{path} holds no video stream (format {container.format.name})", "a video file"
        )
    stream = streams[0]
    if stream.codec_context is None:
        container.close()
        raise Sd2Error(
            f"{path} holds video of a kind that FFmpeg does not decode",
            "H.264, HEVC, VP9, MPEG-4 or another common kind",
            "Convert it, for example 'ffmpeg -i FILE copy.mp4'",
        )
    # More threads hold back more frames and make every seek dearer.
    stream.thread_type = "AUTO"
    stream.codec_context.thread_count = min(os.cpu_count() or 1, 4)
    return container, stream


def decoded_frames(container: Any, stream: Any, packets: int | None = None) -> Iterator[Any]:
    """Decode from where the container stands; skip packets that do not decode.

    With ``packets`` given, stop after that many packets and do not flush.
    """
    demuxer = container.demux(stream)
    count = 0
    while packets is None or count < packets:
        try:
            packet = next(demuxer)
        except StopIteration:
            return
        except (FFmpegError, OSError):
            break
        count += 1
        try:
            frames = packet.decode()
        except (FFmpegError, OSError):
            continue
        yield from frames
    if packets is None:
        # The file broke off: the decoder still holds the frames before that.
        try:
            yield from stream.codec_context.decode(None)
        except (FFmpegError, OSError):
            return


def build_index(path: Path, progress: Progress = silent) -> FrameIndex:
    """Find the frames of a video file that decode, and their times; Sd2Error if none does."""
    container, stream = open_stream(path)
    with container:
        claimed = int(stream.frames)
        rates = [float(r) for r in (stream.average_rate, stream.guessed_rate) if r]
        time_base = stream.time_base
        seconds = _stated_seconds(container, stream)
        megapixels = stream.codec_context.width * stream.codec_context.height / 1e6
        packets = _read_packets(container, stream, progress)
    if packets.count == 0:
        raise _nothing_decodes(path)

    keys = None
    if packets.usable and packets.count * megapixels > _WHOLE_MEGAPIXELS:
        keys = _keys_from_ends(path, packets, progress)
    entries = packets.entry_pts
    counted, late = False, 0
    notes = []
    if keys is None:
        container, stream = open_stream(path)
        with container:
            shown = _shown_times(decoded_frames(container, stream), packets.count, progress)
        if not shown:
            raise _nothing_decodes(path)
        keys, late = _keys_from_all(shown) if packets.usable else (None, 0)
        if keys is None:
            keys = np.arange(len(shown), dtype=np.int64)
            entries = np.zeros(1, np.int64)
            counted = True
        elif late or len(keys) < len(shown):
            notes.append(
                "The file is damaged: some frames come out of turn or have no time; the "
                f"{len(keys):,} that have one are used, each at its own time."
            )

    missing = 0
    if counted:
        stated = rates[0] if rates else 30.0
        times_s = keys / stated
        notes.append(
            f"The file holds no usable frame times: frames are counted and placed at "
            f"{stated:g} frames/s. Jumping back is slow; 'ffmpeg -i FILE copy.mp4' cures both."
        )
    else:
        times_s = (keys - keys[0]) * float(time_base)
        grid = _grid(times_s, rates, float(time_base))
        entries = entries[entries <= keys[-1]]
        if grid is not None:
            places, rate = grid
            times_s = places / rate
            # Where most frames lie further apart, that rate is not the video's.
            if len(places) > 1 and np.median(np.diff(places)) == 1:
                missing = int(places[-1]) + 1 - len(places)
                claimed = claimed or round(seconds * rate)
        notes += _notes_on_gaps(times_s, missing, even=grid is not None)
        if grid is None or len(keys) == 1:
            notes += _note_on_end(times_s, seconds, 1 / (rates[0] if rates else 30.0))
    if claimed > len(keys):
        cut = claimed > len(keys) + missing
        notes.append(
            f"The file claims {claimed:,} frames, {len(keys):,} decode"
            + ("; it is used up to its last frame that decodes." if cut else ".")
        )
    return FrameIndex(keys, times_s, entries, counted, late, tuple(notes))


def _read_packets(container: Any, stream: Any, progress: Progress) -> _Packets:
    pts: list[int] = []
    entry_pts: list[int] = []
    count = 0
    usable = True
    total = max(int(stream.frames), 1)
    demuxer = container.demux(stream)
    while True:
        try:
            packet = next(demuxer)
        except (StopIteration, FFmpegError, OSError):
            break
        if packet.size == 0:
            continue
        count += 1
        if count % 2000 == 0:
            progress(min(count, total), max(count, total))
        if packet.pts is None:
            usable = False
        elif not packet.is_discard:
            pts.append(packet.pts)
        if packet.is_keyframe and packet.pts is not None:
            entry_pts.append(packet.pts)
    if (np.diff(entry_pts) <= 0).any() or not pts:
        usable = False
    return _Packets(np.array(pts, np.int64), np.array(entry_pts, np.int64), count, usable)


def _keys_from_ends(path: Path, packets: _Packets, progress: Progress) -> NDArray[np.int64] | None:
    """Packet times corrected at both ends; None when only decoding all can tell."""
    keys = np.unique(packets.pts)
    container, stream = open_stream(path)
    with container:
        frames = decoded_frames(container, stream, _HEAD_PACKETS)
        head = _shown_times(frames, _HEAD_PACKETS, progress)
    if not head or None in head or (np.diff(head) <= 0).any():
        return None
    within = keys[(keys >= head[0]) & (keys <= head[-1])]
    if not np.array_equal(within, head):
        return None
    keys = keys[keys >= head[0]]

    last = packets.entry_pts[packets.entry_pts <= keys[max(len(keys) - _TAIL_FRAMES, 0)]]
    if not last.size:
        return None
    begin = int(last[-1])
    container, stream = open_stream(path)
    with container:
        container.seek(begin, stream=stream, backward=True)
        expected = int((keys >= begin).sum())
        tail = _shown_times(decoded_frames(container, stream), expected, progress)
    if not tail or None in tail or (np.diff(tail) <= 0).any() or tail[0] > begin:
        return None
    decoded = np.array([t for t in tail if t >= begin], np.int64)
    stated = keys[keys >= begin]
    inside = stated[stated <= decoded[-1]]
    if not np.isin(decoded, stated).all() or len(inside) - len(decoded) > _MISSING_IN_TAIL:
        return None
    return np.concatenate([keys[keys < begin], decoded])


def _keys_from_all(shown: list[Any]) -> tuple[NDArray[np.int64] | None, int]:
    """Times of all decoded frames and how late one may come; None when they make no sense."""
    timed = np.array([time for time in shown if time is not None], np.int64)
    disorder = len(shown) - len(timed) + int((np.diff(timed) <= 0).sum())
    if not timed.size or disorder > _DISORDER * len(shown):
        return None, 0
    keys, places = np.unique(timed, return_inverse=True)
    return keys, int((np.maximum.accumulate(places) - places).max())


def _shown_times(frames: Iterator[Any], expected: int, progress: Progress) -> list[Any]:
    """Presentation times of decoded frames; None for those without."""
    shown = []
    for frame in frames:
        shown.append(frame.pts)
        if len(shown) % 8 == 0:
            progress(min(len(shown), expected), expected)
    return shown


def _stated_seconds(container: Any, stream: Any) -> float:
    """Duration of the video by the file's own claim; 0 without one."""
    if stream.duration is not None:
        return float(stream.duration * stream.time_base)
    # What Matroska states is when the video ends, not how long it lasts.
    start_s = float((stream.start_time or 0) * stream.time_base)
    if start_s < _FIRST_FRAME_S:
        start_s = 0.0
    tag = _CLOCK.fullmatch(stream.metadata.get("DURATION", ""))
    if tag:
        hours, minutes, seconds = (float(part) for part in tag.groups())
        return 3600 * hours + 60 * minutes + seconds - start_s
    if len(container.streams) > 1:
        return 0.0  # the container's duration may be that of the sound
    return float(container.duration or 0) / 1e6 - start_s


def _grid(
    times_s: NDArray[np.float64], rates: list[float], tick_s: float
) -> tuple[NDArray[np.int64], float] | None:
    """Places on a regular clock and its rate, free of jitter by rounded times; None without."""
    for rate in rates:
        places = np.rint(times_s * rate).astype(np.int64)
        steps = np.diff(places)
        if (np.abs(times_s - places / rate) >= tick_s).any() or (steps < 1).any():
            continue
        if (steps == 1).all() or rate * tick_s * _TICKS_PER_FRAME < 1:
            return places, rate
    return None


def _notes_on_gaps(times_s: NDArray[np.float64], missing: int, *, even: bool) -> list[str]:
    steps_s = np.diff(times_s)
    if not steps_s.size or (even and not missing):
        return []
    if not even and steps_s.max() < _LONG_STEP * np.median(steps_s):
        return []
    longest = int(steps_s.argmax())
    where = f"from {times_s[longest]:.2f} s to {times_s[longest + 1]:.2f} s"
    why = "the file is damaged there, or they were never recorded."
    if even:
        plural = "s are" if missing > 1 else " is"
        return [f"{missing:,} frame{plural} missing inside, the longest gap {where}: {why}"]
    return [f"No frame is shown {where}: {why}"]


def _note_on_end(times_s: NDArray[np.float64], claimed_s: float, stated_step_s: float) -> list[str]:
    step_s = np.median(np.diff(times_s)) if len(times_s) > 1 else stated_step_s
    if claimed_s < times_s[-1] + _LONG_STEP * step_s:
        return []
    return [
        f"The file claims to last {claimed_s:.1f} s; its last frame that decodes is at"
        f" {times_s[-1]:.1f} s."
    ]


def _nothing_decodes(path: Path) -> Sd2Error:
    return Sd2Error(
        f"{path}: not one frame decodes",
        "a video with at least one complete frame",
        "The file is damaged or cut short: copy or record it again",
    )
