from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.placements.placements import (
    MAX_PLACEMENTS,
    Place,
    PlacementCloud,
    PlacementGrid,
    placements_from_dict,
    read_placements,
    write_placements,
)
from sd2core.sensor import spherical_from_position

coordinates = st.floats(-20, 20)
targets = st.tuples(coordinates, coordinates, coordinates)
ranges = st.floats(0.05, 1000)
azimuths = st.floats(-360, 360)
elevations = st.floats(-90, 90)


def pairs(values):
    return st.tuples(values, values).map(sorted).map(tuple)


grids = st.builds(
    PlacementGrid,
    st.lists(ranges, min_size=1, max_size=4).map(tuple),
    st.lists(azimuths, min_size=1, max_size=4).map(tuple),
    st.lists(elevations, min_size=1, max_size=4).map(tuple),
)
clouds = st.builds(
    PlacementCloud,
    st.integers(1, 40),
    pairs(ranges),
    pairs(azimuths).filter(lambda pair: pair[1] - pair[0] <= 360),
    pairs(elevations),
    st.integers(0, 2**63 - 1),
)
specs = grids | clouds


@pytest.mark.slow
@given(specs, targets)
def test_every_sensor_looks_at_the_target_from_where_it_says(spec, target):
    places, sensors = spec.places(), spec.sensors(target)
    assert len(places) == len(sensors)
    for place, sensor in zip(places, sensors, strict=True):
        offset = np.subtract(target, sensor.position_m)
        assert np.linalg.norm(offset) == pytest.approx(place.range_m, rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(sensor.boresight, offset / np.linalg.norm(offset), atol=1e-6)
        _, azimuth_deg, elevation_deg = spherical_from_position(target, sensor.position_m)
        assert elevation_deg == pytest.approx(place.elevation_deg, abs=1e-4)
        turn = math.remainder(azimuth_deg - place.azimuth_deg, 360.0)
        assert abs(turn) * math.cos(math.radians(elevation_deg)) < 1e-4


def test_the_first_place_is_on_the_cameras_side_then_right_then_above():
    front, right, above = (
        PlacementGrid((2.0,), (azimuth,), (elevation,)).sensors((0.0, 0.0, 3.0))[0]
        for azimuth, elevation in ((0.0, 0.0), (90.0, 0.0), (0.0, 90.0))
    )
    np.testing.assert_allclose(front.position_m, (0.0, 0.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(front.boresight, (0.0, 0.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(right.position_m, (2.0, 0.0, 3.0), atol=1e-12)
    np.testing.assert_allclose(above.position_m, (0.0, -2.0, 3.0), atol=1e-12)


@given(spec=specs)
def test_a_spec_survives_json_and_its_file(spec, tmp_path_factory):
    assert placements_from_dict(json.loads(json.dumps(spec.as_dict()))) == spec
    file = tmp_path_factory.getbasetemp() / "spec.json"
    write_placements(file, spec)
    assert read_placements(file) == spec


@given(specs)
def test_no_place_comes_twice_and_all_are_within_bounds(spec):
    places = spec.places()
    assert len(set(places)) == len(places)
    for place in places:
        assert 0.05 <= place.range_m <= 1000
        assert -180 < place.azimuth_deg <= 180
        assert -90 <= place.elevation_deg <= 90


def test_a_grid_has_every_combination():
    grid = PlacementGrid((1.0, 2.0, 4.0), (-30.0, 0.0, 30.0, 60.0), (-10.0, 20.0))
    assert len(grid.places()) == 3 * 4 * 2


def test_what_is_the_same_place_is_taken_once():
    assert len(PlacementGrid((1.0, 1.0), (180.0, -180.0)).places()) == 1
    assert len(PlacementGrid((1.0,), (0.0, 40.0, 80.0), (90.0, -90.0)).places()) == 2
    assert len(PlacementCloud(20, (2.0, 2.0)).places()) == 1


@given(clouds, st.integers(0, 100))
def test_a_larger_cloud_of_the_same_seed_begins_with_the_smaller(cloud, more):
    larger = replace(cloud, count=cloud.count + more).places()
    assert larger[: len(cloud.places())] == cloud.places()


def test_another_seed_makes_other_places():
    cloud = PlacementCloud(5, (1.0, 4.0), (-60.0, 60.0), (-20.0, 40.0), seed=1)
    assert cloud.places() == replace(cloud).places()
    assert not set(cloud.places()) & set(replace(cloud, seed=2).places())


def test_a_cloud_around_everywhere_is_uniform_over_the_sphere():
    cloud = PlacementCloud(8000, (1.0, 3.0), (-180.0, 180.0), (-90.0, 90.0), seed=3)
    towards = np.array([s.position_m for s in cloud.sensors((0.0, 0.0, 0.0))])
    range_m = np.linalg.norm(towards, axis=1)
    units = towards / range_m[:, None]
    # Of a uniform direction every coordinate is uniform over [-1, 1]: mean 0, square 1/3.
    np.testing.assert_allclose(units.mean(axis=0), 0.0, atol=0.03)
    np.testing.assert_allclose((units**2).mean(axis=0), 1 / 3, atol=0.015)
    assert range_m.mean() == pytest.approx(2.0, abs=0.03)


@given(clouds)
def test_a_cloud_keeps_within_its_intervals(cloud):
    for place in cloud.places():
        assert cloud.range_m[0] - 1e-6 <= place.range_m <= cloud.range_m[1] + 1e-6
        assert cloud.elevation_deg[0] - 1e-6 <= place.elevation_deg <= cloud.elevation_deg[1] + 1e-6
        if abs(place.elevation_deg) < 90.0:
            middle, half = np.mean(cloud.azimuth_deg), np.ptp(cloud.azimuth_deg) / 2
            assert abs(math.remainder(place.azimuth_deg - middle, 360.0)) <= half + 2e-6


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ([], "table"),
        ({"kind": "ring"}, "ring"),
        ({"kind": "grid"}, "no ranges_m"),
        ({"kind": "grid", "ranges_m": []}, "no ranges"),
        ({"kind": "grid", "ranges_m": [0]}, "range 0 m"),
        ({"kind": "grid", "ranges_m": [1], "elevations_deg": [91]}, "elevation 91"),
        ({"kind": "grid", "ranges_m": [1], "azimuths_deg": [math.nan]}, "nan"),
        ({"kind": "grid", "ranges_m": [True]}, "True"),
        ({"kind": "grid", "ranges_m": [10**400]}, "finite"),
        ({"kind": "grid", "ranges_m": "12"}, "list"),
        ({"kind": "grid", "ranges_m": [1], "spacing": 3}, "spacing"),
        ({"kind": "grid", "ranges_m": [1] * 101, "azimuths_deg": [0] * 100}, str(MAX_PLACEMENTS)),
        ({"kind": "cloud", "range_m": [1, 2]}, "no count"),
        ({"kind": "cloud", "count": 0, "range_m": [1, 2]}, "count"),
        ({"kind": "cloud", "count": MAX_PLACEMENTS + 1, "range_m": [1, 2]}, str(MAX_PLACEMENTS)),
        ({"kind": "cloud", "count": 2.0, "range_m": [1, 2]}, "2.0"),
        ({"kind": "cloud", "count": 2, "range_m": [2, 1]}, "smaller one first"),
        ({"kind": "cloud", "count": 2, "range_m": [1, 2, 3]}, "two numbers"),
        ({"kind": "cloud", "count": 2, "range_m": [1, 2], "azimuth_deg": [-200, 200]}, "360"),
        ({"kind": "cloud", "count": 2, "range_m": [1, 2], "seed": -1}, "seed"),
    ],
)
def test_what_is_wrong_is_named(content, words):
    with pytest.raises(Sd2Error, match=words):
        placements_from_dict(content)


def test_toml_by_hand_is_read_and_a_bad_file_is_named(tmp_path):
    file = tmp_path / "around.toml"
    file.write_text('kind = "grid"\nranges_m = [1, 2.5]\nazimuths_deg = [-30, 30]\n')
    assert read_placements(file) == PlacementGrid((1.0, 2.5), (-30.0, 30.0), (0.0,))
    for text in ("kind = ", 'kind = "grid"\nranges_m = [-1]\n', 'format = "else"\n'):
        file.write_text(text)
        with pytest.raises(Sd2Error, match=r"around\.toml"):
            read_placements(file)
    with pytest.raises(Sd2Error, match="nowhere"):
        read_placements(tmp_path / "nowhere.json")


def test_words_are_rounded_and_know_no_minus_nought():
    assert Place(2.89955, 74.7898, -0.04).words == "2.9 m, azimuth 74.8°, elevation 0°"
