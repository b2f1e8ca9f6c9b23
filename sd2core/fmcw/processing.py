"""From raw FMCW samples, measured or simulated, to Doppler maps.

Steps per frame: mean of every chirp removed, static clutter removed, range FFT,
Doppler FFT, power summed over range gates and receivers, brought onto the
velocity axis. After M. A. Richards, *Fundamentals of Radar Signal Processing*,
and F. J. Harris, "On the use of windows" (Proc. IEEE 66, 1978).

**Sign.** For a beat signal cos(2 pi (f_c tau + S tau t)) the phase grows with the
delay tau, so a forward FFT over the chirps gives a receding target a positive
frequency. Maps turn this round: positive is approaching.

**Unit.** A power of 1 is that of a sine over the converter's full range; windows
are divided out. Summed over all bins, gates and both halves of the spectrum it
is the mean square of the samples (Parseval), and rebinning keeps it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
import scipy.fft
from numpy.typing import NDArray

import sd2core
from sd2core.errors import Sd2Error
from sd2core.io.radar.capture import RadarCapture
from sd2core.progress import Progress, silent
from sd2core.sensor import RadarConfig, VelocityAxis
from sd2core.spectrum import DopplerMap

Clutter = Literal["none", "mean", "moving"]
"""none; mean: each frame's mean over its chirps; moving: that mean averaged over frames."""

Window = Literal["hann", "blackman", "none"]

UNIT = "power (1 = full-scale sine)"

_COSINES: dict[str, tuple[float, ...]] = {
    "hann": (0.5, 0.5),
    "blackman": (0.42, 0.5, 0.08),
    "none": (1.0,),
}
_ZERO_PADDING = 4
_BLOCK_BYTES = 4_000_000
"""Small enough that progress is reported, and a cancel obeyed, every few ms."""


@dataclass(frozen=True)
class ProcessingOptions:
    """How raw samples become power over range and velocity.

    Parameters
    ----------
    clutter : {"none", "mean", "moving"}
        What to subtract as static. ``mean`` takes each frame's mean over its
        chirps, which also removes what moves slower than about one Doppler
        bin; ``moving`` takes that mean averaged over ``clutter_window_s``,
        which keeps a slow mover.
    clutter_window_s : float
        Length of the centred average of ``moving``; shorter at the ends.
    range_m : (float, float) or None
        Gates whose cell overlaps this stretch count; None takes all. Gates
        within the window's main lobe around zero range (0 and 1 for Hann) hold
        the transmitter's own leakage and never count, nor does the gate at
        R_max, where beat frequencies fold.
    window : {"hann", "blackman", "none"}
        For both FFTs.
    """

    clutter: Clutter = "none"
    clutter_window_s: float = 2.0
    range_m: tuple[float, float] | None = None
    window: Window = "hann"

    def __post_init__(self) -> None:
        for name, choices in (("clutter", get_args(Clutter)), ("window", get_args(Window))):
            if getattr(self, name) not in choices:
                raise Sd2Error(f"{name} is {getattr(self, name)!r}", f"one of {', '.join(choices)}")
        if not self.clutter_window_s > 0:
            raise Sd2Error(f"clutter_window_s is {self.clutter_window_s}", "a positive time")
        if self.range_m is not None and not 0 <= self.range_m[0] < self.range_m[1]:
            raise Sd2Error(f"range_m is {self.range_m}", "two ranges in metres, the nearer first")


