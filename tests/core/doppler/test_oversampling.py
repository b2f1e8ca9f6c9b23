"""A raised frame rate, folded back: what each frame's moments must add up to."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, moving, options, wobbling
from numpy.typing import NDArray

from sd2core.doppler import Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VelocityAxis

EVERY = (1, 2, 3, 4, 8)
POINT = np.zeros((1, 3))


def dot_along_the_axis(range_m: NDArray[Any], times_s: NDArray[Any]) -> MeshSequence:
    path = np.stack([0 * range_m, 0 * range_m, range_m], axis=1)
    return moving(POINT, None, path, times_s)


def spectrum(mesh: MeshSequence, every: int, axis: VelocityAxis) -> NDArray[np.float32]:
    chosen = options(visibility="none", oversampling=every, axis=axis)
    return Synthesizer(mesh, chosen).map(CAMERA).values


@pytest.mark.parametrize("every", EVERY)
def test_uniform_acceleration_gives_one_velocity_per_moment(every: int) -> None:
    # Over any span the mean velocity of a parabola is that at the span's middle, so
    # moment j is found at v + a·(j + ½ − n/2)/(n·rate) exactly, up to interpolation,
    # which follows a parabola but for the first and last interval.
    rate, acceleration = 30.0, 36.0
    times = np.arange(14) / rate
    range_m = 5.0 - 0.5 * acceleration * (times - times[7]) ** 2
    axis = VelocityAxis(101)  # of which no moment of any n falls on an edge
    values = spectrum(dot_along_the_axis(range_m, times), every, axis)
    offsets = (np.arange(every) - (every - 1) / 2) / every / rate
    for frame in range(6, 9):
        expected = np.zeros(axis.bins)
        for velocity in acceleration * (times[frame] - times[7] + offsets):
            expected[axis.bin_of(velocity)] += 1 / every
        np.testing.assert_allclose(values[:, frame], expected, atol=1e-6)


def test_a_swing_converges_to_its_own_distribution() -> None:
    # Range r(t) = 3 + A sin(wt): within a frame the velocity −A·w·cos(wt) takes values
    # whose distribution is known; the error of the map falls as moments are added.
    rate, swing, turn = 30.0, 0.12, 2 * np.pi * 1.5
    times = np.arange(41) / rate
    axis = VelocityAxis(64, 1.2)
    fine = (np.arange(20_000) + 0.5) / 20_000 - 0.5
    truth = np.stack(
        [
            np.histogram(-swing * turn * np.cos(turn * (t + fine / rate)), axis.edges_mps)[0]
            for t in times
        ],
        axis=1,
    ) / len(fine)
    mesh = dot_along_the_axis(3.0 + swing * np.sin(turn * times), times)
    inner = slice(2, -2)
    errors = [
        np.abs(spectrum(mesh, every, axis)[:, inner] - truth[:, inner]).sum(axis=0).mean()
        for every in EVERY
    ]
    # A frame's velocities cover some bins, of which n moments reach n at the most.
    covered = (truth[:, inner] > 0).sum(axis=0)
    assert 2 < np.median(covered) < 16
    assert all(many < few for few, many in pairwise(errors)), errors
    assert errors[-1] < 0.5 * errors[0], errors


@pytest.mark.parametrize("every", EVERY)
@pytest.mark.parametrize("uneven", [False, True])
def test_time_reversal_flips_the_sign(every: int, uneven: bool) -> None:
    mesh = wobbling(24, divisions=2)
    times = np.asarray(mesh.times_s)
    if uneven:
        times = np.cumsum(np.random.default_rng(5).uniform(0.02, 0.05, len(times)))
    vertices = np.asarray(mesh.vertices)
    there = MeshSequence(vertices, mesh.faces, type(mesh.timebase)(times), "there")
    back_times = times[-1] + times[0] - times[::-1]
    back = MeshSequence(vertices[::-1], mesh.faces, type(mesh.timebase)(back_times), "back")
    chosen = options(visibility="none", oversampling=every, beyond="clip")
    forward = Synthesizer(there, chosen).map(CAMERA).values
    reverse = Synthesizer(back, chosen).map(CAMERA).values
    # A vertex on a bin's edge, which belongs to the upper bin, may change bins.
    assert np.abs(forward - reverse[::-1, ::-1]).max() <= 2 / mesh.vertex_count


@pytest.mark.parametrize("every", EVERY)
def test_uniform_motion_on_any_clock_stays_in_its_bin(every: int) -> None:
    times = np.cumsum(np.tile([0.02, 0.05, 0.033], 6))
    axis = VelocityAxis()
    values = spectrum(dot_along_the_axis(5.0 - 1.3 * times, times), every, axis)
    np.testing.assert_allclose(values[axis.bin_of(1.3)], 1.0, rtol=1e-6)


@pytest.mark.parametrize("every", EVERY)
def test_a_frame_by_itself_has_the_velocity_in_its_middle(every: int) -> None:
    rate, acceleration = 30.0, 36.0
    times = np.arange(15) / rate
    range_m = 5.0 - 0.5 * acceleration * (times - times[7]) ** 2
    maker = Synthesizer(
        dot_along_the_axis(range_m, times), options(visibility="none", oversampling=every)
    )
    for frame in range(5, 10):
        truth = acceleration * (times[frame] - times[7])
        # Positions are single precision around the clip's origin: 1e-7 m over 1/120 s.
        assert maker.frame(CAMERA, frame).velocity_mps[0] == pytest.approx(truth, abs=3e-5)


@pytest.mark.parametrize("every", EVERY)
@pytest.mark.parametrize("frames", [1, 2, 3])
def test_the_shortest_clips(every: int, frames: int) -> None:
    times = np.arange(frames) / 30.0
    values = spectrum(dot_along_the_axis(4.0 - 1.3 * times, times), every, VelocityAxis())
    if frames == 1:
        assert not values.any()
    else:
        np.testing.assert_allclose(values[VelocityAxis().bin_of(1.3)], 1.0, rtol=1e-6)
