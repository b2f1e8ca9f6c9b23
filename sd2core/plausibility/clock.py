"""Times of frames: rate, unit, gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Cure, Sd2Error

USUAL_FRAMES_PER_S = (5.0, 1000.0)
"""Rates outside are of no camera or radar that sees a body move."""

UNITS_S = {
    name: unit_s
    for unit_s, names in {
        60.0: ("min", "mins", "minute", "minutes"),
        1.0: ("s", "sec", "secs", "second", "seconds"),
        1e-3: ("ms", "msec", "msecs", "millisecond", "milliseconds"),
        1e-6: ("us", "µs", "usec", "usecs", "microsecond", "microseconds"),
        1e-9: ("ns", "nsec", "nsecs", "nanosecond", "nanoseconds"),
    }.items()
    for name in names
}
"""Seconds in a unit of time, by the names that files give it."""
_RECOGNISED_FRAMES_PER_S = (1.0, 1000.0)
"""Rates by which a unit is known: as far apart as units are, so that no more than one fits."""
_GAP_STEPS, _GAP_S = 4.0, 0.25
ROUNDING_S = 1e-5
"""A few steps of times that are written with six digits are off by less."""
_SAME_RATE = 5e-4
_WHOLE_RATES = (24_000.0, 30_000.0, 60_000.0, 120_000.0)
"""Numerators of the rates of television, such as 30000/1001."""


def probable_unit(step: float) -> tuple[str, float] | None:
    """Name of the unit, and its seconds, in which frames a step apart come 1 to 1000 a second.

    None where seconds fit, or nothing does. A step of 1 counts frames.

    Examples
    --------
    >>> probable_unit(33.3)
    ('milliseconds', 0.001)
    >>> probable_unit(0.033) is None
    True
    """
    slowest, fastest = _RECOGNISED_FRAMES_PER_S
    if step <= 1.0:
        return None
    for name in ("milliseconds", "microseconds", "nanoseconds"):
        if slowest < 1.0 / (step * UNITS_S[name]) <= fastest:
            return name, UNITS_S[name]
    return None


def judge_rate(step_s: float, *, of_a_mesh: bool = False) -> list[Sd2Error]:
    """Findings on the typical time between frames; cures are options of a mesh."""
    slowest, fastest = USUAL_FRAMES_PER_S
    rate = 1.0 / step_s
    # Rounding of times is no other rate.
    if slowest * 0.999 <= rate <= fastest * 1.001:
        return []
    cause, usual_rate = "Look at the unit of its times", None
    if (unit := probable_unit(step_s)) is not None:
        usual_rate = 1.0 / (step_s * unit[1])
        cause = f"The times are probably {unit[0]}"
    elif round(step_s, 6) == 1.0:
        cause = "The times probably count frames"
    elif rate in _WHOLE_RATES:
        usual_rate = rate / 1001.0
        cause = "The rate is probably the first number of a fraction such as 30000/1001"
    cure = None
    if of_a_mesh:
        if usual_rate is not None:
            shown = float(f"{usual_rate:.5g}")
            words = f"Read it at {shown:g} frames/s"
            cure = Cure("frames_per_s", shown, words, f"--fps {shown:g}")
        else:
            cause += ": pass --fps with the right rate"
    expected = f"{slowest:g} to {fastest:,g} frames/s"
    return [Sd2Error(f"The frames are {step_s:.4g} s apart, {rate:.3g} frames/s", expected, cause,
                    cure)]  # fmt: skip


def judge_assumed_rate(assumed: float, of_video: float) -> Sd2Error | None:
    """Finding on a mesh without times whose video has other frames per second than were assumed."""
    if abs(of_video / assumed - 1.0) < _SAME_RATE:
        return None
    shown = float(f"{of_video:.5g}")
    return Sd2Error(
        f"The mesh has no times of its own and is read at {assumed:.4g} frames/s",
        f"the rate of its video, {shown:g} frames/s",
        "Every velocity is proportional to it",
        Cure("frames_per_s", shown, f"Read it at {shown:g} frames/s", f"--fps {shown:g}"),
    )


def gaps_between(times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True, (T - 1,), where so much time lies between two frames that others were lost."""
    steps_s = np.diff(times_s)
    usual_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    return np.asarray(steps_s > max(_GAP_STEPS * usual_s, _GAP_S) + ROUNDING_S)


def judge_clock(
    times_s: NDArray[np.float64],
    present: NDArray[np.bool_] | None = None,
    *,
    of_a_mesh: bool = False,
) -> list[Sd2Error]:
    """Findings on the rate of frames and on gaps between them.

    Parameters
    ----------
    times_s : float64 array, shape (T,)
        Increasing.
    present : bool array, shape (T,), optional
        Frames with somebody: time without anybody is no gap.
    of_a_mesh : bool
        True where options of a mesh can put it right.
    """
    steps_s = np.diff(times_s)
    if not steps_s.size:
        return []
    usual_s = float(np.median(steps_s))
    findings = judge_rate(usual_s, of_a_mesh=of_a_mesh)
    gaps = gaps_between(times_s)
    if present is not None:
        gaps &= present[1:] & present[:-1]
    count = int(gaps.sum())
    if count and not findings:
        worst = int(np.argmax(np.where(gaps, steps_s, 0.0)))
        findings.append(
            Sd2Error(
                f"{count:,} {'gap' if count == 1 else 'gaps'} in the times, the longest of"
                f" {steps_s[worst]:.3g} s after frame {worst:,}",
                f"about {usual_s:.3g} s from frame to frame",
                "Frames were probably lost, or several takes joined: nothing is known of the"
                " motion there",
            )
        )
    return findings
