"""Power over range and Doppler from raw samples, block by block.

One capture and one set of options; rebinning onto a velocity axis is in
:mod:`sd2core.fmcw.processing`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.radar.capture import RadarCapture, Signal
from sd2core.mesh.presence import Presence
from sd2core.plausibility.clock import gaps_between
from sd2core.radar_config import Clutter, RadarConfig

Window = Literal["hann", "blackman", "none"]

_COSINES: dict[str, tuple[float, ...]] = {
    "hann": (0.5, 0.5),
    "blackman": (0.42, 0.5, 0.08),
    "none": (1.0,),
}
_ZERO_PADDING = 4
_DEGREE = 2  # of the polynomial that is fitted to the chirps
_BLOCK_BYTES = 4_000_000
"""Small enough that progress is reported, and a cancel obeyed, every few ms."""


@dataclass(frozen=True)
class ProcessingOptions:
    """Options of the processing of raw samples to power over range and velocity.

    Parameters
    ----------
    clutter : {"none", "mean", "regression", "moving"}
        Static part to subtract. ``mean`` takes each frame's mean over its
        chirps; a body that sways by 1 cm/s still leaks into the bins beside
        zero, 20 dB below its echo. ``regression`` takes the parabola that
        fits the chirps best (Torp 1997): 60 dB down at a tenth of a Doppler
        bin, 3 dB at 1.25 bins. ``moving`` takes the mean averaged over
        ``clutter_window_s``, never over a gap in time, which keeps a slow mover.
    clutter_window_s : float
        Length of the centred average of ``moving``; shorter at the ends.
    range_m : (float, float) or None
        Gates whose cell overlaps this stretch count; None takes all. Gates
        within the window's main lobe around zero range (0 and 1 for Hann) hold
        the transmitter's own leakage and never count, nor does the gate at
        R_max, where beat frequencies fold. Of samples that are distances those
        within count. A continuous wave has no ranges to choose.
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
        if not 0 < self.clutter_window_s < np.inf:
            raise Sd2Error(f"clutter_window_s is {self.clutter_window_s}", "a positive time")
        if self.range_m is not None and not 0 <= self.range_m[0] < self.range_m[1] < np.inf:
            raise Sd2Error(f"range_m is {self.range_m}", "two ranges in metres, the nearer first")


def taper(window: Window, length: int) -> NDArray[np.float32]:
    """Cosine window sampled at half steps: symmetric, and without zeros at its ends."""
    phase = 2.0 * np.pi * (np.arange(length) + 0.5) / length
    terms = (
        (-1) ** order * weight * np.cos(order * phase)
        for order, weight in enumerate(_COSINES[window])
    )
    return np.sum(list(terms), axis=0).astype(np.float32)


