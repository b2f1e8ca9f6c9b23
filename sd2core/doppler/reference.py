"""Plain histogram in double precision: the reference for the errors of faster methods.

Positions are the mesh's own, velocities and weights are computed with NumPy, and every
vertex is tested for occlusion. Nothing is shared with the compiled counting but the exact
visibility, which decides in double precision.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import vid2doppler
from sd2core.doppler.expected import SIGMA_FACTOR, sigma_bins, spread_over_bins
from sd2core.doppler.histogram import counting_of
from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Surface
from sd2core.numerics.precision import keeps_shape
from sd2core.scattering.echo_paths import EchoPath, echo_paths, mean_distance_m
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.trajectory import Trajectory
from sd2core.scattering.velocity import moments, radial_velocity
from sd2core.sensor import VirtualSensor


def reference_stretch(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, start: int, stop: int
) -> NDArray[np.float64]:
    """Reference for ``Synthesizer.stretch(...).raw``: shares (bins, n) in double precision.

    The two differ by the vertices within single precision of an edge between two bins,
    which a velocity is right to: 7e-7 m per metre of a vertex's distance from the middle of
    the first frame, over the time between the two knots that it is measured between.
    Weights differ by 1e-6 of themselves.

    Parameters
    ----------
    mesh : MeshSequence
        Without faces all vertices count.
    sensor : VirtualSensor
        Where the radar is.
    options : SynthesisOptions
        Visibility is always exact: theirs, its resolution and stride are not used, nor is the
        smoothing. Nulled bins are emptied.
    start, stop : int
        Half-open range of frames.
    """
    around = mesh.surroundings
    paths = echo_paths(sensor, () if around is None else around.walls)
    return np.sum([_on_path(mesh, path, options, start, stop) for path in paths], axis=0)


def _on_path(
    mesh: MeshSequence, path: EchoPath, options: SynthesisOptions, start: int, stop: int
) -> NDArray[np.float64]:
    """Shares (bins, n) of what comes from all bodies on one path."""
    ends_m, raw = path.ends_m, np.zeros((options.axis.bins, stop - start))
    walks = [_walk(body, path, options, start, stop) for body in mesh.bodies]
    middles = [_middle(body) for body in mesh.bodies]
    things = mesh.surroundings
    for column, moving in enumerate(zip(*walks, strict=True)):
        present = [bool(body.presence.present[start + column]) for body in mesh.bodies]
        for number, (body, (velocities, points)) in enumerate(
            zip(mesh.bodies, moving, strict=True)
        ):
            each = [_weights(body, options, points, end) for end in ends_m]
            weight, total = np.mean([weight for weight, _ in each], axis=0), each[0][1]
            if total == 0 or not len(velocities):
                continue
            weight = weight * _range_law(body, options, points, ends_m)
            weight *= path.share * path.gain(points, ends_m)
            others = [
                (its_points.T, faces)
                for other, (_, its_points) in enumerate(moving)
                if other != number and present[other]
                if (faces := mesh.bodies[other].faces) is not None
            ]
            around = others if things is None else [things.surface, *others]
            seen = _visible(body, points, ends_m[0], middles[number], around)
            if path.wall is not None and things is not None and body.faces is not None:
                hiding = things.by_way_of(path.wall, (points.T, body.faces), others)
                seen &= _visible(body, points, ends_m[1], middles[number], [hiding])
            if path.wall is not None:
                seen &= path.wall.before_m(points.T) > 0
            weights = np.broadcast_to(weight, velocities.shape)[:, seen]
            sigma = _sigma_bins(body, options, points, ends_m, start + column)[seen]
            counted = _counted(velocities[:, seen], weights, sigma, options)
            raw[:, column] += counted / (len(velocities) * total)
    raw[list(options.null_bins)] = 0
    return raw


def _walk(
    mesh: MeshSequence, path: EchoPath, options: SynthesisOptions, start: int, stop: int
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield what :func:`at_frames` does; velocities are the means of those towards both ends."""
    walks = (at_frames(mesh, end, options, start, stop) for end in path.ends_m)
    for ends in zip(*walks, strict=True):
        yield np.mean([velocities for velocities, _ in ends], axis=0), ends[0][1]


