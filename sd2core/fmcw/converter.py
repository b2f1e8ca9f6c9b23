"""Analogue-to-digital converter of a simulated recording: gain, thermal noise, rounding."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.options import SignalOptions
from sd2core.io.radar.capture import RadarCapture
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from sd2core.version import __version__

_NOISE_WITHOUT_ECHO_COUNTS = 4.0


def store(shape: tuple[int, ...], dtype: DTypeLike, memory_bytes: int) -> NDArray[Any]:
    """Array in memory, or in a temporary file if it is larger than this."""
    if math.prod(shape) * np.dtype(dtype).itemsize <= memory_bytes:
        return np.empty(shape, dtype)
    with tempfile.TemporaryFile(prefix="sd2-radar-") as file:
        return np.memmap(file, dtype, "w+", shape=shape)


def digitise(
    signal: NDArray[Any],
    peak: float,
    power: float,
    config: RadarConfig,
    options: SignalOptions,
    samples: NDArray[Any],
    go_on: Callable[[], None] = lambda: None,
    first: int = 0,
) -> dict[str, float]:
    """Apply gain and thermal noise and round to converter counts around mid-scale.

    Parameters
    ----------
    signal : float32 or complex64 array, shape (frames, receivers, chirps, samples)
        Real, or I and Q.
    peak : float
        The signal's largest magnitude.
    power : float
        Mean square of the moving scene's part over the frames with a person; 0 without any.
    config : RadarConfig
        The converter's bits, and the bandwidth of a link's noise.
    options : SignalOptions
        What sets gain and noise, and the noise's seed.
    samples : array, shape of ``signal``
        Written: counts, or relative to half the range where the signal is complex, with I and Q
        rounded each.
    go_on : callable
        Called once per frame; may raise to stop.
    first : int
        Number of the first of these frames in the recording, which selects its noise.

    Returns
    -------
    dict
        For provenance: ``counts_per_unit``, ``noise_rms_counts`` and ``clipped_share``.
    """
    middle = 2 ** (config.adc_bits - 1)
    gain = options.peak_share * middle / peak if peak > 0 else 1.0
    if options.link is not None:
        gain = middle / options.link.full_scale_of(config)
        noise = gain * options.link.noise_rms(config)
    elif math.isinf(options.snr_db) and options.snr_db > 0:
        noise = 0.0
    elif power > 0:
        noise = gain * math.sqrt(power) * 10.0 ** (-options.snr_db / 20.0)
    else:
        noise = _NOISE_WITHOUT_ECHO_COUNTS
    is_complex = np.iscomplexobj(signal)
    if is_complex and options.link is None:
        noise /= math.sqrt(2.0)  # one part of two
    clipped = 0
    for frame, values in enumerate(signal):
        go_on()
        random = np.random.default_rng([options.seed, first + frame])
        parts = values.view(np.float32) if is_complex else values
        counts = np.rint(
            middle + gain * parts.astype(np.float64) + noise * random.standard_normal(parts.shape)
        )
        clipped += int(np.count_nonzero((counts < 0) | (counts > 2 * middle - 1)))
        counts = np.clip(counts, 0, 2 * middle - 1, out=counts)
        if is_complex:
            samples[frame] = ((counts - middle) / middle).astype(np.float32).view(np.complex64)
        else:
            samples[frame] = counts
    return {
        # Rounded, so that the last bits of a machine's arithmetic are not in the file.
        "counts_per_unit": float(f"{gain:.9g}"),
        "noise_rms_counts": float(f"{noise:.9g}"),
        "clipped_share": clipped / (samples.size * (2 if is_complex else 1)),
    }


def simulated_capture(
    samples: NDArray[Any],
    config: RadarConfig,
    times_s: NDArray[np.float64],
    source: str,
    *,
    sensor: VirtualSensor,
    options: SignalOptions,
    levels: dict[str, float],
    how: dict[str, Any] | None = None,
    nobody: Sequence[tuple[int, int]] = (),
) -> RadarCapture:
    """Capture of simulated samples, with the provenance of the simulation.

    Parameters
    ----------
    samples : array, shape (frames, receivers, chirps, samples)
        As :func:`digitise` wrote them.
    config : RadarConfig
    times_s : float64 array, shape (frames,)
        Middles of the frames on the scene's clock; the capture's own begins at 0.
    source : str
        File of the scene; empty if there is none.
    sensor : VirtualSensor
    options : SignalOptions
    levels : dict
        What :func:`digitise` returned.
    how : dict, optional
        Further entries about the simulation.
    nobody : sequence of (int, int)
        Half-open runs of frames in which nothing echoes because there is no person.
    """
    return RadarCapture(
        samples=samples,
        config=config,
        timebase=Timebase(np.asarray(times_s) - times_s[0]),
        simulated=True,
        source=f"simulated from {source or 'a scene'}",
        meta={
            "simulation": {
                "model": "FMCW beat signal of facets",
                # The name only: the folder says nothing on another machine.
                "source": Path(source).name,
                "sensor": sensor.as_dict(),
                **(how or {}),
                "options": _option_entries(options),
                "first_frame_s": float(times_s[0]),
                "frame_time": "middle of the burst of chirps",
                **levels,
                **({"without_person": [list(gap) for gap in nobody]} if nobody else {}),
                "version": __version__,
            }
        },
    )


def _option_entries(options: SignalOptions) -> dict[str, Any]:
    """Options for the provenance; JSON has no infinity."""
    entries = asdict(options)
    if options.link is None:
        del entries["link"]
        return entries | {"snr_db": options.snr_db if math.isfinite(options.snr_db) else None}
    del entries["snr_db"], entries["peak_share"]
    return entries


def check_converter(config: RadarConfig) -> None:
    """Raise Sd2Error for a radar that cannot be simulated, or a converter of over 16 bits."""
    if config.ranges_m or config.transmitters > 1:
        what = "forms range itself" if config.ranges_m else "has several transmitters"
        raise Sd2Error(
            f"{config.name} {what}, which is not simulated",
            "one transmitter, and samples of a beat signal",
        )
    if config.adc_bits > 16:
        raise Sd2Error(f"The converter has {config.adc_bits} bits", "16 or fewer")
