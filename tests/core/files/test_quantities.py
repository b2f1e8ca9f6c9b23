"""Numbers with units, as they are typed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.number_lists import parse_quantity

NUMBERS = st.floats(-1e4, 1e4).map(lambda value: round(value, 3))


@given(NUMBERS, st.sampled_from(("", " ", "  ")))
def test_the_same_length_in_any_unit(metres: float, gap: str) -> None:
    for factor, unit in ((1, ""), (1, "m"), (100, "cm"), (1000, "mm")):
        text = f"{metres * factor:.6f}{gap}{unit}"
        assert parse_quantity(text, "m") == pytest.approx(metres, abs=1e-9)
        assert parse_quantity(text.replace(".", ","), "m") == pytest.approx(metres, abs=1e-9)


@given(NUMBERS)
def test_angles_and_times_too(value: float) -> None:
    assert parse_quantity(f"{math.radians(value):.12f} rad", "°") == pytest.approx(value, abs=1e-6)
    assert parse_quantity(f"{1000 * value:.6f}ms", "s") == pytest.approx(value, abs=1e-9)
    assert parse_quantity(f"{value} %", "%") == value


@given(st.text(max_size=8))
def test_anything_else_is_refused_with_what_is_meant(text: str) -> None:
    try:
        value = parse_quantity(text, "m")
    except Sd2Error as error:
        said = str(error)
    else:
        said = "a length such as 250 cm"
        assert math.isfinite(value)
        assert text.strip()[-1:].isdigit() or text.strip()[-1:] in {"m", ".", ","}
    assert "a length" in said
    assert "250 cm" in said


@pytest.mark.parametrize("text", ["", "m", "2.5 kg", "2.5 s", "1:3", "2 5", "inf", "nan", "1e999"])
def test_refused(text: str) -> None:
    with pytest.raises(Sd2Error, match="is not a length"):
        parse_quantity(text, "m")
