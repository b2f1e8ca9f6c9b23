"""Doppler maps; raw samples are judged in :mod:`sd2core.io.radar.judging`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.plausibility.clock import judge_clock

_LOST_SHARE = 0.01


def judge_map(
    values: NDArray[np.floating],
    times_s: NDArray[np.float64],
    present: NDArray[np.bool_] | None = None,
    *,
    measured: bool = True,
) -> list[Sd2Error]:
    """Findings on a Doppler map.

    Parameters
    ----------
    values : float array, shape (bins, frames)
    times_s : float64 array, shape (frames,)
    present : bool array, shape (frames,), optional
        False where there is nobody by the map's own word.
    measured : bool
        True for a radar's map: noise fills each of its frames, which a computed one may lack.
    """
    findings = judge_clock(times_s, present)
    empty = ~values.any(axis=0)
    if present is not None:
        empty &= present
    count = int(empty.sum())
    if count == values.shape[1]:
        findings.append(
            Sd2Error(
                "The map holds nothing but zeros",
                "something that moves",
                "The recording holds no signal, or its processing went wrong"
                if measured
                else "Nobody moves, or all is too far away, too fast or in emptied bins"
                if count > 1
                else "One frame alone has no velocity",
            )
        )
    elif measured and count > _LOST_SHARE * values.shape[1]:
        findings.append(
            Sd2Error(
                f"{count:,} of {values.shape[1]:,} frames ({count / values.shape[1]:.0%}) hold"
                " nothing but zeros",
                "noise at least, in every frame",
                "Frames were probably lost while the radar was recorded",
            )
        )
    return findings
