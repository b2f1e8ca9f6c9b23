"""Scenes whose Doppler is known."""

from __future__ import annotations

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, moving, options, plate, sensor_at, sphere, wobbling
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.doppler import Synthesizer
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

TIMES_S = np.arange(30) / 30.0
EVERY = ("none", "facing", "exact")


@pytest.mark.parametrize("visibility", EVERY)
@pytest.mark.parametrize("velocity_mps", [1.3, -0.7])
def test_a_plate_lands_in_its_bin(visibility, velocity_mps) -> None:  # type: ignore[no-untyped-def]
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 6.0 - velocity_mps * TIMES_S], axis=1)
    mesh = moving(*plate(0.2), path, TIMES_S)
    values = Synthesizer(mesh, RAW).map(CAMERA, visibility=visibility).values
    bin_number = RAW.axis.bin_of(velocity_mps)
    np.testing.assert_array_equal(values.argmax(axis=0), bin_number)
    np.testing.assert_array_equal(values[bin_number], 1.0)


def test_a_crossing_target_has_no_doppler() -> None:
    angle = np.linspace(-0.5, 0.5, 30)
    path = 2.0 * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    dot = np.zeros((1, 3))
    frame = Synthesizer(moving(dot, None, path, TIMES_S), options(visibility="none"))
    for index in range(30):
        assert abs(frame.frame(CAMERA, index).velocity_mps[0]) < 1e-5


def test_a_sphere_turning_in_place_is_symmetric_about_zero() -> None:
    # A half turn takes this sphere to itself, so each speed has its opposite.
    vertices, faces = sphere()
    angle = 2.0 * TIMES_S
    cos, sin, zero = np.cos(angle), np.sin(angle), 0 * angle
    turn = np.stack([[cos, zero, sin], [zero, zero + 1, zero], [-sin, zero, cos]]).transpose(
        2, 0, 1
    )
    positions = np.einsum("tij,vj->tvi", turn, vertices) + np.array([0.0, 0.0, 2.0])
    mesh = MeshSequence(positions, faces, Timebase(TIMES_S), "ball")
    for visibility in EVERY:
        values = Synthesizer(mesh, RAW).map(CAMERA, visibility=visibility).values
        spread = values @ np.ones(30) / 30
        assert np.abs(spread - spread[::-1]).max() < 0.03
        speeds = RAW.axis.centres_mps[spread > 0]
        assert 0.4 < speeds.max() < 0.6 + RAW.axis.bin_width_mps  # radius × rate = 0.6 m/s


def test_a_pendulum_follows_its_closed_form() -> None:
    length, swing, rate = 1.0, 0.4, np.sqrt(9.81)
    times = np.arange(120) / 60.0
    angle = swing * np.sin(rate * times)
    path = np.stack([length * np.sin(angle), length * np.cos(angle), 0 * angle], axis=1)
    path += np.array([0.0, 0.0, 3.0])
    bob = moving(np.zeros((1, 3)), None, path, times)
    sensor = sensor_at(2.0, 0.5, 1.0)
    synthesizer = Synthesizer(bob, options(visibility="none"))
    place = path - np.array(sensor.position_m)
    speed = swing * rate * np.cos(rate * times)
    step = length * np.stack([np.cos(angle), -np.sin(angle), 0 * angle], axis=1) * speed[:, None]
    truth = -(place * step).sum(axis=1) / np.linalg.norm(place, axis=1)
    measured = [synthesizer.frame(sensor, index).velocity_mps[0] for index in range(120)]
    # The central difference's own error is Δt²/6 times the third derivative: 6e-4 m/s here.
    np.testing.assert_allclose(measured[1:-1], truth[1:-1], atol=1e-3)


def test_time_reversal_flips_the_sign() -> None:
    mesh = wobbling()
    backwards = MeshSequence(mesh.vertices[::-1], mesh.faces, mesh.timebase, "backwards")
    forward = Synthesizer(mesh, RAW).map(CAMERA).values
    reverse = Synthesizer(backwards, RAW).map(CAMERA).values
    # A vertex may sit on a bin's edge, which belongs to the upper bin.
    assert np.abs(forward - reverse[::-1, ::-1]).max() <= 2 / mesh.vertex_count


@settings(max_examples=10)
@given(
    shift=st.tuples(*[st.floats(-50, 50)] * 3),
    turn=st.floats(-3, 3),
    visibility=st.sampled_from(EVERY),
)
def test_moving_everything_together_changes_nothing(shift, turn, visibility) -> None:  # type: ignore[no-untyped-def]
    mesh = wobbling(12, divisions=2)
    cos, sin = np.cos(turn), np.sin(turn)
    rotation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    there = np.asarray(mesh.vertices, np.float64) @ rotation.T + shift
    moved = MeshSequence(there, mesh.faces, mesh.timebase, "moved")
    place = rotation @ [0.3, -0.2, 0.1] + shift
    here = Synthesizer(mesh, RAW).map(sensor_at(0.3, -0.2, 0.1), visibility=visibility).values
    values = Synthesizer(moved, RAW).map(sensor_at(*place), visibility=visibility).values
    # Vertices at a bin's edge, edge-on, or on the byte normals' rounding may change sides.
    allowed = {"none": 2, "exact": 3, "facing": 12}[visibility]
    assert np.abs(values - here).max() <= allowed / mesh.vertex_count


def test_an_uneven_clock_gives_the_same_velocity() -> None:
    times = np.cumsum(np.tile([0.02, 0.05, 0.033], 10))
    path = np.stack([0 * times, 0 * times, 5.0 - 1.3 * times], axis=1)
    values = Synthesizer(moving(*plate(0.2), path, times), RAW).map(CAMERA).values
    np.testing.assert_array_equal(values[RAW.axis.bin_of(1.3)], 1.0)


def test_oversampling_spreads_a_fast_swing_within_its_frame() -> None:
    times = np.arange(20) / 30.0
    path = np.stack([0 * times, 0 * times, 3.0 + 0.05 * np.sin(2 * np.pi * 4 * times)], axis=1)
    dot = moving(np.zeros((1, 3)), None, path, times)
    once = Synthesizer(dot, options(visibility="none")).map(CAMERA)
    many = Synthesizer(dot, options(visibility="none", oversampling=9)).map(CAMERA)
    np.testing.assert_allclose(many.values.sum(axis=0), 1.0, rtol=1e-6)
    assert ((many.values > 0).sum(axis=0) > (once.values > 0).sum(axis=0)).mean() > 0.7
    # True speeds reach 1.26 m/s; the plain difference over two frames sees less.
    top = RAW.axis.centres_mps[(many.values > 0).any(axis=1)].max()
    assert RAW.axis.centres_mps[(once.values > 0).any(axis=1)].max() < top < 1.26 + 0.0625


def test_smoothing_the_path_removes_jitter() -> None:
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 5.0 - 1.3 * TIMES_S], axis=1)
    jitter = np.random.default_rng(0).normal(scale=0.01, size=(30, 100, 3))
    vertices, faces = plate(0.2)
    still = moving(vertices, faces, path, TIMES_S)
    mesh = MeshSequence(np.asarray(still.vertices) + jitter, faces, still.timebase, "jitter")

    def spread(smoothing_s: float) -> float:
        chosen = options(visibility="none", trajectory_smoothing_s=smoothing_s)
        frame = Synthesizer(mesh, chosen).frame(CAMERA, 15)
        return float(frame.velocity_mps.std())

    assert spread(0.1) < 0.2 * spread(0.0)
