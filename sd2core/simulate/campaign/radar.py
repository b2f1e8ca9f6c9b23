"""The target of a campaign: what a simulated FMCW radar shows of the true motion.

A rough surface: every facet keeps a random phase, with the constant-gamma power of
:class:`~sd2core.fmcw.WaveOptions`. A single set of phases is one look, whose speckle moves
the peak of every eighth moving frame (decision 11); a radar averages over receivers and
frequencies, here over looks. Noise comes from a link budget, rounding from the converter's
bits at one fixed gain, and the samples go through the chain that real captures go through.
Then the mean power of noise is taken off and what does not rise above it is emptied, as a
radar's detection does with a recording of an empty room: or the peak of a frame without
motion would be anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from sd2core.body.rotations import Floats
from sd2core.fmcw.chain import FrameChain, ProcessingOptions
from sd2core.fmcw.link import LinkBudget
from sd2core.fmcw.options import Reflector
from sd2core.fmcw.processing import rebinning
from sd2core.fmcw.sums import turns_of
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import CLUTTER, PAPER_RADAR, RadarConfig
from sd2core.scattering.facets import visible_facets
from sd2core.sensor import VelocityAxis, VirtualSensor

REFERENCE_RANGE_M = 2.2
"""A map's value of 1 is the echo of 1 m² of rough surface seen square on at this range:
the range at which the paper's preset counts vertices fully."""

PROCESSING = ProcessingOptions(clutter=CLUTTER)

Samples = NDArray[np.float32] | NDArray[np.complex64]

_BLOCK_FRAMES = 16
_SMOOTH, _LOOKS = 0.25, (1, 2, 4, 8, 12)
_EMPTY_FRAMES, _EMPTY_ROOM = 128, 2026


@dataclass(frozen=True)
class TargetOptions:
    """Options of the simulated radar."""

    looks: int = 12  # Sets of random phases whose powers are averaged.
    # None for a receiver without noise and rounding.
    link: LinkBudget | None = field(default_factory=LinkBudget)
    # Least level of a cell over the noise's mean, in standard deviations of its power.
    above_noise: float = 5.0
    smooth: bool = False  # All of the body's surface reflects in phase, without random phases.

    def drawn(self, rng: np.random.Generator) -> TargetOptions:
        """Options of another radar: looks, surface, noise within 10 dB, and its threshold."""
        smooth = bool(rng.random() < _SMOOTH)
        looks = 1 if smooth else int(rng.choice(_LOOKS))
        noise_db, above = float(rng.uniform(-10.0, 10.0)), float(rng.uniform(3.0, 8.0))
        link = self.link
        if link is not None:
            link = replace(link, noise_figure_db=link.noise_figure_db + noise_db)
        return TargetOptions(looks, link, above, smooth)

    def provenance(self) -> dict[str, Any]:
        """Content for a campaign's provenance; once all surfaces were rough and nothing said so."""
        content = asdict(self)
        if not self.smooth:
            del content["smooth"]
        return content


def radar_at(frames_per_s: float, bins: int, radar: RadarConfig = PAPER_RADAR) -> RadarConfig:
    """A radar at another frame rate, with as many of its chirps as fit into a frame.

    The paper's has two chirps per bin of the map.
    """
    fitting = int((1.0 + 1e-9) / (frames_per_s * radar.chirp_repetition_s))
    chirps, name = min(radar.chirps_per_frame, fitting), radar.name
    if radar == PAPER_RADAR:
        chirps = min(2 * bins, fitting)
        name = f"60 GHz, {chirps} chirps, 32 samples, {frames_per_s:g} frames/s"
    return replace(radar, frame_repetition_s=1.0 / frames_per_s, chirps_per_frame=chirps, name=name)


# On several threads sums have other last digits, of which samples of a radar make whole steps.
@threadpool_limits.wrap(limits=1, user_api="blas")
def radar_target(
    mesh: MeshSequence,
    config: RadarConfig,
    sensor: VirtualSensor,
    axis: VelocityAxis,
    null_bins: Sequence[int],
    *,
    reflectors: tuple[Reflector, ...] = (),
    seed: Sequence[int] = (0,),
    options: TargetOptions | None = None,
) -> NDArray[np.float32]:
    """Doppler map of a moving mesh by a radar: power, (T, bins), see :data:`REFERENCE_RANGE_M`.

    Parameters
    ----------
    mesh : MeshSequence
        With faces; the radar's frames are at its times.
    config : RadarConfig
    sensor : VirtualSensor
    axis : VelocityAxis
    null_bins : sequence of int
        Emptied, as in the synthetic map.
    reflectors : tuple of Reflector
        Static clutter.
    seed : sequence of int
        Of phases and noise.
    options : TargetOptions, optional
    """
    options = options or TargetOptions()
    rng = np.random.default_rng(seed)
    scene = WaveScene(mesh, config, sensor)
    turns = [rng.random((options.looks, len(one.faces))) for one in scene.bodies]
    if options.smooth:
        turns = [np.zeros_like(one) for one in turns]
    phases = [np.exp(2j * np.pi * one).astype(np.complex64) for one in turns]
    static = scene.static(reflectors)[0]  # (chirps, samples)
    chain = FrameChain(config, PROCESSING)
    weights = rebinning(config, axis, chain.doppler_bins).astype(np.float32)
    unit = 0.25 * config.wavelength_m**2 / REFERENCE_RANGE_M**4
    values = np.empty((mesh.frame_count, axis.bins), np.float32)
    for start in range(0, mesh.frame_count, _BLOCK_FRAMES):
        stop = min(start + _BLOCK_FRAMES, mesh.frame_count)
        times_s = mesh.times_s[start:stop].tolist()
        signals = [_echoes(scene, time_s, phases) + static for time_s in times_s]
        samples, full_scale = _received(np.array(signals), config, options.link, rng)
        values[start:stop] = _power(samples, chain, weights) * (full_scale**2 / options.looks)
    if options.link is not None:
        mean, sd = _noise(config, options, chain, weights)
        risen = values > mean + options.above_noise * sd
        values = np.where(risen, values - mean, np.float32(0.0))
    values[:, list(null_bins)] = 0.0
    return values / np.float32(unit)


