"""What was edited is read back: after a clean end, a torn one, and from damaged files."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from labelled import even, imported, many_spans, random_edit

from sd2core.labels import journal as journal_module
from sd2core.labels.journal import Journal, Kept, change, head, packed, replay, unpacked
from sd2core.labels.spans import Labels, Span

FRAMES = even()
START = imported(FRAMES, 7)
WALK = Path("/walk.sd2")


def test_a_length_that_leads_back_ends_the_reading() -> None:
    record = packed(head(Kept(WALK, START)))
    # As long as its prefix and the newline before it: its end would be its own start.
    assert unpacked(record + b"-0000013 00000000 ") == ([record[18:-1]], len(record))


def session(labels: Labels, seed: int, edits: int) -> tuple[list[bytes], list[Labels]]:
    """Records of a session, and the labels after each."""
    rng = random.Random(seed)
    records, states = [packed(head(Kept(WALK, labels)))], [labels]
    for count in range(edits):
        edit = random_edit(states[-1], FRAMES, rng)
        written = {"name": edit.name, "time_unix_s": float(count)}
        records.append(packed(written | change(states[-1], edit.labels)))
        states.append(edit.labels)
    return records, states


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


def test_an_edit_writes_what_it_changed_and_no_more() -> None:
    labels = many_spans(2000)
    after = labels.with_spans([Span(1, "Gestures", 0.0, 0.5, "wave")], without=[2])
    record = change(labels, after)
    assert [entry["id"] for entry in record["put"]] == [1]
    assert record["gone"] == [2]
    assert len(packed(record)) < 300
    assert change(labels, labels) == {}


def test_a_journal_of_the_first_version_is_read() -> None:
    content = head(Kept(WALK, START, 1, "Move span")) | {"version": 1}
    del content["others"]
    payloads, _ = unpacked(packed(content))
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

        monkeypatch.setattr("sd2core.labels.journal.os.fsync", noted)
        for labels in (Labels(), START):
            journal.write("Edit", labels)
            assert sizes[-1] == (tmp_path / "000001-000001.journal").stat().st_size

    def test_parts_take_turns(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(journal_module, "SHORTEST_BYTES", 500)
        journal = self.begun(tmp_path)
        rng, labels = random.Random(1), START
        for _ in range(100):
            labels = random_edit(labels, FRAMES, rng).labels
            journal.write("Edit", labels)
        older, newest = sorted(tmp_path.iterdir())
        assert int(newest.stem.split("-")[1]) > 2
        assert self.read(newest) == labels
        # The older one leads exactly to where the newest begins, or one edit before it.
        begins = replay(unpacked(newest.read_bytes())[0][:1])
        assert begins.edits - replay(unpacked(older.read_bytes())[0]).edits == 1

    def test_a_full_disk_is_said_and_got_over(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        journal = self.begun(tmp_path)
        write = os.write

        def half(descriptor: int, data: memoryview) -> int:
            if len(data) < 10:
                raise OSError(28, "No space left on device")
            return write(descriptor, data[: len(data) // 2])

        with monkeypatch.context() as patch:
            patch.setattr("sd2core.labels.journal.os.write", half)
            with pytest.raises(OSError, match="No space"):
                journal.write("Edit", Labels())
        assert self.read(tmp_path / "000001-000001.journal") == START
        after = Labels(spans=(Span(1, "Gestures", 0.0, 1.0, "wave"),))
        journal.write("Edit", after)
        assert self.read(tmp_path / "000001-000002.journal") == after
        assert journal.kept.edits == 2

    @pytest.mark.skipif(os.name == "nt", reason="an open file cannot be deleted there")
    def test_a_deleted_file_is_made_again(self, tmp_path: Path) -> None:
        journal = self.begun(tmp_path)
        (tmp_path / "000001-000001.journal").unlink()
        journal.write("Edit", Labels())
        assert self.read(tmp_path / "000001-000002.journal") == Labels()

    @given(steps=st.lists(st.one_of(st.none(), st.integers(0, 3), st.just("saved")), max_size=20))
    @settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
    def test_other_fields_are_those_of_the_last_edit_of_them_since_the_file_was_saved(
        self, steps: list[int | str | None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(journal_module, "SHORTEST_BYTES", 1)  # many parts
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
