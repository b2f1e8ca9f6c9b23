"""Radars: Doppler maps and raw samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.plausibility.clock import judge_clock
from sd2core.plausibility.findings import Finding

_LOST_SHARE = 0.01
_ENDS_SHARE = 0.01
_FULL_RMS = 0.45
"""Noise that fills the range evenly has 0.58 of full scale, a signal that just fits less."""
_FEWEST_SAMPLES = 4


def judge_map(
    values: NDArray[np.floating],
    times_s: NDArray[np.float64],
    there: NDArray[np.bool_] | None = None,
    *,
    measured: bool = True,
) -> list[Finding]:
    """Findings on a Doppler map.

    Parameters
    ----------
    values : float array, shape (bins, frames)
    times_s : float64 array, shape (frames,)
    there : bool array, shape (frames,), optional
        False where there is nobody by the map's own word.
    measured : bool
        True for a radar's map: noise fills each of its frames, which a computed one may lack.
    """
    findings = judge_clock(times_s, there)
    empty = ~values.any(axis=0)
    if there is not None:
        empty &= there
    count = int(empty.sum())
    if count == values.shape[1]:
        findings.append(
            Finding(
                "Every value of the map is zero",
                "something that moves",
                "Nobody moves, or faster than the velocity axis reaches"
                if not measured
                else "The recording holds no signal, or its processing went wrong",
            )
        )
    elif measured and count > _LOST_SHARE * values.shape[1]:
        findings.append(_empty_frames(count, values.shape[1], "zeros"))
    return findings


def judge_samples(
    samples: NDArray[np.generic], frames: int, *, converter_bits: int | None = None
) -> list[Finding]:
    """Findings on some frames of raw samples.

    Parameters
    ----------
    samples : array, shape (n, channels, chirps, samples)
        Unsigned counts around mid-scale, or real or complex numbers relative to full scale.
    frames : int
        Frames of the whole capture, of which these are some.
    converter_bits : int, optional
        None where full scale is not known.
    """
    if samples.shape[2] * samples.shape[3] < _FEWEST_SAMPLES:
        return []
    by_chirp = samples.shape[3] >= _FEWEST_SAMPLES
    first = samples[..., :1] if by_chirp else samples[:, :, :1, :1]
    same = samples == first
    flat = same.all(axis=3) if by_chirp else same.all(axis=(2, 3))[..., None]  # (n, channels, m)
    if flat.all():
        return [
            Finding(
                f"Nothing changes within any of {len(samples):,} frames that were looked at: all"
                f" samples of the first are {samples.flat[0]}",
                "samples of a radar",
                "The radar did not send, its data did not arrive, or this is no capture",
            )
        ]
    silent = np.flatnonzero(flat.all(axis=(0, 2)))
    findings = []
    if silent.size:
        numbers = ", ".join(str(number + 1) for number in silent)
        findings.append(
            Finding(
                f"Nothing changes in channel {numbers} of {samples.shape[1]}",
                "a signal in every channel",
                "A receiver is switched off, or a lane is missing or described wrongly: choose"
                " another with --receiver",
            )
        )
    heard = np.setdiff1d(np.arange(samples.shape[1]), silent)
    lost = float(flat[:, heard].mean())
    if lost > _LOST_SHARE:
        looked_at = "" if len(samples) == frames else f" of {len(samples):,} frames looked at"
        findings.append(
            Finding(
                f"{lost:.1%} of the chirps{looked_at} hold one value throughout",
                "samples in every chirp",
                "Packets were probably lost on the way, and zeros stand for them",
            )
        )
    arrived = ~np.broadcast_to(flat, same.shape[:3])
    return findings + _judge_range(samples[arrived], converter_bits)


def _judge_range(samples: NDArray[np.generic], converter_bits: int | None) -> list[Finding]:
    """Findings on how samples fill the converter's range."""
    if converter_bits is None:
        return []
    half = 2.0 ** (converter_bits - 1)
    parts = np.stack([samples.real, samples.imag]) if np.iscomplexobj(samples) else samples
    level = parts.astype(np.float64)
    if samples.dtype.kind == "u":
        level = level / half - 1.0
    ends = float((np.abs(level) >= 1.0 - 1.5 / half).mean())
    rms = float(np.sqrt(np.mean(np.square(level - level.mean()))))
    if ends > _ENDS_SHARE:
        return [
            Finding(
                f"{ends:.1%} of the samples are at the ends of the converter's range",
                f"less than {_ENDS_SHARE:.0%}",
                "The receiver is overdriven: lower its gain, or move it from what is near",
            )
        ]
    if rms > _FULL_RMS:
        return [
            Finding(
                f"The samples fill the converter's range evenly ({rms:.0%} of full scale on"
                " average)",
                f"less than {_FULL_RMS:.0%}",
                "Bytes are probably in another order, or the file is described wrongly",
            )
        ]
    return []


def _empty_frames(count: int, frames: int, of: str) -> Finding:
    return Finding(
        f"{count:,} of {frames:,} frames ({count / frames:.0%}) hold nothing but {of}",
        "noise at least, in every frame",
        "Frames were probably lost while the radar was recorded",
    )
