"""Whatever is edited in whatever order: spans stay what they must be, and the way back is exact."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled import broken_rules, even, imported, random_edit, uneven

from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

EDITS = 300


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32), variable=st.booleans())
def test_rules_hold_after_hundreds_of_edits(seed: int, variable: bool) -> None:
    timebase = uneven(seed) if variable else even()
    labels = imported(timebase, seed)
    placed_s = {edge for span in labels.spans for edge in (span.start_s, span.end_s)}
    rng = random.Random(seed)
    names = set()
    for count in range(EDITS):
        edit = random_edit(labels, timebase, rng)
        names.add(edit.name)
        labels = edit.labels
        assert {*edit.ids} <= {span.id for span in labels.spans}
        if count % 10 == 0:
            assert broken_rules(labels, timebase, placed_s) == []
    assert broken_rules(labels, timebase, placed_s) == []
    assert len(names) > 10


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_without_imports_every_edge_is_of_a_frame(seed: int) -> None:
    timebase = uneven(seed)
    labels = Labels(imported(timebase, 0).tracks)
    rng = random.Random(seed)
    for _ in range(EDITS):
        labels = random_edit(labels, timebase, rng).labels
    assert broken_rules(labels, timebase, set()) == []


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32))
def test_edits_leave_the_labels_before_them_alone(seed: int) -> None:
    timebase = uneven(seed)
    rng = random.Random(seed)
    history = [imported(timebase, seed)]
    described = [repr(history[0])]
    for _ in range(100):
        history.append(random_edit(history[-1], timebase, rng).labels)
        described.append(repr(history[-1]))
    # A step back is the labels from before; nobody may have touched them since.
    assert [repr(labels) for labels in history] == described


def test_what_changes_nothing_gives_the_very_same_labels() -> None:
    timebase = even()
    labels = imported(timebase, 1)
    rng = random.Random(1)
    for _ in range(EDITS):
        after = random_edit(labels, timebase, rng).labels
        assert after is labels or after != labels
        labels = after


@pytest.mark.parametrize("timebase", [Timebase([3.5]), Timebase([0.0, 5.0])])
def test_very_short_recordings(timebase: Timebase) -> None:
    labels = Labels()
    rng = random.Random(3)
    for _ in range(EDITS):
        labels = random_edit(labels, timebase, rng).labels
        assert broken_rules(labels, timebase, set()) == []
