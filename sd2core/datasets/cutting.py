"""Cutting of a source into segments: pure functions from maps to rows of a data set.

A segment is a window of fixed length, or what a labelled span holds. Both lie within clips: runs
of frames with a person, between which no time is missing. Where frames come evenly and at the rate
of the data set, a segment holds them as they are. Otherwise the clip is brought to that rate first:
energies are interpolated linearly, a label is that of the nearest frame, and a map is known where
both its neighbours are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.source import KINDS, LabelledSpan, Outline, Source
from sd2core.denoise.resample_to_model import clips, interpolated, is_regular
from sd2core.errors import Sd2Error
from sd2core.options.exporting import Exporting, SpanOptions
from sd2core.pairs.segments import cut, segment_starts
from sd2core.timebase import frames_that_begin

_BLOCK = 256
"""Segments that are in memory at a time, besides the maps of the source."""
_ROUNDING = 1e-6

Arrays = dict[str, NDArray]


@dataclass(frozen=True, eq=False)
class Clip:
    """Run of frames that segments are cut from."""

    start: int  # First frame of the source.
    stop: int  # End of its frames, exclusive.
    times_s: NDArray[np.float64]  # Times of its frames as segments hold them.
    resampled: bool  # True if these are other times than those of the source.
    starts: NDArray[np.int64]  # First frames of the segments, within the clip.
    span: LabelledSpan | None = None  # That it is; None: windows are cut from it.


def clips_of(
    times_s: NDArray[np.float64],
    present: NDArray[np.bool_] | None,
    frame_rate_hz: float,
    length: int,
    overlap: int,
) -> list[Clip]:
    """Find the clips of a source and the first frames of their segments.

    Parameters
    ----------
    times_s : float64 ndarray, (T,)
        Times of the source's frames.
    present : bool ndarray, (T,), or None
        Frames with a person; None: all.
    frame_rate_hz : float
        Frames per second of the segments.
    length, overlap : int
        Frames of a segment, and those that it shares with the next one.
    """
    mask = np.ones(len(times_s), bool) if present is None else present
    pieces = []
    for start, stop in clips(times_s, mask, frame_rate_hz):
        own_s = times_s[start:stop]
        resampled = not is_regular(own_s, frame_rate_hz)
        if resampled:
            count = int(np.floor((own_s[-1] - own_s[0]) * frame_rate_hz + 1e-6)) + 1
            own_s = own_s[0] + np.arange(count) / frame_rate_hz
        starts = segment_starts(len(own_s), length, overlap)
        pieces.append(Clip(start, stop, own_s, resampled, starts))
    return pieces


def _clips_of_spans(
    outline: Outline, frame_rate_hz: float, length: int, options: SpanOptions
) -> tuple[list[Clip], Counter[str]]:
    """Find the clip of one segment that each labelled span is, and why others are none.

    Of a span that the person leaves, its longest part counts. Raises Sd2Error for a span of more
    than ``length`` frames, unless spans are resampled.
    """
    times_s = outline.times_s
    whole = clips_of(times_s, outline.present, frame_rate_hz, 1, 0)
    ends_s = np.array([clip.times_s[-1] for clip in whole])
    pieces: list[Clip] = []
    left_out: Counter[str] = Counter()
    for span in sorted(outline.spans):
        parts = []
        for number in range(int(np.searchsorted(ends_s, span.start_s)), len(whole)):
            if whole[number].times_s[0] >= span.end_s:
                break
            held = frames_that_begin(whole[number].times_s, span.start_s, span.end_s)
            parts.append((held.stop - held.start, number))
        frames, number = max(parts, default=(0, 0))
        if not frames or frames / frame_rate_hz < options.shortest_s - 1e-9:
            why = "shorter than asked for" if frames else "without a frame that shows the person"
            left_out[why] += 1
            continue
        clip = whole[number]
        wide_s = span.start_s - options.margin_s, span.end_s + options.margin_s
        own_s = clip.times_s[frames_that_begin(clip.times_s, *wide_s)]
        if options.length == "resampled":
            own_s = np.linspace(own_s[0], own_s[-1], length)
        resampled = clip.resampled or options.length == "resampled"
        # Interpolation needs the frames around.
        around = int(resampled)
        start = max(int(np.searchsorted(times_s, own_s[0])) - around, clip.start)
        stop = min(int(np.searchsorted(times_s, own_s[-1], "right")) + around, clip.stop)
        pieces.append(Clip(start, stop, own_s, resampled, np.zeros(1, np.int64), span))
    sizes = ((len(one.times_s), one.span) for one in pieces if one.span is not None)
    frames, longest = max(sizes, default=(0, None))
    if longest is not None and frames > length:
        raise Sd2Error(
            f"The span {outline.labels[longest.label]} at {longest.start_s:.3f} s has"
            f" {frames} frames with its margins, the segments {length}",
            "spans that fit into a segment",
            f"Choose segments of {frames} frames, or spans that are resampled",
        )
    return pieces, left_out


def count_spans(
    outline: Outline, frame_rate_hz: float, length: int, options: SpanOptions
) -> dict[str, int]:
    """Count the spans that are segments (``segments``), and the others by their reasons.

    Parameters
    ----------
    outline : Outline
        Of the source with the spans.
    frame_rate_hz : float
        Frames per second of the segments.
    length : int
        Frames of a segment; Sd2Error for a longer span that is not resampled.
    options : SpanOptions
        Margins, shortest span, and whether spans are padded or resampled.
    """
    pieces, left_out = _clips_of_spans(outline, frame_rate_hz, length, options)
    return {"segments": len(pieces), **left_out}


def count_segments(outline: Outline, frame_rate_hz: float, options: Exporting) -> Counter[str]:
    """Count the segments of a source by their labels."""
    counts: Counter[str] = Counter()
    if options.spans is not None:
        pieces, _ = _clips_of_spans(outline, frame_rate_hz, options.segment_frames, options.spans)
        return Counter(outline.labels[clip.span.label] for clip in pieces if clip.span)
    for clip in clips_of(
        outline.times_s,
        outline.present,
        frame_rate_hz,
        options.segment_frames,
        options.overlap_frames,
    ):
        label = _label(outline.times_s, outline.label, clip)
        windows = label[clip.starts[:, None] + np.arange(options.segment_frames)]
        named, purity = label_of_segments(windows, len(outline.labels), options)
        named = named[purity >= options.min_purity - _ROUNDING]
        counts.update(outline.labels[number] for number in np.sort(named).tolist())
    return counts


def cut_source(
    source: Source,
    frame_rate_hz: float,
    null_bins: Sequence[int],
    label_numbers: NDArray[np.int16],
    options: Exporting,
) -> Iterator[Arrays]:
    """Yield the rows of a data set in blocks of bounded size.

    A block has, per segment (first axis), the kinds that the source has, ``limbs``
    and ``kinematics`` if they are wanted and its synthetic map has them, ``imu`` if it is wanted,
    and ``available``, ``label``, ``segment_label``, ``purity``, ``start_s``, ``start_frame``,
    ``resampled``; of spans also ``mask`` and ``end_s``.

    Parameters
    ----------
    source : Source
        Maps and labels of one recording as one sensor sees it.
    frame_rate_hz : float
        Frames per second of the segments.
    null_bins : sequence of int
        Bins that are set to zero.
    label_numbers : int16 ndarray, (labels of the source,)
        The data set's number of each of them.
    options : Exporting
        What is wanted; frame rate and null bins, which it may leave open, are given apart.
    """
    known = source.known
    kinds = [kind for kind in options.kinds if kind in source.maps]
    length = options.segment_frames
    if options.spans is None:
        pieces = clips_of(
            source.times_s, source.present, frame_rate_hz, length, options.overlap_frames
        )
    else:
        pieces, _ = _clips_of_spans(source.outline(), frame_rate_hz, length, options.spans)
    for clip in pieces:
        label = _filled(label_numbers[_label(source.times_s, source.label, clip)], length)
        is_known = {kind: _known(source.times_s, known[kind], clip) for kind in kinds}
        is_known = {kind: _filled(one, length, True) for kind, one in is_known.items()}
        values = {
            kind: _values(source.maps[kind].values, source.times_s, clip, null_bins, length)
            for kind in kinds
        }
        limbs = source.maps["synthetic"].limbs if options.limbs and "synthetic" in kinds else None
        if limbs is not None:
            split = _values(limbs.values, source.times_s, clip, null_bins, length)
            assert limbs.kinematics is not None
            moving = _values(limbs.kinematics, source.times_s, clip, (), length)
        if options.imu:
            imu_signals = np.stack([source.imu[name].channels for name in options.imu], axis=2)
            channels = _values(imu_signals.transpose(2, 1, 0), source.times_s, clip, (), length)
        for begun in range(0, len(clip.starts), _BLOCK):
            starts = clip.starts[begun : begun + _BLOCK]
            places = starts[:, None] + np.arange(length)  # (segments, length)
            arrays: Arrays = {"available": np.zeros((len(starts), len(KINDS)), bool)}
            for kind in kinds:
                whole = is_known[kind][places].all(axis=1)
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
            if clip.span is None:
                arrays["segment_label"], arrays["purity"] = label_of_segments(
                    arrays["label"], int(label_numbers.max()) + 1, options
                )
            else:
                named = label_numbers[[clip.span.label]]
                filled = len(clip.times_s)
                arrays["segment_label"] = named
                arrays["purity"] = np.array([(label[:filled] == named).mean()], np.float32)
                arrays["mask"] = np.arange(length)[None] < filled
                arrays["end_s"] = clip.times_s[-1:] + 1 / frame_rate_hz
            arrays["start_s"] = clip.times_s[starts]
            arrays["resampled"] = np.full(len(starts), clip.resampled)
            arrays["start_frame"] = (
                np.searchsorted(source.times_s, arrays["start_s"] + 1e-9, side="right") - 1
                if clip.resampled
                else clip.start + starts
            )
            pure = arrays["purity"] >= options.min_purity - _ROUNDING
            yield {name: values[pure] for name, values in arrays.items()}


def label_of_segments(
    windows: NDArray[np.integer], labels: int, options: Exporting
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
    values: NDArray[np.float32],
    times_s: NDArray[np.float64],
    clip: Clip,
    null_bins: Sequence[int],
    least: int,
) -> NDArray[np.float32]:
    """Return energies of a clip at its own times: (…, bins, frames) → (frames, …, bins).

    Empty frames make them ``least`` frames.
    """
    own = np.moveaxis(values, -1, 0)[clip.start : clip.stop].copy()
    if clip.resampled:
        own = interpolated(own, times_s[clip.start : clip.stop], clip.times_s)
    own[..., list(null_bins)] = 0.0
    return _filled(own, least)


def _filled(values: NDArray, least: int, with_: float = 0) -> NDArray:
    """Append frames, so that there are ``least``."""
    missing = [(0, max(0, least - len(values)))] + [(0, 0)] * (values.ndim - 1)
    return np.pad(values, missing, constant_values=with_)


def _label(
    times_s: NDArray[np.float64], label: NDArray[np.integer], clip: Clip
) -> NDArray[np.integer]:
    own = label[clip.start : clip.stop]
    if clip.resampled:
        middles_s = (times_s[clip.start : clip.stop - 1] + times_s[clip.start + 1 : clip.stop]) / 2
        own = own[np.searchsorted(middles_s, clip.times_s)]
    if clip.span is None:
        return own
    # Another span may lie over it.
    own = own.copy()
    own[frames_that_begin(clip.times_s, clip.span.start_s, clip.span.end_s)] = clip.span.label
    return own


def _known(times_s: NDArray[np.float64], known: NDArray[np.bool_], clip: Clip) -> NDArray[np.bool_]:
    own = known[clip.start : clip.stop]
    if not clip.resampled:
        return own
    share = np.interp(clip.times_s, times_s[clip.start : clip.stop], own.astype(np.float64))
    return share > 1 - 1e-6
