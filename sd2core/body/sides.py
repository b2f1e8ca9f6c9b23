"""Left and right: landmarks that the landmark model gave to the other side of the body.

A small network sees the whole body move and tells how likely each part of it is mirrored (decision
47); where a stretch of mirrored frames begins and ends, the smoothness of motion decides.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sd2core.body.lifter_features import (
    RATE_HZ,
    Seen,
    apparent_size,
    backwards,
    features,
    interpolated,
    mirrored,
    nearly_at_rate,
    resampled,
    scale_of,
)
from sd2core.body.network import Network, network_of
from sd2core.body.raw_track import RawTrack, pixels_per_metre, place_m
from sd2core.body.track import LANDMARKS, MIRRORED, TORSO_CORNERS, parts, with_margin
from sd2core.files.resources import open_bundled_arrays, resource_path

Floats = NDArray[np.float64]

ARMS = tuple(range(13, 23))
LEGS = tuple(range(25, 33))
TRUNK = tuple(number for number in range(33) if number not in ARMS + LEGS)
SIDED_PARTS = {"head and trunk": TRUNK, "the arms": ARMS, "the legs": LEGS}
"""Parts of the body that are swapped as one, and their landmarks."""

FORMAT = "sd2-sides"
VERSION = 1

_PARTNERS = np.array(MIRRORED)
_SWITCH_M = 0.10
_RARER = 2.8
"""Log odds by which swaps are rarer than where the network learnt: 1.5 instead of 20 %."""
_SURE = 6.0
"""Log odds beyond which the network is not believed more."""
_ODDS_M2 = 0.03
"""Squared distance from a smooth path that outweighs one unit of log odds, per landmark."""
_LONGEST_GAP_S = 0.5


def find_side_swaps(track: RawTrack) -> dict[str, NDArray[np.bool_]]:
    """Frames (T,) of a clip in which left and right of each part are to be swapped back."""
    frames = len(track.times_s)
    swapped = {part: np.zeros(frames, bool) for part in SIDED_PARTS}
    for start, stop in parts(frames):
        first, last = with_margin(start, stop, frames)
        for part, here in undo_side_swaps(track.part(first, last))[1].items():
            swapped[part][start:stop] = here[start - first : stop - first]
    return swapped


def undo_side_swaps(track: RawTrack) -> tuple[RawTrack, dict[str, NDArray[np.bool_]]]:
    """Undo swaps of left and right: of head and trunk, of the arms, of the legs, or of all.

    Those sides are chosen that make the motion smooth (the sum of accelerations) and are likely, by
    dynamic programming over both sides of each frame. Returns the track, and per part the frames
    that were changed, (T,).
    """
    swaps = {part: np.zeros(len(track.times_s), bool) for part in SIDED_PARTS}
    rows = np.flatnonzero(track.present)
    if len(rows) < 3:
        return track, swaps
    scale = pixels_per_metre(track)[rows, None]
    odds = np.clip(swap_odds(track)[rows] - _RARER, -_SURE, _SURE)
    for number, (part, members) in enumerate(SIDED_PARTS.items()):
        alone = -_ODDS_M2 * len(members) * odds[:, number]
        swaps[part][rows] = _cheapest(_motion_cost(track, rows, scale, members), alone)
        track = swap_sides(track, part, swaps[part])
    return track, swaps


def swap_sides(track: RawTrack, part: str, frames: NDArray[np.bool_]) -> RawTrack:
    """Swap left and right of one of :data:`SIDED_PARTS` in some frames (T,)."""
    members = list(SIDED_PARTS[part])
    order = np.arange(len(LANDMARKS))
    order[members] = _PARTNERS[members]
    return track.picked(order, frames)


# -- What the network says -------------------------------------------------------------------------


def swap_odds(track: RawTrack) -> Floats:
    """Log odds that each of :data:`SIDED_PARTS` is mirrored, (T, 3); 0 without a person."""
    odds = np.zeros((len(track.times_s), len(SIDED_PARTS)))
    rows = np.flatnonzero(track.present)
    breaks = np.flatnonzero(np.diff(track.times_s[rows]) > _LONGEST_GAP_S) + 1
    for stretch in np.split(rows, breaks):
        if len(stretch) > 1:
            odds[stretch] = _odds(load_sides(), track, stretch)
    return odds


def _odds(network: Network, track: RawTrack, rows: NDArray[np.intp]) -> Floats:
    """Log odds (N, 3) of frames that follow one another closely."""
    times_s = track.times_s[rows]
    place = np.arange(len(rows), dtype=np.float64)
    seen = free_of_place(
        Seen(
            track.image_px[rows].astype(np.float64),
            track.depth_px[rows].astype(np.float64),
            track.world_m[rows].astype(np.float64),
            track.visibility[rows].astype(np.float64),
            np.ones(len(rows)),
        )
    )
    if not nearly_at_rate(times_s):
        place = (times_s - times_s[0]) * RATE_HZ
        ticks = np.arange(int(place[-1] + 1e-6) + 1)
        seen = Seen(*(resampled(np.asarray(part), place, ticks) for part in seen))
    return interpolated(likely_swaps(network, seen), place)


def free_of_place(seen: Seen) -> Seen:
    """A stretch in units of the person's size, around their middle place in the picture.

    So it does not depend on the camera's focal length, and pixels serve as well as slopes.
    """
    slopes = np.asarray(seen.slopes)
    size = float(np.median(apparent_size(slopes)))
    middle = np.median(slopes[:, list(TORSO_CORNERS)].mean(axis=1), axis=0)
    return seen._replace(slopes=(slopes - middle) / size, depth=np.asarray(seen.depth) / size)


def likely_swaps(network: Network, seen: Seen) -> NDArray[np.float32]:
    """Log odds (T, 3) of a stretch at the network's rate.

    The mean over the stretch, its mirror image, and both played backwards.
    """
    odds = []
    for view in (seen, mirrored(seen)):
        scale = scale_of(view)
        odds.append(network(features(view, scale)))
        odds.append(network(features(backwards(view), scale))[::-1])
    return np.mean(odds, axis=0, dtype=np.float32)


@lru_cache(maxsize=1)
def load_sides() -> Network:
    """Read the bundled network; Sd2Error if it is missing, damaged or newer."""
    path = resource_path("sides.npz")
    command = "python -m tools.train_lifter sides"
    with open_bundled_arrays(path, FORMAT, VERSION, "what tells sides", command) as (meta, data):
        return network_of(meta, data)


# -- What motion says ------------------------------------------------------------------------------


def _motion_cost(
    track: RawTrack, rows: NDArray[np.intp], scale: Floats, members: tuple[int, ...]
) -> Floats:
    """Squared distances (m²) of landmarks from smooth paths, for each choice of sides.

    (2, 2, 2, N - 2) for three frames in succession; a change of sides has a price.
    """
    cost = np.zeros((2, 2, 2, len(rows) - 2))
    for landmark in members:
        pair = (landmark, MIRRORED[landmark])
        sides = [place_m(track, rows, scale, each) for each in pair]
        cost += _bends(track.times_s[rows], np.stack(sides))
    switch = np.abs(np.diff(np.indices((2, 2, 2)), axis=0)).sum(axis=0)  # (a, b, c)
    return np.asarray(cost + 0.5 * len(members) * _SWITCH_M**2 * switch[..., None])


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


def _cheapest(cost: Floats, alone: Floats) -> NDArray[np.bool_]:
    """Cheapest choices (N,).

    ``cost`` (2, 2, 2, N - 2) is that of three in succession, ``alone`` (N,) that of True in each.
    """
    steps = cost.shape[3]
    total = np.zeros((2, 2))  # (earlier, later)
    total[1] += alone[0]
    total[:, 1] += alone[1]
    choice = np.empty((steps, 2, 2), np.int8)
    for step in range(steps):
        options = total[:, :, None] + cost[:, :, :, step]  # (a, b, c)
        choice[step] = options.argmin(axis=0)
        total = options.min(axis=0)
        total[:, 1] += alone[step + 2]
    states = np.empty(steps + 2, bool)
    b, c = divmod(int(total.argmin()), 2)
    states[-2:] = b, c
    for step in range(steps - 1, -1, -1):
        a = int(choice[step, b, c])
        states[step] = a
        b, c = a, b
    return states
