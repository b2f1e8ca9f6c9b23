from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import (
    VelocityAxis,
    VirtualSensor,
    aimed_at,
    position_from_spherical,
    spherical_from_position,
)

coordinates = st.floats(-50, 50)
points = st.tuples(coordinates, coordinates, coordinates)


@given(st.integers(2, 254), st.floats(0.1, 50), st.floats(-1, 1))
def test_the_bin_of_a_velocity_holds_it(bins, v_max, share):
    axis = VelocityAxis(bins, v_max)
    velocity = share * v_max
    index = axis.bin_of(velocity)
    assert index is not None
    assert axis.edges_mps[index] <= velocity + 1e-9
    assert velocity <= axis.edges_mps[index + 1] + 1e-9


def test_the_default_axis_nulls_around_zero():
    axis = VelocityAxis()
    assert axis.bins == 32
    assert axis.edges_mps[14] == pytest.approx(-0.25)
    assert axis.edges_mps[17] == pytest.approx(0.125)
    assert axis.bin_of(2.0) == 31
    assert axis.bin_of(2.001) is None
    np.testing.assert_allclose(np.diff(axis.centres_mps), 0.125)


@given(points, points)
def test_range_and_angles_lead_back_to_the_position(target, position):
    assume(math.dist(target, position) > 0.01)
    spherical = spherical_from_position(target, position)
    np.testing.assert_allclose(position_from_spherical(target, *spherical), position, atol=1e-9)


def test_the_camera_is_straight_ahead_of_a_body_on_its_axis():
    assert spherical_from_position((0, 0, 2.2), (0, 0, 0)) == (2.2, 0.0, 0.0)
    right = position_from_spherical((0, 0, 2.0), 2.0, 90.0, 0.0)
    np.testing.assert_allclose(right, (2, 0, 2), atol=1e-12)
    above = position_from_spherical((0, 0, 2.0), 2.0, 0.0, 90.0)
    np.testing.assert_allclose(above, (0, -2, 2), atol=1e-12)


def test_limits_follow_from_the_configuration():
    assert PAPER_RADAR.wavelength_m == pytest.approx(299_792_458 / 60e9)
    assert PAPER_RADAR.v_max_mps == pytest.approx(3.1978, rel=1e-4)
    assert PAPER_RADAR.velocity_resolution_mps == pytest.approx(2 * 3.1978 / 64, rel=1e-4)
    assert PAPER_RADAR.range_resolution_m == pytest.approx(0.59958, rel=1e-4)
    assert PAPER_RADAR.range_max_m == pytest.approx(9.5934, rel=1e-4)
    assert PAPER_RADAR.range_max_m > 6.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"end_frequency_hz": 1e9}, "ends at 1e+09 Hz"),
        ({"end_frequency_hz": math.inf}, "end_frequency_hz is inf"),
        (
            {"start_frequency_hz": 60.0, "end_frequency_hz": 61.0},
            "sweeps from 60 Hz to 61 Hz. Expected: radar frequencies, between 100 MHz and 1 THz."
            " State them in Hz",
        ),
        ({"end_frequency_hz": 60e12}, "to 6e+13 Hz"),
        ({"chirps_per_frame": 1}, "chirps_per_frame is 1"),
        ({"frame_repetition_s": 1e-3}, "do not fit"),
        ({"sample_rate_hz": math.nan}, "sample_rate_hz is nan"),
    ],
)
def test_impossible_radars_are_explained(change, words):
    with pytest.raises(Sd2Error) as caught:
        replace(PAPER_RADAR, **change)
    assert words in str(caught.value)


@pytest.mark.parametrize("position", [(0, 0), (0, 0, math.inf), (math.nan, 0, 0)])
def test_impossible_positions_are_explained(position):
    with pytest.raises(Sd2Error, match="sensor position"):
        VirtualSensor(position_m=position)


def test_the_boresight_looks_along_the_optical_axis():
    np.testing.assert_allclose(VirtualSensor().boresight, (0, 0, 1), atol=1e-15)
    np.testing.assert_allclose(VirtualSensor(azimuth_deg=90).boresight, (1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(VirtualSensor(elevation_deg=90).boresight, (0, -1, 0), atol=1e-15)


@given(points, points)
def test_an_aimed_sensor_looks_at_its_target(position, target):
    assume(math.dist(position, target) > 0.01)
    sensor = aimed_at(VirtualSensor(position_m=position), target)
    assert sensor.position_m == tuple(position)
    along = np.subtract(target, position) / math.dist(position, target)
    np.testing.assert_allclose(sensor.boresight, along, atol=1e-9)


def test_a_sensor_on_its_target_keeps_its_direction():
    sensor = VirtualSensor(position_m=(1, 2, 3), azimuth_deg=10)
    assert aimed_at(sensor, (1, 2, 3)) == sensor
