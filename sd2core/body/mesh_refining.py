"""A mesh of another tool made smooth in time, as our own fit is (docs/decisions/0022).

Estimators look at one frame after the other, and what jitters between frames is false Doppler.
Every coordinate keeps to what was estimated within the jitter that is found in it, and its
acceleration may change as fast as it was found to do around each moment: limbs swing, they are not
thrown about. Nothing lags: all frames are solved at once. The body's middle is smoothed by itself,
because it moves more calmly than its limbs.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.parts import body_parts
from sd2core.body.rotations import Floats
from sd2core.body.solve import liveliness
from sd2core.errors import Sd2Error
from sd2core.mesh.made_vertices import MadeVertices
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.progress import Progress, silent

_MIN_FRAMES = 8
"""Frames of a stretch below which jitter cannot be told from motion."""
_MIN_JITTER_M = 1e-5
_LASTING = 1.3
"""Uncertainty over that of white jitter: what errs for several frames is not taken away. Chosen on
recorded motion (CMU subjects 1, 2, 5, 8, 49, 127) with the jitter of estimators."""
_FAR = 8.0
"""Distance, in standard deviations of the jitter, from where on a place counts less than half."""
_FIRST_HZ = 6.0
"""Limit of the motion that is looked for at first: less takes fast limbs for jitter, for good."""
_ROUNDS = 4
_LIVELY = 1.15
"""Standard deviation of a jerk over what was found around it, which jitter's removal lessened."""
_LEAST_MPS3 = 1.0
"""Limit at rest. These four were chosen on the same motion (tools.motion_capture)."""
_JERK_S = 1.0 / 30.0
"""Time for which a jerk lasts: seen more often, it is not another one each time."""
_QUICK = 3.0
"""Jitter over what was found before motion is known: where it turns it looks like a jump."""
_JUMP_FRAMES = 5
_GAUSSIAN = 0.6745  # median of the absolute value, over the standard deviation
_THIRD = 20.0**0.5  # standard deviation of a third difference of white noise of 1
_MARGIN_S = 5.0
"""Time around a part that is smoothed with it; what lies farther away changes nothing there."""
_PART_BYTES = 64 * 2**20
_COLUMNS = 2048
_SAMPLED = 24
"""Vertices of each limb by which its uncertainty is found."""


def refined(mesh: MeshSequence, progress: Progress = silent) -> MeshSequence:
    """The mesh made smooth in time, with what is uncertain in its velocities.

    Parameters
    ----------
    mesh : MeshSequence
        Of another tool; its vertices may stay on disk.
    progress : callable
        Called with frames while uncertainty is found; may raise ``Cancelled``.

    Returns
    -------
    MeshSequence
        Its vertices are computed where they are read, in order best.

    Raises
    ------
    Sd2Error
        If its uncertainty is known already: it is then smooth, too. If nobody is there for so many
        frames in a row that jitter can be told from motion.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> true = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(0, 40)
    >>> jitter_m = np.random.default_rng(0).normal(0, 0.005, (40, 1, 3))
    >>> smooth = refined(replace(true, vertices=true.read(0, 40) + jitter_m))
    >>> bool(np.abs(smooth.read(0, 40) - true.read(0, 40)).mean() < 0.002)
    True
    """
    if mesh.uncertainty is not None:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'} says how uncertain its velocities are",
            "a mesh that another tool made, frame by frame",
            "One of `sd2 fit` or `sd2 refine` is smooth already",
        )
    presence = mesh.presence
    lasts = np.where(presence.present, presence.last - presence.first + 1, 0)  # frames in a row
    if lasts.max() < _MIN_FRAMES:
        raise Sd2Error(
            f"In {mesh.source or 'the mesh'} the longest time that somebody is there, in frames, is"
            f" {lasts.max()}",
            f"{_MIN_FRAMES} or more in a row, in which jitter can be told from motion",
        )
    vertices = RefinedVertices(mesh)
    parts = body_parts(mesh)
    limbs = ("body",) if parts is None else parts.names
    which = np.zeros(mesh.vertex_count, np.uint8) if parts is None else parts.numbers
    sampled, taken_m = _Limbs(which, len(limbs)), 0.0
    along = np.zeros((mesh.frame_count, len(limbs)), np.float32)
    across = np.zeros_like(along)
    for start, stop in vertices.parts():
        progress(start, mesh.frame_count)
        smooth, removed, sigma = vertices.smooth(start, stop, sampled.columns)
        along[start:stop], across[start:stop] = sampled.along_and_across(smooth, sigma)
        taken_m += float(np.square(removed).sum())
    progress(mesh.frame_count, mesh.frame_count)
    # Shorter stretches stay as they were: their velocities are no better known than any other.
    short = presence.present & (lasts < _MIN_FRAMES)
    for known in (along, across):
        known[short] = known[lasts >= _MIN_FRAMES].max(axis=0)
    frames = max(int(presence.present.sum()), 1)
    taken_m = (taken_m / (frames * len(sampled.columns))) ** 0.5
    note = (
        f"Made smooth in time: {1000 * taken_m:.1f} mm (RMS) of every vertex were taken for jitter."
        f" Velocities are known to ±{np.median(along[presence.present]):.2f} m/s (median)."
    )
    uncertainty = VelocityUncertainty(limbs, which, along, across)
    return replace(mesh, vertices=vertices, uncertainty=uncertainty, notes=(*mesh.notes, note))


