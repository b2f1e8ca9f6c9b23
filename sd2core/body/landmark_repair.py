"""Repair of detected landmarks: swapped sides, outliers and gaps.

Limits are in seconds and metres, so that they mean the same at every frame rate and size of
picture. What is repaired in a frame depends on the frames within a second or two: a long clip
is repaired in parts, each with a margin on both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.track import LANDMARKS, MIRRORED, parts

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

ARMS = tuple(range(13, 23))
LEGS = tuple(range(25, 33))
TRUNK = tuple(number for number in range(33) if number not in ARMS + LEGS)
SIDED_PARTS = {"head and trunk": TRUNK, "the arms": ARMS, "the legs": LEGS}
"""Parts of the body that are swapped as one, and their landmarks."""

_PARTNERS = np.array(MIRRORED)

MAX_ACCELERATION_MPS2 = 250.0
"""Limit for any landmark; a swipe of 0.8 m in 0.25 s reaches 74 m/s²."""
_SPIKE_S = 0.1
_SCALE_S = 0.5
_NOISE_M = 0.06
_SIGMAS = 6.0
_ROUNDS = 5
_SWITCH_M = 0.10
_BRIDGED_VISIBILITY = 0.25
_MARGIN_FRAMES = 300


@dataclass(frozen=True, eq=False)
class RawTrack:
    """Landmarks as detected in each of T frames; NaN, or visibility 0, where nothing was found."""

    times_s: Floats  # (T,)
    present: NDArray[np.bool_]  # (T,)
    bridged: NDArray[np.bool_]  # (T,)
    image_px: Singles  # (T, 33, 2)
    depth_px: Singles  # (T, 33)
    world_m: Singles  # (T, 33, 3)
    visibility: Singles  # (T, 33)

    def picked(self, order: NDArray[np.intp], frames: NDArray[np.bool_]) -> RawTrack:
        """Landmarks of some frames in another order (33,)."""
        changed = {}
        for name in ("image_px", "depth_px", "world_m", "visibility"):
            values = getattr(self, name).copy()
            values[frames] = values[frames][:, order]
            changed[name] = values
        return replace(self, **changed)

    def part(self, start: int, stop: int) -> RawTrack:
        """Frames ``start`` to ``stop``."""
        return RawTrack(**{name: values[start:stop] for name, values in vars(self).items()})


# -- Left and right ------------------------------------------------------------------------------


def undo_side_swaps(found: RawTrack) -> tuple[RawTrack, dict[str, NDArray[np.bool_]]]:
    """Undo swaps of left and right: of head and trunk, of the arms, of the legs, or of all.

    A swap is undone where that makes the motion smoother (the sum of accelerations over the whole
    clip is the least, by dynamic programming over both sides of each frame); the side that most
    frames say is right. Returns the track, and per part the frames that were changed, (T,).
    """
    swaps: dict[str, NDArray[np.bool_]] = {}
    rows = np.flatnonzero(found.present)
    times = found.times_s[rows]
    for part, members in SIDED_PARTS.items():
        swapped = np.zeros(len(found.times_s), bool)
        if len(rows) >= 3:
            scale = pixels_per_metre(found)[rows, None]
            cost = np.zeros((2, 2, 2, len(rows) - 2))
            for landmark in members:
                sides = [_place_m(found, rows, scale, each) for each in _pair(landmark)]
                cost += _bends(times, np.stack(sides))
            switch = np.abs(np.diff(np.indices((2, 2, 2)), axis=0)).sum(axis=0)  # (a, b, c)
            cost += 0.5 * len(members) * _SWITCH_M**2 * switch[..., None]
            swapped[rows] = _smoothest(cost)
        found = swap_sides(found, part, swapped)
        swaps[part] = swapped
    return found, swaps


def swap_sides(found: RawTrack, part: str, frames: NDArray[np.bool_]) -> RawTrack:
    """Swap left and right of one of :data:`SIDED_PARTS` in some frames (T,)."""
    members = list(SIDED_PARTS[part])
    order = np.arange(len(LANDMARKS))
    order[members] = _PARTNERS[members]
    return found.picked(order, frames)


def _pair(landmark: int) -> tuple[int, int]:
    return landmark, MIRRORED[landmark]


def _place_m(found: RawTrack, rows: NDArray[np.intp], scale: Floats, landmark: int) -> Floats:
    """One landmark in the picture and in the model's own coordinates, in metres, (N, 5)."""
    picture = found.image_px[rows, landmark] / scale
    return np.concatenate([picture, found.world_m[rows, landmark]], axis=1, dtype=np.float64)


