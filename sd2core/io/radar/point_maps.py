"""Doppler maps of point clouds: a histogram of the points' velocities, frame by frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.io.radar.kkt import RecordedMap
from sd2core.io.radar.points import (
    LONGEST_GAP_FRAMES,
    RadarPoints,
    doppler_step,
    points_description,
    read_points,
)
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap
from sd2core.plausibility.clock import probable_unit
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

OF_POINTS = "table of points"
"""Format in the provenance of such maps: without points a frame of theirs is empty."""
USUAL_FRAME_S = 0.1
"""Between frames of most published sets; no file of theirs says it exactly."""
_CLEAR = 0.25
"""Correlation of velocities with changes of distance that decides on their sign."""
_ENOUGH_FRAMES = 40


def velocity_histogram(
    columns: NDArray[np.integer],
    velocity_mps: NDArray[np.float64],
    weight: NDArray[np.float64],
    frames: int,
    axis: VelocityAxis,
    step_mps: float = 0.0,
) -> NDArray[np.float32]:
    """Weights of points over velocity and frames, (bins, frames); those beyond the axis left out.

    Parameters
    ----------
    columns : int array, shape (P,)
        Frame of every point.
    velocity_mps, weight : float64 array, shape (P,)
    frames : int
    axis : VelocityAxis
    step_mps : float
        Resolution of the radar. A point says no more than that something moves within half a step
        of its velocity: its weight is spread evenly over that cell. 0: it counts in one bin.
    """
    values = np.zeros((frames, axis.bins))
    if step_mps > 0:
        edges = axis.edges_mps
        for start in range(0, len(columns), _BLOCK):
            some = slice(start, start + _BLOCK)
            low = velocity_mps[some, None] - 0.5 * step_mps
            inside = np.minimum(edges[1:], low + step_mps) - np.maximum(edges[:-1], low)
            spread = np.maximum(inside, 0.0) / step_mps  # (P, bins)
            np.add.at(values, columns[some], weight[some, None] * spread)
    else:
        bins = np.floor((velocity_mps + axis.v_max_mps) / axis.bin_width_mps)
        within = (bins >= 0) & (bins < axis.bins)
        np.add.at(values, (columns[within], bins[within].astype(int)), weight[within])
    return values.T.astype(np.float32)


_BLOCK = 1 << 16


def load_points_map(path: Path, axis: VelocityAxis | None = None) -> RecordedMap:
    """Read a table of points as a map, by default of 32 bins over ±2 m/s.

    The value of a cell is the sum of the intensities there, or the number of points where there
    are none. Raises Sd2Error if the table cannot be read.
    """
    axis = axis or VelocityAxis()
    description = points_description(path)
    points = read_points(path, description)
    notes: list[str] = []
    if points.guessed:
        notes.append(
            f"Columns have no names; by their numbers they are {', '.join(points.columns)}."
            f" `sd2 radar describe {path.name} --columns LIST` says otherwise."
        )
    numbers, rows = np.unique(points.frame, return_inverse=True)
    stated_s = None if description is None else description.frame_repetition_s
    columns, times_s = _clock(numbers, rows, points, stated_s, path, notes)
    weight = _weights(points, notes)
    sign = _sign(points, rows, None if description is None else description.sign, path, notes)
    velocity_mps = -sign * points.doppler  # positive when approaching
    step_mps = doppler_step(points.doppler)
    values = velocity_histogram(columns[rows], velocity_mps, weight, len(times_s), axis, step_mps)
    speed_mps = np.abs(velocity_mps)
    beyond = float((speed_mps > axis.v_max_mps).mean())
    if beyond > 0:
        notes.append(
            f"{100 * beyond:.2g} % of the points are faster than {axis.v_max_mps:g} m/s and left"
            f" out, up to {speed_mps.max():.3g} m/s: `sd2 radar --v-max` takes them in."
        )
    doppler = DopplerMap(
        values=values,
        axis=axis,
        timebase=Timebase(times_s),
        kind="real",
        unit="points" if points.intensity is None else "intensity of points",
        meta={
            "source": path.name,
            "format": OF_POINTS,
            "columns": list(points.columns),
            "velocity_step_mps": step_mps,
            "notes": notes,
        },
    )
    return RecordedMap(doppler, Labels(), "", str(path), tuple(notes))


def _clock(
    numbers: NDArray[np.float64],
    rows: NDArray[np.intp],
    points: RadarPoints,
    stated_s: float | None,
    path: Path,
    notes: list[str],
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Column of every frame with points, and the times of all columns, from 0 s on.

    Frames that are left out had no points, and are empty columns; longer gaps are gaps in time.
    """
    steps = np.maximum(np.diff(numbers), 1.0)
    frame_s = stated_s
    moments_s = None
    if frame_s is None and points.time is not None and len(numbers) > 1:
        first = np.zeros(len(numbers))
        first[rows[::-1]] = points.time[::-1]
        moments_s, frame_s = _in_seconds(first, steps, points.time_unit_s, notes)
    if frame_s is None:
        frame_s = USUAL_FRAME_S
        if points.time is not None and "frame" not in points.columns:  # numbers are of times, too
            steps = np.minimum(steps, LONGEST_GAP_FRAMES + 1)
        why = "The table tells no times" if points.time is None else "Its times tell no frame rate"
        notes.append(
            f"{why}: a frame is taken every {1e3 * frame_s:g} ms."
            f" `sd2 radar describe {path.name} --frame-repetition-s S` says otherwise."
        )
    if moments_s is not None and (np.diff(moments_s) > 0).all():
        gaps_s = np.diff(moments_s)
    else:
        gaps_s = steps * frame_s
    filled = np.where(steps <= LONGEST_GAP_FRAMES, steps, 1.0).astype(np.intp)
    columns = np.concatenate([[0], np.cumsum(filled)])
    at_s = np.concatenate([[0.0], np.cumsum(gaps_s)])
    return columns, np.interp(np.arange(columns[-1] + 1), columns, at_s)


