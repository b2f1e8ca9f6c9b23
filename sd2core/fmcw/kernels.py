"""Compiled loops of the FMCW simulation: echoes of facets, and their direct sum."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.fmcw.facet import bent_facet_mean, unit_phasor
from sd2core.numerics.compiled import compiled
from sd2core.scattering.beam_kernels import gain_towards

Floats = NDArray[np.float64]

# Must be plain numbers here: kernels read module constants when they are compiled.
NEAREST_M = 0.05
"""The 1/R^2 of the far field is not continued to nearer than this."""
_STEADY_BELOW_RAD = 0.1
_TANGENT_BELOW_RAD = 0.7
_NODE = 0.7


@compiled
def _mean_at(phase: Floats, turn: Floats, weight: Floats, bend: Floats, time_s: float) -> Any:
    return bent_facet_mean(
        phase[0] + time_s * turn[0],
        phase[1] + time_s * turn[1],
        phase[2] + time_s * turn[2],
        weight[0],
        weight[1],
        weight[2],
        turn[0],
        turn[1],
        turn[2],
        bend[0],
        bend[1],
        bend[2],
    )


@compiled
def _turning(
    phase: Floats,
    turn: Floats,
    weight: Floats,
    bend: Floats,
    half_s: float,
    place: int,
    amplitude: NDArray[np.complex128],
) -> None:
    """Echo of a facet whose corners recede at different rates (docs/decisions/0011)."""
    now, change = _mean_at(phase, turn, weight, bend, 0.0)
    amplitude[0, place] = now
    if amplitude.shape[0] == 1:
        return
    amplitude[1, place] = amplitude[2, place] = 0.0
    parting = half_s * (max(turn[0], turn[1], turn[2]) - min(turn[0], turn[1], turn[2]))
    if parting < _STEADY_BELOW_RAD:
        return
    if parting < _TANGENT_BELOW_RAD:
        amplitude[1, place] = half_s * change
        return
    before, _ = _mean_at(phase, turn, weight, bend, -_NODE * half_s)
    after, _ = _mean_at(phase, turn, weight, bend, _NODE * half_s)
    amplitude[1, place] = (after - before) / (2.0 * _NODE)
    amplitude[2, place] = (0.5 * (after + before) - now) / (_NODE * _NODE)


@compiled
def _along(antenna: Floats, axis: int, x: float, y: float, z: float) -> Any:
    return x * antenna[axis, 0] + y * antenna[axis, 1] + z * antenna[axis, 2]


@compiled
def _gain(antenna: Floats, x: float, y: float, z: float, across: Any, up: Any) -> Any:
    return gain_towards(
        _along(antenna, 1, x, y, z),
        -_along(antenna, 2, x, y, z),
        _along(antenna, 3, x, y, z),
        across,
        up,
    )


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
    across: NDArray[np.float32],
    up: NDArray[np.float32],
    coherent: bool,
    half_s: float,
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
    transmitter, receiver : (4, 3)
        Position, and axes: right, down, ahead.
    plane : (4,)
        Facets with plane[:3] . p + plane[3] <= 0 are behind a mirror.
    wave_number : float
        4 pi / lambda: phase per metre of range.
    across, up
        Tables of the beam's two-way power, :class:`~sd2core.scattering.beam_kernels.BeamTables`.
    half_s : float
        Half the duration.
    index, range_m, rate_mps : (F,)
        Results: number of the facet, half the path and its rate of change.
    amplitude : (F,) per term
        Result: echo as a polynomial in time over ``half_s``; one term, or three
        for a facet that turns meanwhile.

    Returns
    -------
    int
        Number of facets found.
    """
    same = True
    for k in range(3):
        same = same and transmitter[0, k] == receiver[0, k]
    found = 0
    out, back, motion = np.empty(9), np.empty(9), np.empty(9)
    corner_m, phase, turn = np.empty(3), np.empty(3), np.empty(3)
    weight, bend = np.empty(3), np.empty(3)
    for f in range(faces.shape[0]):
        if not counts[f]:
            continue
        for c in range(3):
            v = faces[f, c]
            for k in range(3):
                out[3 * c + k] = vertices_m[v, k] - transmitter[0, k]
                back[3 * c + k] = vertices_m[v, k] - receiver[0, k]
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
        place_x, place_y, place_z = (
            ox + transmitter[0, 0],
            oy + transmitter[0, 1],
            oz + transmitter[0, 2],
        )
        if plane[0] * place_x + plane[1] * place_y + plane[2] * place_z + plane[3] <= 0.0:
            continue
        there = math.sqrt(ox * ox + oy * oy + oz * oz)
        again = there if same else math.sqrt(tx * tx + ty * ty + tz * tz)
        near_there, near_again = max(there, NEAREST_M), max(again, NEAREST_M)
        pattern = 1.0
        if pattern_exponent > 0.0:
            leaving = _along(transmitter, 3, ox, oy, oz) / near_there
            arriving = _along(receiver, 3, tx, ty, tz) / near_again
            if leaving <= 0.0 or arriving <= 0.0:
                continue
            pattern = (leaving * arriving) ** (0.5 * pattern_exponent)
        if across.shape[0] > 0:
            leaving = _gain(transmitter, ox, oy, oz, across, up)
            arriving = _gain(receiver, tx, ty, tz, across, up)
            # Each is the power of two passages.
            pattern *= (leaving * arriving) ** 0.25
        vx = vy = vz = 0.0
        for c in range(3):
            v = faces[f, c]
            for k in range(3):
                motion[3 * c + k] = velocity_mps[v, k]
            vx += velocity_mps[v, 0] / 3.0
            vy += velocity_mps[v, 1] / 3.0
            vz += velocity_mps[v, 2] / 3.0
        rate_there = (vx * ox + vy * oy + vz * oz) / max(there, 1e-9)
        rate_again = (vx * tx + vy * ty + vz * tz) / max(again, 1e-9)
        half = 0.5 * (there + again)
        rate = 0.5 * (rate_there + rate_again)
        index[found] = f
        range_m[found] = half
        rate_mps[found] = rate
        if coherent:
            for c in range(3):
                k = 3 * c
                x, y, z = out[k], out[k + 1], out[k + 2]
                far = math.sqrt(x * x + y * y + z * z)
                recede = x * motion[k] + y * motion[k + 1] + z * motion[k + 2]
                recede /= max(far, 1e-9)
                near = max(far, NEAREST_M)
                if same:
                    corner_m[c] = far
                    phase[c] = wave_number * (far - half)
                    turn[c] = wave_number * (recede - rate)
                    weight[c] = pattern * facing_out / (near * near * near)
                    continue
                x, y, z = back[k], back[k + 1], back[k + 2]
                far_back = math.sqrt(x * x + y * y + z * z)
                recede_back = x * motion[k] + y * motion[k + 1] + z * motion[k + 2]
                recede_back /= max(far_back, 1e-9)
                near_back = max(far_back, NEAREST_M)
                corner_m[c] = 0.5 * (far + far_back)
                phase[c] = wave_number * (corner_m[c] - half)
                turn[c] = wave_number * (0.5 * (recede + recede_back) - rate)
                # Mean of the two cosines: cos(theta) when both antennas are in one place.
                weight[c] = 0.5 * pattern / (near * near_back)
                weight[c] *= facing_out / near + facing_back / near_back
            for c in range(3):
                k, n = 3 * c, 3 * ((c + 1) % 3)
                edge = 0.0
                for i in range(3):
                    edge += (out[n + i] - out[k + i]) ** 2
                radial = corner_m[(c + 1) % 3] - corner_m[c]
                bend[c] = wave_number * 0.5 * (edge - radial * radial) / max(half, 1e-9)
            _turning(phase, turn, weight, bend, half_s, found, amplitude)
        else:
            projected = 0.5 * (facing_out / near_there + facing_back / near_again)
            strength = pattern * math.sqrt(projected) * 2.0 * math.pi / wave_number
            amplitude[0, found] = complex(strength / (near_there * near_again), 0.0)
        found += 1
    return found


