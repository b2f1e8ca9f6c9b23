from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sd2app.maps.partial_map import FINAL, PREVIEW, Part, PartialMap, empty_map, pieces
from sd2app.session.maps import MapModel
from sd2core.doppler.options import SynthesisOptions
from sd2core.maps import LimbMaps
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import JOINTS, QUANTITIES
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase


def values_of(frames, value):
    return np.full((2, frames), value, np.float32)


def partial_map(frames):
    """An empty map of two bins, and the track that it is shown on."""
    times, track = Timebase.regular(frames, 30.0), MapModel("Synthetic")
    mesh = MeshSequence(np.zeros((frames, 3, 3), np.float32), None, times)
    partial = PartialMap(track)
    options = SynthesisOptions(axis=VelocityAxis(2, 2.0), null_bins=())
    partial.begin(empty_map(options, mesh))
    return partial, track


def paint(partial, sensor, start, values, quality, limbs=None):
    key = "key" if quality == FINAL else None
    partial.take(Part(sensor, start, values, limbs, quality, f"rank {quality}", "count", key))


@given(
    st.lists(st.booleans(), min_size=1, max_size=80),
    st.integers(1, 20),
    st.data(),
)
def test_pieces_are_of_all_that_want_something_and_of_nothing_else(wants, size, data):
    wanting = np.array(wants)
    start = data.draw(st.integers(0, len(wants)))
    stop = data.draw(st.integers(start, len(wants)))
    covered, before = np.zeros(len(wants), bool), start
    for first, last in pieces(wanting, start, stop, size):
        assert before <= first < last <= min(first + size, stop)
        covered[first:last], before = True, last
    np.testing.assert_array_equal(covered[start:stop], wanting[start:stop])


def test_a_new_placement_forgets_the_old_one():
    partial, track = partial_map(10)
    here, there = VirtualSensor(), VirtualSensor(position_m=(1, 0, 0))
    paint(partial, here, 0, values_of(10, 1.0), FINAL)
    assert partial.final
    paint(partial, there, 4, values_of(3, 2.0), PREVIEW)
    assert not partial.full
    assert track.covered.tolist() == [False] * 4 + [True] * 3 + [False] * 3
    assert partial.quality.tolist() == [0] * 4 + [PREVIEW] * 3 + [0] * 3
    assert not partial.quality_for(here).any()
    np.testing.assert_array_equal(partial.quality_for(there), partial.quality)


def test_levels_refer_to_the_first_whole_map_and_until_then_to_what_there_is():
    (partial, track), here = partial_map(4), VirtualSensor()
    paint(partial, here, 0, values_of(1, 0.0), PREVIEW)
    assert track.reference == 1.0
    paint(partial, here, 1, values_of(1, 3.0), PREVIEW)
    assert track.reference == 3.0
    track.set_reference(8.0, by_hand=True)
    paint(partial, here, 1, values_of(1, 3.0), PREVIEW)
    assert track.reference == 8.0
    paint(partial, here, 2, values_of(2, 5.0), PREVIEW)
    assert track.reference == 5.0
    paint(partial, here, 0, values_of(4, 7.0), FINAL)
    assert track.reference == 5.0


def test_ranks_rise_to_final():
    partial, _ = partial_map(4)
    assert not partial.full
    paint(partial, VirtualSensor(), 0, values_of(4, 1.0), PREVIEW)
    assert partial.full
    assert not partial.final
    paint(partial, VirtualSensor(), 0, values_of(4, 1.0), FINAL)
    assert partial.quality.min() == FINAL


def test_what_is_left_is_kept_where_it_is_final():
    (partial, track), here = partial_map(4), VirtualSensor()
    for start, quality in ((0, PREVIEW), (1, FINAL)):
        assert partial.kept() is None
        paint(partial, here, start, values_of(4 - start, 1.0), quality)
    assert partial.kept() is None
    assert track.key is None
    paint(partial, here, 0, values_of(1, 2.0), FINAL)
    assert track.key == "key"
    kept = partial.kept()
    paint(partial, VirtualSensor(position_m=(1, 0, 0)), 0, values_of(4, 3.0), PREVIEW)
    assert (kept.key, kept.start, kept.sensor) == ("key", 0, here)
    assert kept.values[0].tolist() == [2.0, 1.0, 1.0, 1.0]
    partial.take(kept)
    assert partial.final
    assert track.map.values[0].tolist() == [2.0, 1.0, 1.0, 1.0]


def test_another_plan_leaves_the_values_until_they_are_replaced():
    (partial, track), here = partial_map(4), VirtualSensor()
    paint(partial, here, 0, values_of(3, 1.0), FINAL)
    partial.mark_stale()
    assert partial.quality.tolist() == [PREVIEW] * 3 + [0]
    assert track.map.values[0].tolist() == [1.0] * 3 + [0.0]


@given(
    st.lists(st.tuples(st.integers(0, 9), st.integers(1, 10), st.integers(0, 10**6)), max_size=12)
)
def test_parts_are_painted_whole_also_where_they_become_zero(strokes):
    (partial, track), wanted = partial_map(10), np.zeros((3, 2, 10), np.float32)
    kinematics = np.zeros((len(JOINTS), len(QUANTITIES), 10), np.float32)
    for start, frames, seed in strokes:
        stop, rng = min(start + frames, 10), np.random.default_rng(seed)
        limbs = rng.random((3, 2, stop - start)).astype(np.float32)
        limbs[rng.random((3, 2)) < 0.6] = 0  # most parts stand still
        moves = rng.normal(size=(*kinematics.shape[:2], stop - start)).astype(np.float32)
        split = LimbMaps(("a", "b", "c"), limbs, moves)
        paint(partial, VirtualSensor(), start, values_of(stop - start, 1.0), FINAL, split)
        wanted[..., start:stop], kinematics[..., start:stop] = limbs, moves
        np.testing.assert_array_equal(track.map.limbs.values, wanted)
        np.testing.assert_array_equal(track.map.limbs.kinematics, kinematics)


def test_parts_of_somebody_who_comes_take_the_place_of_the_others():
    partial, track = partial_map(6)

    def limbs(names):
        return LimbMaps(names, np.ones((len(names), 2, 3), np.float32), None)

    paint(partial, VirtualSensor(), 0, values_of(3, 1.0), FINAL, limbs(("arm",)))
    paint(partial, VirtualSensor(), 3, values_of(3, 2.0), FINAL, limbs(("arm", "anna: arm")))
    found = track.map.limbs
    assert found.parts == ("arm", "anna: arm")
    np.testing.assert_array_equal(found.values[:, 0], [[0, 0, 0, 1, 1, 1]] * 2)