def _bends(times_s: Floats, sides: Floats) -> Floats:
    """Squared distance (m²) of the middle of three frames from the line between the others.

    ``sides`` (2, N, d) holds the landmark and the one on the other side. The result,
    (2, 2, 2, N - 2), is for each choice of side in the three frames.
    """
    before, middle, after = times_s[:-2], times_s[1:-1], times_s[2:]
    share = ((middle - before) / (after - before))[:, None]
    bends = np.empty((2, 2, 2, len(middle)))
    for a, b, c in np.ndindex(2, 2, 2):
        line = (1.0 - share) * sides[a, :-2] + share * sides[c, 2:]
        # Limited: a jump that no choice of side avoids must not count for more.
        bends[a, b, c] = np.minimum(np.square(sides[b, 1:-1] - line).sum(axis=1), 0.25)
    return bends


def _smoothest(cost: Floats) -> NDArray[np.bool_]:
    """Cheapest choices (N,) for costs (2, 2, 2, N - 2) of three in succession."""
    steps = cost.shape[3]
    # What most frames say, where motion says nothing.
    tie = 1e-9
    total = np.array([[0.0, tie], [tie, 2 * tie]])  # (earlier, later)
    choice = np.empty((steps, 2, 2), np.int8)
    for step in range(steps):
        options = total[:, :, None] + cost[:, :, :, step]  # (a, b, c)
        choice[step] = options.argmin(axis=0)
        total = options.min(axis=0)
        total[:, 1] += tie
    best = int(total.argmin())
    states = np.empty(steps + 2, bool)
    b, c = divmod(best, 2)
    states[-2:] = b, c
    for step in range(steps - 1, -1, -1):
        a = int(choice[step, b, c])
        states[step] = a
        b, c = a, b
    if states.mean() > 0.5:
        states = ~states
    return states