class FrameChain:
    """Processing of single frames for one radar and one set of options.

    ``range_m`` (gates,) are the centres of the gates that count, none for a continuous wave;
    ``doppler_bins`` is the length of the zero-padded Doppler FFT.
    """

    def __init__(self, config: RadarConfig, options: ProcessingOptions) -> None:
        self.config = config
        self.options = options
        self.doppler_bins = _ZERO_PADDING * config.chirps_per_frame
        self.gates: slice | NDArray[np.intp]
        slow = taper(options.window, config.chirps_per_frame).astype(np.float64)
        if config.has_beat:
            self.gates = _gates(config, options)
            self.range_m = np.arange(self.gates.start, self.gates.stop) * config.range_resolution_m
            fast = taper(options.window, config.samples_per_chirp).astype(np.float64)
            samples = config.samples_per_chirp
        else:
            self.gates, self.range_m = _points(config, options)
            fast, samples = np.ones(1), 1
        # One-sided spectrum (2) and sine power 1/2 (2), which are 1 for a phasor; window
        # energies, zero padding.
        norm = (4.0 if config.sampling == "real" else 1.0) / (
            samples * config.chirps_per_frame * (fast**2).sum() * (slow**2).sum() * _ZERO_PADDING
        )
        self._fast = fast.astype(np.float32)
        self._slow = (slow * np.sqrt(norm)).astype(np.float32)[:, None]

    def without_own_clutter(self, signal: Signal) -> Signal:
        """Frames without what a frame knows of clutter by itself, in place.

        That is the mean of every chirp, where it is no echo, and the courses of the option.
        """
        self._remove_offset(signal)
        if (courses := clutter_courses(self.options.clutter, signal.shape[2])) is not None:
            signal -= courses @ (courses.T @ signal)
        return signal

    def _remove_offset(self, signal: Signal) -> None:
        if self.config.has_beat:
            signal -= signal.mean(axis=3, keepdims=True)

    def spectra(self, signal: Signal) -> NDArray[np.complex64]:
        """Spectra (n, channels, doppler, gates) of frames (n, channels, chirps, samples).

        The signal, without clutter, is overwritten.
        """
        import scipy.fft

        if self.config.has_beat:
            signal *= self._fast
            transform = scipy.fft.fft if np.iscomplexobj(signal) else scipy.fft.rfft
            signal = transform(signal, axis=3)
        profiles = signal[..., self.gates] * self._slow
        return scipy.fft.fft(profiles, n=self.doppler_bins, axis=2)

    def power_over_doppler(self, signal: Signal) -> NDArray[np.float32]:
        """Power of :meth:`spectra` summed over channels and gates, (n, doppler)."""
        parts = self.spectra(signal).view(np.float32)  # real, imaginary, real …
        return np.einsum("nrdk,nrdk->nd", parts, parts)