def _middle(mesh: MeshSequence) -> NDArray[np.float64]:
    """Middle of the first frame, as a number that the mesh's own precision has."""
    first = mesh.frame(0).astype(np.float64)
    middle = 0.5 * (first.min(axis=0) + first.max(axis=0))
    return np.asarray(middle.astype(mesh.vertices.dtype), np.float64)


def _counted(
    velocities: NDArray[np.float64],
    weights: NDArray[np.float64],
    sigma: NDArray[np.float64],
    options: SynthesisOptions,
) -> NDArray[np.float64]:
    """Weights per bin of velocities (moments, N), in m/s; those that are known are in one bin."""
    edges_mps = options.axis.edges_mps
    ends_mps = float(edges_mps[0]), float(edges_mps[-1])
    known = sigma == 0
    folded = _on_axis(velocities[:, known], edges_mps, options)
    counted, _ = np.histogram(folded, options.axis.bins, ends_mps, weights=weights[:, known])
    if known.all():
        return counted
    places = (velocities[:, ~known] - edges_mps[0]) / options.axis.bin_width_mps
    deviations = np.broadcast_to(sigma[~known], places.shape).ravel()
    spread = spread_over_bins(
        places.ravel(), weights[:, ~known].ravel(), deviations, counting_of(options)
    )
    return np.asarray(counted + spread)


def _sigma_bins(
    mesh: MeshSequence,
    options: SynthesisOptions,
    points: NDArray[np.float64],
    ends_m: NDArray[np.float64],
    frame: int,
) -> NDArray[np.float64]:
    """Deviation of every vertex's velocity in bins (V,), 0 where each counts in one bin."""
    known = mesh.uncertainty
    if known is None or options.count == "plain":
        return np.zeros(points.shape[1])
    limb, limbs = known.vertex_limb, len(known.limbs)
    members = np.maximum(np.bincount(limb, minlength=limbs), 1)
    limbs_m = np.stack([np.bincount(limb, line, limbs) / members for line in points], axis=-1)
    sigma = sigma_bins(known, ends_m, limbs_m[None], frame, options.axis)
    return SIGMA_FACTOR * sigma[0, limb]


