"""How a map fades with range: by vertex, and by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, moving, options, sensor_at, wobbling

from sd2core.doppler import Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.amplitude import NEAREST_RANGE_M

VELOCITIES = ("central", "vid2doppler")


@pytest.mark.parametrize("velocity", VELOCITIES)
@pytest.mark.parametrize("exponent", [2.0, 2.5, 4.0])
def test_by_frame_two_points_share_the_range_of_their_middle(velocity: Any, exponent: Any) -> None:
    times = np.arange(8) / 30
    pair = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]])
    path = np.stack([0 * times, 0 * times, 4.0 - 1.3 * times], axis=1)
    mesh = moving(pair, None, path, times)
    chosen = options(
        visibility="none", velocity=velocity, range_exponent=exponent, range_law="frame"
    )
    values = Synthesizer(mesh, chosen).map(CAMERA).values
    unweighted = options(visibility="none", velocity=velocity)
    plain = Synthesizer(mesh, unweighted).map(CAMERA).values
    assert plain.any()
    law = (2.2 / path[:, 2]) ** exponent
    np.testing.assert_allclose(values, plain * law, rtol=1e-6)
    by_vertex = Synthesizer(
        mesh, options(visibility="none", velocity=velocity, range_exponent=exponent)
    ).map(CAMERA)
    both = 0.5 * ((2.2 / (path[:, 2] - 0.5)) ** exponent + (2.2 / (path[:, 2] + 0.5)) ** exponent)
    np.testing.assert_allclose(by_vertex.values, plain * both, rtol=1e-5)


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_without_a_law_both_are_the_same(velocity: Any) -> None:
    mesh = wobbling(8, divisions=2)
    made = [
        Synthesizer(mesh, options(velocity=velocity, range_law=law)).map(CAMERA).values
        for law in ("vertex", "frame")
    ]
    np.testing.assert_array_equal(*made)


def test_the_two_agree_from_afar() -> None:
    # A body of 1 m seen from 1 km: R⁻⁴ differs by 4 · 0.5/1000 at the most.
    mesh, far = wobbling(8, divisions=2), sensor_at(0, 0, -1000)
    vertex, frame = (
        Synthesizer(mesh, options(range_exponent=4.0, range_law=law)).map(far).values
        for law in ("vertex", "frame")
    )
    assert vertex.any()
    np.testing.assert_allclose(frame, vertex, rtol=3e-3)


def test_on_the_middle_the_nearest_range_holds() -> None:
    mesh = wobbling(5, divisions=2)
    middle = np.asarray(mesh.vertices[2], float).mean(axis=0)
    chosen = options(range_exponent=4.0, range_law="frame", visibility="none", beyond="clip")
    values = Synthesizer(mesh, chosen).map(sensor_at(*middle)).values
    assert values[:, 2].sum() == pytest.approx((2.2 / NEAREST_RANGE_M) ** 4, rel=1e-5)


def test_far_from_the_worlds_origin() -> None:
    mesh = wobbling(6, divisions=2)
    offset = np.array([1e6, -1e6, 1e6])
    away = MeshSequence(np.asarray(mesh.vertices, float) + offset, mesh.faces, mesh.timebase)
    chosen = options(range_exponent=4.0, range_law="frame", visibility="none", beyond="clip")
    here = Synthesizer(mesh, chosen).map(CAMERA).values.sum(axis=0)
    there = Synthesizer(away, chosen).map(sensor_at(*offset)).values.sum(axis=0)
    np.testing.assert_allclose(there, here, rtol=1e-6)
