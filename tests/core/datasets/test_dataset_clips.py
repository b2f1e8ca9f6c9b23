"""What a classifier gets of a data set is what went in, every frame once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lazy_sources import write_dataset
from made_sources import AXIS, source

from sd2core.cli.classify.data import clips_of, split_of
from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.reading import open_dataset
from sd2core.errors import Sd2Error
from sd2core.options.exporting import Exporting

ENDINGS = (".zarr", ".h5", ".npz")
CLASSES = ("background", "horizontal", "vertical")


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.sampled_from(ENDINGS), st.integers(24, 150), st.integers(0, 23))
def test_segments_are_put_together_again(
    tmp_path_factory: pytest.TempPathFactory, ending: str, frames: int, overlap: int
) -> None:
    out = tmp_path_factory.mktemp("set") / f"set{ending}"
    sources = [
        source("r1", "anna", frames=frames),
        source("r1", "anna", frames=frames, placement=1),
        source("r1", "ben", frames=100),
    ]
    write_dataset(out, sources, Exporting(segment_frames=24, overlap_frames=overlap))
    with open_dataset(out) as dataset:
        known = clips_of_dataset(dataset, "denoised")
    assert (known.axis, known.frame_rate_hz, known.classes) == (AXIS, 30.0, CLASSES)
    for clip, one in zip(known.clips, sources, strict=True):
        assert clip.key == (one.subject, one.recording)
        assert (clip.kind, clip.placement) == ("denoised", one.placement)
        np.testing.assert_array_equal(clip.energies, one.maps["denoised"].values.T)
        np.testing.assert_array_equal(clip.label, one.label)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("rate_hz", [29.52, 29.97, 30.4])
def test_a_camera_that_is_not_quite_on_time_gives_whole_clips(
    tmp_path: Path, rate_hz: float
) -> None:
    times_s = np.arange(150) / rate_hz + np.random.default_rng(1).uniform(-5e-3, 5e-3, 150)
    one = source(frames=150, times_s=times_s)
    write_dataset(
        tmp_path / "set.zarr",
        [one],
        Exporting(segment_frames=24, overlap_frames=4, frame_rate_hz=30.0),
    )
    with open_dataset(tmp_path / "set.zarr") as dataset:
        assert not dataset["resampled"][:].any()
        (clip,) = clips_of_dataset(dataset, "synthetic").clips
    np.testing.assert_array_equal(clip.energies, one.maps["synthetic"].values.T)


def test_what_was_resampled_is_put_together_by_its_times(tmp_path: Path) -> None:
    one = source(frames=120, rate_hz=30.7)
    out = tmp_path / "set.zarr"
    write_dataset(out, [one], Exporting(segment_frames=24, overlap_frames=4, frame_rate_hz=30.0))
    with open_dataset(out) as dataset:
        assert dataset["resampled"][:].all()
        (clip,) = clips_of_dataset(dataset, "synthetic").clips
    times_s = np.arange(len(clip.energies)) / 30.0
    for number, energies in enumerate(one.maps["synthetic"].values):
        np.testing.assert_allclose(
            clip.energies[:, number], np.interp(times_s, one.times_s, energies), atol=1e-6
        )


def test_who_leaves_the_picture_parts_a_clip(tmp_path: Path) -> None:
    present = np.ones(120, bool)
    present[50:60] = False
    out = tmp_path / "set.zarr"
    one = source(frames=120, present=present)
    write_dataset(out, [one], Exporting(segment_frames=24, overlap_frames=4))
    with open_dataset(out) as dataset:
        first, second = clips_of_dataset(dataset, "synthetic").clips
    np.testing.assert_array_equal(first.energies, one.maps["synthetic"].values.T[:50])
    np.testing.assert_array_equal(second.energies, one.maps["synthetic"].values.T[60:])


def test_only_sources_that_have_the_map_count(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    sources = [source("r1"), source("r2", kinds=("synthetic", "real")), source("r3")]
    write_dataset(out, sources, Exporting(segment_frames=24, overlap_frames=4))
    with open_dataset(out) as dataset:
        assert [clip.movement for clip in clips_of_dataset(dataset, "real").clips] == ["r2"]
        with pytest.raises(Sd2Error, match="holds no simulated maps"):
            clips_of_dataset(dataset, "simulated")


def test_a_data_set_without_a_segment_of_a_kind_says_so(tmp_path: Path) -> None:
    out = tmp_path / "set.npz"
    write_dataset(out, [source()], Exporting(segment_frames=24, overlap_frames=4))
    with np.load(out) as file:
        arrays = dict(file)
    arrays["available"][:] = False
    np.savez(out, **arrays)
    with open_dataset(out) as dataset, pytest.raises(Sd2Error, match="no segment of it has synth"):
        clips_of_dataset(dataset, "synthetic")


def test_classifiers_take_the_split_of_data_sets(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    people = [source(subject=name, kinds=("synthetic", "simulated")) for name in "abcd"]
    options = Exporting(
        segment_frames=24, overlap_frames=4, validation_subjects=("b",), test_subjects=("a",)
    )
    write_dataset(out, people, options)
    given = [LabelledSource(out, "")]
    assert (split_of(given, "validation"), split_of(given, "test")) == (["b"], ["a"])
    assert split_of([*given, LabelledSource(tmp_path / "other", "")], "test") is None
    assert {clip.kind for clip in clips_of(given, ("radar",)).clips} == {"simulated"}
    assert {clip.kind for clip in clips_of(given, ("synthetic", "radar")).clips} == {
        "synthetic",
        "simulated",
    }
    with pytest.raises(Sd2Error, match="holds no denoised maps"):
        clips_of(given, ("denoised",))
    with pytest.raises(Sd2Error, match="data sets say whose they are"):
        clips_of([LabelledSource(out, "anna")], ("radar",))
