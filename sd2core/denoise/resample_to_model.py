"""Check that a map fits a model, and interpolation to the model's frame rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import runs
from sd2core.plausibility.clock import ROUNDING_S
from sd2core.progress import Progress
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from sd2core.denoise.card import ModelCard
    from sd2core.denoise.network_card import NetworkCard

Energies = NDArray[np.float32]
"""Energies without a gap, (frames, bins)."""

SAME_RATE = 0.02
"""Relative difference of frame rates that does not affect a model."""

MAX_RESAMPLED = 4.0
"""Largest ratio of frame rates for which a map is interpolated to the model's rate."""

_UNEVEN = 0.5
"""Share of a frame duration by which frames may be early or late."""

_BREAK_FRAMES = 5.0
"""Frame durations from one frame to the next, beyond which a new clip begins."""


def is_same_rate(one_hz: float, other_hz: float) -> bool:
    """True if frame rates are equal but for what does not affect a model."""
    return abs(one_hz / other_hz - 1.0) <= SAME_RATE


def can_resample(from_hz: float, to_hz: float) -> bool:
    """True if one frame rate is at most :data:`MAX_RESAMPLED` times the other, but for rounding."""
    return max(from_hz / to_hz, to_hz / from_hz) <= MAX_RESAMPLED * (1.0 + 1e-6)


def check_map(doppler: DopplerMap, card: ModelCard) -> None:
    """Raise Sd2Error for a map that is not synthetic or does not fit the model."""
    model = f"the model {card.title or card.name}"
    if doppler.kind != "synthetic":
        raise Sd2Error(
            f"The map is of kind {doppler.kind!r}",
            f"a synthetic map, which {model} turns into what a radar would show",
            "Make one with `sd2 synth`",
        )
    if card.parts and doppler.limbs is None:
        raise Sd2Error(
            "The map is not split by the parts of the body",
            f"limb maps, from which {model} learnt",
            "Make it with `sd2 synth --limbs`, or choose a model that takes the map alone",
        )
    if card.parts and doppler.limbs is not None and not doppler.limbs.of_everybody:
        raise Sd2Error(
            "Somebody in the scene is no body whose parts are known",
            f"limb maps of everybody, whom {model} answers one by one",
            "Choose a model that takes the map alone",
        )
    check_bins(doppler, card)


def input_of(doppler: DopplerMap, parts: Sequence[str] = ()) -> Energies:
    """Energies that a model takes, (frames, bins), or (frames, parts · bins) of these parts.

    Parts of several persons are side by side, for the model to answer one after the other.
    """
    if not parts:
        return np.ascontiguousarray(doppler.values.T)
    assert doppler.limbs is not None
    return doppler.limbs.inputs(parts)


def check_bins(doppler: DopplerMap, card: NetworkCard) -> None:
    """Raise Sd2Error for a map of another axis, other emptied bins or too different a rate."""
    model = f"the model {card.title or card.name}"
    if doppler.axis != card.axis:
        raise Sd2Error(
            f"The map has {doppler.axis.words}",
            f"{card.axis.words}, for {model}",
            f"Make it with `sd2 synth --bins {card.axis.bins} --v-max {card.axis.v_max_mps:g}`",
        )
    extra = sorted(set(doppler.null_bins) - set(card.null_bins))
    if extra:
        wanted = ",".join(map(str, card.null_bins)) or "none"
        raise Sd2Error(
            f"Bins {', '.join(map(str, extra))} of the map were emptied",
            f"energy there, for {model}",
            f"Make it with `sd2 synth --null-bins {wanted}`",
        )
    rate_hz = doppler.timebase.frames_per_s
    if len(doppler.timebase) > 1 and not can_resample(rate_hz, card.frame_rate_hz):
        raise Sd2Error(
            f"The map has {rate_hz:.4g} frames/s",
            f"{card.frame_rate_hz:g} frames/s, for {model}, or up to {MAX_RESAMPLED:g} times"
            " more or less",
            "Use a model for such maps",
        )


def stretches(doppler: DopplerMap, frame_rate_hz: float) -> list[tuple[int, int]]:
    """Half-open runs of frames that are clips of their own: without gaps, with a person.

    ``frame_rate_hz`` is the rate of the model.
    """
    return clips(doppler.times_s, doppler.present_mask, frame_rate_hz)


