from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2app.maps.heatmap_image import Columns
from sd2app.session.display import HeatmapLevels
from sd2app.session.maps import MapModel
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def track_of(values, rate=10.0, **changes) -> MapModel:
    track = MapModel("Synthetic")
    values = np.asarray(values, np.float32)
    track.set_map(
        DopplerMap(
            values,
            VelocityAxis(values.shape[0], 2.0),
            Timebase.regular(values.shape[1], rate),
            "synthetic",
            **changes,
        )
    )
    return track


def test_levels_are_relative_to_the_reference():
    track = track_of(np.ones((4, 2)))
    track.set_reference(0.1)
    assert float(track.levels_db(np.float32(1.0))) == pytest.approx(10.0)
    levels = HeatmapLevels(low_db=-20, high_db=20)
    np.testing.assert_allclose(
        track.shade(np.float32([0.0, 0.001, 0.1, 10.0, 99.0]), levels), [0, 0, 0.5, 1, 1], atol=1e-6
    )
    linear = HeatmapLevels(scale="linear", high_db=0)
    np.testing.assert_allclose(track.shade(np.float32([0, 0.05, 0.1]), linear), [0, 0.5, 1])


def test_a_reading_names_bin_frame_and_sign():
    values = np.zeros((4, 10))
    values[3, 7] = 0.5
    track = track_of(values, null_bins=(1,), unseen_bins=(0,))
    reading = track.read(0.75, 1.2)
    assert reading.frame == 7
    assert reading.velocity_mps == pytest.approx(1.5)
    assert reading.value == 0.5
    assert track.read(0.75, -0.5).note == "nulled bin"
    assert track.read(0.75, -1.9).note == "beyond the radar's v_max"
    assert track.read(0.75, 2.5) is None
    assert track.read(1.05, 1.2) is None
    track.set_offset(0.3)
    assert track.read(1.05, 1.2).frame == 7
    assert track.read(1.05, 1.2).time_s == pytest.approx(1.0)


def shade_columns(track, levels, start_s, stop_s, columns):
    values, filled = Columns.of(track, start_s, stop_s, columns).shown()
    return track.shade(values, levels), filled


def test_every_frame_is_somewhere_when_zoomed_out():
    values = np.zeros((2, 1000))
    values[1, 777] = 1.0
    track = track_of(values)
    shades, filled = shade_columns(track, HeatmapLevels(), 0.0, 100.0, 50)
    assert filled.all()
    assert np.flatnonzero(shades[1] > 0).tolist() == [777 // 20]


def test_a_frame_fills_its_columns_when_zoomed_in():
    values = np.zeros((2, 10))
    values[0, 4] = 1.0
    track = track_of(values)
    shades, filled = shade_columns(track, HeatmapLevels(), 0.0, 1.0, 100)
    assert filled.all()
    assert np.flatnonzero(shades[0] > 0).tolist() == list(range(40, 50))


def test_what_lies_outside_or_is_not_computed_is_left_empty():
    track = track_of(np.ones((2, 10)))
    covered = np.ones(10, bool)
    covered[5:] = False
    track.set_map(track.map, covered)
    track.set_offset(0.5)
    _, filled = shade_columns(track, HeatmapLevels(), 0.0, 2.0, 20)
    assert np.flatnonzero(filled).tolist() == [5, 6, 7, 8, 9]
    assert track.read(1.2, 0.5) is None


def test_columns_without_a_person_are_stretches_on_the_recordings_clock():
    present = np.array([1, 1, 0, 0, 1, 0], bool)
    track = track_of(np.ones((2, 6)), present=present)
    track.set_offset(1.0)
    np.testing.assert_allclose(track.gaps_s, [(1.2, 1.4), (1.5, 1.6)])
    assert track.read(1.25, 1.0).note == "no person"
    assert track.read(1.45, 1.0).note == ""
    assert track_of(np.ones((2, 6))).gaps_s == ()


def test_nothing_is_shown_while_a_radar_was_stopped():
    times_s = np.concatenate([np.arange(10) / 10, 4.0 + np.arange(10) / 10])
    track = track_of(np.ones((2, 20)))
    track.set_map(replace(track.map, timebase=Timebase(times_s)))
    _, filled = shade_columns(track, HeatmapLevels(), 0.01, 6.01, 120)  # 0.05 s each
    expected = [*range(28), *range(80, 100)]
    assert np.flatnonzero(filled).tolist() == expected
    _, filled = shade_columns(track, HeatmapLevels(), 0.0, 6.0, 3)
    assert filled.tolist() == [True, False, True]
    assert track.read(1.3, 0.5) is not None  # a few frames may be missing
    assert track.read(2.0, 0.5) is None
    assert track.read(4.0, 0.5).frame == 10
