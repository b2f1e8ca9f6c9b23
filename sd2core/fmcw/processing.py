"""Doppler maps from raw FMCW samples, measured or simulated.

Steps per frame: mean of every chirp removed, static clutter removed, range FFT,
Doppler FFT, power summed over range gates and averaged over receivers and
transmitters, brought onto the velocity axis. Where the samples of a chirp are
distances already, or there is one of a continuous wave, they are the range gates.
After M. A. Richards, *Fundamentals of Radar Signal Processing*,
and F. J. Harris, "On the use of windows" (Proc. IEEE 66, 1978).

**Sign.** For a beat signal cos(2 pi (f_c tau + S tau t)) the phase grows with the
delay tau, so a forward FFT over the chirps gives a receding target a positive
frequency. Maps turn this round: positive is approaching.

**Unit.** A power of 1 is that of a sine over the converter's full range, or of a
complex phasor; windows are divided out. Summed over bins and gates, the map is twice
the mean square of the samples relative to half the range (Parseval), or once that of
complex ones, and rebinning keeps it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error, wanted
from sd2core.fmcw.chain import Chain, FrameChain, ProcessingOptions, Window
from sd2core.io.radar.capture import RadarCapture
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import gaps_in_words, runs
from sd2core.progress import Progress, silent
from sd2core.radar_config import Clutter, RadarConfig
from sd2core.sensor import VelocityAxis
from sd2core.version import __version__

UNIT = "power (1 = full-scale sine)"
UNKNOWN_UNIT = "power (unit of the file, squared)"
"""Unit where a file does not say what fills its converter."""


@dataclass(frozen=True, eq=False)
class RangeDoppler:
    """Power of one frame over range and velocity, averaged over channels."""

    values: NDArray[np.float32]  # (gates, bins); velocity ascending, positive when approaching.
    range_m: NDArray[np.float64]  # Centre of every gate, (gates,).
    axis: VelocityAxis
    time_s: float

    @property
    def range_profile(self) -> NDArray[np.float32]:
        """Power per gate, shape (gates,)."""
        return self.values.sum(axis=1)


def doppler_map(
    capture: RadarCapture,
    *,
    axis: VelocityAxis | None = None,
    bins: int | None = None,
    v_max_mps: float | None = None,
    clutter: Clutter = "none",
    clutter_window_s: float = 2.0,
    range_m: tuple[float, float] | None = None,
    window: Window = "hann",
    progress: Progress = silent,
) -> DopplerMap:
    """Doppler map of a capture, one column per radar frame.

    Parameters
    ----------
    axis : VelocityAxis or None
        Axis of the map. None takes ``bins`` and ``v_max_mps``, and for
        each of these that is None the radar's own: one bin per chirp, v_max.
    bins, v_max_mps
        Short for ``axis=VelocityAxis(bins, v_max_mps)``.
    clutter, clutter_window_s, range_m, window
        See :class:`ProcessingOptions`.

    Returns
    -------
    DopplerMap
        Of kind ``real`` or ``simulated``; of a simulation ``present`` says in which
        frames there was a person, besides noise. Bins wholly beyond the radar's v_max
        are ``unseen_bins`` and zero. What lies beyond a narrower axis is left
        out; ``meta["beyond_share"]`` says how much, ``meta["notes"]`` what else
        to know.

    Raises
    ------
    Sd2Error
        For options that do not fit this radar.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> capture = sd2.load_capture(resource_path("swipes.sd2") / "radar")
    >>> doppler = sd2.doppler_map(capture, bins=32, v_max_mps=2.0, clutter="mean")
    >>> doppler.kind, doppler.values.shape
    ('simulated', (32, 450))
    """
    wanted(capture, RadarCapture, 'Read one with sd2.load_capture("recording/")')
    options = ProcessingOptions(clutter, clutter_window_s, range_m, window)
    config = capture.config
    axis = _axis(config, axis, bins, v_max_mps)
    chain = Chain(capture, options)
    weights = weights_of(axis, chain)  # (bins, doppler)
    values = np.empty((axis.bins, capture.frame_count), dtype=np.float32)
    inside = everything = 0.0
    progress(0, capture.frame_count)
    for start, stop in chain.blocks():
        power = chain.doppler_power(start, stop)  # (n, doppler)
        values[:, start:stop] = binned(weights, power)
        inside += float(values[:, start:stop].sum(dtype=np.float64))
        everything += float(power.sum(dtype=np.float64)) / config.channels
        progress(stop, capture.frame_count)
    beyond = max(0.0, 1.0 - inside / everything) if everything > 0 else 0.0
    unseen = _unseen(config, axis)
    return DopplerMap(
        values=values,
        axis=axis,
        timebase=capture.timebase,
        kind="simulated" if capture.simulated else "real",
        unit=UNIT if capture.full_scale_known else UNKNOWN_UNIT,
        unseen_bins=unseen,
        meta={
            "source": capture.source,
            "simulated": capture.simulated,
            "radar": {**config.as_dict(), **limits(config)},
            "options": asdict(options),
            "range_gates_m": [float(value) for value in chain.range_m],
            "beyond_share": beyond,
            "notes": [
                *capture.notes,
                *_without_person(capture),
                *_notes(config, axis, unseen, beyond, chain.clipped_share),
            ],
            "version": __version__,
        },
        present=capture.present,
    )


def range_doppler(
    capture: RadarCapture,
    frame: int,
    *,
    axis: VelocityAxis | None = None,
    clutter: Clutter = "none",
    clutter_window_s: float = 2.0,
    range_m: tuple[float, float] | None = None,
    window: Window = "hann",
) -> RangeDoppler:
    """Range-Doppler map of one frame; summed over gates it is that frame of the map.

    Parameters are those of :func:`doppler_map`.
    """
    if not 0 <= frame < capture.frame_count:
        raise IndexError(f"frame {frame} of {capture.frame_count}")
    if capture.config.is_continuous:
        raise Sd2Error(
            f"{capture.config.name} is a continuous wave, which tells no ranges apart",
            "a radar that measures range, or a Doppler map",
        )
    axis = _axis(capture.config, axis, None, None)
    chain = Chain(capture, ProcessingOptions(clutter, clutter_window_s, range_m, window))
    weights = weights_of(axis, chain)
    power = chain.cell_power(frame)  # (doppler, gates)
    return RangeDoppler((weights @ power).T, chain.range_m, axis, capture.timebase.time_of(frame))


def limits(config: RadarConfig) -> dict[str, float]:
    """Limits of a radar in velocity and, if it has any, range, for provenance and read-outs."""
    result = {
        "wavelength_m": config.wavelength_m,
        "v_max_mps": config.v_max_mps,
        "velocity_resolution_mps": config.velocity_resolution_mps,
    }
    if not config.is_continuous:
        result["range_resolution_m"] = config.range_resolution_m
        result["range_max_m"] = config.range_max_m
    return result


def weights_of(axis: VelocityAxis, chain: FrameChain) -> NDArray[np.float32]:
    """Weights of the rebinning of power that is summed over channels, (bins, doppler)."""
    config = chain.config
    return (rebinning(config, axis, chain.doppler_bins) / config.channels).astype(np.float32)


def binned(weights: NDArray[np.float32], power: NDArray[np.float32]) -> NDArray[np.float32]:
    """Columns of a map, (bins, n), of the power of frames, (n, doppler).

    A column does not depend on how many are computed together, as it would by a matrix product of
    BLAS.
    """
    return np.einsum("bd,nd->bn", weights, power)


def rebinning(config: RadarConfig, axis: VelocityAxis, doppler_bins: int) -> NDArray[np.float64]:
    """Weights of the rebinning of FFT bins (in FFT order) onto a velocity axis.

    The Doppler FFT is zero-padded, so that power is known several times per
    native bin. Each of its bins is an interval of width 2 v_max / doppler_bins
    around its frequency; its power goes to the bins of the axis in proportion to
    the overlap. The interval at the edge folds to the other end, as the radar's
    own spectrum does. Columns add up to 1 where the axis covers ±v_max, so power
    is conserved.

    The weights have the shape (axis.bins, doppler_bins).
    """
    v_max = config.v_max_mps
    width = 2.0 * v_max / doppler_bins
    centre = -np.fft.fftfreq(doppler_bins, 1.0 / doppler_bins) * width
    edges = axis.edges_mps
    weights = np.zeros((axis.bins, doppler_bins))
    for turn in (-2.0 * v_max, 0.0, 2.0 * v_max):
        low = np.maximum(centre + turn - 0.5 * width, -v_max)
        high = np.minimum(centre + turn + 0.5 * width, v_max)
        overlap = np.minimum(edges[1:, None], high) - np.maximum(edges[:-1, None], low)
        weights += np.maximum(overlap, 0.0) / width
    return weights


def _axis(
    config: RadarConfig, axis: VelocityAxis | None, bins: int | None, v_max_mps: float | None
) -> VelocityAxis:
    if axis is None:
        return VelocityAxis(
            config.chirps_per_frame if bins is None else bins,
            config.v_max_mps if v_max_mps is None else v_max_mps,
        )
    if bins is not None or v_max_mps is not None:
        raise Sd2Error("Both an axis and bins or v_max_mps are given", "one of the two")
    return axis


def _unseen(config: RadarConfig, axis: VelocityAxis) -> tuple[int, ...]:
    nearest = np.abs(axis.centres_mps) - 0.5 * axis.bin_width_mps
    beyond = nearest >= config.v_max_mps * (1 - 1e-9)
    return tuple(int(index) for index in np.flatnonzero(beyond))


def _without_person(capture: RadarCapture) -> list[str]:
    if capture.present is None:
        return []
    share = gaps_in_words(
        runs(~capture.present), capture.timebase.times_s, capture.config.frame_repetition_s
    )
    return [f"Without a person: {share}. Nothing of one echoes there."]


def _notes(
    config: RadarConfig, axis: VelocityAxis, unseen: tuple[int, ...], beyond: float, clipped: float
) -> list[str]:
    notes = []
    if axis.v_max_mps > config.v_max_mps * (1 + 1e-9):
        notes.append(
            f"The axis reaches ±{axis.v_max_mps:g} m/s, this radar only"
            f" ±{config.v_max_mps:.3g} m/s: {len(unseen)} of {axis.bins} bins are unseen, and"
            " faster motion folds back."
        )
    elif beyond > 0.001:
        notes.append(f"{beyond:.1%} of the power lies beyond ±{axis.v_max_mps:g} m/s.")
    if axis.bin_width_mps < config.velocity_resolution_mps * (1 - 1e-9):
        notes.append(
            f"Bins are {axis.bin_width_mps:.3g} m/s wide, the radar resolves"
            f" {config.velocity_resolution_mps:.3g} m/s."
        )
    if clipped > 1e-4:
        notes.append(f"{clipped:.2%} of the samples are clipped by the converter.")
    return notes
