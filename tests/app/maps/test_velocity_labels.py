"""Labels of the velocity axis of a map."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sd2app.maps.heatmap import velocity_labels


@given(
    v_max_mps=st.sampled_from((0.5, 1.0, 2.0, 3.2, 5.0)) | st.floats(0.05, 50.0),
    height_px=st.floats(8.0, 2000.0),
    line_px=st.floats(9.0, 40.0),
)
def test_labels_never_overprint(v_max_mps: float, height_px: float, line_px: float) -> None:
    labels = velocity_labels(v_max_mps, height_px, line_px)
    assert labels
    middles_px = [beside_px for _, beside_px in sorted(labels, reverse=True)]
    apart_px = [below - above for above, below in pairwise(middles_px)]
    # A line of text is lower than its font's height by what is below its digits.
    assert all(each >= 0.9 * line_px for each in apart_px)


def test_a_map_of_usual_height_has_its_ends_and_zero() -> None:
    assert [velocity for velocity, _ in velocity_labels(2.0, 72.0, 15.0)] == [-2.0, 0.0, 2.0]
    assert [velocity for velocity, _ in velocity_labels(2.0, 23.0, 15.0)] == [0.0]