@dataclass(frozen=True, eq=False)
class RangeDoppler:
    """Power of one frame over range and velocity, summed over receivers.

    Parameters
    ----------
    values : float32 array, shape (gates, bins)
        Velocity ascending, positive when approaching.
    range_m : float64 array, shape (gates,)
        Centre of every gate.
    axis : VelocityAxis
    time_s : float
    """

    values: NDArray[np.float32]
    range_m: NDArray[np.float64]
    axis: VelocityAxis
    time_s: float

    @property
    def range_profile(self) -> NDArray[np.float32]:
        """Power per gate, shape (gates,)."""
        profile: NDArray[np.float32] = self.values.sum(axis=1)
        return profile


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
    capture : RadarCapture
    axis : VelocityAxis or None
        Where to show the power. None takes ``bins`` and ``v_max_mps``, and for
        each of these that is None the radar's own: one bin per chirp, v_max.
    bins, v_max_mps
        Short for ``axis=VelocityAxis(bins, v_max_mps)``.
    clutter, clutter_window_s, range_m, window
        See :class:`ProcessingOptions`.
    progress : Progress

    Returns
    -------
    DopplerMap
        Of kind ``real`` or ``simulated``. Bins wholly beyond the radar's v_max
        are ``unseen_bins`` and zero. What lies beyond a narrower axis is left
        out; ``meta["beyond_share"]`` says how much, ``meta["notes"]`` what else
        to know.

    Raises
    ------
    Sd2Error
        For options that do not fit this radar.
    """
    options = ProcessingOptions(clutter, clutter_window_s, range_m, window)
    config = capture.config
    axis = _axis(config, axis, bins, v_max_mps)
    chain = _Chain(capture, options)
    weights = rebinning(config, axis, chain.doppler_bins).astype(np.float32)  # (bins, doppler)
    values = np.empty((axis.bins, capture.frame_count), dtype=np.float32)
    inside = everything = 0.0
    progress(0, capture.frame_count)
    for start, stop in chain.blocks():
        power = chain.doppler_power(start, stop)  # (n, doppler)
        values[:, start:stop] = weights @ power.T
        inside += float(values[:, start:stop].sum(dtype=np.float64))
        everything += float(power.sum(dtype=np.float64))
        progress(stop, capture.frame_count)
    beyond = max(0.0, 1.0 - inside / everything) if everything > 0 else 0.0
    unseen = _unseen(config, axis)
    return DopplerMap(
        values=values,
        axis=axis,
        timebase=capture.timebase,
        kind="simulated" if capture.simulated else "real",
        unit=UNIT,
        unseen_bins=unseen,
        meta={
            "source": capture.source,
            "simulated": capture.simulated,
            "radar": {**asdict(config), **limits(config)},
            "options": asdict(options),
            "range_gates_m": [float(value) for value in chain.range_m],
            "beyond_share": beyond,
            "notes": [*capture.notes, *_notes(config, axis, unseen, beyond, chain.clipped_share)],
            "version": sd2core.__version__,
        },
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
    axis = _axis(capture.config, axis, None, None)
    chain = _Chain(capture, ProcessingOptions(clutter, clutter_window_s, range_m, window))
    weights = rebinning(capture.config, axis, chain.doppler_bins).astype(np.float32)
    power = chain.cell_power(frame)  # (doppler, gates)
    return RangeDoppler((weights @ power).T, chain.range_m, axis, capture.timebase.time_of(frame))


def limits(config: RadarConfig) -> dict[str, float]:
    """What a radar can see, for provenance and read-outs."""
    return {
        "wavelength_m": config.wavelength_m,
        "v_max_mps": config.v_max_mps,
        "velocity_resolution_mps": config.velocity_resolution_mps,
        "range_resolution_m": config.range_resolution_m,
        "range_max_m": config.range_max_m,
    }


def rebinning(config: RadarConfig, axis: VelocityAxis, doppler_bins: int) -> NDArray[np.float64]:
    """Weights that bring FFT bins (in FFT order) onto a velocity axis.

    The Doppler FFT is zero-padded, so that power is known several times per
    native bin. Each of its bins is an interval of width 2 v_max / doppler_bins
    around its frequency; its power goes to the bins of the axis in proportion to
    the overlap. The interval at the edge folds to the other end, as the radar's
    own spectrum does. Columns add up to 1 where the axis covers ±v_max, so power
    is conserved.

    Returns
    -------
    float64 array, shape (axis.bins, doppler_bins)
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


def taper(window: Window, length: int) -> NDArray[np.float32]:
    """Cosine window sampled at half steps: symmetric, and without zeros at its ends."""
    phase = 2.0 * np.pi * (np.arange(length) + 0.5) / length
    terms = (
        (-1) ** order * weight * np.cos(order * phase)
        for order, weight in enumerate(_COSINES[window])
    )
    return np.sum(list(terms), axis=0).astype(np.float32)


