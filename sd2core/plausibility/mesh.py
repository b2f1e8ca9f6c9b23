"""A body that moves: its size, place, speed and jumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Cure, Sd2Error

LARGEST_BODY_M = 10.0
_SMALLEST_BODY_M = 0.02
_LIKELY_BODY_M = (0.3, 3.0)
AT_ROOT_M = 0.6
"""A body whose middle is nearer to the camera is centred on its own root."""
_FARTHEST_M = 20.0
_LYING_M, _LYING_SHARE = (1.2, 2.3), 1.5

_FASTEST_BODY_MPS = 13.0
"""The middle of the fastest sprinter moves at 12.4 m/s."""
_FASTEST_PARTS_MPS = 13.0
"""Of all points about the middle, root mean square: a somersault has 5 m/s."""
_LARGEST_CHANGE_MPS = 8.0
"""A landing from 2 m takes 6 m/s from the middle of a body."""
_SPACING_S = 1 / 30
"""Velocities are taken over this time at least, so that noise of fast cameras counts little."""
_SLOWEST_S = 0.25
"""Over a longer time nothing is known of acceleration."""
_OFTEN = 0.25
_BACK = 0.3


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Some points of a body in some frames of a mesh.

    Parameters
    ----------
    frames : int array, shape (K,)
        Numbers of the frames, increasing.
    points_m : float64 array, shape (K, N, 3)
        The same vertices in each, in the camera's frame.
    times_s : float64 array, shape (K,)
    present : bool array, shape (K,)
        False in frames without a person.
    extent_m : float64 array, shape (K, 3)
        Size of the body along x, y and z.
    """

    frames: NDArray[np.int64]
    points_m: NDArray[np.float64]
    times_s: NDArray[np.float64]
    present: NDArray[np.bool_]
    extent_m: NDArray[np.float64]

    def neighbours(self, step: int) -> NDArray[np.int64]:
        """Places k whose frames ``k`` to ``k + step`` follow each other, all with a person."""
        follows = (np.diff(self.frames) == 1) & self.present[1:] & self.present[:-1]
        if len(follows) < step:
            return np.zeros(0, np.int64)
        windows = np.lib.stride_tricks.sliding_window_view(follows, step)
        return np.flatnonzero(windows.all(axis=1))


def judge_size(extent_m: float) -> Sd2Error | None:
    """Finding on the largest measure of a body; one beyond ``LARGEST_BODY_M`` is to be refused."""
    if _SMALLEST_BODY_M <= extent_m <= _LIKELY_BODY_M[1]:
        return None
    if extent_m <= LARGEST_BODY_M:
        shown = f"{extent_m:.3g} m" if extent_m > 1 else f"{extent_m * 1000:.3g} mm"
        return Sd2Error(
            f"The mesh measures {shown}",
            remedy="When that is not its size in metres, pass --scale with the factor",
        )
    keeping = "(or --scale 1 when the size is right)"
    guess, cure = f"Pass --scale with the factor to metres {keeping}", None
    for factor, unit in ((0.01, "centimetres"), (0.001, "millimetres")):
        if _LIKELY_BODY_M[0] <= extent_m * factor <= _LIKELY_BODY_M[1]:
            guess, option = f"These are probably {unit}", f"--scale {factor:g} {keeping}"
            cure = Cure("scale", factor, f"Read it as {unit}", option)
            break
    return Sd2Error(
        f"The body measures {extent_m:,.0f} m",
        f"metres, a body below {LARGEST_BODY_M:g} m",
        guess,
        cure,
    )


def judge_place(body: BodyPoints) -> list[Sd2Error]:
    """Findings on where a body is in the camera's frame, and which way up."""
    present = body.present if body.present.any() else np.ones_like(body.present)
    points_m = body.points_m[present]
    depth_m = float(points_m[..., 2].mean())
    far_m = float(np.linalg.norm(points_m.mean(axis=1), axis=1).max())
    extent_m = np.median(body.extent_m[present], axis=0)
    low, high = _LYING_M
    wholly_behind = bool((points_m[..., 2] < 0).all())
    lies = low <= extent_m[2] <= high and extent_m[2] > _LYING_SHARE * extent_m[:2].max()
    if depth_m <= 0 and (wholly_behind or not lies):
        return [_behind(depth_m, wholly_behind, far_m < AT_ROOT_M)]
    if lies:
        return [
            Sd2Error(
                f"The body is {extent_m[2]:.2f} m long along the line of sight and"
                f" {extent_m[1]:.2f} m high",
                "y down and z forward",
                "It lies towards the camera, or z points up",
                Cure("turn", "x90", "Turn it: z is up", "--turn x90"),
            )
        ]
    if depth_m > _FARTHEST_M:
        return [
            Sd2Error(
                f"The body is {depth_m:.0f} m away on average",
                f"below {_FARTHEST_M:g} m",
                "The focal length was probably guessed by the tool that made it: depth, and"
                " velocities along the line of sight, grow in proportion to it. Make the mesh"
                " again with the camera's focal length",
            )
        ]
    return []