def pixels_per_metre(found: RawTrack) -> Floats:
    """Scale of the person in the picture, (T,), in pixels per metre: median over 0.5 s."""
    from scipy.ndimage import median_filter

    image, world = (
        np.sqrt(places.var(axis=1, dtype=np.float64).sum(axis=1))
        for places in (found.image_px, found.world_m[..., :2])
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = image / world
    good = np.isfinite(scale) & (scale > 0)
    middle = float(np.median(scale[good])) if good.any() else 1.0
    scale[~good] = middle
    step_s = float(np.median(np.diff(found.times_s))) if len(scale) > 1 else _SCALE_S
    # One landmark that jumps away makes that frame's picture look larger.
    window = max(round(_SCALE_S / step_s), 5)
    return np.asarray(median_filter(scale, size=window, mode="nearest"))


# -- Outliers ------------------------------------------------------------------------------------


def replace_outliers(found: RawTrack) -> tuple[RawTrack, NDArray[np.bool_]]:
    """Replace landmarks that jump away and back within a tenth of a second.

    A run of frames is replaced by the cubic through two frames before and after it if every frame
    of it is farther from that curve, and from the line between the two nearest, than any limb can
    get and return (:data:`MAX_ACCELERATION_MPS2`), than six standard deviations of the noise, and
    than the frame before is from the frame after. Returns the track, and what was replaced (T, 33).
    """
    replaced = np.zeros(found.visibility.shape, bool)
    changed = {name: getattr(found, name).copy() for name in ("image_px", "depth_px", "world_m")}
    rows = np.flatnonzero(found.present)
    if len(rows) < 5:
        return found, replaced
    times, scale = found.times_s[rows], pixels_per_metre(found)[rows, None]
    for landmark in range(len(LANDMARKS)):
        place = _place_m(found, rows, scale, landmark)
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
                changed[name][rows, landmark] = _filled(times, values, wrong)
    return replace(found, **changed), replaced


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
    window = (2 * max(round(0.5 * _SCALE_S / step_s), 2) + 1, 1)
    away = np.linalg.norm(places_m - median_filter(places_m, window, mode="nearest"), axis=1)
    for length in range(min(longest, frames - 4), 0, -1):
        for _ in range(_ROUNDS):
            found = _outlying_runs(times_s, current, away, length) & ~wrong
            if not found.any():
                break
            wrong |= found
            current = _filled(times_s, places_m, wrong)
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
    found = np.zeros(len(times_s), bool)
    for start in surely[np.argsort(-rank[surely], kind="stable")]:
        run = inner[start]
        # What overlaps a clearer one was its shadow.
        if not found[max(run[0] - 2, 0) : run[-1] + 3].any():
            found[run] = True
    return found


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


def _filled(times_s: Floats, values: Floats, wrong: NDArray[np.bool_]) -> Floats:
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


# -- Gaps ----------------------------------------------------------------------------------------


def bridge_gaps(found: RawTrack, max_gap_s: float) -> RawTrack:
    """Interpolate across gaps of up to ``max_gap_s``; longer ones stay empty.

    By a curve that does not overshoot (monotone piecewise cubic).
    """
    rows, times = np.flatnonzero(found.present), found.times_s
    short = (np.diff(rows) > 1) & (np.diff(times[rows]) <= max_gap_s + 1e-9)
    if not short.any():
        return found
    from scipy.interpolate import PchipInterpolator

    fill = np.zeros(len(times), bool)
    near = np.zeros(len(rows), bool)  # the curve depends on two frames before and after
    for number in np.flatnonzero(short):
        fill[rows[number] + 1 : rows[number + 1]] = True
        near[max(number - 2, 0) : number + 4] = True
    rows, changed = rows[near], {}
    for name in ("image_px", "depth_px", "world_m", "visibility"):
        values = getattr(found, name).copy()
        values[fill] = PchipInterpolator(times[rows], values[rows], axis=0)(times[fill])
        changed[name] = values
    changed["visibility"][fill] *= _BRIDGED_VISIBILITY
    return replace(found, present=found.present | fill, bridged=found.bridged | fill, **changed)


# -- The whole clip ------------------------------------------------------------------------------

Read = Callable[[int, int], RawTrack]
"""Function that gives what was found in frames ``start`` to ``stop``."""


def repair_landmarks(
    read: Read,
    times_s: Floats,
    seen: NDArray[np.bool_],
    max_gap_s: float,
    write: Callable[[RawTrack], None],
) -> tuple[str, ...]:
    """Repair a whole clip part by part; return sentences about it.

    ``seen`` (T,) marks the frames in which the person was found. Gaps up to ``max_gap_s``,
    from the last frame before to the first after, are bridged. ``write`` is called with the
    repaired parts, in order.
    """
    swapped = find_side_swaps(read, seen)
    tally = _Tally(swapped={part: int(frames.sum()) for part, frames in swapped.items()})
    for start, stop in parts(len(times_s)):
        first, last = _around(start, stop, times_s, seen, max_gap_s)
        found = read(first, last)
        for part, frames in swapped.items():
            found = swap_sides(found, part, frames[first:last])
        found, replaced = replace_outliers(found)
        found = bridge_gaps(found, max_gap_s).part(start - first, stop - first)
        tally.add(found, replaced[start - first : stop - first])
        write(found)
    return tally.sentences(max_gap_s)


def find_side_swaps(read: Read, seen: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
    """Frames (T,) in which left and right are to be swapped back, for each part of the body.

    The side that most frames say is right: not only those of one part of the clip, but of all
    parts that are linked by frames that they share.
    """
    frames = len(seen)
    swapped = {part: np.zeros(frames, bool) for part in SIDED_PARTS}
    linked, decided = 0, 0  # where what is linked began, and up to where all is decided
    for start, stop in parts(frames):
        first, last = max(start - _MARGIN_FRAMES, 0), min(stop + _MARGIN_FRAMES, frames)
        shared = seen[first:decided]
        if not shared.any():
            linked = start
        for part, here in undo_side_swaps(read(first, last))[1].items():
            whole = swapped[part]
            both = slice(first, decided)
            if shared.any() and (whole[both] != here[: decided - first])[shared].mean() > 0.5:
                here = ~here & seen[first:last]
            whole[start:last] = here[start - first :]
            counted = whole[linked:last][seen[linked:last]]
            if counted.any() and counted.mean() > 0.5:
                whole[linked:last] = ~whole[linked:last] & seen[linked:last]
        decided = last
    return swapped


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
    return max(start - _MARGIN_FRAMES, 0), min(stop + _MARGIN_FRAMES, len(times_s))


@dataclass
class _Tally:
    """Counts of repairs."""

    swapped: dict[str, int]
    landmarks: int = 0
    outlying: int = 0
    bridged: int = 0
    missing: int = 0

    def add(self, found: RawTrack, replaced: NDArray[np.bool_]) -> None:
        self.landmarks += int(replaced.sum())
        self.outlying += int(replaced.any(axis=1).sum())
        self.bridged += int(found.bridged.sum())
        self.missing += int((~found.present).sum())

    def sentences(self, max_gap_s: float) -> tuple[str, ...]:
        notes = [
            f"Left and right of {part} swapped back in {_count(frames)}."
            for part, frames in self.swapped.items()
            if frames
        ]
        if self.landmarks:
            notes.append(
                "Replaced from the frames around them:"
                f" {_count(self.landmarks, 'outlying landmark')} in {_count(self.outlying)}."
            )
        if self.bridged:
            notes.append(
                f"Interpolated, in gaps of up to {max_gap_s:g} s without the person:"
                f" {_count(self.bridged)}."
            )
        if self.missing:
            notes.append(f"Left empty, without the person: {_count(self.missing)}.")
        return tuple(notes)


def _count(number: int, what: str = "frame") -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
