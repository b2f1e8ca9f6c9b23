from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.number_lists import format_numbers, parse_interval, parse_numbers

numbers = st.floats(-400, 400)


@given(st.lists(numbers, min_size=1, max_size=8))
def test_what_is_written_is_read_again(values):
    assert parse_numbers(format_numbers(values)) == tuple(values)


@given(st.integers(-90, 90), st.integers(1, 30), st.integers(2, 12))
def test_an_evenly_spaced_list_is_written_as_a_range(first, step, steps):
    values = [float(first + number * step) for number in range(steps + 1)]
    assert format_numbers(values) == f"{first}:{first + steps * step}:{step}"
    assert parse_numbers(format_numbers(values)) == tuple(values)


def test_ranges_hold_both_ends_and_may_go_down():
    assert parse_numbers("-60:60:30, 75") == (-60.0, -30.0, 0.0, 30.0, 60.0, 75.0)
    assert parse_numbers("2:1:-0.25") == (2.0, 1.75, 1.5, 1.25, 1.0)
    np.testing.assert_array_equal(parse_numbers("0.1:0.5:0.1"), (0.1, 0.2, 0.3, 0.4, 0.5))


def test_a_minus_sign_may_be_typeset():
    assert parse_numbers("−30, 0") == (-30.0, 0.0)


@pytest.mark.parametrize(
    "text",
    ["", "1,", "a", "1:2", "1:2:3:4", "1:2:0", "1:2:-1", "1:2:0.3", "nan", "inf", "0:1e9:1", "1 2"],
)
def test_what_is_no_list_is_refused(text):
    with pytest.raises(Sd2Error, match="Expected"):
        parse_numbers(text)


def test_an_interval_is_two_numbers_or_one():
    assert parse_interval("-60:60") == (-60.0, 60.0)
    assert parse_interval(" 2.5 ") == (2.5, 2.5)
    for text in ("", "1:2:3", "a:b", "nan", "1,2"):
        with pytest.raises(Sd2Error, match="interval"):
            parse_interval(text)
