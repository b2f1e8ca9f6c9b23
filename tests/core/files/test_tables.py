"""Texts in tables for spreadsheets: computed by none, and read back as they were."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.files.tables import as_cell, of_cell


@given(st.text("'=+-@ \t\n＝＋－＠a1,", max_size=8) | st.text())
def test_a_text_comes_back(text: str) -> None:
    assert of_cell(as_cell(text)) == text
    assert not as_cell(text).lstrip().startswith(tuple("=+-@＝＋－＠"))


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
        ("+1", "'+1"),
        ("-x", "'-x"),
        ("@SUM", "'@SUM"),
        ("\t=1", "'\t=1"),
        ("'=1", "''=1"),
        ("'twas", "'twas"),
        ("left-to-right", "left-to-right"),
        ("", ""),
    ],
)
def test_the_apostrophe(text: str, cell: str) -> None:
    assert as_cell(text) == cell
    assert of_cell(cell) == text
