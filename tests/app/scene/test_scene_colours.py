"""What colours mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.palette import LIGHT
from sd2app.scene.colours import (
    Colouring,
    marker_colours,
    mesh_colours,
    range_colours,
    range_limits,
)
from sd2app.widgets.time_axis import tick_step
from sd2core.figures.colours import DIVERGING, SEQUENTIAL, rgb, velocity_colours


def luminance(colours: np.ndarray) -> np.ndarray:
    linear = (np.asarray(colours) / 255.0) ** 2.2
    return linear @ [0.2126, 0.7152, 0.0722]


def test_approaching_is_red_receding_is_blue_still_is_neutral() -> None:
    red, neutral, blue = velocity_colours(np.array([1.5, 0.0, -1.5]), 2.0).astype(int)
    assert red[0] > red[2] + 80
    assert blue[2] > blue[0] + 80
    assert np.ptp(neutral) < 12


def test_velocity_colours_are_symmetric_in_lightness_and_end_at_the_limits() -> None:
    light = luminance(DIVERGING)
    np.testing.assert_allclose(light, light[::-1], atol=0.09)
    ends = velocity_colours(np.array([-9.0, -2.0, 2.0, 9.0]), 2.0)
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[2], ends[3])


def test_diverging_lightness_falls_from_the_middle_to_both_ends() -> None:
    light = luminance(DIVERGING)
    assert (np.diff(light[:127]) >= -0.02).all()
    assert (np.diff(light[129:]) <= 0.02).all()
    assert light[0] < 0.35 * light[128]


def test_range_colours_darken_with_distance() -> None:
    assert (np.diff(luminance(SEQUENTIAL)) <= 0.01).all()
    near, far = range_colours(np.array([1.0, 3.0]), (1.0, 3.0))
    np.testing.assert_array_equal(near, SEQUENTIAL[0])
    np.testing.assert_array_equal(far, SEQUENTIAL[-1])


def test_unknown_values_have_a_colour() -> None:
    assert velocity_colours(np.array([np.nan, np.inf, -np.inf]), 2.0).shape == (3, 3)


@given(st.floats(0.0, 1e6), st.floats(0.0, 1e3))
def test_range_limits_enclose_and_are_not_empty(nearest: float, span: float) -> None:
    low, high = range_limits(nearest, nearest + span)
    slack = 1e-6 * max(nearest + span, 1.0)
    assert 0.0 <= low <= nearest + slack
    assert high >= nearest + span - slack
    assert high > low


@pytest.mark.parametrize(
    ("span", "most", "step"), [(2.0, 5, 0.5), (1.0, 5, 0.2), (1.4, 8, 0.2), (40.0, 12, 5.0)]
)
def test_steps_are_round(span: float, most: int, step: float) -> None:
    assert tick_step(span, most) == pytest.approx(step)


def test_hidden_vertices_are_grey_in_velocity_and_visibility() -> None:
    visible = np.array([True, False])
    for mode in ("velocity", "visibility"):
        seen, hidden = mesh_colours(
            Colouring(mode, velocity_mps=np.array([1.5, 1.5]), visible=visible), LIGHT, 2
        )
        np.testing.assert_array_equal(hidden, rgb(LIGHT.hidden))
        assert np.ptp(seen.astype(int)) > 60


def test_hidden_vertices_keep_a_trace_of_their_range() -> None:
    colours = mesh_colours(
        Colouring(
            "range",
            range_m=np.array([1.0, 1.0, 3.0]),
            range_limits_m=(1.0, 3.0),
            visible=np.array([True, False, False]),
        ),
        LIGHT,
        3,
    )
    saturation = np.ptp(colours.astype(int), axis=1)
    assert saturation[1] < 0.5 * saturation[0]
    assert not np.array_equal(colours[1], colours[2])


def test_hidden_dots_step_back_towards_the_background() -> None:
    still = Colouring(velocity_mps=np.array([0.0]), visible=np.array([False]))
    surface = mesh_colours(still, LIGHT, 1)
    dots = mesh_colours(replace(still, as_dots=True), LIGHT, 1)
    ground = rgb(LIGHT.backdrop).astype(int)
    assert abs(dots.astype(int) - ground).sum() < abs(surface.astype(int) - ground).sum()


@pytest.mark.parametrize("mode", ["velocity", "range", "visibility", "plain"])
def test_what_is_not_known_yet_is_plain(mode: str) -> None:
    colours = mesh_colours(Colouring(mode), LIGHT, 4)
    np.testing.assert_array_equal(colours, np.tile(rgb(LIGHT.plain), (4, 1)))


def test_places_are_coloured_from_near_to_far_and_those_beyond_the_radar_as_a_warning() -> None:
    ranges = np.array([1.0, 2.5, 4.0])
    near, middle, far = marker_colours(ranges, None, LIGHT)
    np.testing.assert_array_equal(near, SEQUENTIAL[0])
    np.testing.assert_array_equal(far, SEQUENTIAL[-1])
    np.testing.assert_array_equal(middle, SEQUENTIAL[128])
    marked = marker_colours(ranges, np.array([False, True, False]), LIGHT)
    np.testing.assert_array_equal(marked[1], rgb(LIGHT.warning))
    np.testing.assert_array_equal(marked[[0, 2]], [near, far])
    assert (marker_colours(np.array([2.0, 2.0]), None, LIGHT) == SEQUENTIAL[0]).all()