class _Chain:
    """Everything of one capture and one set of options that frames have in common."""

    def __init__(self, capture: RadarCapture, options: ProcessingOptions) -> None:
        config = capture.config
        self.capture = capture
        self.options = options
        self.doppler_bins = _ZERO_PADDING * config.chirps_per_frame
        self.gates = _gates(config, options)
        self.range_m = np.arange(self.gates.start, self.gates.stop) * config.range_resolution_m
        fast = taper(options.window, config.samples_per_chirp).astype(np.float64)
        slow = taper(options.window, config.chirps_per_frame).astype(np.float64)
        # One-sided spectrum (2), sine power 1/2 (2), window energies, zero padding.
        norm = 4.0 / (
            config.samples_per_chirp
            * config.chirps_per_frame
            * (fast**2).sum()
            * (slow**2).sum()
            * _ZERO_PADDING
        )
        self._fast = fast.astype(np.float32)
        self._slow = (slow * np.sqrt(norm)).astype(np.float32)[:, None]
        self._clipped = 0
        self._read = 0

    @property
    def clipped_share(self) -> float:
        """Share of the samples processed so far that sit at the converter's ends."""
        return self._clipped / max(self._read, 1)

    @cached_property
    def _reach(self) -> int:
        """Frames to either side that the moving average needs."""
        if self.options.clutter != "moving":
            return 0
        frame_s = self.capture.config.frame_repetition_s
        return min(round(0.5 * self.options.clutter_window_s / frame_s), self.capture.frame_count)

    def blocks(self) -> Iterator[tuple[int, int]]:
        config = self.capture.config
        gates = len(self.range_m)
        per_frame = (
            8
            * config.receivers
            * max(self.doppler_bins * gates, config.chirps_per_frame * config.samples_per_chirp)
        )
        # A block reads its neighbourhood as well, so it may not be much shorter.
        size = max(1, _BLOCK_BYTES // per_frame, self._reach)
        frames = self.capture.frame_count
        for start in range(0, frames, size):
            yield start, min(start + size, frames)

    def doppler_power(self, start: int, stop: int) -> NDArray[np.float32]:
        """Power of frames [start, stop) summed over receivers and gates, (n, doppler)."""
        parts = self._spectra(start, stop).view(np.float32)  # real, imaginary, real …
        summed: NDArray[np.float32] = np.einsum("nrdk,nrdk->nd", parts, parts)
        return summed

    def cell_power(self, frame: int) -> NDArray[np.float32]:
        """Power of one frame summed over receivers, (doppler, gates)."""
        spectra = self._spectra(frame, frame + 1)[0]
        power: NDArray[np.float32] = (spectra.real**2 + spectra.imag**2).sum(axis=0)
        return power

    def _spectra(self, start: int, stop: int) -> NDArray[np.complex64]:
        """Spectra of frames [start, stop), (n, receivers, doppler, gates)."""
        signal = self._without_clutter(start, stop)  # (n, receivers, chirps, samples)
        signal *= self._fast
        profiles = scipy.fft.rfft(signal, axis=3)[..., self.gates] * self._slow
        spectra: NDArray[np.complex64] = scipy.fft.fft(profiles, n=self.doppler_bins, axis=2)
        return spectra

    def _without_clutter(self, start: int, stop: int) -> NDArray[np.float32]:
        signal = self.capture.read(start, stop)
        top = 1.0 - 2.0 ** (1 - self.capture.config.adc_bits)
        self._clipped += int(np.count_nonzero((signal <= -1.0) | (signal >= top)))
        self._read += signal.size
        signal -= signal.mean(axis=3, keepdims=True)
        if self.options.clutter == "none":
            return signal
        if self.options.clutter == "mean":
            signal -= signal.mean(axis=2, keepdims=True)
            return signal
        first = max(start - self._reach, 0)
        last = min(stop + self._reach, self.capture.frame_count)
        around = [self._mean_chirp(k, min(k + 64, last)) for k in range(first, last, 64)]
        # float64, or the running sum would lose the small samples of a long stretch.
        total = np.cumsum(np.concatenate(around), axis=0, dtype=np.float64)
        total = np.concatenate([np.zeros_like(total[:1]), total])  # (frames + 1, rx, samples)
        frames = np.arange(start, stop)
        low = np.maximum(frames - self._reach, 0) - first
        high = np.minimum(frames + self._reach + 1, self.capture.frame_count) - first
        mean = (total[high] - total[low]) / (high - low)[:, None, None]
        signal -= mean[:, :, None, :].astype(np.float32)
        return signal

    def _mean_chirp(self, start: int, stop: int) -> NDArray[np.float32]:
        signal = self.capture.read(start, stop)
        signal -= signal.mean(axis=3, keepdims=True)
        mean: NDArray[np.float32] = signal.mean(axis=2)  # (n, rx, samples)
        return mean


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


def _gates(config: RadarConfig, options: ProcessingOptions) -> slice:
    first = len(_COSINES[options.window])
    end = (config.samples_per_chirp + 1) // 2
    step_m = config.range_resolution_m
    if options.range_m is not None:
        # Gate k is the cell from (k - 1/2) to (k + 1/2) times the resolution.
        low, high = options.range_m
        first = max(first, int(np.floor(low / step_m + 0.5)))
        end = min(end, int(np.ceil(high / step_m + 0.5)))
    if first >= end:
        wanted = "" if options.range_m is None else f" from {low:g} m to {high:g} m"
        raise Sd2Error(
            f"No range gate is left{wanted}: {config.samples_per_chirp} samples per chirp give"
            f" gates every {step_m:.3g} m up to {config.range_max_m:.3g} m, and the nearest"
            f" {len(_COSINES[options.window])} hold the transmitter's own leakage",
            f"ranges between {len(_COSINES[options.window]) * step_m:.3g} m"
            f" and {config.range_max_m:.3g} m",
            "Choose other ranges, or window='none' for a radar with very few samples",
        )
    return slice(first, end)


def _unseen(config: RadarConfig, axis: VelocityAxis) -> tuple[int, ...]:
    nearest = np.abs(axis.centres_mps) - 0.5 * axis.bin_width_mps
    beyond = nearest >= config.v_max_mps * (1 - 1e-9)
    return tuple(int(index) for index in np.flatnonzero(beyond))


def _notes(
    config: RadarConfig,
    axis: VelocityAxis,
    unseen: tuple[int, ...],
    beyond: float,
    clipped: float,
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
