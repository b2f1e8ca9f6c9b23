"""Limit of a frame's signal when its facets are cut ever finer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.fmcw.chain import taper
from sd2core.fmcw.cutting import subdivided
from sd2core.fmcw.sums import direct
from sd2core.fmcw.wave import BeatSignal, GoOn, WaveScene

CONVERGED_L1 = 2e-3
"""A tenth of the error that is looked for, 0.02."""

_MAX_CUTS = 5
_FACETS_PER_STEP = 20_000
"""Some 40 ms, and memory that does not grow with the cutting."""


@dataclass(frozen=True, eq=False)
class Converged:
    """A frame's signal on facets cut until nothing changes."""

    signal: BeatSignal  # Signal of the finest cut, (receivers, chirps, samples).
    pieces: tuple[int, ...]  # Triangles per facet that were tried: 1, 4, 16 …
    # L1 of the change of :func:`doppler_marginal` from one to the next of these.
    changes: tuple[float, ...]


def converged_frame(
    scene: WaveScene,
    time_s: float,
    *,
    tolerance: float = CONVERGED_L1,
    most_cuts: int = _MAX_CUTS,
    go_on: GoOn | None = None,
) -> Converged:
    """Direct complex128 sum over facets, all edges halved until the Doppler marginal stays.

    Each piece has its own range, rate, amplitude and phase. What nothing hides
    stays what it is for the whole facet, and a path is as long as the scene's
    ``motion`` makes it, so that this is the limit of the same physics. A rough surface has
    one random phase per facet and is summed as it is.

    Parameters
    ----------
    scene : WaveScene
    time_s : float
        Middle of the frame.
    tolerance : float
        L1 between the last two marginals below which it has converged.
    most_cuts : int
        Halvings after which it stops, converged or not.
    go_on : callable, optional
        Called every few ten milliseconds; may raise to stop.
    """
    signal = _cut(scene, time_s, 0, go_on)
    pieces, changes = [1], list[float]()
    while scene.wave.coherent and len(changes) < most_cuts:
        finer = _cut(scene, time_s, len(pieces), go_on)
        changes.append(float(np.abs(doppler_marginal(finer) - doppler_marginal(signal)).sum()))
        pieces.append(4 * pieces[-1])
        signal = finer
        if changes[-1] <= tolerance:
            break
    return Converged(signal, tuple(pieces), tuple(changes))


def doppler_marginal(signal: BeatSignal) -> NDArray[np.float64]:
    """Share of a frame's power per Doppler bin, (chirps,), over all ranges and receivers.

    Hann windows in both directions, no clutter filter. The signal is (receivers, chirps, samples);
    the result is in FFT order and adds up to 1, or is 0 without any power.
    """
    _, chirps, samples = signal.shape
    peak = np.abs(signal).max()
    tapered = signal / (peak or 1.0) * taper("hann", chirps)[:, None] * taper("hann", samples)
    over_range = np.fft.fft if np.iscomplexobj(signal) else np.fft.rfft
    power = np.abs(np.fft.fft(over_range(tapered, axis=2), axis=1)) ** 2
    share: NDArray[np.float64] = power.sum(axis=(0, 2))
    return share / (share.sum() or 1.0)


def _cut(scene: WaveScene, time_s: float, cuts: int, go_on: GoOn | None) -> BeatSignal:
    """Beat signal with every facet in 4^cuts pieces, (receivers, chirps, samples)."""
    return np.sum([_cut_body(one, time_s, cuts, go_on) for one in scene.bodies], axis=0)


def _cut_body(scene: WaveScene, time_s: float, cuts: int, go_on: GoOn | None) -> BeatSignal:
    """That of one body alone."""
    if not scene.scene.is_present(time_s):
        return scene.silence()
    seen = scene.scene.seen(time_s)
    rows = []
    for (position, velocity), chirps in scene.bursts(time_s):
        total = scene.silence(chirps)
        for receiver in range(len(total)):
            for wall, visible in seen.items():
                if not cuts:
                    echoes = scene.echoes(position, velocity, visible, receiver, wall=wall)
                    total[receiver] += scene.sampled(direct(echoes, scene.config, chirps))
                    continue
                shown = scene.faces if visible is None else scene.faces[visible]
                step = max(1, _FACETS_PER_STEP // 4**cuts)
                for start in range(0, len(shown), step):
                    if go_on is not None:
                        go_on()
                    some = shown[start : start + step]
                    corners = subdivided(position[some], cuts).reshape(-1, 3)
                    motion = subdivided(velocity[some], cuts).reshape(-1, 3)
                    loose = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
                    echoes = scene.echoes(corners, motion, None, receiver, loose, wall)
                    total[receiver] += scene.sampled(direct(echoes, scene.config, chirps))
        rows.append(total)
    return np.concatenate(rows, axis=1)