@compiled
def direct_sum(
    start_turns: Floats,
    chirp_turns: Floats,
    sample_turns: Floats,
    migration_turns: Floats,
    amplitude: NDArray[np.complex128],
    first_chirp: float,
    first_sample: float,
    half_chirps: float,
    real_total: Floats,
    imaginary_total: Floats,
) -> None:
    """Add scatterers to the totals: one phasor per chirp, turned from sample to sample.

    Turns at chirp m and sample n, both counted from the frame's middle, are
    start + m chirp + n sample + m n migration. Rounding grows with the number of samples, to some
    1e-14 times it.

    Parameters
    ----------
    start_turns, chirp_turns, sample_turns, migration_turns : float64 array, shape (k,)
        See :class:`~sd2core.fmcw.sums.Turns`.
    amplitude : complex128 array, shape (terms, k)
        Polynomial in m over ``half_chirps``, the constant first.
    first_chirp, first_sample : float
        The first m and the first n.
    half_chirps : float
        Half the chirps of the radar's frame.
    real_total, imaginary_total : float64 array, shape (samples, chirps)
        Added to.
    """
    samples, chirps = real_total.shape
    terms = amplitude.shape[0]
    real, imaginary = np.empty(chirps), np.empty(chirps)
    cosine, sine = np.empty(chirps), np.empty(chirps)
    for k in range(start_turns.shape[0]):
        for m in range(chirps):
            place = first_chirp + m
            strength = amplitude[terms - 1, k]
            for term in range(terms - 2, -1, -1):
                strength = strength * (place / half_chirps) + amplitude[term, k]
            step = sample_turns[k] + place * migration_turns[k]
            base = start_turns[k] + place * chirp_turns[k] + first_sample * step
            angle = 2.0 * math.pi * (base - math.floor(base))
            phasor = strength * unit_phasor(angle)
            real[m], imaginary[m] = phasor.real, phasor.imag
            phasor = unit_phasor(2.0 * math.pi * (step - math.floor(step)))
            cosine[m], sine[m] = phasor.real, phasor.imag
        for n in range(samples):
            for m in range(chirps):
                x, y = real[m], imaginary[m]
                real_total[n, m] += x
                imaginary_total[n, m] += y
                real[m] = x * cosine[m] - y * sine[m]
                imaginary[m] = x * sine[m] + y * cosine[m]
