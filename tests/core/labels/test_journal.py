"""What was edited is read back: after a clean end, a torn one, and from damaged files."""

from __future__ import annotations

import json
import os
import random
from pathlib import Path

import pytest
from earlier_journals import part, record
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from labelled import even, imported, random_edit

from sd2core.labels.journal import Journal, Kept, packed, replay, unpacked
from sd2core.labels.spans import Labels, Span

FRAMES = even()
START = imported(FRAMES, 7)
WALK = Path("/walk.sd2")


def test_a_length_that_leads_back_ends_the_reading() -> None:
    record = packed(Kept(WALK, START))
    # As long as its prefix and the newline before it: its end would be its own start.
    assert unpacked(record + b"-0000013 00000000 ") == ([record[18:-1]], len(record))


def session(labels: Labels, seed: int, edits: int) -> tuple[list[bytes], list[Labels]]:
    """Records of a session of an earlier version, and the labels after each."""
    rng = random.Random(seed)
    states = [labels]
    for _ in range(edits):
        states.append(random_edit(states[-1], FRAMES, rng).labels)
    return part(WALK, states), states


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32), edits=st.integers(0, 150))
def test_edits_are_done_again(seed: int, edits: int) -> None:
    records, states = session(START, seed, edits)
    payloads, end = unpacked(b"".join(records))
    assert end == sum(map(len, records))
    replayed = replay(payloads)
    assert replayed.labels == states[-1]
    assert (replayed.edits, replayed.recording) == (edits, WALK)


@settings(max_examples=20)
@given(seed=st.integers(0, 99), cut=st.floats(0, 1), tail=st.binary(max_size=40))
def test_a_torn_end_costs_the_edit_in_progress_only(seed: int, cut: float, tail: bytes) -> None:
    records, states = session(START, seed, 20)
    whole = b"".join(records)
    kept = len(records[0]) + int(cut * (len(whole) - len(records[0])))
    lengths = [sum(map(len, records[: k + 1])) for k in range(len(records))]
    last = max(k for k, length in enumerate(lengths) if length <= kept)
    for content in (whole[:kept], whole[:kept] + bytes(40), whole[: lengths[last]] + tail):
        payloads, end = unpacked(content)
        assert end == lengths[last]
        assert replay(payloads).labels == states[last]


@given(seed=st.integers(0, 9), where=st.integers(0, 10**9), flip=st.integers(1, 255))
@settings(max_examples=20)
def test_a_changed_byte_is_noticed(seed: int, where: int, flip: int) -> None:
    records, states = session(START, seed, 8)
    content = bytearray(b"".join(records))
    where %= len(content)
    content[where] ^= flip
    payloads, end = unpacked(bytes(content))
    assert end <= where
    if payloads:
        assert replay(payloads).labels == states[len(payloads) - 1]


def test_a_journal_of_the_first_version_is_read() -> None:
    newest = packed(Kept(WALK, START, 1, "Move span"))
    content = json.loads(newest[18:]) | {"version": 1}
    del content["others"]
    payloads, _ = unpacked(record(content))
    replayed = replay(payloads)
    assert (replayed.labels, replayed.others) == (START, None)


class TestJournal:
    def begun(self, folder: Path, labels: Labels = START) -> Journal:
        return Journal(folder, 1, Kept(WALK, labels))

    def read(self, path: Path) -> Labels:
        return replay(unpacked(path.read_bytes())[0]).labels

    def test_every_edit_is_on_disk_when_it_returns(self, tmp_path: Path) -> None:
        journal = self.begun(tmp_path)
        rng, labels = random.Random(1), START
        for _ in range(50):
            labels = random_edit(labels, FRAMES, rng).labels
            journal.write("Edit", labels)
            assert self.read(tmp_path / "000001-000001.journal") == labels
        assert journal.kept.edits == 50
        journal.close()
        assert list(tmp_path.iterdir()) == []

    def test_it_is_flushed_to_the_disk(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        journal = self.begun(tmp_path)
        sizes = []
        fsync = os.fsync

        def noted(descriptor: int) -> None:
            fsync(descriptor)
            sizes.append(os.fstat(descriptor).st_size)

        monkeypatch.setattr("sd2core.files.atomic.os.fsync", noted)
        for labels in (Labels(), START):
            journal.write("Edit", labels)
            assert sizes[-1] == (tmp_path / "000001-000001.journal").stat().st_size

    def test_a_full_disk_is_said_and_got_over(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        journal = self.begun(tmp_path)

        def full(descriptor: int) -> None:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("sd2core.files.atomic.os.fsync", full)
            with pytest.raises(OSError, match="No space"):
                journal.write("Edit", Labels())
        assert self.read(tmp_path / "000001-000001.journal") == START
        after = Labels(spans=(Span(1, "Gestures", 0.0, 1.0, "wave"),))
        journal.write("Edit", after)
        assert self.read(tmp_path / "000001-000001.journal") == after
        assert journal.kept.edits == 2

    def test_a_deleted_file_is_made_again(self, tmp_path: Path) -> None:
        journal = self.begun(tmp_path)
        (tmp_path / "000001-000001.journal").unlink()
        journal.write("Edit", Labels())
        assert self.read(tmp_path / "000001-000001.journal") == Labels()

    @given(steps=st.lists(st.one_of(st.none(), st.integers(0, 3), st.just("saved")), max_size=20))
    @settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_other_fields_are_those_of_the_last_edit_of_them_since_the_file_was_saved(
        self, steps: list[int | str | None], tmp_path: Path
    ) -> None:
        journal = Journal(tmp_path, 1, Kept(WALK, START))
        expected = None
        for step in steps:
            if step == "saved":
                journal.saved()
                expected = None
            elif step is None:
                journal.write("Edit", START)
            else:
                expected = {"radar_offset_s": step}
                journal.write("Align radar", START, expected)
        payloads, _ = unpacked(max(tmp_path.iterdir()).read_bytes())
        journal.close()
        assert replay(payloads).others == expected

    def test_saved_edits_do_not_count(self, tmp_path: Path) -> None:
        journal = self.begun(tmp_path)
        journal.write("Edit", Labels())
        journal.saved()
        replayed = replay(unpacked((tmp_path / "000001-000001.journal").read_bytes())[0])
        assert (replayed.edits, replayed.last) == (0, "Edit")
        assert replayed.labels == Labels()
        journal.write("Edit again", START)
        replayed = replay(unpacked((tmp_path / "000001-000001.journal").read_bytes())[0])
        assert (replayed.edits, replayed.last) == (1, "Edit again")