class RefinedVertices(MadeVertices):
    """Vertices (T, V, 3) that are smoothed where they are read, a part of the clip at a time."""

    def __init__(self, mesh: MeshSequence) -> None:
        shape = (mesh.frame_count, mesh.vertex_count, 3)
        super().__init__(shape, mesh.vertices.dtype, self._smoothed)
        self._mesh = mesh
        step_s = float(np.median(np.diff(mesh.times_s))) if mesh.frame_count > 1 else 1.0
        self._margin = int(np.ceil(_MARGIN_S / step_s))
        frame_bytes = 3 * mesh.vertex_count * self.dtype.itemsize
        self._step = max(_PART_BYTES // frame_bytes, self._margin)
        self._kept: tuple[int, NDArray[Any]] | None = None

    def parts(self) -> list[tuple[int, int]]:
        """Half-open ranges of frames that are smoothed together."""
        frames = self.shape[0]
        return [(k, min(k + self._step, frames)) for k in range(0, frames, self._step)]

    def _smoothed(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        vertices = np.empty((len(rows), *self.shape[1:]), self.dtype)
        for start in np.unique(rows // self._step) * self._step:
            inside = rows // self._step == start // self._step
            vertices[inside] = self._part(int(start))[rows[inside] - start]
        return vertices

    def _part(self, start: int) -> NDArray[Any]:
        if self._kept is None or self._kept[0] != start:
            stop = min(start + self._step, self.shape[0])
            self._kept = start, self.smooth(start, stop)[0].astype(self.dtype)
        return self._kept[1]

    def smooth(
        self, start: int, stop: int, columns: NDArray[np.intp] | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """Vertices of some frames, smoothed; what was taken away; σ of their velocities, m/s.

        All are (n, C, 3), of some of the vertices or all.
        """
        first = max(start - self._margin, 0)
        last = min(stop + self._margin, self.shape[0])
        given = self._mesh.read(first, last)
        middle = given.mean(axis=1, dtype=np.float64)  # (m, 3)
        chosen = given if columns is None else given[:, columns]
        limbs = (chosen - middle[:, None]).reshape(len(given), -1)
        smooth = limbs.astype(np.float64)
        spread = np.zeros_like(smooth)
        calm, calm_spread = middle.copy(), np.zeros_like(middle)
        presence = self._mesh.presence.between(first, last)
        for begin in np.unique(presence.first[presence.present]):
            stretch = slice(int(begin), int(presence.last[begin]) + 1)
            times_s = self._mesh.times_s[first:last][stretch]
            calm[stretch], calm_spread[stretch] = smooth_paths(times_s, middle[stretch])
            for column in range(0, smooth.shape[1], _COLUMNS):
                part = (stretch, slice(column, column + _COLUMNS))
                smooth[part], spread[part] = smooth_paths(times_s, limbs[part])
        kept = slice(start - first, stop - first)
        shape = (stop - start, -1, 3)
        smoothed = smooth[kept].reshape(shape) + calm[kept, None]
        sigma = np.hypot(spread[kept].reshape(shape), calm_spread[kept, None])
        return smoothed, chosen[kept] - smoothed, sigma


class _Limbs:
    """A sample of the vertices of each limb."""

    def __init__(self, which: NDArray[np.uint8], count: int) -> None:
        rows = [np.flatnonzero(which == limb) for limb in range(count)]
        chosen = [row[:: max(len(row) // _SAMPLED, 1)] for row in rows]
        self.columns = np.concatenate(chosen)
        self._limb = np.repeat(np.arange(count), [len(row) for row in chosen])
        self._count = count

    def along_and_across(self, places_m: Floats, sigma_mps: Floats) -> tuple[Floats, Floats]:
        """σ (n, L) of each limb's velocity along the line from the camera, and across it."""
        along = np.zeros((len(places_m), self._count))
        across = np.zeros_like(along)
        for limb in np.unique(self._limb):
            members = self._limb == limb
            variance = np.square(sigma_mps[:, members]).mean(axis=1)  # (n, 3)
            line = places_m[:, members].mean(axis=1)
            length = np.linalg.norm(line, axis=1, keepdims=True)
            line = np.divide(line, length, out=np.zeros_like(line), where=length > 0)
            seen = (line**2 * variance).sum(axis=1)
            along[:, limb] = np.sqrt(seen)
            across[:, limb] = np.sqrt(np.maximum(variance.sum(axis=1) - seen, 0.0) / 2.0)
        return along, across


def smooth_paths(times_s: Floats, paths_m: Floats) -> tuple[Floats, Floats]:
    """Smooth paths (T, N) of coordinates, and the standard deviation of their velocities in m/s.

    Each is solved by itself: squared distances from what is given, over the jitter's variance, and
    squared jerks, over those that were found around each moment, are least together.
    """
    from scipy.ndimage import median_filter

    if len(times_s) < _MIN_FRAMES:
        return paths_m, np.zeros(paths_m.shape)
    jitter_m = np.median(np.abs(np.diff(paths_m, 3, axis=0)), axis=0) / (_GAUSSIAN * _THIRD)
    jitter_m = np.maximum(jitter_m, _MIN_JITTER_M)  # (N,)
    weights = _third_differences(times_s)
    beside = paths_m - median_filter(paths_m, (_JUMP_FRAMES, 1), mode="nearest")
    jumps = (1.0 - _trust(beside, _QUICK * jitter_m)) * beside
    smooth = _below(_FIRST_HZ, times_s, paths_m - jumps, weights)
    for _ in range(_ROUNDS - 1):
        trust = _trust(paths_m - smooth, jitter_m)
        jerks = sum(weights[k][:, None] * smooth[k : len(smooth) - 3 + k] for k in range(4))
        sd = liveliness(np.asarray(jerks), times_s, _LEAST_MPS3, share=_LIVELY)
        smooth = _solved(weights, paths_m, jitter_m / sd, trust)
    return smooth, _velocity_sd(times_s, paths_m - smooth, sd)


def _trust(off_m: Floats, jitter_m: Floats) -> Floats:
    """How much a place counts that is off by so much, from 0 to 1."""
    return np.asarray(1.0 / (1.0 + np.square(off_m / (_FAR * jitter_m))))


def _third_differences(times_s: Floats) -> Floats:
    """Weights (4, T - 3) of four successive places that give the jerk between them."""
    near = np.stack([times_s[k : len(times_s) - 3 + k] for k in range(4)])
    apart = near[:, None] - near
    apart[range(4), range(4)] = 1.0
    return np.asarray(6.0 / apart.prod(axis=1))


def _below(limit_hz: float, times_s: Floats, paths_m: Floats, weights: Floats) -> Floats:
    """Paths without what is faster: at the limit, or a quarter of the rate, half of it is left."""
    from scipy.linalg import solveh_banded

    step_s = float(np.median(np.diff(times_s)))
    turn = min(np.pi * limit_hz * step_s, np.pi / 4.0)
    rows = weights * (step_s / (2.0 * np.sin(turn))) ** 3
    bands = np.zeros((4, len(times_s)))
    bands[0] = 1.0
    for k in range(4):
        for far in range(4 - k):
            bands[far, k : len(times_s) - 3 + k] += rows[k] * rows[k + far]
    return np.asarray(solveh_banded(bands, paths_m, lower=True))


def _solved(weights: Floats, given: Floats, stiffness: Floats, trust: Floats) -> Floats:
    """Solution x (T, N) of (W + Dᵀ S² D) x = W given: third differences D, stiffness S, trust W.

    The matrix has seven diagonals; L D Lᵀ is worked out row after row, for all columns at once.
    """
    frames = len(given)
    rows = weights[:, :, None] * stiffness  # (4, T - 3, N)
    bands = np.zeros((4, *given.shape))  # of the matrix: itself and those below its diagonal
    bands[0] = trust
    for k in range(4):
        for far in range(4 - k):
            bands[far, k : frames - 3 + k] += rows[k] * rows[k + far]
    pivots, x = bands[0], trust * given
    for t in range(frames):
        for far in range(1, min(t, 3) + 1):
            share = bands[far, t - far]
            scaled = share * pivots[t - far]
            pivots[t] -= share * scaled
            x[t] -= share * x[t - far]
            for farther in range(far + 1, 4):
                bands[farther - far, t] -= scaled * bands[farther, t - far]
        bands[1:, t] /= pivots[t]
    x /= pivots
    for t in range(frames - 2, -1, -1):
        for far in range(1, min(frames - 1 - t, 3) + 1):
            x[t] -= bands[far, t] * x[t + far]
    return x


def _velocity_sd(times_s: Floats, removed_m: Floats, sd_mps3: Floats) -> Floats:
    """Standard deviation (T, N) of velocities, by what was taken away around each moment.

    White noise of density n² dt that passes 1 / (1 + (ω / ω₀)⁶), with ω₀³ = s / n for jerks s,
    leaves a velocity of variance n² dt ω₀³ / 12 uncertain, and what it takes of motion whose jerks
    last for τ one of s² τ / 12 ω₀³.
    """
    step_s = float(np.median(np.diff(times_s)))
    both_s = step_s + max(step_s, _JERK_S)
    jitter_m = liveliness(removed_m, times_s, _MIN_JITTER_M, share=1.0)
    edge = np.concatenate([sd_mps3[:1], sd_mps3, sd_mps3[-1:], sd_mps3[-1:]])
    cutoff_cubed = np.minimum(edge / jitter_m, (np.pi / step_s) ** 3)
    return np.asarray(_LASTING * jitter_m * np.sqrt(both_s * cutoff_cubed / 12.0))
