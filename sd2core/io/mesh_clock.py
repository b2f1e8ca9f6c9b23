"""The clock of a mesh file: names and units of times, rates and numbers of frames."""

from __future__ import annotations

import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.plausibility.clock import UNITS_S, probable_unit

_OWN_TIMES = "times_s"
"""The name in files of this program, which are taken at their word."""
_TIMES = re.compile(f"(?:frame_?)?(?:times?|time_?stamps?)(?:_?({'|'.join(UNITS_S)}))?")
_RATES = {"fps", "framerate", "framespers", "framespersecond", "mocapframerate", "videofps"}
_NUMBERS = {"frameid", "frameids", "framenumber", "framenumbers", "frameindex", "frameindices"}
_SURE = {"times", "timess", "frameids"} | _RATES
_OF_A_CALENDAR_S = 1e8
"""Times beyond three years are dates, counted from 1970."""


@dataclass(frozen=True, eq=False)
class Clock:
    """Times of a mesh file's frames, as far as it states them."""

    times_s: NDArray[np.float64] | None = None  # (T,)
    frames_per_s: float | None = None
    frame_numbers: NDArray[np.int64] | None = None  # (T,), of the video
    notes: tuple[str, ...] = ()


def is_of_clock(name: str) -> bool:
    """True for the name of times, of a rate or of numbers of frames.

    Examples
    --------
    >>> [is_of_clock(name) for name in ("mocap_framerate", "timestamps_ms", "trans")]
    [True, True, False]
    """
    return bool(_TIMES.fullmatch(name.lower())) or _plain(name) in _RATES | _NUMBERS


def clock_of(places: Sequence[Mapping[Any, Any]], frames: int, source: str) -> Clock:
    """Clock by names and values, the first place that has them taking precedence.

    Parameters
    ----------
    places : sequence of mappings
        Arrays, numbers or lists by name; others are passed over.
    frames : int
        Number of frames of the mesh.
    source : str
        Name of the file, for errors.

    Raises
    ------
    Sd2Error
        If times, rate or numbers of frames are none.
    """
    entries = [
        (str(name), value)
        for place in places
        for name, value in place.items()
        if isinstance(name, str) and is_of_clock(name) and value is not None
        # Of names that may mean something else, only what has a value per frame.
        if _plain(name) in _SURE or np.shape(value) == (frames,)
    ]
    times = [entry for entry in entries if _TIMES.fullmatch(entry[0].lower())]
    times = [(name, value) for name, value in times if isinstance(value, np.ndarray)]
    times.sort(key=lambda entry: entry[0] != _OWN_TIMES)
    rates = [v for n, v in entries if _plain(n) in _RATES and not isinstance(v, Mapping | bool)]
    numbers = [v for n, v in entries if _plain(n) in _NUMBERS]
    notes: list[str] = []
    try:
        times_s = _seconds(*times[0], notes) if times else None
        rate = _rate(rates[0]) if rates else None
    except (TypeError, ValueError, IndexError, ZeroDivisionError) as error:
        raise Sd2Error(
            f"{source}: its times or frames per second are no numbers ({error})", "real numbers"
        ) from error
    known = None if times or not numbers else _frame_numbers(numbers[0], frames, source)
    return Clock(times_s, rate, known, tuple(notes))


def _rate(value: Any) -> float:
    """Frames per second: a number, or a fraction such as ``30000/1001``, also as two numbers."""
    parts = np.asarray(value).reshape(-1)
    if parts.dtype.kind == "U":
        parts = np.asarray(str(parts[0]).split("/"))
    rate = float(parts[0])
    # Two rates alike may as well be those of two people.
    return rate / float(parts[1]) if len(parts) == 2 and parts[0] != parts[1] else rate


def _plain(name: str) -> str:
    return re.sub("[ _-]", "", name.lower())


def _seconds(name: str, values: NDArray[Any], notes: list[str]) -> NDArray[np.float64]:
    """Times in seconds, by their type, the unit in their name, or the usual rates of frames."""
    if values.dtype.kind in "mM":
        if np.isnat(values).any():
            raise ValueError(f"{int(np.isnat(values).sum())} of {values.size} are NaT")
        first = values.flat[0] if values.dtype.kind == "M" and values.size else 0
        times_s: NDArray[np.float64] = (values - first) / np.timedelta64(1, "s")
        if values.dtype.kind == "M":
            notes.append(f"The times are dates: they are counted from the first, {first}.")
        return times_s
    times_s = np.asarray(values, np.float64)
    if name == _OWN_TIMES or times_s.ndim != 1:
        return times_s
    match = _TIMES.fullmatch(name.lower())
    if match is not None and match[1]:
        times_s = times_s * UNITS_S[match[1]]
    elif len(times_s) > 1:
        step = float(np.median(np.diff(times_s)))
        probable = probable_unit(step)
        if probable is not None:
            times_s = times_s * probable[1]
            notes.append(
                f"{name!r} has no unit and steps of {step:.6g}: they are taken as {probable[0]}"
                f" ({1 / (step * probable[1]):.4g} frames/s). Pass --fps if they are not."
            )
    if times_s.size and times_s[0] > _OF_A_CALENDAR_S:
        date = np.datetime64(int(times_s[0]), "s") if times_s[0] < 1e11 else times_s[0]
        notes.append(f"The times are dates: they are counted from the first, {date}.")
        times_s = times_s - times_s[0]
    return times_s


def _frame_numbers(numbers: Any, frames: int, source: str) -> NDArray[np.int64]:
    try:
        if not isinstance(numbers, np.ndarray):
            numbers = [operator.index(number) for number in numbers]
        with np.errstate(invalid="raise"):
            array = np.asarray(numbers, dtype=np.int64)
    except (ArithmeticError, TypeError, ValueError) as error:
        raise Sd2Error(
            f"{source}: frame_ids are no numbers of frames ({error})",
            "one video frame number per frame",
        ) from error
    if array.shape != (frames,):
        raise Sd2Error(
            f"{source}: {frames} frames of vertices but frame_ids of shape {array.shape}",
            "one video frame number per frame",
        )
    return array
