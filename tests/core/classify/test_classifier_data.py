"""Labelled clips, of pairs and of maps, and how they are split."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import small_pairs
from classifiers import AXIS, NULLED, RATE_HZ, doppler, energies
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from labelled_clips import clip_set

from sd2core.classify.data import (
    UNKNOWN,
    clips_of_map,
    clips_of_pairs,
    frame_counts,
    frame_labels,
    gesture_classes,
    merged,
)
from sd2core.classify.splitting import dealt, split_clips
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.per_frame import label_per_frame
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import DopplerMap
from sd2core.pairs.labelling import TakeLabel, labelled
from sd2core.pairs.store import PairSet, Take
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

SWIPES = ("background", "left-to-right", "right-to-left", "up-to-down", "down-to-up")


def pairs(kind="simulated") -> PairSet:
    takes = tuple(
        Take(
            subject,
            "take-0001",
            energies(20, seed),
            energies(20, seed + 10) * 3,
            np.arange(20) / RATE_HZ,
            np.repeat(np.arange(5), 4).astype(np.int8),
            np.zeros(3),
            placement,
        )
        for seed, (subject, placement) in enumerate([("s01", 0), ("s01", 1), ("s02", 0)])
    )
    return PairSet(kind, AXIS, NULLED, RATE_HZ, SWIPES, takes)


def test_four_swipes_are_three_classes() -> None:
    assert gesture_classes(SWIPES) == (
        "background",
        "horizontal",
        "horizontal",
        "vertical",
        "vertical",
    )
    assert gesture_classes(("Background", "FirstGesture")) == ("background", "FirstGesture")


def test_clips_of_pairs_hold_what_was_asked_for() -> None:
    held = pairs()
    radar, synthetic = clips_of_pairs(held, "simulated"), clips_of_pairs(held, "synthetic")
    assert radar.classes == ("background", "horizontal", "vertical")
    for take, one, other in zip(held.takes, radar.clips, synthetic.clips, strict=True):
        np.testing.assert_array_equal(one.energies, take.radar)
        np.testing.assert_array_equal(other.energies, take.synthetic)
        np.testing.assert_array_equal(one.label, np.repeat([0, 1, 2], [4, 8, 8]))
        assert (one.key, one.placement) == ((take.subject, take.name), take.placement)
    np.testing.assert_array_equal(frame_counts(radar.clips, 3), [12, 24, 24])
    with pytest.raises(Sd2Error, match="simulated radar"):
        clips_of_pairs(held, "real")
    with pytest.raises(Sd2Error, match="No denoiser"):
        clips_of_pairs(held, "denoised")


def labels(*spans: tuple[str, float, float], origin="person", classes=True) -> Labels:
    known = LabelSet(
        "own",
        (
            Label("wave", "#112233", "", "wave" if classes else ""),
            Label("left-to-right", "#445566", "", "horizontal"),
            Label("nothing", "#778899"),
        ),
    )
    return Labels(
        (LabelTrack("one", "free"),),
        tuple(
            Span(number, "one", start_s, end_s, name, origin=origin)
            for number, (name, start_s, end_s) in enumerate(spans, start=1)
        ),
        known,
    )


def test_frames_have_the_class_of_their_label() -> None:
    clock = Timebase.regular(10, 10.0)
    found, classes = frame_labels(
        clock, labels(("wave", 0.1, 0.3), ("left-to-right", 0.5, 0.7), ("nothing", 0.8, 0.9))
    )
    assert classes == ("background", "horizontal", "wave")
    np.testing.assert_array_equal(found, [0, 2, 2, 0, 0, 1, 1, 0, UNKNOWN, 0])


@given(start=st.integers(0, 15), count=st.integers(0, 40), shift=st.floats(-1.0, 1.0))
def test_a_label_has_the_same_frames_wherever_one_learns_from_it(
    start: int, count: int, shift: float
) -> None:
    """From a recording, in a data set or in pairs; written with six digits, and between frames."""
    clock = Timebase.regular(60, 30.0)
    middle_s = (start + max(count // 2, 1) + shift) / 30.0
    edges_s = [round(one, 6) for one in (start / 30.0, middle_s, (start + count + 2) / 30.0)]
    assume(edges_s == sorted(set(edges_s)))
    given_labels = labels(("wave", *edges_s[:2]), ("left-to-right", *edges_s[1:]))
    found, _ = frame_labels(clock, given_labels)
    names = ("background", "left-to-right", "wave")
    np.testing.assert_array_equal(found, label_per_frame(given_labels, names, clock.times_s))
    rows = [TakeLabel("*", "*", one.label, one.start_s, one.end_s) for one in given_labels.spans]
    known = replace(pairs(), labels=names, takes=(small_pairs.take("s", "t", 60, 0),))
    np.testing.assert_array_equal(found, labelled(known, rows).takes[0].label)
    np.testing.assert_array_equal(np.flatnonzero(found), np.arange(start, start + count + 2))


def test_frames_on_which_classes_disagree_are_unknown() -> None:
    clock = Timebase.regular(6, 10.0)
    found, _ = frame_labels(
        clock, labels(("wave", 0.0, 0.3), ("left-to-right", 0.2, 0.4), ("wave", 0.1, 0.2))
    )
    np.testing.assert_array_equal(found, [2, 2, UNKNOWN, 1, 0, 0])


def test_more_classes_than_frames_can_name_are_refused() -> None:
    many = labels(*((f"l{number}", 0.1 * number, 0.1 * number + 0.05) for number in range(130)))
    with pytest.raises(Sd2Error, match="131 classes"):
        frame_labels(Timebase.regular(400, 30.0), many)


def test_a_long_map_at_another_rate_takes_little_memory() -> None:
    clock = Timebase.regular(6000, 28.6)
    whole = DopplerMap(np.ones((AXIS.bins, 6000), np.float32), AXIS, clock, "real")
    tracemalloc.start()
    made = clips_of_map(
        whole, labels(("wave", 1.0, 2.0)), subject="anna", movement="walk", frame_rate_hz=30.0
    )
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    assert np.flatnonzero(made.clips[0].label).tolist() == list(range(30, 61))


def test_suggestions_are_no_labels() -> None:
    found, classes = frame_labels(
        Timebase.regular(6, 10.0), labels(("wave", 0.0, 0.3), origin="suggestion")
    )
    assert classes == ("background",)
    np.testing.assert_array_equal(found, 0)


def test_a_map_is_parted_by_absence_and_brought_to_another_rate() -> None:
    values = energies(60)
    present = np.ones(60, bool)
    present[20:25] = False
    shown = doppler(values, present=present)
    own = clips_of_map(shown, labels(("wave", 1.0, 2.0)), subject="anna", movement="m")
    assert [len(one) for one in own.clips] == [20, 35]
    np.testing.assert_array_equal(own.clips[1].energies, values[25:])
    np.testing.assert_array_equal(own.clips[1].label, np.isin(np.arange(25, 60), np.arange(30, 60)))
    half = clips_of_map(
        doppler(values), labels(("wave", 1.0, 2.0)), subject="a", movement="m", frame_rate_hz=15.0
    )
    np.testing.assert_allclose(half.clips[0].energies[:30], values[::2], atol=1e-3)
    np.testing.assert_array_equal(half.clips[0].label[:30], np.arange(30) >= 15)
    assert half.frame_rate_hz == 15.0
    with pytest.raises(Sd2Error, match="30 frames/s"):
        clips_of_map(doppler(values), labels(), subject="a", movement="m", frame_rate_hz=7.0)


def test_sets_of_other_classes_are_put_together() -> None:
    one = clips_of_pairs(pairs(), "simulated")
    other = clips_of_map(
        doppler(energies(40)), labels(("wave", 0.0, 0.5)), subject="anna", movement="m"
    )
    both = merged([other, one])
    assert both.classes == ("background", "horizontal", "vertical", "wave")
    assert both.subjects == ("anna", "s01", "s02")
    assert both.clips[0].label.max() == 3
    np.testing.assert_array_equal(both.clips[1].label, one.clips[0].label)
    assert merged([one, replace(other, null_bins=(3,))]).null_bins == (3, *NULLED)
    with pytest.raises(Sd2Error, match="16 bins"):
        merged([one, replace(other, axis=VelocityAxis(16, 2.0))])
    with pytest.raises(Sd2Error, match="frames/s"):
        merged([one, replace(other, frame_rate_hz=10.0)])
    with pytest.raises(Sd2Error, match="Nothing to learn from"):
        merged([])


@settings(max_examples=30, deadline=None)
@given(subjects=st.integers(3, 9), each=st.integers(1, 4))
def test_nobody_is_in_two_parts(subjects: int, each: int) -> None:
    known = clip_set(subjects, each, frames=2)
    parts = split_clips(known)
    groups = [parts.training, parts.validation, parts.test]
    names = [{clip.subject for clip in group} for group in groups]
    assert all(names)
    assert sum(map(len, names)) == len(set.union(*names)) == len(known.subjects)
    assert not parts.by_movement


def test_where_no_own_sensor_saw_anything_the_first_place_counts() -> None:
    """A batch may look from planned places only, which are numbered from 1."""
    here = clip_set(3, 2, frames=2, placements=2)
    away = replace(
        here, clips=tuple(replace(one, placement=one.placement + 1) for one in here.clips)
    )
    parts = split_clips(away, first_only=True)
    for clips in (parts.training, parts.validation, parts.test):
        assert {clip.placement for clip in clips} == {1}


@settings(max_examples=30, deadline=None)
@given(each=st.integers(2, 9), parts=st.integers(2, 5), seed=st.integers(0, 5))
def test_movements_of_every_class_are_dealt_alike(each: int, parts: int, seed: int) -> None:
    known = clip_set(1, 3 * each, frames=6, one_class=True)
    part = dealt(known, known.clips, parts, seed)
    assert set(part) == {clip.key for clip in known.clips}
    for number in range(3):
        own = [part[clip.key] for clip in known.clips if clip.label[0] == number]
        counts = [own.count(one) for one in range(parts)]
        assert max(counts) - min(counts) <= 1


def test_one_movement_of_each_class_cannot_be_split() -> None:
    with pytest.raises(Sd2Error, match="one subject"):
        split_clips(clip_set(1, 3, frames=6, one_class=True))
