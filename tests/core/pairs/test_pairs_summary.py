"""What is told of a store of pairs without reading it equals what reading it shows."""

from __future__ import annotations

import json

import pytest
from test_pairs import HEADER, take

from sd2core.errors import Sd2Error
from sd2core.pairs.segments import segment_starts
from sd2core.pairs.store import PairWriter, read_pairs
from sd2core.pairs.summary import is_among, kept_out, pair_facts


@pytest.fixture
def store(tmp_path):
    writer = PairWriter(tmp_path / "pairs.zarr", **HEADER)
    for one in (
        take("a", 200), take("b", 70), take("c", 150, "s2"), take("c", 150, "s2", placement=1),
    ):  # fmt: skip
        writer.append(one)
    return tmp_path / "pairs.zarr"


def test_facts_equal_what_is_read(store) -> None:
    facts, pairs = pair_facts(store), read_pairs(store)
    assert (facts.kind, facts.bins, facts.v_max_mps) == ("simulated", 8, 2.0)
    assert facts.subjects == pairs.subjects
    assert facts.placements == 2
    assert facts.duration_s == pytest.approx(420 / 30.0)
    for subject in ("s1", "s2"):
        takes = pairs.of([subject]).takes
        expected = sum(len(segment_starts(len(one.times_s), 72, 10)) for one in takes)
        assert facts.segments(subject, 72, 10) == expected
    assert facts.segments("s1", 72, 10) == 4  # a take of 70 frames has no window


def test_nothing_but_the_description_is_read(store) -> None:
    for folder in ("synthetic", "radar", "times_s", "label"):
        (store / folder).rename(store.parent / folder)
    assert len(pair_facts(store).takes) == 4


def test_what_is_no_store_is_refused(store, tmp_path) -> None:
    with pytest.raises(Sd2Error, match="holds no pairs"):
        pair_facts(tmp_path)
    header = json.loads((store / "zarr.json").read_text())
    header["attributes"]["kind"] = "dreamt"
    (store / "zarr.json").write_text(json.dumps(header))
    with pytest.raises(Sd2Error, match="dreamt"):
        pair_facts(store)
    header["attributes"] |= {"version": 7}
    (store / "zarr.json").write_text(json.dumps(header))
    with pytest.raises(Sd2Error, match="version 7"):
        pair_facts(store)


def test_a_store_without_a_take_is_refused(tmp_path) -> None:
    PairWriter(tmp_path / "pairs.zarr", **HEADER)
    with pytest.raises(Sd2Error, match="no take yet"):
        pair_facts(tmp_path / "pairs.zarr")


def test_whom_a_training_kept_out_is_judged_by_whatever_name() -> None:
    people = ("s1", "s2", "s3")
    assert kept_out(people, ["s3"], ["s1", "s2"]) == ("s3",)
    assert kept_out(people, ["b:s3"], ["a:s1", "b:s2"]) == ("s3",)
    # Which of both stores it is, nobody knows.
    assert kept_out(people, ["b:s3"], ["a:s3", "b:s2"]) == people
    assert kept_out(people, [], ["ann"]) == people
    assert is_among("s1", ["a:s1"])
    assert not is_among("b:s1", ["a:s1"])
