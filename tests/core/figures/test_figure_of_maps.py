"""Figures of Doppler maps: the difference of two, what is left out, what the file says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from sd2core.errors import Sd2Error
from sd2core.figures.maps import Levels, MapRow, difference_of, draw_maps, save_maps
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def row_of(values, reference=1.0, title="A map", offset_s=0.0, rate=10.0, **more):
    values = np.asarray(values, np.float32)
    doppler = DopplerMap(
        values,
        VelocityAxis(len(values), 2.0),
        Timebase.regular(values.shape[1], rate),
        "denoised",
        unit="power",
        **more,
    )
    return MapRow(doppler, title, reference, offset_s)


@pytest.mark.parametrize("unit", [1.0, 7e-5])
def test_the_difference_is_that_of_maps_made_as_strong_as_each_other(unit):
    # Both add up to 1,110 of the other's unit, whatever that of the first is.
    one = row_of(np.array([[100.0, 10.0], [1000.0, 0.0]]) * unit)
    other = row_of([[10.0, 100.0], [500.0, 500.0]], reference=1000.0)
    difference, known = difference_of(one, other, Levels(low_db=-30.0, high_db=0.0))
    np.testing.assert_allclose(
        difference, [[10.0, -10.0], [10 * np.log10(2.0), 10 * np.log10(2.0) - 30.0]], atol=1e-4
    )
    assert known.all()
    difference, _ = difference_of(one, other, Levels(scale="linear"))
    np.testing.assert_allclose(difference, [[9.0, -9.0], [50.0, -50.0]], atol=1e-3)


def test_maps_on_other_clocks_meet_at_the_same_moment():
    one = row_of([[0.1, 0.1, 0.1, 1.0, 0.1, 0.1]] * 2)
    # The same moment, 0.3 s, is frame 3 of a clock that starts 0.15 s later at 20 frames/s.
    late = np.full((2, 6), 0.1)
    late[:, 3] = 1.0
    other = row_of(late, offset_s=0.15, rate=20.0)
    difference, known = difference_of(one, other, Levels())
    assert known[0].tolist() == [False, False, True, True, True, False]
    np.testing.assert_allclose(difference, 0.0, atol=1e-5)


def test_where_one_says_nothing_there_is_no_difference():
    one = row_of(np.ones((4, 3)), null_bins=(1,), present=np.array([True, False, True]))
    quiet = np.full((4, 3), 0.1)
    quiet[1], quiet[3] = 1e6, 1e6  # where the other says nothing, or it itself
    quiet[0] = 1e-4
    other = row_of(quiet, unseen_bins=(3,))
    difference, known = difference_of(one, other, Levels())
    assert known.tolist() == [[True, False, True], [False] * 3, [True, False, True], [False] * 3]
    assert (difference[~known] == 0).all()
    # Half of 0.1001 and half of it, against 0.0001 and 0.1; all within 30 dB.
    np.testing.assert_allclose(difference[0, [0, 2]], 10 * np.log10(0.05005) + 30.0, atol=1e-3)
    np.testing.assert_allclose(difference[2, [0, 2]], 10 * np.log10(0.5005), atol=1e-3)
    with pytest.raises(Sd2Error, match="different velocity axes"):
        difference_of(one, row_of(np.ones((5, 3))), Levels())


def test_a_radar_that_was_stopped_saw_nothing():
    whole = row_of(np.ones((4, 40)), rate=8.0)
    times_s = np.delete(whole.doppler.times_s, slice(10, 30))
    doppler = replace(whole.doppler, values=np.ones((4, 20)), timebase=Timebase(times_s))
    stopped = replace(whole, doppler=doppler)
    _, known = difference_of(whole, stopped, Levels())
    assert np.flatnonzero(~known[0]).tolist() == list(range(14, 30))
    figure = draw_maps([stopped], Levels(), start_s=0.0, end_s=5.0)
    (cells,) = figure.axes[0].collections
    assert cells.get_coordinates()[0, 9:12, 0].tolist() == pytest.approx([1.125, 1.75, 3.75])
    assert np.flatnonzero(cells.get_array().mask[0]).tolist() == [10]


def test_a_part_of_the_difference_is_that_of_the_whole():
    """Of the first second alone, the first map would be as strong as the other."""
    half = np.full((4, 10), 1e-3)
    rows = [row_of(np.hstack([half, half])), row_of(np.hstack([half, 100 * half]))]
    whole, part = (
        draw_maps(rows, Levels(low_db=-60.0), start_s=0.0, end_s=end_s, difference=(0, 1))
        for end_s in (2.0, 0.5)
    )
    drawn = [one.axes[2].collections[0].get_array() for one in (whole, part)]
    np.testing.assert_array_equal(drawn[1], drawn[0][:, : drawn[1].shape[1]])
    assert drawn[1].min() > 15.0


def test_what_is_short_is_seen_in_a_figure_of_hours(tmp_path):
    """As on screen; drawn one by one, of the frames in a pixel the last would be seen."""
    frames = 40_000
    values = np.full((4, frames), 1e-3)
    moments = np.arange(1_003, frames, 4_001)
    values[:, moments] = 1.0
    share = [0.5] * frames
    rows = [row_of(values, present=np.arange(frames) >= 500, meta={"visible_share": share})]
    figure = draw_maps(rows, Levels(), start_s=0.0, end_s=frames / 10.0)
    save_maps(figure, tmp_path / "hours.png", rows, {})
    with Image.open(tmp_path / "hours.png") as picture:
        assert json.loads(picture.info["Description"])["maps"][0]["provenance"] == {}
        pixels = np.asarray(picture.convert("RGB"), int)
    box = figure.axes[0].get_window_extent()
    scale = pixels.shape[1] / figure.bbox.width
    line = pixels[round(pixels.shape[0] - scale * (box.y0 + box.y1) / 2)]
    for moment in moments:
        x = scale * (box.x0 + box.width * moment / frames)
        near = line[round(x) - 3 : round(x) + 4]
        assert (np.abs(near - (253, 231, 36)).sum(axis=1) < 60).any()  # the strongest colour


@pytest.mark.slow
def test_the_figure_shows_the_sign_and_carries_provenance(tmp_path):
    loud, quiet = np.full((8, 10), 1.0), np.full((8, 10), 0.01)
    rows = [
        row_of(np.hstack([loud, quiet]), title="Denoised · a model", meta={"sensor": [1, 2, 3]}),
        row_of(np.hstack([quiet, loud]), title="Real"),
    ]
    figure = draw_maps(rows, Levels(), start_s=0.0, end_s=2.0, difference=(0, 1))
    titles = [axes.get_title("left") for axes in figure.axes if axes.get_title("left")]
    assert titles == ["Denoised · a model", "Real", "Denoised − real"]
    how = figure.axes[2].get_title("right")
    assert how == "both as strong altogether, relative to the 0 dB of real"
    save_maps(figure, tmp_path / "maps.png", rows, {"recording": "walk"})
    with Image.open(tmp_path / "maps.png") as picture:
        told = json.loads(picture.info["Description"])
        pixels = np.asarray(picture.convert("RGB"), int)
    assert told["recording"] == "walk"
    assert told["maps"][0]["provenance"] == {"sensor": [1, 2, 3]}
    box = figure.axes[2].get_window_extent()
    scale = pixels.shape[1] / figure.bbox.width
    y = round(pixels.shape[0] - scale * (box.y0 + box.y1) / 2)
    left, right = (round(scale * (box.x0 + share * box.width)) for share in (0.25, 0.75))
    red, green, _ = pixels[y, left]
    assert green > red  # more in the first: green
    red, green, _ = pixels[y, right]
    assert red > green
    with pytest.raises(Sd2Error, match=r"ends in"):
        save_maps(figure, tmp_path / "maps.gif", rows, {})
    with pytest.raises(Sd2Error, match="no Doppler map"):
        draw_maps([], Levels(), start_s=0.0, end_s=1.0)
