"""Repair of detected landmarks: swapped sides, outliers and gaps.

Limits are in seconds and metres, so that they mean the same at every frame rate and size of
picture. What is repaired in a frame depends on the frames within a second or two: a long clip
is repaired in parts, each with a margin on both sides.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.raw_track import SCALE_S, RawTrack, pixels_per_metre, place_m
from sd2core.body.roi import PLACES, Sightings
from sd2core.body.sides import find_side_swaps, swap_sides
from sd2core.body.track import LANDMARKS, parts, with_margin
from sd2core.mesh.presence import runs

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

MAX_ACCELERATION_MPS2 = 250.0
"""Limit for any landmark; a swipe of 0.8 m in 0.25 s reaches 74 m/s²."""
_SPIKE_S = 0.1
_NOISE_M = 0.06
_SIGMAS = 6.0
_ROUNDS = 5
_JUMP, _STILL_MPS = 4.0, 0.3
"""How many times faster than around it, and than noise, a body jumps; of all trials of CMU's motion
capture, at 30, 15 and 10 frames/s, three do so, in frames that are broken."""
_AROUND_S = 0.1
"""Around a jump, and two frames at least: stutter repeats its frames more often than that."""
_BRIDGED_VISIBILITY = 0.25
_NAMED = 4
"""Stretches that a note names at most."""
_ONE_STRETCH_S, _SHORT_S = 1.0, 0.3
"""Gap that a stretch with somebody else may have, and how long it is at least."""


# -- Outliers ------------------------------------------------------------------------------------


def replace_outliers(track: RawTrack) -> tuple[RawTrack, NDArray[np.bool_]]:
    """Replace landmarks that jump away and back within a tenth of a second.

    A run of frames is replaced by the cubic through two frames before and after it if every frame
    of it is farther from that curve, and from the line between the two nearest, than any limb can
    get and return (:data:`MAX_ACCELERATION_MPS2`), than six standard deviations of the noise, and
    than the frame before is from the frame after. Returns the track, and what was replaced (T, 33).
    """
    replaced = np.zeros(track.visibility.shape, bool)
    changed = {name: getattr(track, name).copy() for name in ("image_px", "depth_px", "world_m")}
    rows = np.flatnonzero(track.present)
    if len(rows) < 5:
        return track, replaced
    times, scale = track.times_s[rows], pixels_per_metre(track)[rows, None]
    for landmark in range(len(LANDMARKS)):
        place = place_m(track, rows, scale, landmark)
        seen = find_spikes(times, place[:, :2])
        deep = find_spikes(times, place[:, 2:])
        replaced[rows, landmark] = seen | deep
        for name, wrong in (
            ("image_px", seen),
            ("depth_px", seen | deep),
            ("world_m", seen | deep),
        ):
            if wrong.any():
                values = changed[name][rows, landmark]
                changed[name][rows, landmark] = on_cubics(times, values, wrong)
    return replace(track, **changed), replaced


def find_spikes(times_s: Floats, places_m: Floats) -> NDArray[np.bool_]:
    """Outliers (T,) among the places (T, d) of one point."""
    from scipy.ndimage import median_filter

    frames = len(times_s)
    wrong = np.zeros(frames, bool)
    if frames < 5:
        return wrong
    step_s = float(np.median(np.diff(times_s)))
    longest = max(int(_SPIKE_S / step_s + 0.01), 1)
    current = places_m
    window = (2 * max(round(0.5 * SCALE_S / step_s), 2) + 1, 1)
    away = np.linalg.norm(places_m - median_filter(places_m, window, mode="nearest"), axis=1)
    for length in range(min(longest, frames - 4), 0, -1):
        for _ in range(_ROUNDS):
            spikes = _outlying_runs(times_s, current, away, length) & ~wrong
            if not spikes.any():
                break
            wrong |= spikes
            current = on_cubics(times_s, places_m, wrong)
    return wrong


def _outlying_runs(
    times_s: Floats, places_m: Floats, away_m: Floats, length: int
) -> NDArray[np.bool_]:
    """Frames of runs of one length that stand out, the clearest of those near one another."""
    starts = np.arange(2, len(times_s) - length - 1)
    support = starts[:, None] + [-2, -1, length, length + 1]  # (S, 4)
    inner = starts[:, None] + np.arange(length)  # (S, L)
    around_s = times_s[support[:, 2]] - times_s[support[:, 1]]
    before, after = places_m[support[:, 1], None], places_m[support[:, 2], None]
    share = ((times_s[inner] - times_s[support[:, 1, None]]) / around_s[:, None])[..., None]
    curve = np.einsum("slk,skd->sld", _cubic(times_s[support], times_s[inner]), places_m[support])
    # A curve through an outlier bends far; the line between the nearest two does not.
    line = before + share * (after - before)
    off = np.minimum(
        *(np.linalg.norm(places_m[inner] - each, axis=2) for each in (curve, line))
    )  # (S, L)
    limit = np.maximum(MAX_ACCELERATION_MPS2 * around_s**2 / 8.0, _NOISE_M)
    limit = np.maximum(limit, _SIGMAS * 1.4826 * float(np.median(off)))
    limit = np.maximum(limit, np.linalg.norm(after - before, axis=2)[:, 0])
    least = off.min(axis=1)
    # Of two outliers and a good frame between them, the latter is where most are.
    rank = least + away_m[inner].min(axis=1)
    surely = np.flatnonzero(least > limit)
    outlying = np.zeros(len(times_s), bool)
    for start in surely[np.argsort(-rank[surely], kind="stable")]:
        run = inner[start]
        # What overlaps a clearer one was its shadow.
        if not outlying[max(run[0] - 2, 0) : run[-1] + 3].any():
            outlying[run] = True
    return outlying


def _cubic(support: Floats, at: Floats) -> Floats:
    """Lagrange weights (S, L, 4) of values at ``support`` (S, 4) for times ``at`` (S, L)."""
    weights = np.ones((*at.shape, 4))
    for k in range(4):
        for other in range(4):
            if other != k:
                weights[:, :, k] *= (at - support[:, other, None]) / (
                    support[:, k, None] - support[:, other, None]
                )
    return weights


def on_cubics(times_s: Floats, values: NDArray[Any], wrong: NDArray[np.bool_]) -> NDArray[Any]:
    """Values (T, ...) with wrong ones put on the cubic through two right ones on either side."""
    right = np.flatnonzero(~wrong)
    filled = values.copy()
    for frame in np.flatnonzero(wrong):
        after = int(np.searchsorted(right, frame))
        support = right[np.clip(after - 2, 0, max(len(right) - 4, 0)) :][:4]
        if len(support) < 4:
            continue
        weights = _cubic(times_s[support][None], times_s[[frame]][None])[0, 0]
        filled[frame] = np.tensordot(weights, values[support], 1)
    return filled


# -- Jumps ---------------------------------------------------------------------------------------


def find_jumps(track: RawTrack) -> NDArray[np.bool_]:
    """Frames (T,) to which the whole body jumps, as after a cut in the video.

    Half of the landmarks move by far more there than from frame to frame just before and after; a
    fast limb is not half of them, and a fast body needs several frames to start and to stop. So
    near a gap, and at less than 10 frames/s, nothing is known of it.
    """
    jumps = np.zeros(len(track.times_s), bool)
    rows = np.flatnonzero(track.present)
    if len(rows) < 2:
        return jumps
    from scipy.ndimage import maximum_filter

    scale = pixels_per_metre(track)[rows, None]
    places = (place_m(track, rows, scale, number) for number in range(len(LANDMARKS)))  # (N, 5)
    each_m = [np.linalg.norm(np.diff(place, axis=0), axis=1) for place in places]
    moved_m = np.median(each_m, axis=0)  # (N - 1,)
    step_s = np.diff(track.times_s[rows])
    known = (np.diff(rows) == 1) & (step_s < 1.1 * _AROUND_S)
    beside = max(round(_AROUND_S / float(np.median(step_s))), 2)
    speed_mps = np.where(known, moved_m / step_s, np.inf)
    window = np.ones(2 * beside + 1, bool)
    window[beside] = False
    around_mps = maximum_filter(speed_mps, footprint=window, mode="constant", cval=np.inf)
    jumps[rows[1:]] = known & (speed_mps > _JUMP * np.maximum(around_mps, _STILL_MPS))
    return jumps


# -- Gaps ----------------------------------------------------------------------------------------


def bridge_gaps(track: RawTrack, max_gap_s: float) -> RawTrack:
    """Interpolate across gaps of up to ``max_gap_s``; longer ones stay empty.

    By a curve that does not overshoot (monotone piecewise cubic).
    """
    rows, times = np.flatnonzero(track.present), track.times_s
    short = (np.diff(rows) > 1) & (np.diff(times[rows]) <= max_gap_s + 1e-9)
    if not short.any():
        return track
    from scipy.interpolate import PchipInterpolator

    fill = np.zeros(len(times), bool)
    near = np.zeros(len(rows), bool)  # the curve depends on two frames before and after
    for number in np.flatnonzero(short):
        fill[rows[number] + 1 : rows[number + 1]] = True
        near[max(number - 2, 0) : number + 4] = True
    rows, changed = rows[near], {}
    for name in ("image_px", "depth_px", "world_m", "visibility"):
        values = getattr(track, name).copy()
        values[fill] = PchipInterpolator(times[rows], values[rows], axis=0)(times[fill])
        changed[name] = values
    changed["visibility"][fill] *= _BRIDGED_VISIBILITY
    return replace(track, present=track.present | fill, bridged=track.bridged | fill, **changed)


# -- The whole clip ------------------------------------------------------------------------------


def repair_landmarks(
    found: RawTrack, max_gap_s: float, unclear: NDArray[np.bool_] | None = None
) -> tuple[RawTrack, tuple[str, ...]]:
    """Repair a whole clip part by part; return it, and sentences about the repair.

    Parameters
    ----------
    found : RawTrack
        What was found in all frames.
    max_gap_s : float
        Longest gap that is bridged, from the last frame before to the first after.
    unclear : bool ndarray, (T,), optional
        Frames in which whoever is there may be another person; None: in none.
    """
    jumps, swapped = find_jumps(found), find_side_swaps(found)
    whole = RawTrack(**{name: values.copy() for name, values in vars(found).items()})
    replaced = np.zeros(found.visibility.shape, bool)
    for start, stop in parts(len(found.times_s)):
        first, last = _around(start, stop, found.times_s, found.present, max_gap_s)
        track = found.part(first, last)
        for part, frames in swapped.items():
            track = swap_sides(track, part, frames[first:last])
        track, outlying = replace_outliers(track)
        replaced[start:stop] = outlying[start - first : stop - first]
        mended = bridge_gaps(track, max_gap_s).part(start - first, stop - first)
        for name, values in vars(mended).items():
            getattr(whole, name)[start:stop] = values
    whole.present[jumps] = False
    unclear = np.zeros(len(replaced), bool) if unclear is None else unclear
    return whole, _sentences(whole, swapped, replaced, max_gap_s, unclear, jumps)


def _around(
    start: int, stop: int, times_s: Floats, seen: NDArray[np.bool_], max_gap_s: float
) -> tuple[int, int]:
    """Frames that a part is repaired with.

    A gap that is bridged belongs to them with three frames on either side, on which its curve
    rests, however long it is.
    """
    rows = np.flatnonzero(seen)

    def bridged_after(number: int) -> bool:
        if not 0 <= number < len(rows) - 1:
            return False
        here, there = rows[number], rows[number + 1]
        return bool(there - here > 1 and times_s[there] - times_s[here] <= max_gap_s + 1e-9)

    before = int(np.searchsorted(rows, start)) - 1
    if bridged_after(before):
        start = min(start, int(rows[max(before - 2, 0)]))
    after = int(np.searchsorted(rows, stop))
    if bridged_after(after - 1):
        stop = max(stop, int(rows[min(after + 2, len(rows) - 1)]) + 1)
    return with_margin(start, stop, len(times_s))


def _sentences(
    track: RawTrack,
    swapped: dict[str, NDArray[np.bool_]],
    replaced: NDArray[np.bool_],
    max_gap_s: float,
    unclear: NDArray[np.bool_],
    jumps: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Sentences on a repaired clip: frames of parts that were swapped, and outliers (T, 33)."""
    notes = [
        f"Left and right of {part} swapped back in {_which(frames)}."
        for part, frames in swapped.items()
        if frames.any()
    ]
    if replaced.any():
        notes.append(
            "Replaced from the frames around them:"
            f" {_count(int(replaced.sum()), 'outlying landmark')} in"
            f" {_count(int(replaced.any(axis=1).sum()))}."
        )
    missing, bridged = ~track.present & ~jumps, track.bridged
    if bridged.any():
        notes.append(
            f"Interpolated, in gaps of up to {max_gap_s:g} s without the person:"
            f" {_count(int(bridged.sum()))}."
        )
    for which, why in (
        (jumps, "Left empty, because the body jumps as after a cut in the video"),
        (missing & ~unclear, "Left empty, without the person"),
        (missing & unclear, "Left empty, because whoever is seen may be somebody else"),
        (
            track.present & ~bridged & unclear,
            "Found again elsewhere and known by their looks alone",
        ),
    ):
        if which.any():
            notes.append(f"{why}: {_which(which)}.")
    return tuple(notes)


