"""Doppler columns of single frames, without simulating a whole clip."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.chain import FrameChain, ProcessingOptions
from sd2core.fmcw.options import WaveOptions
from sd2core.fmcw.processing import rebinning
from sd2core.fmcw.scene import FacetsSeen
from sd2core.fmcw.wave import BeatSignal, WaveScene
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.parallel import spread
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VelocityAxis, VirtualSensor


def frame_spectra(
    mesh: MeshSequence,
    config: RadarConfig,
    times_s: ArrayLike,
    *,
    sensor: VirtualSensor | None = None,
    visibility: FacetsSeen = "facing",
    wave: WaveOptions | None = None,
    axis: VelocityAxis | None = None,
    processing: ProcessingOptions | None = None,
    seed: int = 0,
    threads: Literal[1, "all"] = "all",
) -> NDArray[np.float32]:
    """Doppler columns of a moving mesh at some times.

    The columns of :func:`~sd2core.fmcw.doppler_map` on
    :func:`~sd2core.fmcw.simulate_radar`, up to one common gain, without noise, static
    reflectors and rounding.

    Parameters
    ----------
    mesh : MeshSequence
        With faces.
    times_s : array_like, shape (n,)
        Middles of the frames.
    sensor : VirtualSensor
        At the camera by default.
    visibility : bool array, shape (T, F), "facing" or "exact"
        Per mesh frame; only those nearest to the times are read. "exact" finds them.
    axis : VelocityAxis or None
        The 32 bins over ±2 m/s by default.
    processing : ProcessingOptions
        Clutter must not be ``moving``: a moving average needs the frames between.
    seed : int
        Seed of the random phases of a rough surface.
    threads : 1 or "all"
        1 stays in the calling thread.

    Returns
    -------
    float32 array, shape (bins, n)
        Power; only ratios mean anything.
    """
    times = np.asarray(times_s, dtype=np.float64)
    scene = WaveScene(mesh, config, sensor or VirtualSensor(), visibility, wave, seed)
    beats: Iterable[BeatSignal] = (map if threads == 1 else spread)(scene.frame, times.tolist())
    return signal_spectra(np.stack(list(beats)), config, axis=axis, processing=processing)


def signal_spectra(
    signal: BeatSignal,
    config: RadarConfig,
    *,
    axis: VelocityAxis | None = None,
    processing: ProcessingOptions | None = None,
) -> NDArray[np.float32]:
    """Doppler columns of beat signals (n, receivers, chirps, samples), (bins, n).

    Parameters are those of :func:`frame_spectra`; the signals may also come from
    :func:`~sd2core.fmcw.reference.converged_frame`.
    """
    options = processing or ProcessingOptions()
    if options.clutter == "moving":
        raise Sd2Error(
            "A moving average of the clutter is asked for single frames",
            "clutter 'none', 'mean' or 'regression', which a frame knows by itself",
            "Simulate the whole clip with simulate_radar",
        )
    chain = FrameChain(config, options)
    # Brought to 1, or far echoes would be lost below the smallest float32.
    single = np.complex64 if np.iscomplexobj(signal) else np.float32
    scaled = (signal / (np.abs(signal).max() or 1.0)).astype(single)
    power = chain.power_over_doppler(chain.without_own_clutter(scaled))
    weights = rebinning(config, axis or VelocityAxis(), chain.doppler_bins).astype(np.float32)
    return weights @ power.T
