"""What a crash left behind is offered, declined, deleted; and only one window edits."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from earlier_journals import part
from labelled import even, imported
from lock_holders import held

from sd2core.errors import Sd2Error
from sd2core.files.edit_lock import Holder
from sd2core.labels.recovery import Recoveries, RecoveryPlace, offers_in
from sd2core.labels.spans import Labels

START = imported(even(), 7)


def edited(count: int) -> Labels:
    """Labels after so many edits."""
    return START.with_spans(without=range(1, count + 1))


def crashed(root: Path, recording: Path, edits: int, *, saved_after: int = 0) -> None:
    """A session that ended without a close."""
    place = RecoveryPlace(root, recording)
    assert place.take()
    journal = place.begin(START)
    for count in range(1, edits + 1):
        journal.write(f"Edit {count}", edited(count))
        if count == saved_after:
            journal.saved()
    place.release()


def crashed_earlier(root: Path, recording: Path, edits: int, saved_after: int = 0) -> Path:
    """Part of a session of an earlier version that ended without a close."""
    crashed(root, recording, 0)
    (path,) = root.rglob("*.journal")
    states = [edited(count) for count in range(edits + 1)]
    path.write_bytes(b"".join(part(recording, states, saved_after)))
    return path


Take = Callable[[Path, Path], RecoveryPlace]


@pytest.fixture
def taken() -> Iterator[Take]:
    """Takes places, and releases them in the end."""
    places = []

    def take(root: Path, recording: Path) -> RecoveryPlace:
        place = RecoveryPlace(root, recording)
        assert place.take()
        places.append(place)
        return place

    yield take
    for place in places:
        place.release()


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "data" / "Wälk 1.sd2"
    path.mkdir(parents=True)
    return path


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "recovery"


class TestOffers:
    def test_what_was_not_saved(self, taken: Take, root: Path, recording: Path) -> None:
        before_s = time.time()
        crashed(root, recording, 5, saved_after=2)
        (offer,) = taken(root, recording).offers().offers
        assert offer.labels == edited(5)
        assert (offer.edits, offer.last, offer.recording) == (3, "Edit 5", recording)
        assert before_s <= offer.time_unix_s <= time.time()
        assert not offer.declined

    def test_nothing_after_a_save_a_close_or_no_edit(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        crashed(root, recording, 4, saved_after=4)
        crashed(root, recording, 0)
        place = taken(root, recording)
        assert place.offers() == Recoveries()
        journal = place.begin(START)
        journal.write("Edit", edited(1))
        journal.close()
        assert place.offers() == Recoveries()
        # What only says what the user's file says as well is gone too.
        assert not list(root.rglob("*.journal"))

    def test_of_all_recordings_but_those_in_use(
        self, taken: Take, root: Path, tmp_path: Path
    ) -> None:
        assert offers_in(root) == Recoveries()
        for name in "ab":
            crashed(root, tmp_path / name, 2)
        assert [one.recording.name for one in offers_in(root).offers] == ["b", "a"]
        place = taken(root, tmp_path / "b")
        assert [one.recording.name for one in offers_in(root).offers] == ["a"]
        place.release()
        assert len(offers_in(root).offers) == 2

    def test_the_newest_session_first(self, taken: Take, root: Path, recording: Path) -> None:
        crashed(root, recording, 1)
        crashed(root, recording, 2)
        assert [one.edits for one in taken(root, recording).offers().offers] == [2, 1]

    def test_taken_it_goes_on_in_a_new_session(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        crashed(root, recording, 3)
        place = taken(root, recording)
        (offer,) = place.offers().offers
        journal = place.begin(offer.labels, offer)
        assert not any(path.exists() for path in offer.files)
        assert journal.kept.edits == 3
        journal.write("Edit 4", edited(4))
        place.release()
        (again,) = taken(root, recording).offers().offers
        assert (again.edits, again.last, again.labels) == (4, "Edit 4", edited(4))

    def test_lost_again_before_any_edit_it_is_still_offered(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        crashed(root, recording, 3)
        place = taken(root, recording)
        (offer,) = place.offers().offers
        place.begin(offer.labels, offer)
        place.release()
        (again,) = taken(root, recording).offers().offers
        assert (again.edits, again.last, again.labels) == (3, "Edit 3", edited(3))

    def test_declined_it_is_kept_and_not_offered(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        crashed(root, recording, 3)
        place = taken(root, recording)
        (offer,) = place.offers().offers
        place.decline(offer)
        assert place.offers() == Recoveries()
        assert offers_in(root) == Recoveries()
        place.release()
        assert offers_in(root, declined=True).offers[0].declined
        assert place.take()
        (declined,) = place.offers(declined=True).offers
        assert declined.declined
        assert declined.labels == edited(3)
        journal = place.begin(START)
        journal.write("Edit", edited(1))
        place.release()
        place = taken(root, recording)
        assert [one.edits for one in place.offers(declined=True).offers] == [1, 3]
        place.delete(declined)
        assert [one.edits for one in place.offers(declined=True).offers] == [1]

    def test_a_link_leads_to_the_same_place(
        self, taken: Take, root: Path, recording: Path, tmp_path: Path
    ) -> None:
        link = tmp_path / "link.sd2"
        link.symlink_to(recording, target_is_directory=True)
        crashed(root, link, 2)
        assert taken(root, recording).offers().offers[0].recording == recording


@pytest.mark.skipif(os.name == "nt", reason="POSIX permissions")
class TestPrivacy:
    @pytest.fixture(autouse=True)
    def mask(self) -> Iterator[None]:
        before = os.umask(0o022)
        yield
        os.umask(before)

    def test_nobody_else_reads_what_a_session_writes(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        place = taken(root, recording)
        place.begin(START).write("Edit", edited(1))
        assert self.modes(*root.glob("*/*.journal"), *root.glob("*/holder.json")) == {0o600}
        assert self.modes(root, *root.iterdir()) == {0o700}

    @pytest.mark.parametrize("look", ["open", "list"])
    def test_what_an_earlier_version_left_is_closed_to_others(
        self, taken: Take, root: Path, recording: Path, look: str
    ) -> None:
        crashed(root, recording, 3)
        (folder,) = root.iterdir()
        for path in (root, folder, *folder.iterdir()):
            path.chmod(0o755 if path.is_dir() else 0o644)
        if look == "open":
            assert taken(root, recording).offers().offers
            assert self.modes(root) == {0o700}
        else:
            assert offers_in(root).offers
        assert self.modes(folder) == {0o700}
        assert self.modes(*folder.iterdir()) == {0o600}

    @staticmethod
    def modes(*paths: Path) -> set[int]:
        return {path.stat().st_mode & 0o777 for path in paths}


class TestDamage:
    @pytest.mark.parametrize(
        ("content", "says"),
        [
            (b"", "does not begin with a whole record"),
            (bytes(5000), "does not begin with a whole record"),
            (b"hello\n", "does not begin with a whole record"),
        ],
    )
    def test_is_noted_once_and_kept(
        self, taken: Take, root: Path, recording: Path, content: bytes, says: str
    ) -> None:
        crashed(root, recording, 2)
        crashed(root, recording, 3)
        newest = max(root.rglob("*.journal"))
        newest.write_bytes(content)
        place = taken(root, recording)
        found = place.offers()
        assert [one.edits for one in found.offers] == [2]
        assert str(newest) in found.notes[0]
        assert says in found.notes[0]
        place.begin(START, found.offers[0]).close()
        assert place.offers() == Recoveries()
        assert newest.with_suffix(".damaged").read_bytes() == content

    def test_of_the_newest_part_costs_that_part(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        older = crashed_earlier(root, recording, 40)
        newest = older.with_name("000001-000002.journal")
        newest.write_bytes(older.read_bytes()[1:])
        found = taken(root, recording).offers()
        assert found.offers[0].files == (older,)
        assert found.offers[0].edits == 40
        assert found.offers[0].labels == edited(40)
        assert "is kept" in found.notes[0]

    def test_a_torn_end_is_noted(self, taken: Take, root: Path, recording: Path) -> None:
        path = crashed_earlier(root, recording, 3)
        path.write_bytes(path.read_bytes()[:-7])
        found = taken(root, recording).offers()
        assert found.offers[0].labels == edited(2)
        assert "ends within an edit" in found.notes[0]

    def test_half_an_edit_and_nothing_else_is_noted_once(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        path = crashed_earlier(root, recording, 3, saved_after=2)
        path.write_bytes(path.read_bytes()[:-7])
        place = taken(root, recording)
        found = place.offers()
        assert found.offers == ()
        assert "ends within an edit" in found.notes[0]
        place.begin(START).close()
        assert place.offers() == Recoveries()

    def test_a_later_version_is_left_alone(
        self, taken: Take, root: Path, recording: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        with monkeypatch.context() as patch:
            patch.setattr("sd2core.labels.journal.VERSION", 3)
            crashed(root, recording, 1)
        place = taken(root, recording)
        found = place.offers()
        assert found.offers == ()
        assert "version is 3" in found.notes[0]
        place.begin(START).close()
        assert place.offers() == found

    def test_strange_names_are_nothing(self, taken: Take, root: Path, recording: Path) -> None:
        crashed(root, recording, 1)
        (path,) = root.rglob("*.journal")
        for name in ("mine.journal", "1-2-3.journal", "-.journal", "notes.txt"):
            (path.parent / name).write_text("mine")
        place = taken(root, recording)
        assert len(place.offers().offers) == 1
        place.begin(START).close()
        assert (path.parent / "mine.journal").read_text() == "mine"


class TestOneWindow:
    def test_the_second_is_told_who_is_first(
        self, taken: Take, root: Path, recording: Path
    ) -> None:
        second = RecoveryPlace(root, recording)
        assert second.holder() is None
        first = taken(root, recording)
        assert first.take()
        assert not second.take()
        assert not second.held
        holder = second.holder()
        assert holder is not None
        assert holder.pid == os.getpid()
        assert f"(process {os.getpid()})" in str(holder)
        with pytest.raises(Sd2Error, match=rf"edited by .*process {os.getpid()}.*Close the other"):
            second.begin(START)
        first.release()
        assert second.holder() is None
        taken(root, recording)

    def test_it_ends_with_the_process(self, taken: Take, root: Path, recording: Path) -> None:
        place = taken(root, recording)
        (lock,) = root.rglob("lock")
        (said,) = root.rglob("holder.json")
        place.release()
        said.write_text("half a")
        process = held(lock)
        try:
            assert not place.take()
            assert place.holder() == Holder()
            assert str(Holder()) == "Another user"
        finally:
            process.kill()
            process.communicate()
        assert place.take()

    def test_other_recordings_are_other_places(
        self, taken: Take, root: Path, tmp_path: Path
    ) -> None:
        taken(root, tmp_path / "a" / "walk.sd2")
        taken(root, tmp_path / "b" / "walk.sd2")
