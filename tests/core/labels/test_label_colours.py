"""Which colours pass for one, and to whom."""

from __future__ import annotations

from itertools import combinations

import pytest

from sd2core.labels.colours import _VISION, ALIKE, OFFERED, Alike, alike, distance
from sd2core.labels.label_set import GESTURES, Label


def test_offered_colours_differ_to_all_eyes() -> None:
    offered = tuple(Label(name, colour) for name, colour in OFFERED)
    assert not alike(offered)
    assert not alike(GESTURES.labels)
    assert {one.colour for one in GESTURES.labels} <= {colour for _, colour in OFFERED}


@pytest.mark.parametrize("vision", _VISION)
def test_every_vision_sees_greys_as_they_are_and_black_from_white(vision: str) -> None:
    for grey in ("#000000", "#808080", "#ffffff"):
        assert distance(grey, grey, vision) == 0.0
    assert distance("#000000", "#ffffff", vision) == pytest.approx(1.0, abs=1e-3)
    # A matrix whose rows sum to one leaves greys grey.
    assert _VISION[vision].sum(axis=1) == pytest.approx(1.0, abs=1e-5)


def test_a_distance_has_no_direction() -> None:
    for (_, one), (_, other) in combinations(OFFERED, 2):
        assert distance(one, other) == pytest.approx(distance(other, one))
        assert distance(one, other) > ALIKE


@pytest.mark.parametrize(
    ("one", "other", "vision"),
    [
        ("#d55e00", "#e06a10", ""),
        ("#ff0000", "#a05000", "without red cones"),
        ("#ff0000", "#00a000", "without green cones"),
        ("#0072b2", "#009090", "without blue cones"),
    ],
)
def test_a_pair_is_named_with_the_eyes_that_confuse_it(one: str, other: str, vision: str) -> None:
    found = alike((Label("a", one), Label("b", other), Label("c", "#f0e442")))
    assert found == (Alike("a", "b", vision),)
    assert found[0].words().startswith("a and b look alike")
    assert found[0].words().endswith(vision or "alike")
