"""Raw samples of a moving mesh by facets, NUFFT and threads, for any mesh and sensor.

The bundled sample keeps its own, simpler path (:mod:`sd2core.fmcw.signal`), whose
bytes must not change. Source of every formula: :class:`WaveOptions`.
"""

from __future__ import annotations

import threading
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sd2core
from sd2core.compiled import workers
from sd2core.fmcw.options import WaveOptions
from sd2core.fmcw.signal import SignalOptions, check_converter, digitise, finite_or_none
from sd2core.fmcw.wave import WaveScene
from sd2core.io.radar.capture import RadarCapture
from sd2core.mesh import MeshSequence
from sd2core.progress import Cancelled, Progress, silent
from sd2core.sensor import RadarConfig, VirtualSensor
from sd2core.timebase import Timebase

_POLL_S = 0.03


def simulate_radar(
    mesh: MeshSequence,
    config: RadarConfig,
    *,
    sensor: VirtualSensor | None = None,
    visibility: NDArray[np.bool_] | Literal["facing"] = "facing",
    wave: WaveOptions | None = None,
    options: SignalOptions | None = None,
    progress: Progress = silent,
) -> RadarCapture:
    """Raw samples that a radar would record of a moving mesh.

    Parameters
    ----------
    mesh : MeshSequence
        With faces.
    config : RadarConfig
    sensor : VirtualSensor
        At the camera by default.
    visibility : bool array, shape (T, F), or "facing"
        Per mesh frame, the facets that nothing hides from the sensor;
        ``facing`` takes all whose normal points towards it.
    wave : WaveOptions
        Model of the sum, surface, motion, antennas, ground.
    options : SignalOptions
        Noise, static reflectors, converter, seed.
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
    times_s = scene.scene.frame_times_s()
    signal = _frames(scene, times_s, progress)
    power = float(np.mean(np.square(signal)))
    signal += scene.static(options.reflectors)
    samples, levels = digitise(signal, power, config, options)
    progress(len(times_s), len(times_s))
    return RadarCapture(
        samples=samples,
        config=config,
        timebase=Timebase(times_s - times_s[0]),
        simulated=True,
        source=f"simulated from {mesh.source or 'a mesh'}",
        meta={
            "simulation": {
                "model": "FMCW beat signal of facets",
                # The name only: the folder says nothing on another machine.
                "source": Path(mesh.source).name,
                "sensor": asdict(sensor),
                "visibility": "facing" if isinstance(visibility, str) else "exact",
                "wave": asdict(wave),
                "options": asdict(options) | {"snr_db": finite_or_none(options.snr_db)},
                "first_frame_s": float(times_s[0]),
                "frame_time": "middle of the burst of chirps",
                **levels,
                "version": sd2core.__version__,
            }
        },
    )


def _frames(
    scene: WaveScene, times_s: NDArray[np.float64], progress: Progress
) -> NDArray[np.float64]:
    """Beat signals of all frames, each on a thread of its own, (T, receivers, chirps, samples)."""
    config, frames = scene.config, len(times_s)
    shape = (config.receivers, config.chirps_per_frame, config.samples_per_chirp)
    signal = np.empty((frames, *shape))
    stopped = threading.Event()

    def go_on() -> None:
        if stopped.is_set():
            raise Cancelled

    def fill(frame: int) -> None:
        go_on()
        signal[frame] = scene.frame(float(times_s[frame]), go_on)

    progress(0, frames)
    pending: set[Future[None]] = {workers().submit(fill, frame) for frame in range(frames)}
    running = set(pending)
    try:
        while running:
            ended, running = wait(running, _POLL_S, FIRST_COMPLETED)
            for future in ended:
                future.result()
            progress(frames - len(running), frames)
    except BaseException:
        stopped.set()
        for future in pending:
            future.cancel()
        wait(pending)
        raise
    return signal