def _in_seconds(
    first: NDArray[np.float64], steps: NDArray[np.float64], unit_s: float | None, notes: list[str]
) -> tuple[NDArray[np.float64] | None, float | None]:
    """Times of frames in seconds, and the usual step; None where they tell nothing."""
    if not np.isfinite(first).all():
        return None, None
    step = float(np.median(np.diff(first) / steps))
    if unit_s is None:
        unit_s = 1.0
        if (probable := probable_unit(step)) is not None:
            name, unit_s = probable
            notes.append(f"Times are taken to be {name}: {1 / (step * unit_s):.3g} frames/s.")
        elif not 1e-3 <= step < 1.0:  # steps of 1 count frames
            return None, None
    return ((first - first[0]) * unit_s, step * unit_s) if step > 0 else (None, None)


def _weights(points: RadarPoints, notes: list[str]) -> NDArray[np.float64]:
    weight = points.intensity
    if weight is not None and np.isfinite(weight).all() and (weight >= 0).all() and weight.any():
        return weight
    if weight is not None:
        notes.append("Some intensities are negative or no numbers: points are counted instead.")
    return np.ones(len(points.doppler))


def _sign(
    points: RadarPoints, rows: NDArray[np.intp], stated: int | None, path: Path, notes: list[str]
) -> int:
    """1 if a positive velocity recedes, as TI's radars say it, -1 if it approaches."""
    if stated is not None:
        return stated
    along = _agreement(points, rows)
    if along is not None and abs(along) > _CLEAR:
        sign = 1 if along > 0 else -1
        notes.append(
            f"A positive velocity is taken to {'recede' if sign > 0 else 'approach'}, as the"
            f" distances of the points change (correlation {along:.2f})."
        )
        return sign
    notes.append(
        "A positive velocity is taken to recede, as TI's radars say it; walk towards the radar to"
        f" check. `sd2 radar describe {path.name} --sign -1` says otherwise."
    )
    return 1


def _agreement(points: RadarPoints, rows: NDArray[np.intp]) -> float | None:
    """Correlation of mean velocities with changes of mean distances; None where nothing moves."""
    if points.range_m is None or not np.isfinite(points.range_m).all():
        return None
    count = np.bincount(rows)
    distance = np.bincount(rows, points.range_m) / count
    velocity = np.bincount(rows, points.doppler) / count
    span = 5  # frames: one frame alone is noise
    if len(count) < _ENOUGH_FRAMES + span:
        return None
    moved = distance[span:] - distance[:-span]
    driven = np.convolve(velocity, np.ones(span) / span, "valid")[: len(moved)]
    frames = points.frame[np.searchsorted(rows, np.arange(len(count)))]
    whole = frames[span:] - frames[:-span] <= 2 * span
    if whole.sum() < _ENOUGH_FRAMES or moved[whole].std() < 1e-6 or driven[whole].std() < 1e-6:
        return None
    return float(np.corrcoef(moved[whole], driven[whole])[0, 1])
