"""Uncertainty of the cells of a synthetic map, from the uncertainty of its limbs' velocities.

Model (docs/decisions/0021): all velocities of a limb are wrong by one random velocity,
normally distributed with the standard deviation that the mesh states, independently of
the other limbs, and alike (in units of that deviation) over the few frames that
smoothing in time brings together. Nothing else is uncertain: visibility and weights are
those of the map.

Everything between a limb's histogram and the map is linear, so the map is a sum of
limbs, each a function of one normally distributed number. Mean and variance of each are
sums over a grid of that number; the variances add up.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.frame_counts import FrameCounts
from sd2core.doppler.limb_histograms import FineAxis, fine_histograms
from sd2core.doppler.limb_kernels import REACH
from sd2core.doppler.masks import Visibility
from sd2core.doppler.prepared import Block
from sd2core.doppler.smoothing import frames_within_reach, smooth_time, velocity_kernel
from sd2core.errors import Sd2Error
from sd2core.maps import CellUncertainty
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.parallel import Ticket, run_jobs
from sd2core.progress import Progress
from sd2core.scattering.echo_paths import EchoPath
from sd2core.sensor import VirtualSensor

_STEP_BINS = 0.25
_MIN_STEPS, _MAX_STEPS = 16, 256
_FRAMES = 32
"""Frames computed together. Their products of matrices are too small for NumPy to divide among
threads of its own, which would wait for those of the pieces: a hundred times as long on busy cores.
"""


def cell_uncertainty(
    counts: FrameCounts,
    sensor: VirtualSensor,
    start: int,
    stop: int,
    visibility: Visibility,
    progress: Progress,
    threads: int | None,
) -> CellUncertainty:
    """Uncertainty of some frames, see :meth:`Synthesizer.uncertainty`.

    Parameters
    ----------
    counts : FrameCounts
        Of the mesh; Sd2Error if it does not say how well its velocities are known.
    sensor : VirtualSensor
        Of the map.
    start, stop : int
        Half-open range of frames.
    visibility : {"none", "facing", "depth", "exact", "frozen"}
        That of the map.
    progress : Progress
        Counts frames; may raise Cancelled.
    threads : int or None
        Number of worker threads; None: one per core.
    """
    mesh, axis = counts.mesh, counts.options.axis
    if mesh.uncertainty is None:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'} does not say how well its velocities are known",
            "a mesh that was fitted to a video with `sd2 fit`",
        )
    result = CellUncertainty(
        np.empty((axis.bins, stop - start), np.float32),
        np.empty((axis.bins, stop - start), np.float32),
    )

    def job(low: int, high: int) -> Callable[[Ticket], None]:
        def work(ticket: Ticket) -> None:
            ticket.advance(0)
            piece = _Piece(counts, sensor, low, high, visibility)
            expected, variance = piece.moments(lambda: ticket.advance(0))
            columns = slice(low - start, high - start)
            result.expected[:, columns] = expected
            result.sd[:, columns] = np.sqrt(np.maximum(variance, 0.0))
            ticket.advance(high - low)

        return work

    cuts = range(start, stop, _FRAMES)
    jobs = [job(low, min(low + _FRAMES, stop)) for low in cuts]
    run_jobs(jobs, stop - start, progress, threads)
    return result


class _Piece:
    """Some frames of a clip, with the frames around them that smoothing needs."""

    def __init__(
        self,
        counts: FrameCounts,
        sensor: VirtualSensor,
        start: int,
        stop: int,
        visibility: Visibility,
    ) -> None:
        self._counts = counts
        self._sensor = sensor
        self._start, self._stop = start, stop
        self._visibility: Visibility = visibility
        options, mesh = counts.options, counts.mesh
        known = mesh.uncertainty
        assert known is not None
        self._known: VelocityUncertainty = known
        self._first, self._last = frames_within_reach(
            mesh.times_s, start, stop, options.time_sigma_s
        )
        frames = slice(self._first, self._last)
        most_mps = float(max(known.along_mps[frames].max(), known.across_mps[frames].max()))
        most_bins = min(most_mps / options.axis.bin_width_mps, options.axis.bins)
        room_bins = math.ceil(REACH * most_bins) + 1
        self._axis = FineAxis(counts.counting, 0 if options.beyond == "wrap" else room_bins)

    def moments(self, go_on: Callable[[], None]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Expected values and their variance, (bins, n) each."""
        options = self._counts.options
        counted = self._histograms(go_on)
        frames = self._stop - self._start
        expected = np.zeros((options.axis.bins, frames))
        variance = np.zeros((options.axis.bins, frames))
        over_time = self._smoothing_over_time()
        for limb in range(len(self._known.limbs)):
            go_on()
            of_limb = [(fine[limb], sigma_bins[:, limb]) for fine, sigma_bins in counted]
            nodes, share = _grid(max(float(deviation.max()) for _, deviation in of_limb))
            # Paths by walls err with the direct one, as far as they run alike.
            shifted = sum(
                self._axis.shifted(fine, nodes[:, None] * deviation)  # (k, n, bins)
                for fine, deviation in of_limb
            )
            mapped = self._smoothed(np.asarray(shifted), over_time)
            mean = np.tensordot(share, mapped, 1)
            expected += mean
            variance += np.tensordot(share, (mapped - mean) ** 2, 1)
        return expected, variance

    def _smoothed(
        self, raw: NDArray[np.float64], over_time: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Smooth shares per frame and bin (k, n, bins) as the map is, (k, bins, frames)."""
        options = self._counts.options
        nulled = list(options.null_bins)
        raw[..., nulled] = 0
        along = velocity_kernel(options.axis.bins, options.velocity_sigma_bins)
        values = along @ raw.transpose(0, 2, 1) @ over_time
        if options.null_after_smoothing:
            values[:, nulled] = 0
        return values

    def _smoothing_over_time(self) -> NDArray[np.float64]:
        """Matrix of the smoothing over time, (frames around, frames)."""
        mesh, options = self._counts.mesh, self._counts.options
        return smooth_time(
            np.eye(self._last - self._first),
            mesh.times_s,
            self._first,
            self._start,
            self._stop,
            options.time_sigma_s,
            mesh.presence,
        )

    def _histograms(
        self, go_on: Callable[[], None]
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Shares of each path on the fine axis (limbs, n, parts); deviations in bins (n, limbs)."""
        counts, known = self._counts, self._known
        frames = self._last - self._first
        by_path = []
        for path in counts.paths(self._sensor):
            fine = np.zeros((len(known.limbs), frames, self._axis.parts))
            sigma_bins = np.zeros((frames, len(known.limbs)))
            for index, low, high in counts.blocks_between(self._first, self._last):
                go_on()
                block = counts.prepared.block(index)
                rows = slice(low - block.start, high - block.start)
                target = slice(low - self._first, high - self._first)
                fine[:, target] = self._counted(block, rows, path)
                sigma_bins[target] = counts.sigma_bins(block, rows, path)
            by_path.append((fine, sigma_bins))
        return by_path

    def _counted(self, block: Block, rows: slice, path: EchoPath) -> NDArray[np.float64]:
        """Shares of some of a block's frames on the fine axis, (limbs, n, parts)."""
        counts, known = self._counts, self._known
        place = counts.prepared.sensor(path.ends_m)
        visibility, limb = self._visibility, known.vertex_limb
        scatterers, _ = counts.scatterers(block, rows, path, visibility, limb)
        frames, velocity = block.frames.rows(rows), None
        if counts.options.velocity == "vid2doppler":
            velocity = counts.prepared.velocities_vid2doppler(block, rows, place)
        fine = fine_histograms(
            frames, place, self._axis, scatterers, len(known.limbs), velocity
        ).transpose(1, 0, 2)
        total = counts.totals(block, rows)
        law = path.share * counts.frame_law(block, rows, path)
        factor = np.divide(law, total, out=np.zeros_like(total), where=total > 0)
        return fine * factor[:, None]


def _grid(most_bins: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Grid of a standard normal variable and its weights, fine enough for this deviation."""
    if most_bins == 0:
        return np.zeros(1), np.ones(1)
    wanted = math.ceil(2 * REACH * most_bins / _STEP_BINS)
    steps = min(max(_MIN_STEPS, wanted), _MAX_STEPS)
    nodes = np.linspace(-REACH, REACH, steps + 1)
    share = np.exp(-0.5 * nodes**2)
    return nodes, share / share.sum()
