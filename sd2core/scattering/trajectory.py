"""Paths of the vertices, resampled and smoothed in time.

Both are linear in the positions with weights that depend on the real frame times
only, so a long recording can be computed in parts without visible seams, and a
variable frame rate needs no special case.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.presence import Presence

if TYPE_CHECKING:
    from scipy.sparse import csr_array

REACH = 4.0
"""Where a Gaussian on time is cut, in sigmas (its value there: 3e-4 of the peak)."""

SLACK_S = 1e-6
"""A frame that lies on the cut is inside on both sides, whatever the last digit says, which is
2e-7 s of times since 1970."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Knots of a trajectory: the frames, and ``oversampling - 1`` moments between each two."""

    frame_times_s: NDArray[np.float64]  # (T,)
    oversampling: int = 1
    smoothing_s: float = 0.0
    """Sigma of a zero-phase Gaussian; 0 leaves the path alone. A straight line is fitted under the
    Gaussian, so uniform motion stays as it is, up to both ends of the recording."""
    presence: Presence | None = None
    """Of the frames. Frames without a person separate paths of their own; knots without a person
    are at the frame before."""

    def __post_init__(self) -> None:
        if self.oversampling < 1:
            raise Sd2Error(f"The oversampling is {self.oversampling}", "1 or more")
        if not (np.isfinite(self.smoothing_s) and self.smoothing_s >= 0):
            raise Sd2Error(f"The trajectory smoothing is {self.smoothing_s} s", "0 or more seconds")

    @property
    def knot_times_s(self) -> NDArray[np.float64]:
        """Time of every knot; frame k is knot ``k * oversampling``."""
        frames = len(self.frame_times_s)
        if self.oversampling == 1:
            return self.frame_times_s
        knots = np.arange((frames - 1) * self.oversampling + 1) / self.oversampling
        return np.interp(knots, np.arange(frames), self.frame_times_s)

    def frames_needed(self, first_knot: int, last_knot: int) -> tuple[int, int]:
        """Half-open range of frames on which knots ``first`` to ``last`` (exclusive) depend."""
        first = first_knot // self.oversampling
        last = -((1 - last_knot) // self.oversampling) + 1
        if self.smoothing_s > 0:
            reach = REACH * self.smoothing_s + 2 * SLACK_S
            times = self.knot_times_s
            first = int(np.searchsorted(self.frame_times_s, times[first_knot] - reach))
            last = int(
                np.searchsorted(self.frame_times_s, times[last_knot - 1] + reach, side="right")
            )
        # Cubic interpolation takes two frames on each side; so does a line fit
        # whose Gaussian is narrower than the distance between frames.
        margin = 2 if self.oversampling > 1 or self.smoothing_s > 0 else 0
        return max(first - margin, 0), min(last + margin, len(self.frame_times_s))

    def knots(
        self, vertices: NDArray[Any], first_frame: int, first_knot: int, last_knot: int
    ) -> NDArray[Any]:
        """Positions (knots, V, 3) at knots ``first_knot`` to ``last_knot`` (exclusive).

        Parameters
        ----------
        vertices : float array, shape (frames, V, 3)
            The frames that :meth:`frames_needed` names.
        first_frame : int
            Number of the first of them.
        first_knot, last_knot : int

        Returns
        -------
        float array, shape (knots, V, 3)
            Part of ``vertices`` itself where nothing is to be done; otherwise float64.
        """
        if self.oversampling == 1 and self.smoothing_s == 0:
            return vertices[first_knot - first_frame : last_knot - first_frame]
        frames = slice(first_frame, first_frame + len(vertices))
        weights = self._weights(frames, first_knot, last_knot)
        flat = vertices.reshape(len(vertices), -1).astype(np.float64, copy=False)
        return (weights @ flat).reshape(last_knot - first_knot, -1, 3)

    def _weights(self, frames: slice, first_knot: int, last_knot: int) -> csr_array:
        from scipy.sparse import csr_array

        rows = []
        for knot, time_s in enumerate(self.knot_times_s[first_knot:last_knot], first_knot):
            begin, end = self._stretch(knot)
            times, frame = self.frame_times_s[begin:end], knot // self.oversampling - begin
            row = line_weights(times, time_s, self.smoothing_s) if self.smoothing_s > 0 else None
            if row is None:
                row = cubic_weights(times, time_s, frame)
            rows.append((row[0] + begin, row[1]))
        counts = [len(weight) for _, weight in rows]
        columns = np.concatenate([np.arange(len(w)) + start for start, w in rows]) - frames.start
        return csr_array(
            (
                np.concatenate([weight for _, weight in rows]),
                columns,
                np.concatenate([[0], np.cumsum(counts)]),
            ),
            shape=(len(rows), frames.stop - frames.start),
        )

    def _stretch(self, knot: int) -> tuple[int, int]:
        """Frames of the path that a knot lies on, half-open."""
        if self.presence is None or self.presence.whole:
            return 0, len(self.frame_times_s)
        frame, between = divmod(knot, self.oversampling)
        begin, last = int(self.presence.first[frame]), int(self.presence.last[frame])
        # Past the end of a stretch there is no path.
        return (frame, frame + 1) if between and frame == last else (begin, last + 1)


def line_weights(
    times_s: NDArray[np.float64], time_s: float, sigma_s: float
) -> tuple[int, NDArray[np.float64]] | None:
    """Weights of a Gaussian-weighted straight-line fit at ``time_s``.

    Returns the first frame, and its and the following frames' weights; None when fewer than
    two frames lie under the Gaussian.
    """
    reach = REACH * sigma_s + SLACK_S
    first = int(np.searchsorted(times_s, time_s - reach))
    last = int(np.searchsorted(times_s, time_s + reach, side="right"))
    if last - first < 2:
        return None
    distance = (times_s[first:last] - time_s) / sigma_s
    bell = np.exp(-0.5 * distance**2)
    s0, s1, s2 = bell.sum(), bell @ distance, bell @ distance**2
    return first, bell * (s2 - s1 * distance) / (s0 * s2 - s1 * s1)


def cubic_weights(
    times_s: NDArray[np.float64], time_s: float, frame: int
) -> tuple[int, NDArray[np.float64]]:
    """Weights of the cubic through ``frame`` and the next, with parabolic tangents.

    The tangent at a frame is that of the parabola through it and its neighbours
    (of the line at the ends), so the path is smooth and passes every frame.
    """
    frame = min(frame, len(times_s) - 2)
    if frame < 0:
        return 0, np.ones(1)
    first, last = max(frame - 1, 0), min(frame + 3, len(times_s))
    weights = np.zeros(last - first)
    span = times_s[frame + 1] - times_s[frame]
    u = (time_s - times_s[frame]) / span
    weights[frame - first] += (1 + 2 * u) * (1 - u) ** 2
    weights[frame + 1 - first] += u * u * (3 - 2 * u)
    for at, share in ((frame, u * (1 - u) ** 2 * span), (frame + 1, -u * u * (1 - u) * span)):
        tangent_first, tangent = _tangent_weights(times_s, at)
        start = tangent_first - first
        weights[start : start + len(tangent)] += share * tangent
    return first, weights


def _tangent_weights(times_s: NDArray[np.float64], frame: int) -> tuple[int, NDArray[np.float64]]:
    if frame == 0 or frame == len(times_s) - 1:
        first = min(frame, len(times_s) - 2)
        step = times_s[first + 1] - times_s[first]
        return first, np.array([-1.0, 1.0]) / step
    left, right = times_s[frame] - times_s[frame - 1], times_s[frame + 1] - times_s[frame]
    return frame - 1, np.array(
        [
            -right / (left * (left + right)),
            (right - left) / (left * right),
            left / (right * (left + right)),
        ]
    )