def who_else(sightings: Sightings, times_s: Floats) -> tuple[str, ...]:
    """Sentence on who was seen besides the person, and when; none where nobody was."""
    named, advice = [], ""
    for place, seen in zip(PLACES, sightings.others.T, strict=True):
        times = times_s[sightings.frames[seen]]
        stretches = np.split(times, np.flatnonzero(np.diff(times) > _ONE_STRETCH_S) + 1)
        # What is shorter may be a slip of the detector.
        spans = [
            f"{each[0]:.1f} to {each[-1]:.1f} s"
            for each in stretches
            if len(each) and np.ptp(each) >= _SHORT_S
        ]
        if spans:
            named.append(f"{place} from {_first(spans)}")
            if place == PLACES[-1]:
                frames = sightings.frames[seen]
                advice = (
                    " If it is the person, fit them too:"
                    f" --person-box X,Y,WIDTH,HEIGHT --person-frame {frames[len(frames) // 2]}"
                )
    return (f"Others were seen: {'; '.join(named)}.{advice}",) if named else ()


def _which(frames: NDArray[np.bool_]) -> str:
    """Number of the frames, and which they are."""
    spans = [f"{a} to {b - 1}" if b > a + 1 else f"{a}" for a, b in runs(frames)]
    return f"{_count(int(frames.sum()))} ({_first(spans)})"


def _first(spans: list[str]) -> str:
    """The first stretches, and how many more there are."""
    more = [f"{len(spans) - _NAMED} more"] if len(spans) > _NAMED else []
    return ", ".join(spans[:_NAMED] + more)


def _count(number: int, what: str = "frame") -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
