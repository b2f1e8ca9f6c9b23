"""Cutting of a source into segments: pure functions from maps to rows of a data set.

Segments lie within clips: runs of frames with a person, between which no time is missing.
Where frames come evenly and at the rate of the data set, a segment holds them as they are.
Otherwise the clip is brought to that rate first: energies are interpolated linearly, a label
is that of the nearest frame, and a map is known where both its neighbours are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.source import KINDS, Outline, Source
from sd2core.denoise.resample_to_model import clips, interpolated, is_regular
from sd2core.pairs.segments import cut, segment_starts

_BLOCK = 256
"""Segments that are in memory at a time, besides the maps of the source."""

Arrays = dict[str, NDArray]


@dataclass(frozen=True, eq=False)
class Clip:
    """Run of frames that segments are cut from."""

    start: int  # First frame of the source.
    stop: int  # End of its frames, exclusive.
    times_s: NDArray[np.float64]  # Times of its frames as segments hold them.
    resampled: bool  # True if these are other times than those of the source.
    starts: NDArray[np.int64]  # First frames of the segments, within the clip.


def clips_of(
    times_s: NDArray[np.float64],
    present: NDArray[np.bool_] | None,
    frame_rate_hz: float,
    length: int,
    overlap: int,
) -> list[Clip]:
    """Find the clips of a source and the first frames of their segments.

    ``present`` marks frames with a person; None: all. ``frame_rate_hz`` is that of the segments.
    """
    there = np.ones(len(times_s), bool) if present is None else present
    found = []
    for start, stop in clips(times_s, there, frame_rate_hz):
        own_s = times_s[start:stop]
        resampled = not is_regular(own_s, frame_rate_hz)
        if resampled:
            count = int(np.floor((own_s[-1] - own_s[0]) * frame_rate_hz + 1e-6)) + 1
            own_s = own_s[0] + np.arange(count) / frame_rate_hz
        starts = segment_starts(len(own_s), length, overlap)
        found.append(Clip(start, stop, own_s, resampled, starts))
    return found


def count_segments(outline: Outline, frame_rate_hz: float, options: DatasetOptions) -> Counter[str]:
    """Count the segments of a source by their labels."""
    counts: Counter[str] = Counter()
    for clip in clips_of(
        outline.times_s, outline.present, frame_rate_hz, options.length, options.overlap
    ):
        label = _label(outline.times_s, outline.label, clip)
        windows = label[clip.starts[:, None] + np.arange(options.length)]
        named, _ = label_of_segments(windows, len(outline.labels), options)
        counts.update(outline.labels[number] for number in np.sort(named).tolist())
    return counts


def cut_source(
    source: Source,
    frame_rate_hz: float,
    null_bins: Sequence[int],
    label_numbers: NDArray[np.int16],
    options: DatasetOptions,
) -> Iterator[Arrays]:
    """Yield the rows of a data set in blocks of bounded size.

    ``null_bins`` are set to zero. ``label_numbers`` holds the data set's number of each label of
    the source. A block has, per segment (first axis), the kinds that the source has, ``limbs``
    and ``kinematics`` if they are wanted and its synthetic map has them, ``imu`` if it is wanted,
    and ``available``, ``label``, ``segment_label``, ``purity``, ``start_s``, ``start_frame``,
    ``resampled``.
    """
    known = source.known
    kinds = [kind for kind in options.kinds if kind in source.maps]
    length = options.length
    for clip in clips_of(source.times_s, source.present, frame_rate_hz, length, options.overlap):
        label = label_numbers[_label(source.times_s, source.label, clip)]
        there = {kind: _known(source.times_s, known[kind], clip) for kind in kinds}
        values = {
            kind: _values(source.maps[kind].values, source.times_s, clip, null_bins)
            for kind in kinds
        }
        limbs = source.maps["synthetic"].limbs if options.limbs and "synthetic" in kinds else None
        if limbs is not None:
            split = _values(limbs.values, source.times_s, clip, null_bins)
            assert limbs.kinematics is not None
            moving = _values(limbs.kinematics, source.times_s, clip, ())
        if options.imu:
            felt = np.stack([source.imu[name].channels for name in options.imu], axis=2)
            channels = _values(felt.transpose(2, 1, 0), source.times_s, clip, ())
        for begun in range(0, len(clip.starts), _BLOCK):
            starts = clip.starts[begun : begun + _BLOCK]
            places = starts[:, None] + np.arange(length)  # (segments, length)
            arrays: Arrays = {"available": np.zeros((len(starts), len(KINDS)), bool)}
            for kind in kinds:
                whole = there[kind][places].all(axis=1)
                # A map that is partly unknown says nothing, rather than something false.
                arrays[kind] = cut(values[kind], starts, length) * whole[:, None, None]
                if kind == "synthetic" and limbs is not None:
                    rows = whole[:, None, None, None]
                    arrays["limbs"] = cut(split, starts, length) * rows
                    arrays["kinematics"] = cut(moving, starts, length) * rows
                arrays["available"][:, KINDS.index(kind)] = whole
            if options.imu:
                arrays["imu"] = cut(channels, starts, length)
            arrays["label"] = label[places]
            arrays["segment_label"], arrays["purity"] = label_of_segments(
                arrays["label"], int(label_numbers.max()) + 1, options
            )
            arrays["start_s"] = clip.times_s[starts]
            arrays["resampled"] = np.full(len(starts), clip.resampled)
            arrays["start_frame"] = (
                np.searchsorted(source.times_s, arrays["start_s"] + 1e-9, side="right") - 1
                if clip.resampled
                else clip.start + starts
            )
            yield arrays


def label_of_segments(
    windows: NDArray[np.integer], labels: int, options: DatasetOptions
) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
    """Return the label of every segment and the share of its frames that have it.

    ``windows`` holds the labels of the frames, (segments, length), below ``labels``; 0 is
    background.
    """
    counts = np.stack([(windows == number).sum(axis=1) for number in range(labels)], axis=1)
    if options.label_rule == "majority" or labels == 1:
        named = counts.argmax(axis=1)
    else:
        gesture = 1 + counts[:, 1:].argmax(axis=1)
        frames = np.take_along_axis(counts, gesture[:, None], axis=1)[:, 0]
        enough = (frames > 0) & (frames >= options.min_share * windows.shape[1] - 1e-9)
        named = np.where(enough, gesture, 0)
    purity = np.take_along_axis(counts, named[:, None], axis=1)[:, 0] / windows.shape[1]
    return named.astype(np.int16), purity.astype(np.float32)


def _values(
    values: NDArray[np.float32], times_s: NDArray[np.float64], clip: Clip, null_bins: Sequence[int]
) -> NDArray[np.float32]:
    """Return energies of a clip at its own times: (…, bins, frames) → (frames, …, bins)."""
    own = np.moveaxis(values, -1, 0)[clip.start : clip.stop].copy()
    if clip.resampled:
        rows = own.reshape(len(own), -1)
        rows = interpolated(rows, times_s[clip.start : clip.stop], clip.times_s)
        own = rows.reshape(-1, *own.shape[1:])
    own[..., list(null_bins)] = 0.0
    return own


def _label(
    times_s: NDArray[np.float64], label: NDArray[np.integer], clip: Clip
) -> NDArray[np.integer]:
    own = label[clip.start : clip.stop]
    if not clip.resampled:
        return own
    middles_s = (times_s[clip.start : clip.stop - 1] + times_s[clip.start + 1 : clip.stop]) / 2
    return own[np.searchsorted(middles_s, clip.times_s)]


def _known(times_s: NDArray[np.float64], known: NDArray[np.bool_], clip: Clip) -> NDArray[np.bool_]:
    own = known[clip.start : clip.stop]
    if not clip.resampled:
        return own
    share = np.interp(clip.times_s, times_s[clip.start : clip.stop], own.astype(np.float64))
    return share > 1 - 1e-6
