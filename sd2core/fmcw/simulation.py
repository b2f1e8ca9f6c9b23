"""Raw samples of a moving mesh by facets, NUFFT and threads, for any mesh and sensor.

A simpler path, which tests compare with, is ``tests/facet_signal.py``. Source of every
formula: :class:`WaveOptions`.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sd2core.fmcw.converter import check_converter, digitise, simulated_capture, store
from sd2core.fmcw.options import SignalOptions, WaveOptions
from sd2core.fmcw.scene import FacetsSeen, radar_times_s
from sd2core.fmcw.wave import BeatSignal, WaveScene
from sd2core.io.radar.capture import RadarCapture, Signal
from sd2core.mesh.presence import runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import await_kernels
from sd2core.numerics.parallel import Ticket, run_jobs
from sd2core.progress import Progress, silent
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VirtualSensor


def simulate_radar(
    mesh: MeshSequence,
    config: RadarConfig,
    *,
    sensor: VirtualSensor | None = None,
    visibility: FacetsSeen = "facing",
    frames: tuple[int, int] | None = None,
    wave: WaveOptions | None = None,
    options: SignalOptions | None = None,
    memory_bytes: int = 500_000_000,
    progress: Progress = silent,
) -> RadarCapture:
    """Simulate the raw samples of a radar from a moving mesh.

    Parameters
    ----------
    mesh : MeshSequence
        With faces. What stands around it hides facets, and echoes as static clutter; of a scene
        of several bodies the signal is the sum.
    sensor : VirtualSensor
        At the camera by default.
    visibility : bool array, shape (T, F), "facing" or "exact"
        Per mesh frame, the facets (of the first body) that nothing hides from the sensor;
        ``facing`` takes all whose normal points towards it, ``exact`` finds those that
        nothing hides as it goes.
    frames : (int, int), optional
        Only these radar frames, the last excluded. With a ``link`` they are those of the
        whole recording; otherwise gain and noise follow from them alone.
    wave : WaveOptions
        Model of the sum, surface, motion, antennas, ground.
    options : SignalOptions
        Noise, static reflectors, converter, seed.
    memory_bytes : int
        A longer signal, and samples that are more, lie in temporary files, which
        vanish with the result.
    progress : Progress
        Counts radar frames; called at least every 30 ms.

    Returns
    -------
    RadarCapture
        ``simulated``; frame k is at k times the frame repetition time after the
        mesh's first frame, the middle of its burst of chirps. The phase of a
        facet follows its range, so it runs on from frame to frame.

    Raises
    ------
    Sd2Error
        When options do not fit radar or mesh, or a vertex is not finite; it is named.
    """
    sensor, wave = sensor or VirtualSensor(), wave or WaveOptions()
    options = options or SignalOptions()
    check_converter(config)
    scene = WaveScene(mesh, config, sensor, visibility, wave, options.seed)
    start, stop = frames or (0, None)
    times_s = radar_times_s(mesh.timebase, config)[start:stop]
    count = len(times_s)
    shape = (count, config.receivers, config.chirps_per_frame, config.samples_per_chirp)
    # The gain is known when the last frame is. Single precision rounds the strongest sample
    # by a 2^9th of a count of 16 bits.
    real = config.sampling == "real"
    signal = store(shape, np.float32 if real else np.complex64, memory_bytes)
    present = np.array([scene.is_present(time_s) for time_s in times_s.tolist()])
    power, peak = _fill(scene, times_s, scene.static(options.reflectors), signal, progress)
    samples = store(shape, np.uint16 if real else np.complex64, memory_bytes)
    mean_power = float(power[present].mean()) if present.any() else 0.0
    levels = digitise(
        signal, peak, mean_power, config, options, samples, lambda: progress(count, count), start
    )
    progress(count, count)
    return simulated_capture(
        samples,
        config,
        times_s,
        mesh.source,
        sensor=sensor,
        options=options,
        levels=levels,
        how={
            "visibility": visibility if isinstance(visibility, str) else "exact",
            "wave": asdict(wave),
            **({} if mesh.surroundings is None else mesh.surroundings.as_dict()),
            **({"bodies": list(mesh.persons)} if mesh.others else {}),
        },
        nobody=runs(~present),
    )


def _fill(
    scene: WaveScene,
    times_s: NDArray[np.float64],
    static: BeatSignal,
    signal: Signal,
    progress: Progress,
) -> tuple[NDArray[np.float64], float]:
    """Fill in beat signals on worker threads; mean squares of what moves, and the peak."""
    frames = len(times_s)
    power, peak = np.empty(frames), np.empty(frames)

    def fill(frame: int, ticket: Ticket) -> None:
        ticket.advance(0)
        beat = scene.frame(float(times_s[frame]), lambda: ticket.advance(0))
        power[frame] = np.mean(np.square(np.abs(beat)))
        beat += static
        if (shadow := scene.shadow(float(times_s[frame]))) is not None:
            beat -= shadow
        peak[frame] = np.abs(beat).max()
        signal[frame] = beat
        ticket.advance(1)

    await_kernels(lambda: progress(0, frames))
    run_jobs([partial(fill, frame) for frame in range(frames)], frames, progress)
    return power, float(peak.max())
