from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sd2app.maps.partial_map import FINAL, PREVIEW, ROUGH, PartialMap, pieces
from sd2core.doppler.synthesizer import Stretch
from sd2core.maps import LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, QUANTITIES
from sd2core.sensor import VirtualSensor


def stretch_of(frames, value):
    ones = np.ones(frames, np.float32)
    values = np.full((2, frames), value)
    return Stretch(values.astype(np.float32), values, ones, 0 * ones, "exact")


@given(
    st.lists(st.integers(0, 3), min_size=1, max_size=80),
    st.integers(1, 3),
    st.integers(1, 20),
    st.data(),
)
def test_pieces_cover_what_is_below_once_and_nothing_else(ranks, below, size, data):
    quality = np.array(ranks, np.uint8)
    start = data.draw(st.integers(0, len(ranks)))
    stop = data.draw(st.integers(start, len(ranks)))
    covered = np.zeros(len(ranks), int)
    for first, last in pieces(quality, below, start, stop, size):
        assert 0 < last - first <= size
        covered[first:last] += 1
    inside = np.zeros(len(ranks), bool)
    inside[start:stop] = True
    np.testing.assert_array_equal(covered, (inside & (quality < below)).astype(int))


def test_a_new_placement_forgets_the_old_one():
    partial = PartialMap(2, 10)
    here, there = VirtualSensor(), VirtualSensor(position_m=(1, 0, 0))
    partial.paint(here, 0, stretch_of(10, 1.0), FINAL)
    assert partial.final
    partial.paint(there, 4, stretch_of(3, 2.0), ROUGH)
    assert not partial.full
    assert partial.quality.tolist() == [0] * 4 + [ROUGH] * 3 + [0] * 3
    assert not partial.quality_for(here).any()
    np.testing.assert_array_equal(partial.quality_for(there), partial.quality)


def test_ranks_rise_to_final():
    partial = PartialMap(2, 4)
    assert not partial.full
    partial.paint(VirtualSensor(), 0, stretch_of(4, 1.0), ROUGH)
    assert partial.full
    assert not partial.final
    partial.paint(VirtualSensor(), 0, stretch_of(4, 1.0), FINAL)
    assert partial.quality.min() == FINAL


def test_another_plan_leaves_the_values_until_they_are_replaced():
    partial, here = PartialMap(2, 4), VirtualSensor()
    partial.paint(here, 0, stretch_of(3, 1.0), FINAL)
    partial.mark_stale()
    assert partial.quality.tolist() == [PREVIEW] * 3 + [0]
    assert partial.values[0].tolist() == [1.0] * 3 + [0.0]


@given(
    st.lists(st.tuples(st.integers(0, 9), st.integers(1, 10), st.integers(0, 10**6)), max_size=12)
)
def test_parts_are_painted_whole_also_where_they_become_zero(strokes):
    partial, wanted = PartialMap(2, 10), np.zeros((3, 2, 10), np.float32)
    kinematics = np.zeros((len(JOINTS), len(QUANTITIES), 10), np.float32)
    for start, frames, seed in strokes:
        stop, rng = min(start + frames, 10), np.random.default_rng(seed)
        limbs = rng.random((3, 2, stop - start)).astype(np.float32)
        limbs[rng.random((3, 2)) < 0.6] = 0  # most parts stand still
        moves = rng.normal(size=(*kinematics.shape[:2], stop - start)).astype(np.float32)
        split = LimbMaps(("a", "b", "c"), limbs, moves)
        painted = replace(stretch_of(stop - start, 1.0), limbs=split)
        partial.paint(VirtualSensor(), start, painted, FINAL)
        wanted[..., start:stop], kinematics[..., start:stop] = limbs, moves
        np.testing.assert_array_equal(partial.limbs.values, wanted)
        np.testing.assert_array_equal(partial.limbs.kinematics, kinematics)