def _power(
    samples: Samples, chain: FrameChain, weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Power of samples (n, looks, chirps, samples), summed over looks, (n, bins)."""
    power = chain.power_over_doppler(chain.without_own_clutter(samples))
    return np.asarray(power @ weights.T)


def _noise(
    config: RadarConfig, options: TargetOptions, chain: FrameChain, weights: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean power of an empty room in each bin, and its standard deviation, (bins,) each."""
    rng = np.random.default_rng(_EMPTY_ROOM)
    shape = (_EMPTY_FRAMES, options.looks, config.chirps_per_frame, config.samples_per_chirp)
    samples, full_scale = _received(np.zeros(shape, np.float32), config, options.link, rng)
    power = _power(samples, chain, weights) * (full_scale**2 / options.looks)
    return power.mean(axis=0), power.std(axis=0)


def _echoes(scene: WaveScene, time_s: float, phases: list[NDArray[np.complex64]]) -> Samples:
    """Beat signals of everybody in the frame around a time, (looks, chirps, samples)."""
    signals: Any = np.zeros((len(phases[0]), 1, 1))
    for one, own in zip(scene.bodies, phases, strict=True):
        if len(phases) == 1 or one.scene.is_present(time_s):
            signals = signals + _looks(one, time_s, own)
    return cast("Samples", signals)


def _looks(scene: WaveScene, time_s: float, phases: NDArray[np.complex64]) -> Samples:
    """Beat signals of one body in the frame around a time, (looks, chirps, samples).

    The sum over facets is separable in chirps and samples when migration through range
    within a frame is left out (decision 11: 2e-3 of the signal), so it is a product of
    matrices, which for a few hundred facets and several looks is cheaper than a
    non-uniform FFT.
    """
    config, faces, antenna = scene.config, scene.faces, scene.paths[0][None][0][0]
    samples, alike = config.samples_per_chirp, np.ones(len(faces), np.complex128)
    bursts: list[Any] = []
    shown = scene.scene.visible(time_s)  # before things and others
    for (position, velocity), chirps in scene.bursts(time_s):
        visible = visible_facets(position, faces, scene.scene.sensor.position_m)
        visible &= True if shown is None else shown
        echoes, rows = scene.facets(position, velocity, faces, visible, antenna, antenna, alike)
        turns = turns_of(echoes, config)
        first = turns.start - 0.5 * (chirps - 1) * turns.chirp - 0.5 * samples * turns.sample
        slow = _phasors(turns.chirp, chirps, first) * echoes.terms[0]
        fast = _phasors(turns.sample, samples, np.zeros_like(first))
        # Phases go to the shorter of the two.
        right = phases[:, None, rows] * fast.astype(np.complex64)  # (looks, samples, facets)
        right = right.reshape(len(phases) * samples, len(rows))
        if config.sampling != "real":
            signal = slow.astype(np.complex64) @ right.T
        else:
            # Re(a b) is the product of conj(a) and b as pairs of real numbers.
            pairs = [
                np.ascontiguousarray(x).view(np.float32)
                for x in (slow.conj().astype(np.complex64), right)
            ]
            signal = pairs[0] @ pairs[1].T
        bursts.append(signal.reshape(chirps, len(phases), samples).transpose(1, 0, 2))
    return np.concatenate(bursts, axis=1)


def _phasors(turns: Floats, count: int, first: Floats) -> NDArray[np.complex128]:
    """exp(2 pi j (first + k turns)) for k below ``count``, (count, n)."""
    phasors = np.empty((count, len(turns)), np.complex128)
    phasors[0] = np.exp(2j * np.pi * (first - np.rint(first)))
    step = np.exp(2j * np.pi * turns)
    for k in range(1, count):
        np.multiply(phasors[k - 1], step, out=phasors[k])
    return phasors


def _received(
    signals: Samples, config: RadarConfig, link: LinkBudget | None, rng: np.random.Generator
) -> tuple[Samples, float]:
    """Samples relative to the converter's half range, with noise and rounded; that range."""
    kind: Any = np.float32 if config.sampling == "real" else np.complex64
    signals = signals.astype(kind)
    if link is None:
        return signals, 1.0
    parts = signals.view(np.float32)  # I and Q, where there are both
    noise = rng.standard_normal(parts.shape, np.float32) * np.float32(link.noise_rms(config))
    counts, full_scale = 2.0 ** (config.adc_bits - 1), link.full_scale_of(config)
    samples = (parts + noise) * np.float32(counts / full_scale)
    np.clip(np.rint(samples, out=samples), -counts, counts - 1.0, out=samples)
    return (samples / counts).astype(np.float32).view(kind), full_scale