def at_frames(
    mesh: MeshSequence, place: NDArray[np.float64], options: SynthesisOptions, start: int, stop: int
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield velocities (moments, V) in m/s and positions (3, V), frame by frame.

    Parameters
    ----------
    mesh : MeshSequence
        Read around the frames as far as the velocities need it.
    place : float64 ndarray, (3,)
        Place of the sensor in the camera frame.
    options : SynthesisOptions
        Oversampling, smoothing of paths, and the rule of velocities.
    start, stop : int
        Half-open range of frames.
    """
    every = options.oversampling
    trajectory = Trajectory(mesh.times_s, every, options.trajectory_smoothing_s, mesh.presence)
    centre = np.arange(start, stop) * every
    between = moments(trajectory.knot_times_s, centre, every, mesh.presence)
    low, high = int(between.before.min()), int(between.after.max()) + 1
    if options.velocity == "vid2doppler":
        low = max(start - vid2doppler.REACH_BEFORE, 0)
        high = min(stop + vid2doppler.REACH_AFTER, mesh.frame_count)
    first, last = trajectory.frames_needed(low, high)
    knots = trajectory.knots(mesh.read(first, last).astype(np.float64), first, low, high)
    points = np.ascontiguousarray(knots.transpose(0, 2, 1))
    for row, frame in enumerate(range(start, stop)):
        moments_s = between.duration_s[row]
        if options.velocity == "vid2doppler" and moments_s.any():
            frames, rate = mesh.frame_count, mesh.timebase.frames_per_s
            yield (
                vid2doppler.velocities(
                    points, low, frame, frame + 1, frames, place, rate, mesh.presence
                ),
                points[centre[row] - low],
            )
            continue
        measured = moments_s > 0
        before, after = between.before[row, measured] - low, between.after[row, measured] - low
        duration_s = moments_s[measured][:, None]
        velocity_mps = radial_velocity(points[before], points[after], place, duration_s)
        yield velocity_mps, points[centre[row] - low]


def _range_law(
    mesh: MeshSequence,
    options: SynthesisOptions,
    points: NDArray[np.float64],
    ends_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(R_ref / R)ⁿ of every vertex (V,), or of their mean (1,), R² the product of both ends'."""
    if options.range_law == "frame":
        points = np.average(points, axis=1, weights=mesh.vertex_counts)[:, None]
    ratio = options.reference_range_m / mean_distance_m(points, ends_m)
    return ratio**options.range_exponent


def _on_axis(
    velocity: NDArray[np.float64], edges_mps: NDArray[np.float64], options: SynthesisOptions
) -> NDArray[np.float64]:
    """Velocities with those beyond the axis, which is closed at both ends, where they belong."""
    low, high = edges_mps[0], edges_mps[-1]
    if options.beyond == "clip":
        return np.clip(velocity, low, high)
    if options.beyond == "wrap":
        beyond = (velocity < low) | (velocity > high)
        return np.where(beyond, low + np.mod(velocity - low, high - low), velocity)
    return velocity


def _weights(
    mesh: MeshSequence,
    options: SynthesisOptions,
    points: NDArray[np.float64],
    place: NDArray[np.float64],
) -> tuple[NDArray[np.float64], float]:
    """Weight of each vertex before the range law, and the total that the map is a share of."""
    if options.weight == "count" or mesh.faces is None:
        multiplicity = np.ones(points.shape[1])
        if mesh.vertex_counts is not None:
            multiplicity *= mesh.vertex_counts
        return multiplicity, float(mesh.represented_count)
    a, b, c = (points[:, mesh.faces[:, corner]] for corner in range(3))
    thirds = np.cross(b - a, c - a, axis=0) / 6.0
    corners = mesh.faces.ravel()
    each = np.repeat(np.linalg.norm(thirds, axis=0), 3)
    areas = np.asarray(np.bincount(corners, each, points.shape[1]), np.float64)
    if options.weight == "area":
        return areas, float(areas.sum())
    vectors = np.stack([np.bincount(corners, np.repeat(t, 3), points.shape[1]) for t in thirds])
    ray = place[:, None] - points
    distance = np.maximum(np.linalg.norm(ray, axis=0), 1e-30)
    return np.maximum((vectors * ray).sum(axis=0) / distance, 0.0), float(areas.sum())


def _visible(
    mesh: MeshSequence,
    points: NDArray[np.float64],
    place: NDArray[np.float64],
    middle: NDArray[np.float64],
    around: list[Surface],
) -> NDArray[np.bool_]:
    """Exact visibility of every vertex, decided in double precision on single coordinates.

    Things and other bodies ``around`` it are taken as if they were more of the body.

    They are taken around the clip's own middle, as everywhere, or around the frame's
    where single precision would spoil the shape so far out.
    """
    if mesh.faces is None:
        return np.ones(points.shape[1], bool)
    low, high = points.min(axis=1), points.max(axis=1)
    origin, extent_m = middle, float(np.abs(points - middle[:, None]).max())
    if not keeps_shape(extent_m, float((high - low).max())):
        origin = 0.5 * (low + high)
    count = points.shape[1]
    faces = np.array(mesh.faces, np.int32)
    for vertices_m, more in around:
        faces = np.concatenate([faces, more + np.int32(points.shape[1])])
        points = np.concatenate([points, vertices_m.T], axis=1)
    single = (points - origin[:, None]).astype(np.float32)
    needed = np.zeros((1, points.shape[1]), np.uint8)
    needed[0, :count] = 1
    visible = np.empty_like(needed)
    exact_visibility_kernel(single[None], faces, place - origin, needed, 0, 1, visible)
    return visible[0, :count] > 0
