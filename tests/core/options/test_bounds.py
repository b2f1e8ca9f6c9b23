"""Bounds of settings, the same for library, commands, plans and window."""

from __future__ import annotations

import math

import pytest

from sd2core.body.fit_video import FitChoices
from sd2core.errors import Sd2Error
from sd2core.options.bounds import EPOCHS, LEARNING_RATE, Bounds


def test_both_ends_are_within_and_nan_is_not() -> None:
    bounds = Bounds(0.5, 2.5)
    assert all(value in bounds for value in (0.5, 1, 2.5))
    assert not any(value in bounds for value in (0.49, 2.51, math.nan, math.inf))
    assert [bounds.nearest(value) for value in (-1.0, 2.0, 3.0)] == [0.5, 2.0, 2.5]


def test_whole_numbers_are_said_and_held() -> None:
    assert 3.0 in EPOCHS
    assert 3.5 not in EPOCHS
    assert Bounds(1, 100, whole=True).words == "a whole number from 1 to 100"
    assert LEARNING_RATE.words == "a number from 1e-08 to 1"


@pytest.mark.parametrize("choices", [{"stature_m": 178.0}, {"field_of_view_deg": 500.0}])
def test_choices_of_a_fit_are_refused_before_any_video_is_opened(
    choices: dict[str, float],
) -> None:
    with pytest.raises(Sd2Error, match=r"178 m|500°"):
        FitChoices(**choices)
