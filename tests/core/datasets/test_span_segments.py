"""One segment of each labelled span: its own frames, and as many as labels are counted."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lazy_sources import write_dataset
from made_sources import LABELS, source

from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.cutting import count_segments, cut_source
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.source import LabelledSpan, Source
from sd2core.datasets.sources import gather
from sd2core.datasets.torch_dataset import NOT_LEARNT, SegmentDataset
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.labels.statistics import label_statistics
from sd2core.options.exporting import Exporting, SpanOptions
from sd2core.recording.recording import open_recording

NUMBERS = np.arange(3, dtype=np.int16)


def spanned(*spans: tuple[float, float, int], **others: object) -> Source:
    """A source of 4 s, its frames labelled as the spans say, later ones over earlier ones."""
    one = source(frames=120, **others)  # type: ignore[arg-type]
    label = np.zeros(120, np.int16)
    for start_s, end_s, number in spans:
        label[(one.times_s >= start_s) & (one.times_s < end_s)] = number
    return replace(one, label=label, spans=tuple(LabelledSpan(*span) for span in spans))


def cut(one: Source, options: SpanOptions, length: int = 120, rate_hz: float = 30.0) -> dict:
    wanted = Exporting(segment_frames=length, spans=options)
    blocks = list(cut_source(one, rate_hz, (), NUMBERS, wanted))
    counted = count_segments(one.outline(), rate_hz, wanted)
    assert counted.total() == len(blocks)
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def within(times_s: np.ndarray, start_s: float, end_s: float) -> np.ndarray:
    """Frames from one time to another, to a microsecond: sums have other last bits."""
    return (times_s >= start_s - 1e-6) & (times_s < end_s - 1e-6)


times = st.integers(0, 3900).map(lambda ms: ms / 1000)
spans = st.lists(st.tuples(times, st.integers(40, 2000), st.integers(1, 2)), min_size=1, max_size=5)


@given(spans, st.integers(0, 300).map(lambda ms: ms / 1000))
def test_a_segment_holds_the_frames_of_its_span_and_margin(
    drawn: list[tuple[float, int, int]], margin_s: float
) -> None:
    chosen = sorted((start, start + long / 1000, label) for start, long, label in drawn)
    one = spanned(*chosen)
    found = cut(one, SpanOptions(margin_s=margin_s))
    assert found["segment_label"].tolist() == [label for _, _, label in chosen]
    values = one.maps["synthetic"].values.T
    for row, (start_s, end_s, label) in enumerate(chosen):
        mine = within(one.times_s, start_s - margin_s, end_s + margin_s)
        mask = found["mask"][row]
        assert mask.tolist() == [True] * mine.sum() + [False] * (120 - mine.sum())
        assert np.array_equal(found["synthetic"][row][mask], values[mine])
        assert not found["synthetic"][row][~mask].any()
        inside = within(one.times_s[mine], start_s, end_s)
        assert (found["label"][row][mask][inside] == label).all()
        assert not found["label"][row][~mask].any()
        assert found["purity"][row] == pytest.approx((found["label"][row][mask] == label).mean())


def test_spans_without_a_person_and_too_short_ones_give_no_segment() -> None:
    present = np.ones(120, bool)
    present[30:60] = False
    one = spanned((0.8, 2.5, 1), (1.2, 1.6, 2), (3.0, 3.1, 2), (3.2, 3.6, 1), present=present)
    found = cut(one, SpanOptions(shortest_s=0.2))
    # Of the first the longer part is left, after the person has come back.
    assert found["start_frame"].tolist() == [60, 96]
    assert found["mask"].sum(axis=1).tolist() == [15, 12]


def test_a_span_longer_than_a_segment_is_refused_or_stretched() -> None:
    one = spanned((0.2, 1.0, 1), (2.0, 3.0, 2))  # both: the longest says what helps
    with pytest.raises(Sd2Error, match=r"up-to-down at 2.000 s has 30 frames") as refused:
        cut(one, SpanOptions(), length=20)
    assert "segments of 30 frames" in refused.value.remedy
    found = cut(one, SpanOptions(length="resampled"), length=20)
    assert found["mask"].all()
    first_s, frames = found["start_s"][1], found["synthetic"][1]
    assert first_s == pytest.approx(2.0)
    assert found["end_s"][1] == pytest.approx(3.0)
    wanted_s = np.linspace(2.0, 2.0 + 29 / 30, 20)
    for number, energies in enumerate(one.maps["synthetic"].values):
        near = np.interp(wanted_s, one.times_s, energies)
        np.testing.assert_allclose(frames[:, number], near, atol=1e-5)


def test_another_frame_rate_keeps_the_time_of_spans() -> None:
    found = cut(spanned((1.0, 2.0, 1)), SpanOptions(), rate_hz=15.0)
    assert found["mask"].sum() == 15
    assert (found["label"][found["mask"]] == 1).all()


def test_frames_that_are_labelled_one_by_one_make_spans_of_their_runs(tmp_path: Path) -> None:
    label = np.array([0, 0, 1, 1, 1, 2, 2, 0, 0, 1], np.int16).repeat(12)
    one = source(frames=120, label=label)
    found = cut(one, SpanOptions())
    assert found["segment_label"].tolist() == [1, 2, 1]
    assert found["mask"].sum(axis=1).tolist() == [36, 24, 12]


def test_the_sample_has_as_many_segments_as_labels_are_counted() -> None:
    sample = resource_path("swipes.sd2")
    recording = open_recording(sample)
    (one,) = gather([sample], Making(kinds=("simulated",)))
    assert one.outline is not None
    counts = count_segments(one.outline(), 30.0, Exporting(spans=SpanOptions()))
    counted = {each.label: each.count for each in label_statistics(recording.labelled)}
    assert counts == Counter(counted)
    assert counts.total() == 8


@pytest.mark.one_in(3)
@pytest.mark.parametrize("ending", [".zarr", ".h5", ".npz"])
def test_what_is_written_tells_frames_of_spans_from_empty_ones(tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"set{ending}"
    one = spanned((0.5, 1.0, 1), (1.0, 2.0, 2), (3.5, 5.0, 1))
    options = Exporting(segment_frames=40, spans=SpanOptions(margin_s=0.1, shortest_s=0.6))
    written = write_dataset(out, [one], options)
    assert written.segments == 1
    with open_dataset(out) as dataset:
        assert dataset.header.spans == options.spans
        mask = dataset["mask"][:]
        assert mask.sum() == 36
        (clip,) = clips_of_dataset(dataset, "denoised").clips
    assert np.array_equal(clip.energies, one.maps["denoised"].values.T[27:63])
    card = (tmp_path / "set.card.md").read_text(encoding="utf-8")
    assert "2 labelled spans are shorter than asked for" in card
    with pytest.raises(Sd2Error, match="spans as"):
        write_dataset(out, [one], Exporting(segment_frames=40))
    learnt = SegmentDataset(out, "synthetic", "frame label")
    (_, labels) = learnt[0]
    assert torch.equal(labels == NOT_LEARNT, torch.from_numpy(~mask[0]))


def test_stretched_spans_are_no_clips_for_classifiers_of_frames(tmp_path: Path) -> None:
    options = Exporting(segment_frames=20, spans=SpanOptions(length="resampled"))
    write_dataset(tmp_path / "set.zarr", [spanned((0.5, 1.0, 1))], options)
    with open_dataset(tmp_path / "set.zarr") as dataset, pytest.raises(Sd2Error, match="stretched"):
        clips_of_dataset(dataset, "synthetic")


def test_windows_that_are_not_pure_are_left_out() -> None:
    one = spanned((0.0, 0.5, 1), (1.0, 2.0, 2))
    options = Exporting(segment_frames=30, overlap_frames=0, min_purity=0.6)
    blocks = list(cut_source(one, 30.0, (), NUMBERS, options))
    named = np.concatenate([block["segment_label"] for block in blocks])
    assert named.tolist() == [2, 0, 0]
    assert count_segments(one.outline(), 30.0, options) == Counter({LABELS[0]: 2, LABELS[2]: 1})


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        ({"margin_s": -1.0}, "margin"),
        ({"shortest_s": np.inf}, "shortest"),
        ({"length": "cut"}, "cut"),
    ],
)
def test_options_that_cannot_be(wrong: dict, found: str) -> None:
    with pytest.raises(Sd2Error, match=found):
        SpanOptions(**wrong)