def _behind(depth_m: float, wholly: bool, at_root: bool) -> Sd2Error:
    cure = None
    remedy = (
        "A mesh with y up and z backward needs a half turn about x (--turn x180); one centred on"
        " its root needs its distance (--distance-m)"
    )
    if at_root:
        remedy = "It is centred on its root: pass its distance (--distance-m)"
    elif wholly:
        remedy = "y probably points up and z backward"
        cure = Cure("turn", "x180", "Turn it to the front", "--turn x180")
    return Sd2Error(
        f"The mesh is at a mean depth of {depth_m:.2f} m, at or behind the camera",
        "the camera's frame: x right, y down, z forward",
        remedy,
        cure,
    )


def judge_motion(body: BodyPoints) -> list[Sd2Error]:
    """Findings on the speed of a body, the change of its velocity, and the speed of its parts."""
    spacing_s = np.diff(body.times_s)[np.diff(body.frames) == 1]
    if not spacing_s.size:
        return []
    step = max(1, round(_SPACING_S / float(np.median(spacing_s))))
    at = body.neighbours(step)
    if not at.size:
        return []
    middle_m = body.points_m.mean(axis=1)  # (K, 3)
    durations_s = (body.times_s[at + step] - body.times_s[at])[:, None]
    velocity_mps = (middle_m[at + step] - middle_m[at]) / durations_s
    speed_mps = np.linalg.norm(velocity_mps, axis=1)
    fast = speed_mps > _FASTEST_BODY_MPS
    if fast.any():
        return [_too_fast(body, middle_m, at, step, speed_mps)]
    pairs = body.neighbours(2 * step)
    if pairs.size and float(np.median(durations_s)) <= _SLOWEST_S:
        first = np.searchsorted(at, pairs)
        second = np.searchsorted(at, pairs + step)
        change_mps = np.linalg.norm(velocity_mps[second] - velocity_mps[first], axis=1)
        worst = int(np.argmax(change_mps))
        if change_mps[worst] > _LARGEST_CHANGE_MPS:
            return [_jump(body, int(pairs[worst]), step, float(change_mps[worst]), change_mps)]
    return _parts(body, at, step)


def _too_fast(
    body: BodyPoints,
    middle_m: NDArray[np.float64],
    at: NDArray[np.int64],
    step: int,
    speed_mps: NDArray[np.float64],
) -> Sd2Error:
    """Finding on a body that is too fast, with what its pattern tells of the cause."""
    fast = speed_mps > _FASTEST_BODY_MPS
    often = float(fast.mean()) > _OFTEN
    pairs = np.intersect1d(body.neighbours(2 * step), at[fast])
    there_m = np.linalg.norm(middle_m[pairs + step] - middle_m[pairs], axis=1)
    back_m = np.linalg.norm(middle_m[np.minimum(pairs + 2 * step, len(middle_m) - 1)]
                            - middle_m[pairs], axis=1)  # fmt: skip
    if pairs.size and np.mean(back_m < _BACK * there_m) > (0.5 if often else 0.0):
        cause = (
            "It jumps away and back: frames of another person, or of nobody, probably lie between"
        )
    elif often:
        cause = (
            "The frame rate is probably wrong (--fps), the unit (--scale), or the depth, which a"
            " guessed focal length stretches"
        )
    else:
        cause = (
            "It jumps: another person, a cut in the video or lost frames probably. Velocities"
            " there are no motion"
        )
    worst = int(np.argmax(speed_mps))
    return Sd2Error(
        f"The body moves at up to {speed_mps[worst]:,.0f} m/s, after frame"
        f" {body.frames[at[worst]]:,}; too fast in {int(fast.sum()):,} of {len(fast):,} steps",
        f"below {_FASTEST_BODY_MPS:g} m/s",
        cause,
    )


def _jump(
    body: BodyPoints, at: int, step: int, change_mps: float, changes_mps: NDArray[np.float64]
) -> Sd2Error:
    duration_s = float(body.times_s[at + step] - body.times_s[at])
    count = int((changes_mps > _LARGEST_CHANGE_MPS).sum())
    return Sd2Error(
        f"The body's velocity changes by {change_mps:.0f} m/s within {duration_s:.3g} s"
        f" ({change_mps / duration_s:,.0f} m/s²) at frame {body.frames[at + step]:,}, and too fast"
        f" {count:,} {'time' if count == 1 else 'times'} in all",
        f"changes below {_LARGEST_CHANGE_MPS:g} m/s",
        "It jumps: another person, lost frames, or the jitter of a tool that sees each frame by"
        " itself",
    )


def _parts(body: BodyPoints, at: NDArray[np.int64], step: int) -> list[Sd2Error]:
    """Finding on how a body's points move about its middle, which is itself not too fast."""
    about_m = body.points_m - body.points_m.mean(axis=1, keepdims=True)
    moved_m = np.linalg.norm(about_m[at + step] - about_m[at], axis=2)  # (n, N)
    durations_s = body.times_s[at + step] - body.times_s[at]
    speed_mps = np.sqrt(np.mean(np.square(moved_m), axis=1)) / durations_s
    worst = int(np.argmax(speed_mps))
    if speed_mps[worst] <= _FASTEST_PARTS_MPS:
        return []
    return [
        Sd2Error(
            f"The parts of the body move at {speed_mps[worst]:,.0f} m/s on average after frame"
            f" {body.frames[at[worst]]:,}",
            f"below {_FASTEST_PARTS_MPS:g} m/s",
            "The vertices probably have another order in some frames, or the body flips over",
        )
    ]
