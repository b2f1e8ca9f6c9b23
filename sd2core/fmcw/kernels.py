"""Compiled loops of the FMCW simulation: echoes of facets, and their direct sum."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.compiled import compiled

Floats = NDArray[np.float64]

# Must be plain numbers here: kernels read module constants when they are compiled.
_NEAREST_M = 0.05
_SERIES_BELOW_RAD = 1.0
_SERIES_TERMS = 16


@compiled
def _sinc(x: float) -> Any:
    """sin(x) / x."""
    if abs(x) < 1e-4:
        return 1.0 - x * x / 6.0
    return math.sin(x) / x


@compiled
def triangle_phasor(p: float, q: float, r: float) -> Any:
    """Mean of exp(j phase) over a triangle with these phases at its corners.

    Same formula as :func:`sd2core.fmcw.triangle.mean_phasor`.
    """
    low, high = min(p, q, r), max(p, q, r)
    mid = p + q + r - low - high
    middle = (p + q + r) / 3.0
    low, mid, high = low - middle, mid - middle, high - middle
    if high - low < _SERIES_BELOW_RAD:
        second = low * mid + mid * high + high * low
        third = low * mid * high
        before, last, now = 0.0, 0.0, 1.0
        real, imaginary, factor = 1.0, 0.0, 1.0
        for order in range(1, _SERIES_TERMS):
            factor /= order + 2
            before, last, now = last, now, third * before - second * last
            turn = order % 4
            if turn == 0:
                real += factor * now
            elif turn == 1:
                imaginary += factor * now
            elif turn == 2:
                real -= factor * now
            else:
                imaginary -= factor * now
    else:
        # 2j (first(low, mid) - first(mid, high)) / (high - low)
        one, two = 0.5 * (low + mid), 0.5 * (mid + high)
        a, b = _sinc(0.5 * (mid - low)), _sinc(0.5 * (high - mid))
        scale = 2.0 / (high - low)
        real = -scale * (a * math.sin(one) - b * math.sin(two))
        imaginary = scale * (a * math.cos(one) - b * math.cos(two))
    c, s = math.cos(middle), math.sin(middle)
    return real * c - imaginary * s, real * s + imaginary * c


@compiled
def facet_echoes(
    vertices_m: Floats,
    velocity_mps: Floats,
    faces: NDArray[np.int32],
    counts: NDArray[np.bool_],
    transmitter: Floats,
    receiver: Floats,
    plane: Floats,
    wave_number: float,
    pattern_exponent: float,
    coherent: bool,
    index: NDArray[np.int32],
    range_m: Floats,
    rate_mps: Floats,
    amplitude: NDArray[np.complex128],
) -> Any:
    """Echoes of the facets that face both antennas.

    Parameters
    ----------
    vertices_m, velocity_mps : (V, 3)
    faces : (F, 3)
    counts : (F,)
        Facets to look at.
    transmitter, receiver : (6,)
        Position and boresight.
    plane : (4,)
        Facets with plane[:3] . p + plane[3] <= 0 are behind a mirror.
    wave_number : float
        4 pi / lambda: phase per metre of range.
    index, range_m, rate_mps, amplitude : (F,)
        Results: number of the facet, half the path and how fast it grows, echo.

    Returns
    -------
    int
        How many facets were found.
    """
    same = True
    for k in range(3):
        same = same and transmitter[k] == receiver[k]
    found = 0
    out = np.empty(9)
    back = np.empty(9)
    for f in range(faces.shape[0]):
        if not counts[f]:
            continue
        for c in range(3):
            v = faces[f, c]
            for k in range(3):
                out[3 * c + k] = vertices_m[v, k] - transmitter[k]
                back[3 * c + k] = vertices_m[v, k] - receiver[k]
        ax, ay, az = out[3] - out[0], out[4] - out[1], out[5] - out[2]
        bx, by, bz = out[6] - out[0], out[7] - out[1], out[8] - out[2]
        # The normal's length is the area.
        nx, ny, nz = (
            0.5 * (ay * bz - az * by),
            0.5 * (az * bx - ax * bz),
            0.5 * (ax * by - ay * bx),
        )
        ox = (out[0] + out[3] + out[6]) / 3.0
        oy = (out[1] + out[4] + out[7]) / 3.0
        oz = (out[2] + out[5] + out[8]) / 3.0
        facing_out = -(nx * ox + ny * oy + nz * oz)
        if not facing_out > 0.0:
            continue
        tx = (back[0] + back[3] + back[6]) / 3.0
        ty = (back[1] + back[4] + back[7]) / 3.0
        tz = (back[2] + back[5] + back[8]) / 3.0
        facing_back = -(nx * tx + ny * ty + nz * tz)
        if not facing_back > 0.0:
            continue
        place_x, place_y, place_z = ox + transmitter[0], oy + transmitter[1], oz + transmitter[2]
        if plane[0] * place_x + plane[1] * place_y + plane[2] * place_z + plane[3] <= 0.0:
            continue
        there = math.sqrt(ox * ox + oy * oy + oz * oz)
        again = there if same else math.sqrt(tx * tx + ty * ty + tz * tz)
        near_there, near_again = max(there, _NEAREST_M), max(again, _NEAREST_M)
        # Mean of the two cosines: cos(theta) when both antennas are in one place.
        projected = 0.5 * (facing_out / near_there + facing_back / near_again)
        if coherent:
            strength = projected / (near_there * near_again)
        else:
            strength = math.sqrt(projected) * 2.0 * math.pi / wave_number
            strength /= near_there * near_again
        if pattern_exponent > 0.0:
            leaving = (ox * transmitter[3] + oy * transmitter[4] + oz * transmitter[5]) / near_there
            arriving = (tx * receiver[3] + ty * receiver[4] + tz * receiver[5]) / near_again
            if leaving <= 0.0 or arriving <= 0.0:
                continue
            strength *= (leaving * arriving) ** (0.5 * pattern_exponent)
        vx = vy = vz = 0.0
        for c in range(3):
            v = faces[f, c]
            vx += velocity_mps[v, 0] / 3.0
            vy += velocity_mps[v, 1] / 3.0
            vz += velocity_mps[v, 2] / 3.0
        rate_there = (vx * ox + vy * oy + vz * oz) / max(there, 1e-9)
        rate_again = (vx * tx + vy * ty + vz * tz) / max(again, 1e-9)
        half = 0.5 * (there + again)
        index[found] = f
        range_m[found] = half
        rate_mps[found] = 0.5 * (rate_there + rate_again)
        if coherent:
            p0 = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
            p1 = math.sqrt(out[3] ** 2 + out[4] ** 2 + out[5] ** 2)
            p2 = math.sqrt(out[6] ** 2 + out[7] ** 2 + out[8] ** 2)
            if not same:
                p0 = 0.5 * (p0 + math.sqrt(back[0] ** 2 + back[1] ** 2 + back[2] ** 2))
                p1 = 0.5 * (p1 + math.sqrt(back[3] ** 2 + back[4] ** 2 + back[5] ** 2))
                p2 = 0.5 * (p2 + math.sqrt(back[6] ** 2 + back[7] ** 2 + back[8] ** 2))
            p0, p1, p2 = (
                wave_number * (p0 - half),
                wave_number * (p1 - half),
                wave_number * (p2 - half),
            )
            # Distance is convex: see facet_scatterers for where 3/4 comes from.
            off = 0.25 * (p0 + p1 + p2)
            real, imaginary = triangle_phasor(p0 - off, p1 - off, p2 - off)
            amplitude[found] = complex(strength * real, strength * imaginary)
        else:
            amplitude[found] = complex(strength, 0.0)
        found += 1
    return found


@compiled
def direct_sum(
    start_turns: Floats,
    chirp_turns: Floats,
    sample_turns: Floats,
    migration_turns: Floats,
    amplitude: NDArray[np.complex128],
    start: int,
    stop: int,
    first_chirp: float,
    first_sample: float,
    total: NDArray[np.complex128],
) -> None:
    """Add scatterers [start, stop) to ``total`` (chirps, samples), every phase on its own.

    Turns at chirp m and sample n, both counted from the frame's middle, are
    start + m chirp + n sample + m n migration.
    """
    for k in range(start, stop):
        real, imaginary = amplitude[k].real, amplitude[k].imag
        for m in range(total.shape[0]):
            place = first_chirp + m
            base = start_turns[k] + place * chirp_turns[k]
            base -= math.floor(base)
            step = sample_turns[k] + place * migration_turns[k]
            for n in range(total.shape[1]):
                angle = 2.0 * math.pi * (base + (first_sample + n) * step)
                c, s = math.cos(angle), math.sin(angle)
                total[m, n] += complex(real * c - imaginary * s, real * s + imaginary * c)


def compile_kernels() -> None:
    """Call every kernel once with the types it is used with."""
    one = np.zeros(1)
    echo = np.zeros(1, np.complex128)
    corners = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]])
    facet_echoes(
        corners,
        np.zeros((3, 3)),
        np.array([[0, 1, 2]], np.int32),
        np.ones(1, np.bool_),
        np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        np.array([0.0, 0.0, 0.0, 1.0]),
        1.0,
        1.0,
        True,
        np.zeros(1, np.int32),
        one,
        one,
        echo,
    )
    direct_sum(one, one, one, one, echo, 0, 1, 0.0, 0.0, np.zeros((1, 1), np.complex128))
