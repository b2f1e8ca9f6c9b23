"""Segments are their source's own frames; only where frames come unevenly are they between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_sources import AXIS, LABELS, source

from sd2core.datasets.cutting import clips_of, count_segments, cut_source, label_of_segments
from sd2core.datasets.options import dataset_options
from sd2core.datasets.source import KINDS, Source
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import runs
from sd2core.options.exporting import Exporting
from sd2core.pairs.segments import join
from sd2core.timebase import Timebase

NUMBERS = np.arange(3, dtype=np.int16)


def cut_whole(one: Source, options: Exporting, rate_hz: float = 30.0) -> dict:
    blocks = list(cut_source(one, rate_hz, (), NUMBERS, options))
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


@given(
    there=st.lists(st.booleans(), min_size=30, max_size=120),
    length=st.integers(2, 12),
    data=st.data(),
)
def test_segments_put_together_are_the_maps(
    there: list[bool], length: int, data: st.DataObject
) -> None:
    overlap = data.draw(st.integers(0, length - 1))
    present = np.array(there)
    long_enough = [run for run in runs(present) if run[1] - run[0] >= length]
    one = source(frames=len(there), present=present)
    options = Exporting(segment_frames=length, overlap_frames=overlap)
    if not long_enough:
        assert not list(cut_source(one, 30.0, (), NUMBERS, options))
        return
    cut = cut_whole(one, options)
    for start, stop in long_enough:
        mine = (cut["start_frame"] >= start) & (cut["start_frame"] < stop)
        starts = cut["start_frame"][mine] - start
        for kind, doppler in one.maps.items():
            back = join(cut[kind][mine], starts, stop - start)
            np.testing.assert_allclose(back, doppler.values.T[start:stop], rtol=1e-6)
        for start_frame, label, start_s in zip(
            cut["start_frame"][mine], cut["label"][mine], cut["start_s"][mine], strict=True
        ):
            assert np.array_equal(label, one.label[start_frame : start_frame + length])
            assert start_s == one.times_s[start_frame]
    covered = sum(stop - start for start, stop in long_enough)
    frames = cut["start_frame"][:, None] + np.arange(length)
    assert len(np.unique(frames)) == covered  # nothing else is in a segment


def test_no_segment_reaches_over_a_frame_without_a_person() -> None:
    present = np.ones(100, bool)
    present[40] = False
    cut = cut_whole(
        source(frames=100, present=present), Exporting(segment_frames=30, overlap_frames=5)
    )
    frames = cut["start_frame"][:, None] + np.arange(30)
    assert not (frames == 40).any()
    assert cut["available"][:, :2].all()


def test_a_radar_that_missed_a_frame_says_nothing_of_a_segment() -> None:
    one = source(frames=90, kinds=("synthetic", "real"))
    recorded = np.ones(90, bool)
    recorded[:35] = False
    maps = one.maps | {"real": replace(one.maps["real"], present=recorded)}
    cut = cut_whole(replace(one, maps=maps), Exporting(segment_frames=30, overlap_frames=0))
    assert cut["available"][:, KINDS.index("synthetic")].tolist() == [True] * 3
    assert cut["available"][:, KINDS.index("real")].tolist() == [False, False, True]
    assert not cut["real"][:2].any()
    assert np.array_equal(cut["real"][2], one.maps["real"].values.T[60:])


def ramp(times_s: np.ndarray) -> Source:
    """Energies that grow with time, so that those between frames are known."""
    values = np.outer(np.arange(1, AXIS.bins + 1), times_s).astype(np.float32)
    doppler = DopplerMap(values, AXIS, Timebase(times_s), "synthetic")
    label = (times_s >= 1.0).astype(np.int16)
    return replace(
        source(frames=len(times_s), times_s=times_s), maps={"synthetic": doppler}, label=label
    )


@pytest.mark.parametrize("rate_hz", [15.0, 60.0, 31.0])
def test_another_frame_rate_is_brought_to_that_of_the_data_set(rate_hz: float) -> None:
    one = ramp(np.arange(int(3 * rate_hz)) / rate_hz)
    cut = cut_whole(one, Exporting(segment_frames=30, overlap_frames=0))
    frames_s = cut["start_s"][:, None] + np.arange(30) / 30.0
    np.testing.assert_allclose(cut["synthetic"][..., 3], 4.0 * frames_s, atol=1e-5)
    near = np.abs(frames_s - 1.0) > 1.0 / rate_hz
    assert np.array_equal(cut["label"][near], (frames_s >= 1.0)[near])
    assert (cut["start_frame"] == [one.maps["synthetic"].timebase.frame_at(s) for s in
                                   cut["start_s"]]).all()  # fmt: skip


def test_uneven_frames_are_evened_and_lost_time_parts_clips() -> None:
    rng = np.random.default_rng(3)
    uneven_s = np.cumsum(rng.uniform(0.3, 1.7, 120)) / 30.0
    cut = cut_whole(ramp(uneven_s), Exporting(segment_frames=20, overlap_frames=0))
    frames_s = cut["start_s"][:, None] + np.arange(20) / 30.0
    np.testing.assert_allclose(cut["synthetic"][..., 0], frames_s, atol=1e-5)

    gap_s = np.arange(80) / 30.0
    gap_s[40:] += 2.0
    found = clips_of(gap_s, None, 30.0, 20, 0)
    assert [(clip.start, clip.stop, clip.resampled) for clip in found] == [
        (0, 40, False),
        (40, 80, False),
    ]


def test_limb_maps_are_cut_as_maps_of_their_parts() -> None:
    """At another rate, around a gap, with a nulled bin: each like a map of its own."""
    present = np.arange(100) != 40
    one = source(limbs=True, rate_hz=25.0, present=present, kinds=("synthetic",))
    options = Exporting(segment_frames=20, overlap_frames=5)

    def cut_at_30_hz(of: Source, limbs: bool, name: str) -> np.ndarray:
        blocks = cut_source(of, 30.0, (2,), NUMBERS, replace(options, limbs=limbs))
        return np.concatenate([block[name] for block in blocks])

    whole = one.maps["synthetic"]
    assert whole.limbs is not None
    limbs = cut_at_30_hz(one, True, "limbs")
    assert cut_at_30_hz(one, True, "resampled").all()
    assert not limbs[..., 2].any()
    for number, values in enumerate(whole.limbs.values):
        part = replace(one, maps={"synthetic": replace(whole, values=values)})
        expected = cut_at_30_hz(part, False, "synthetic")
        np.testing.assert_array_equal(limbs[:, :, number], expected)
    # In between frames they add up as well as single precision can.
    np.testing.assert_allclose(limbs.sum(axis=2), cut_at_30_hz(one, True, "synthetic"), rtol=1e-6)


def test_how_a_segment_is_named() -> None:
    windows = np.array([[0] * 8 + [1] * 2, [0] * 9 + [1], [1] * 4 + [2] * 6, [0] * 5 + [2] * 5])
    named, purity = label_of_segments(windows, 3, Exporting(min_share=0.2))
    assert named.tolist() == [1, 0, 2, 2]
    np.testing.assert_allclose(purity, [0.2, 0.9, 0.6, 0.5])
    named, purity = label_of_segments(windows, 3, Exporting(label_rule="majority"))
    assert named.tolist() == [0, 0, 2, 0]
    np.testing.assert_allclose(purity, [0.8, 0.9, 0.6, 0.5])


@given(frames=st.integers(1, 200), length=st.integers(2, 40))
def test_what_is_counted_beforehand_is_cut(frames: int, length: int) -> None:
    one = source(frames=frames)
    options = Exporting(segment_frames=length, overlap_frames=length // 3)
    labels = count_segments(one.outline(), 30.0, options)
    blocks = list(cut_source(one, 30.0, (), NUMBERS, options))
    assert labels.total() == sum(len(block["start_s"]) for block in blocks)
    counts: dict[str, int] = {}
    for block in blocks:
        for number in block["segment_label"].tolist():
            counts[LABELS[number]] = counts.get(LABELS[number], 0) + 1
    assert labels == counts


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"maps": {}}, "has no map"),
        ({"labels": ("swipe",)}, "background first"),
        ({"label": np.full(100, 9, np.int16)}, "labels from 9"),
        ({"label": np.zeros(99, np.int16)}, "a whole number per frame"),
        ({"maps": {"real": source().maps["synthetic"]}}, "is of kind synthetic"),
    ],
)
def test_a_source_that_does_not_fit_together_is_refused(change: dict, message: str) -> None:
    with pytest.raises(Sd2Error, match=message):
        replace(source(), **change)


def test_options_that_cannot_be_are_refused() -> None:
    for change, message in (
        ({"kinds": ()}, "some of synthetic"),
        ({"segment_frames": 0}, "2 to"),
        ({"segment_frames": 10, "overlap_frames": 10}, "less than segment_frames"),
        ({"label_rule": "any"}, "foreground"),
        ({"min_share": 1.5}, "0 to 1"),
        ({"frame_rate_hz": 0.0}, "above 0"),
    ):
        with pytest.raises(Sd2Error, match=message):
            dataset_options(Exporting(**change))  # type: ignore[arg-type]