class Chain(FrameChain):
    """Processing of the frames of one capture."""

    def __init__(self, capture: RadarCapture, options: ProcessingOptions) -> None:
        super().__init__(capture.config, options)
        self.capture = capture
        self._clipped = 0
        self._read = 0

    @property
    def clipped_share(self) -> float:
        """Share of the samples processed so far that sit at the converter's ends."""
        return self._clipped / max(self._read, 1)

    @cached_property
    def _reach(self) -> int:
        """Number of frames to either side that the moving average needs."""
        if self.options.clutter != "moving":
            return 0
        frame_s = self.capture.config.frame_repetition_s
        frames = min(self.options.clutter_window_s / frame_s, 2.0 * self.capture.frame_count)
        return round(0.5 * frames)

    @cached_property
    def _stretches(self) -> Presence:
        """Frames between gaps in time, over which what stands still may have been moved."""
        times_s = self.capture.timebase.times_s
        return Presence.of(None, len(times_s), gaps_between(times_s))

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Half-open runs of frames that fit into a few megabytes."""
        config = self.capture.config
        gates = max(len(self.range_m), 1)
        per_frame = (
            8
            * config.channels
            * max(self.doppler_bins * gates, config.chirps_per_frame * config.samples_per_chirp)
        )
        # A block reads its neighbourhood as well, so it may not be much shorter.
        size = max(1, _BLOCK_BYTES // per_frame, self._reach)
        frames = self.capture.frame_count
        for start in range(0, frames, size):
            yield start, min(start + size, frames)

    def doppler_power(self, start: int, stop: int) -> NDArray[np.float32]:
        """Power of frames [start, stop) summed over channels and gates, (n, doppler)."""
        return self.power_over_doppler(self._without_clutter(start, stop))

    def cell_power(self, frame: int) -> NDArray[np.float32]:
        """Power of one frame summed over channels, (doppler, gates)."""
        spectra = self.spectra(self._without_clutter(frame, frame + 1))[0]
        return (spectra.real**2 + spectra.imag**2).sum(axis=0)

    def _without_clutter(self, start: int, stop: int) -> Signal:
        signal = self.capture.read(start, stop)
        if self.capture.full_scale_known:
            top = 1.0 - 2.0 ** (1 - self.capture.config.adc_bits)
            parts = signal.view(np.float32)
            self._clipped += int(np.count_nonzero((parts <= -1.0) | (parts >= top)))
            self._read += parts.size
        if self.options.clutter != "moving":
            return self.without_own_clutter(signal)
        self._remove_offset(signal)
        first = max(start - self._reach, 0)
        last = min(stop + self._reach, self.capture.frame_count)
        around = [self._mean_chirp(k, min(k + 64, last)) for k in range(first, last, 64)]
        # Double precision, or the running sum would lose the small samples of a long stretch.
        chirps = np.concatenate(around)
        total = np.cumsum(chirps, axis=0, dtype=np.result_type(chirps, np.float64))
        total = np.concatenate([np.zeros_like(total[:1]), total])  # (frames + 1, rx, samples)
        frames = np.arange(start, stop)
        low = np.maximum(frames - self._reach, self._stretches.first[frames]) - first
        high = np.minimum(frames + self._reach, self._stretches.last[frames]) + 1 - first
        mean = (total[high] - total[low]) / (high - low)[:, None, None]
        signal -= mean[:, :, None, :].astype(signal.dtype)
        return signal

    def _mean_chirp(self, start: int, stop: int) -> Signal:
        signal = self.capture.read(start, stop)
        self._remove_offset(signal)
        return signal.mean(axis=2)  # (n, rx, samples)


@cache
def clutter_courses(clutter: Clutter, chirps: int) -> NDArray[np.float32] | None:
    """Courses over the chirps of a frame that a filter takes out, orthonormal (chirps, n).

    None for what no frame knows by itself.

    References
    ----------
    H. Torp, "Clutter rejection filters in color flow imaging: a theoretical approach",
    IEEE Transactions on Ultrasonics, Ferroelectrics, and Frequency Control 44(2), 1997,
    section on polynomial regression.
    """
    degrees = {"mean": 0, "regression": _DEGREE}
    if clutter not in degrees:
        return None
    degree = min(degrees[clutter], chirps - 1)
    powers = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, chirps), degree)
    return np.asarray(np.linalg.qr(powers)[0], dtype=np.float32)


def _gates(config: RadarConfig, options: ProcessingOptions) -> slice:
    first = len(_COSINES[options.window])
    # Of complex samples, the last gates are below zero range, within the main lobe.
    end = config.samples_per_chirp - first + 1
    if config.sampling != "complex":
        end = (config.samples_per_chirp + 1) // 2
    step_m = config.range_resolution_m
    if options.range_m is not None:
        # Gate k is the cell from (k - 1/2) to (k + 1/2) times the resolution.
        low, high = options.range_m
        first = max(first, int(np.floor(min(low / step_m, end) + 0.5)))
        end = int(min(end, np.ceil(high / step_m + 0.5)))
    if first >= end:
        wanted = "" if options.range_m is None else f" from {low:g} m to {high:g} m"
        raise Sd2Error(
            f"No range gate is left{wanted}: {config.samples_per_chirp} samples per chirp give"
            f" gates every {step_m:.3g} m up to {config.range_max_m:.3g} m, and the nearest"
            f" {len(_COSINES[options.window])} hold the transmitter's own leakage",
            f"ranges between {len(_COSINES[options.window]) * step_m:.3g} m"
            f" and {config.range_max_m:.3g} m",
            'Choose other ranges, or in Python window="none" for a radar with very few samples',
        )
    return slice(first, end)


def _points(
    config: RadarConfig, options: ProcessingOptions
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Samples that count of a radar without a beat frequency, and their distances if it has any."""
    places = np.array(config.ranges_m, dtype=np.float64)
    if options.range_m is None:
        return np.arange(config.samples_per_chirp), places
    low, high = options.range_m
    if config.is_continuous:
        raise Sd2Error(
            f"Ranges from {low:g} m to {high:g} m are asked of {config.name}, a continuous wave,"
            " which tells no ranges apart",
            "no limits of range",
        )
    chosen = np.flatnonzero((places >= low) & (places <= high))
    if not chosen.size:
        raise Sd2Error(
            f"No distance lies between {low:g} m and {high:g} m",
            f"ranges that hold some of the sensor's points, {places.min():.3g} m to"
            f" {places.max():.3g} m",
        )
    return chosen, places[chosen]
