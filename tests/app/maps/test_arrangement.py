"""Order, heights and folding of the maps, without a window."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.maps.arrangement import HEADER_PX, MIN_PX, Arrangement, Row, heights_px
from sd2app.settings import Settings

NAMES = ("synthetic", "denoised", "real")
ROWS = st.lists(
    st.builds(Row, st.none() | st.integers(1, 900), st.booleans()), min_size=1, max_size=6
)


@given(ROWS, st.integers(0, 2000))
def test_maps_fill_the_room_and_are_never_too_low(rows, room_px):
    heights = heights_px(rows, room_px)
    for row, height in zip(rows, heights, strict=True):
        assert height == HEADER_PX if row.folded else height >= max(MIN_PX, row.wanted_px or 0)
    if any(not row.folded for row in rows):
        assert sum(heights) >= room_px
    # Beyond the room they reach only where each is as low as it may be.
    if sum(heights) > room_px:
        least = [max(MIN_PX, row.wanted_px or 0) for row in rows if not row.folded]
        assert sum(heights) == sum(least) + HEADER_PX * sum(row.folded for row in rows)


@given(st.integers(1, 6), st.integers(0, 2000))
def test_maps_share_the_room_alike(count, room_px):
    heights = heights_px([Row()] * count, room_px)
    assert max(heights) - min(heights) <= 1


def test_what_the_user_set_is_kept():
    settings = Settings.forgetful()
    one = Arrangement(NAMES, settings, None)
    one.fold("denoised", True)
    one.set_height("real", 321)
    one.move("real", "synthetic", below=False)
    one.enlarge("real")
    other = Arrangement(NAMES, settings, None)
    assert other.order == ["real", "synthetic", "denoised"]
    assert other.row("denoised") == Row(folded=True)
    assert other.row("real") == Row(321)
    assert other.enlarged is None


@pytest.mark.parametrize("kept", ["no json", "[1, 2]", '{"real": 3}', '{"real": ["high", 0]}'])
def test_damaged_settings_are_as_none(kept):
    settings = Settings.forgetful()
    settings.set_value("maps/arrangement", kept)
    arrangement = Arrangement(NAMES, settings, None)
    assert arrangement.order == list(NAMES)
    assert all(arrangement.row(name) == Row() for name in NAMES)


def test_maps_of_later_versions_go_last():
    settings = Settings.forgetful()
    Arrangement(("real", "synthetic"), settings, None).fold("real", True)
    assert Arrangement(NAMES, settings, None).order == ["real", "synthetic", "denoised"]


@given(st.permutations(NAMES), st.sampled_from(NAMES), st.booleans())
def test_a_moved_map_stands_beside_the_other(order, other, below):
    name = next(each for each in order if each != other)
    arrangement = Arrangement(order, Settings.forgetful(), None)
    arrangement.move(name, other, below)
    found = arrangement.order
    assert sorted(found) == sorted(NAMES)
    assert found.index(name) - found.index(other) == (1 if below else -1)
