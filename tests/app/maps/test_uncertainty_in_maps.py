"""Which cells are shown as uncertain, and how."""

from __future__ import annotations

import numpy as np
import pytest

from sd2app.maps.heatmap_image import Columns, heatmap_image
from sd2app.session.display import COLOUR_MAPS, HeatmapLevels
from sd2app.session.maps import MapModel
from sd2app.widgets.canvas import lookup_table, uncertain_table
from sd2core.maps import CellUncertainty, DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

DB = HeatmapLevels(low_db=-30.0, high_db=0.0)


def track_of(values, sd) -> MapModel:
    """A map of two bins: what is given above, and nothing below."""
    values, sd = (np.concatenate([0.0 * np.array(part), part]) for part in (values, sd))
    track = MapModel("Synthetic")
    timebase = Timebase.regular(values.shape[1], 10.0)
    track.set_map(DopplerMap(values, VelocityAxis(len(values), 2.0), timebase, "synthetic"))
    track.set_uncertainty(CellUncertainty(values, sd))
    return track


def test_uncertain_is_what_is_known_to_worse_than_half_of_it():
    track = track_of([[1.0, 1.0, 0.1, 0.1]], [[0.4, 0.6, 0.04, 0.06]])
    assert track.uncertain(DB, 0, 4)[1].tolist() == [False, True, False, True]
    assert track.uncertain(DB, 1, 3)[1].tolist() == [True, False]


@pytest.mark.parametrize("levels", [DB, HeatmapLevels(scale="linear")])
def test_where_nothing_shows_only_what_might_is_uncertain(levels):
    track = track_of([[0.0, 0.0, 0.0005]], [[0.2, 0.05, 0.05]])
    assert track.uncertain(levels, 0, 3)[1].tolist() == [True, False, False]


def test_another_map_has_no_uncertainty_yet():
    track = track_of([[1.0]], [[0.9]])
    changes = []
    track.changed.connect(lambda: changes.append(track.uncertainty))
    assert track.read(0.01, 1.0).deviation == np.float32(0.9)
    track.set_map(track.map)
    assert changes == [None]
    assert track.uncertain(DB, 0, 1) is None
    assert track.read(0.01, 1.0).deviation is None


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_without_colour_levels_keep_their_lightness(name):
    def channels(table):
        return np.stack([table >> 16 & 255, table >> 8 & 255, table & 255], 1).astype(float)

    colour, grey = channels(lookup_table(name)), channels(uncertain_table(name))
    light = np.array([0.2126, 0.7152, 0.0722])
    # Amber cannot be as light as white.
    dim = slice(0, 256 if name != "gray" else 190)
    np.testing.assert_allclose((grey @ light)[dim], (colour @ light)[dim], atol=1.0)
    assert np.abs(colour - grey).max(axis=1).mean() > 10


def test_of_frames_that_share_a_column_the_one_that_is_shown_decides():
    values = np.zeros((1, 100))
    sd = np.zeros((1, 100))
    values[0, 10], sd[0, 10] = 1.0, 0.1  # shown, known
    values[0, 12], sd[0, 12] = 0.3, 0.3  # hidden behind it
    values[0, 30], sd[0, 30] = 1.0, 0.9  # shown, unknown
    values[0, 33], sd[0, 33] = 0.5, 0.1
    found = Columns.of(track_of(values, sd), 0.0, 10.0, 10).uncertain(DB)
    assert np.flatnonzero(found[1]).tolist() == [3]


def test_the_picture_takes_the_colour_from_uncertain_cells_only():
    track = track_of([[1.0, 1.0]], [[0.1, 0.9]])
    image = heatmap_image(track, DB, 0.0, 0.2, 2, 0)
    assert image.pixel(0, 0) == lookup_table("viridis")[255]
    assert image.pixel(1, 0) == uncertain_table("viridis")[255]
    track.set_uncertainty(None)
    image = heatmap_image(track, DB, 0.0, 0.2, 2, 0)
    assert image.pixel(1, 0) == lookup_table("viridis")[255]


def test_a_value_that_is_certainly_elsewhere_is_not_known():
    track = track_of([[1.0]], [[0.0]])
    assert not track.uncertain(DB, 0, 1)[1, 0]
    elsewhere = CellUncertainty(np.array([[0.4], [0.4]]), np.zeros((2, 1)))
    track.set_uncertainty(elsewhere)
    assert track.uncertain(DB, 0, 1).tolist() == [[True], [True]]
    assert track.read(0.01, 1.0).deviation == pytest.approx(0.6)