def clips(
    times_s: NDArray[np.float64], present: NDArray[np.bool_], frame_rate_hz: float
) -> list[tuple[int, int]]:
    """Half-open runs of marked frames between which no time is missing.

    ``frame_rate_hz`` is that of the model.
    """
    longest_s = _BREAK_FRAMES * max(Timebase(times_s).frame_duration_s, 1 / frame_rate_hz)
    breaks = np.flatnonzero(np.diff(times_s) > longest_s + ROUNDING_S) + 1
    pieces: list[tuple[int, int]] = []
    for start, stop in runs(present):
        edges = [start, *breaks[(breaks > start) & (breaks < stop)].tolist(), stop]
        pieces += pairwise(edges)
    return pieces


def is_regular(times_s: NDArray[np.float64], frame_rate_hz: float) -> bool:
    """True if frames have this rate, within tolerances that do not affect a model."""
    if len(times_s) < 2:
        return True
    steps = np.diff(times_s) * frame_rate_hz
    even = bool((np.abs(steps - 1.0) <= _UNEVEN).all())
    return even and abs(float(steps.mean()) - 1.0) <= SAME_RATE


def apply_to_stretches(
    work: Callable[[Energies, Progress], Energies],
    doppler: DopplerMap,
    energies: Energies,
    frame_rate_hz: float,
    result: Energies,
    progress: Progress,
) -> bool:
    """Apply ``work`` to every stretch of a map, at the model's rate.

    Parameters
    ----------
    work : callable
        Takes energies without a gap, and a progress, and returns as many frames.
    doppler : DopplerMap
        Gives times, and frames with a person.
    energies : float32 ndarray, (frames, features)
        Those of the map, in the form that ``work`` takes.
    frame_rate_hz : float
        Rate of the model.
    result : float32 ndarray, (frames, bins)
        Written; rows between stretches stay as they are.
    progress : Progress
        Counts frames; may raise Cancelled.

    Returns
    -------
    bool
        True if frames were interpolated to the model's rate and back.
    """
    total, resampled = len(energies), False
    for start, stop in stretches(doppler, frame_rate_hz):

        def own(values: Energies, start: int = start, size: int = stop - start) -> Energies:
            # At the model's rate there are more frames, or fewer, than in the map.
            return work(values, lambda done, of: progress(start + size * done // of, total))

        values, times_s = energies[start:stop], doppler.times_s[start:stop]
        if is_regular(times_s, frame_rate_hz):
            result[start:stop] = own(values)
        else:
            resampled = True
            even_s = even_times(times_s, frame_rate_hz)
            answer = own(interpolated(values, times_s, even_s))
            result[start:stop] = interpolated(answer, even_s, times_s)
    progress(total, total)
    return resampled


def even_times(times_s: NDArray[np.float64], frame_rate_hz: float) -> NDArray[np.float64]:
    """Times at an even rate, from the first frame to the first at or after the last one."""
    duration_s = float(times_s[-1] - times_s[0])
    count = int(np.ceil(duration_s * frame_rate_hz - 1e-6)) + 1
    return np.asarray(times_s[0] + np.arange(count) / frame_rate_hz)


def interpolated(
    values: Energies, times_s: NDArray[np.float64], wanted_s: NDArray[np.float64]
) -> Energies:
    """Interpolate linearly between frames, along the first axis; constant beyond both ends."""
    if len(times_s) == 1:
        return np.repeat(values, len(wanted_s), axis=0)
    after = np.clip(np.searchsorted(times_s, wanted_s), 1, len(times_s) - 1)
    span_s = times_s[after] - times_s[after - 1]
    part = np.clip((wanted_s - times_s[after - 1]) / span_s, 0.0, 1.0)
    part = part.reshape(-1, *[1] * (values.ndim - 1))
    between = (1 - part) * values[after - 1] + part * values[after]
    return between.astype(np.float32)


def evenly(doppler: DopplerMap, rate_hz: float) -> DopplerMap:
    """Return the map as a model takes it, at an even rate, where frames of it were lost."""
    if is_regular(doppler.times_s, rate_hz):
        return doppler
    even_s = even_times(doppler.times_s, rate_hz)

    def there(values: NDArray[np.float32]) -> NDArray[np.float32]:
        made = interpolated(np.moveaxis(values, -1, 0), doppler.times_s, even_s)
        return np.moveaxis(made, 0, -1)

    limbs = doppler.limbs
    if limbs is not None:
        moves = None if limbs.kinematics is None else there(limbs.kinematics)
        limbs = replace(limbs, values=there(limbs.values), kinematics=moves)
    clock = Timebase(even_s)
    return DopplerMap(there(doppler.values), doppler.axis, clock, doppler.kind, limbs=limbs)
