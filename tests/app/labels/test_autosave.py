"""Labels from opening to closing, without a window: kept, offered again, edited in one place."""

from __future__ import annotations

import errno
import os
import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from labelled import even, imported, random_edit
from left_behind import end_process
from numbered_videos import write_video
from PySide6.QtCore import QTimer

from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits, LabelMarking
from sd2app.labels.model import LabelsModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2app.settings import Settings
from sd2core.errors import Cure
from sd2core.labels import edits as core_edits
from sd2core.labels.files import read_labels, write_labels
from sd2core.labels.recovery import Recoverable, Recoveries, offers_in
from sd2core.recording.recording import Recording, open_recording


class Desk:
    """What a window has for labels, without the window."""

    def __init__(self, qtbot, root: Path) -> None:
        self.qtbot, self.root = qtbot, root
        self.document = DocumentModel(TaskList())
        self.labels, self.playback = LabelsModel(), PlaybackModel()
        self.session = LabelAutosave(self.document, self.labels, root, self.document)
        self.all_edits = Edits(self.document, SensorModel())
        self.edits = LabelEdits(
            self.document, self.labels, self.playback, self.session, self.all_edits
        )
        self.marking = LabelMarking(self.edits, Settings.forgetful())
        self.hand = LabelDragging(self.edits)
        self.said: list[str] = []
        for signal in (self.session.failed, self.session.noted, self.edits.failed):
            signal.connect(self.said.append)
        self.document.opened.connect(self._take_over)

    def _take_over(self) -> None:
        self.playback.set_timebase(self.document.content.timebase)
        self.session.attach()

    def open(self, path: Path) -> Desk:
        with self.qtbot.waitSignal(self.document.opened, timeout=10_000):
            self.document.open([path])
        return self

    def mark(self, first: int, stop: int, label: str = "left-to-right") -> None:
        """Mark frames from the first to the one before ``stop`` by key."""
        for frame in (first, stop):
            self.playback.seek_frame(frame)
            self.marking.mark(label)

    def edit(self, rng: random.Random) -> bool:
        return self.edits.apply(lambda now: random_edit(now.labels, now.timebase, rng))

    def crash(self) -> None:
        """What the end of a process does."""
        end_process(self.session, self.root)

    @property
    def spans(self) -> list[tuple[str, int, int]]:
        base = self.playback.timebase
        return [
            (span.label, *base.frames_between(span.start_s, span.end_s))
            for span in self.labels.labels.spans
        ]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "recovery"


@pytest.fixture
def desk(qtbot, root: Path):
    """Makes desks, and clears them in the end."""
    made = []

    def make(home: Path = root) -> Desk:
        made.append(Desk(qtbot, home))
        return made[-1]

    yield make
    for one in made:
        one.session.close()
        one.document.close()


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    vertices = np.random.default_rng(0).normal(size=(90, 5, 3))
    vertices[..., 2] += 3.0
    np.savez(tmp_path / "walk.npz", vertices=vertices)
    return tmp_path / "walk.npz"


@pytest.fixture
def recording(mesh: Path) -> Path:
    return Recording.create(mesh.with_name("walk.sd2"), mesh=mesh).folder


def left(root: Path) -> list[Recoverable]:
    """What a process that ended now would leave behind."""
    copy = shutil.copytree(root, root.with_name("of a process that ended"), dirs_exist_ok=True)
    found = offers_in(copy).offers
    shutil.rmtree(copy)
    return list(found)


class TestEveryEdit:
    @pytest.mark.parametrize("seed", range(4))
    def test_is_on_disk_when_it_returns_and_so_are_steps_back_and_forth(
        self, desk, root, recording, seed
    ) -> None:
        write_labels(recording / "labels.json", imported(even(90), 7))
        at, rng = desk().open(recording), random.Random(seed)
        stack, changes = at.document.undo_stack, 0
        for _ in range(40):
            before = at.labels.labels
            rng.choice([lambda: at.edit(rng), lambda: at.edit(rng), stack.undo, stack.redo])()
            if at.labels.labels is not before:
                (offer,) = left(root)
                assert offer.labels == at.labels.labels
                changes += 1
            assert at.document.recording.labels in (None, at.labels.labels)
        assert changes > 10

    def test_a_drag_is_one_record(self, desk, root, recording) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        size = [path.stat().st_size for path in root.rglob("*.journal")]
        assert at.hand.begin_drag()
        span = at.labels.labels.spans[0]
        for to_s in (0.8, 0.9, 1.0):
            at.hand.drag_edge(span.id, "end", to_s, 0.0)
            assert [path.stat().st_size for path in root.rglob("*.journal")] == size
        at.hand.end_drag()
        (offer,) = left(root)
        assert (offer.edits, offer.last) == (2, "Move end of span")
        assert offer.labels == at.labels.labels

    def test_names_say_what_was_done_last(self, desk, root, recording) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        assert left(root)[0].last == "Create span"
        at.document.undo_stack.undo()
        assert left(root)[0].last == "Undo create span"

    def test_nothing_is_written_where_nothing_changes(self, desk, root, recording) -> None:
        at = desk().open(recording)
        at.edits.apply(lambda now: core_edits.Edit("Nothing", now.labels))
        at.edits.delete()
        assert not list(root.rglob("*.journal"))
        assert not at.document.modified

    def test_that_cannot_be_written_is_made_and_told_once(
        self, desk, root, recording, monkeypatch
    ) -> None:
        at = desk().open(recording)
        at.mark(10, 20)

        def full(_: int) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            at.mark(30, 40)
            at.mark(50, 60)
        assert len(at.spans) == 3
        (said,) = at.said
        assert said.startswith("The edit is made, but could not be kept")
        assert "No space left" in said
        at.mark(70, 80)
        assert at.said[1:] == ["Edits are kept again."]
        assert left(root)[0].labels == at.labels.labels
        assert left(root)[0].edits == 4

    def test_a_place_that_cannot_be_made_keeps_nobody_from_editing(
        self, desk, root, recording
    ) -> None:
        root.write_text("a file where the folder should be")
        at = desk().open(recording)
        assert not at.session.refusal
        assert "not kept until they are saved" in at.session.notes[0]
        at.mark(10, 20)
        assert at.spans == [("left-to-right", 10, 20)]
        assert "could not be kept" in at.said[0]


class TestOpeningAndClosing:
    def test_what_was_saved_or_given_up_is_not_offered(self, desk, root, recording) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        at.document.save()
        assert offers_in(root) == Recoveries()
        at.mark(30, 40)
        at.session.close()
        at = desk().open(recording)
        assert at.session.offer is None
        assert at.spans == [("left-to-right", 10, 20)]

    def test_what_was_saved_and_then_lost_is_no_more_than_the_rest(
        self, desk, root, recording
    ) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        at.document.save()
        at.mark(30, 40)
        at.crash()
        again = desk().open(recording)
        assert again.session.offer.edits == 1
        assert len(again.session.offer.labels.spans) == 2

    def test_saved_as_something_else_it_goes_on_there(self, desk, root, mesh, tmp_path) -> None:
        at = desk().open(mesh)
        at.mark(10, 20)
        at.document.save_as(tmp_path / "other.sd2")
        assert not list(root.rglob("*.journal"))
        at.mark(30, 40)
        (offer,) = left(root)
        assert offer.recording == tmp_path / "other.sd2"
        # The mesh is free for another window again.
        other = desk().open(mesh)
        assert not other.session.refusal
        assert other.spans == []

    def test_a_file_that_is_no_recording_yet(self, desk, root, mesh) -> None:
        at = desk().open(mesh)
        at.mark(10, 20)
        at.crash()
        again = desk().open(mesh)
        assert again.session.offer.recording == mesh
        again.edits.restore()
        assert again.spans == [("left-to-right", 10, 20)]

    def test_files_that_are_added_change_no_labels(self, qtbot, desk, root, mesh, tmp_path) -> None:
        at = desk().open(mesh)
        at.mark(10, 20)
        write_capture_of_nothing(tmp_path / "radar")
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            at.all_edits.add([tmp_path / "radar"])
            at.mark(30, 40)  # while it is read
        assert at.spans == [("left-to-right", 10, 20), ("left-to-right", 30, 40)]
        assert at.document.modified
        at.mark(50, 60)
        (offer,) = left(root)
        assert (offer.edits, offer.recording) == (4, mesh)

    def test_files_that_are_added_are_an_edit_as_any_other(
        self, qtbot, desk, root, recording, tmp_path
    ) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        write_capture_of_nothing(tmp_path / "radar")
        document, stack = at.document, at.document.undo_stack
        at.labels.select_all()
        with qtbot.waitSignal(document.opened, timeout=10_000):
            at.all_edits.add([tmp_path / "radar"])
        assert len(at.labels.selected) == 1
        assert (stack.undoText(), document.modified) == ("Add radar file", True)
        for step, radar in ((stack.undo, None), (stack.redo, tmp_path / "radar")):
            with qtbot.waitSignal(document.opened, timeout=10_000):
                step()
            assert (document.recording.radar, document.capture is None) == (radar, radar is None)
        for step in (stack.undo, stack.undo):
            step()
        assert (at.spans, document.modified) == ([], False)
        with qtbot.waitSignal(document.opened, timeout=10_000):
            for step in (stack.redo, stack.redo):
                step()
        at.crash()
        again = desk().open(recording)
        assert again.document.capture is None
        with qtbot.waitSignal(again.document.opened, timeout=10_000):
            again.edits.restore()
        assert again.document.capture is not None
        assert again.spans == [("left-to-right", 10, 20)]
        again.document.save()
        assert open_recording(recording).radar == tmp_path / "radar"

    def test_what_cannot_be_read_is_not_added(self, qtbot, desk, root, mesh, tmp_path) -> None:
        at = desk().open(mesh)
        lost = write_video(tmp_path / "walk.mp4", 90)
        lost.write_bytes(lost.read_bytes()[:2_000])
        with qtbot.waitSignal(at.document.failed, timeout=10_000) as caught:
            at.all_edits.add([lost])
        assert "walk.mp4" in caught.args[0]
        assert (at.document.recording.video, at.document.undo_stack.count()) == (None, 0)

    def test_what_was_never_saved_is_offered_with_the_files_that_were_added(
        self, qtbot, desk, root, mesh, tmp_path
    ) -> None:
        video = write_video(tmp_path / "walk.mp4", 90)
        at = desk().open(mesh)
        at.mark(10, 20)
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            at.all_edits.add([video])
        at.crash()
        again = desk()
        with qtbot.waitSignal(again.document.opened, timeout=10_000):
            again.document.open([video, mesh])
        again.edits.restore()
        assert again.spans == [("left-to-right", 10, 20)]

    def test_edits_stay_where_they_are_kept_while_another_window_has_the_added_file(
        self, qtbot, desk, root, mesh, tmp_path
    ) -> None:
        video = write_video(tmp_path / "walk.mp4", 90)
        other = desk().open(video)
        at = desk().open(mesh)
        at.mark(10, 20)
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            at.all_edits.add([video])
        assert not at.session.read_only
        at.mark(30, 40)
        assert at.spans == [("left-to-right", 10, 20), ("left-to-right", 30, 40)]
        other.session.close()
        at.crash()
        again = desk().open(mesh)
        again.edits.restore()
        assert again.spans == at.spans

    def test_files_that_are_added_while_others_are_read_come_with_them(
        self, qtbot, desk, root, mesh, tmp_path
    ) -> None:
        write_capture_of_nothing(tmp_path / "radar")
        shutil.copy(mesh, tmp_path / "other.npz")
        at = desk().open(mesh)
        at.all_edits.add([tmp_path / "radar"])
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            at.all_edits.add([tmp_path / "other.npz"])
        recording = at.document.recording
        assert (recording.radar, recording.mesh) == (tmp_path / "radar", tmp_path / "other.npz")
        assert at.document.undo_stack.undoText() == "Add mesh and radar file"
        # A file that is read again while a step is undone is not left out.
        at.all_edits.add([mesh])
        at.document.undo_stack.undo()
        qtbot.waitUntil(lambda: at.document.recording.mesh == mesh and not at.document.reading)
        assert at.document.recording.radar is None
        qtbot.waitUntil(lambda: at.document.capture is None, timeout=10_000)

    def test_a_recording_is_not_added_to_another(self, qtbot, desk, mesh, recording) -> None:
        at = desk().open(mesh)
        at.mark(10, 20)
        with qtbot.waitSignal(at.document.failed, timeout=10_000) as caught:
            at.all_edits.add([recording])
        assert "cannot be added to another" in caught.args[0]
        assert at.spans == [("left-to-right", 10, 20)]


class TestOffers:
    @pytest.fixture
    def crashed(self, desk, recording) -> list[tuple[str, int, int]]:
        """Two edits beyond the file, which has one span."""
        at = desk().open(recording)
        at.mark(10, 20)
        at.document.save()
        at.mark(30, 40, "up-to-down")
        at.edits.relabel("down-to-up")
        spans = at.spans
        at.crash()
        return spans

    def test_restoring_is_one_step(self, desk, root, recording, crashed) -> None:
        at = desk().open(recording)
        assert at.spans == crashed[:1]
        at.edits.restore()
        assert at.spans == crashed
        assert at.session.offer is None
        assert at.document.modified
        stack = at.document.undo_stack
        assert stack.undoText() == "Restore labels"
        stack.undo()
        assert at.spans == crashed[:1]
        stack.redo()
        assert at.spans == crashed
        at.crash()
        again = desk().open(recording)
        again.edits.restore()
        assert again.spans == crashed

    def test_restored_and_lost_again_it_counts_as_before(
        self, desk, root, recording, crashed
    ) -> None:
        at = desk().open(recording)
        at.edits.restore()
        at.crash()
        assert desk().open(recording).session.offer.edits == 2

    def test_restoring_goes_before_edits_that_were_made_meanwhile(
        self, desk, root, recording, crashed
    ) -> None:
        at = desk().open(recording)
        at.mark(50, 60)
        at.edits.restore()
        assert at.spans == crashed
        at.document.undo_stack.undo()
        assert at.spans == [crashed[0], ("left-to-right", 50, 60)]
        (offer,) = left(root)
        assert offer.labels == at.labels.labels

    def test_another_way_to_read_the_mesh_comes_back_with_the_mesh(
        self, qtbot, desk, recording
    ) -> None:
        at = desk().open(recording)
        first_m = at.document.mesh.frame(0)
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            Edits(at.document, SensorModel()).cure_mesh(Cure("turn", "z180", "Turn it"))
        at.crash()
        at = desk().open(recording)
        assert at.session.changed_others(at.session.offer) == ["way to read the mesh"]
        np.testing.assert_allclose(at.document.mesh.frame(0), first_m)
        with qtbot.waitSignal(at.document.opened, timeout=10_000):
            at.edits.restore()
        np.testing.assert_allclose(at.document.mesh.frame(0), first_m * [-1, -1, 1], atol=1e-6)
        at.document.undo_stack.undo()
        np.testing.assert_allclose(at.document.mesh.frame(0), first_m)

    def test_declined_is_kept_and_asked_for_comes_back(
        self, desk, root, recording, crashed
    ) -> None:
        at = desk().open(recording)
        at.session.decline()
        at.session.close()
        at = desk().open(recording)
        assert at.session.offer is None
        (offer,) = at.session.recoveries().offers
        assert offer.declined
        at.session.ask_for(offer)
        assert at.session.offer == offer
        at.edits.restore()
        assert at.spans == crashed
        assert not list(root.rglob("*.declined"))

    def test_not_now_is_asked_again(self, desk, root, recording, crashed) -> None:
        at = desk().open(recording)
        at.session.postpone()
        assert at.session.offer is None
        at.mark(50, 60)  # begins a journal of its own
        at.session.close()
        assert desk().open(recording).session.offer.edits == 2

    def test_what_is_in_the_file_already_is_dropped(self, desk, root, recording) -> None:
        at = desk().open(recording)
        at.mark(10, 20)
        at.document.undo_stack.undo()
        at.crash()
        assert len(offers_in(root).offers) == 1
        assert desk().open(recording).session.offer is None
        assert not list(root.rglob("*.journal"))

    def test_of_another_recording_asked_for_when_it_is_opened(
        self, desk, root, recording, mesh, crashed
    ) -> None:
        at = desk()
        at.session.look_around()
        assert [one.recording for one in at.session.waiting.offers] == [recording]
        at.open(mesh)
        assert at.session.waiting == Recoveries()
        assert at.session.offer is None
        (offer,) = at.session.recoveries().offers
        assert not at.session.is_of_open(offer)
        at.session.give_up(offer)
        (offer,) = at.session.recoveries().offers
        assert offer.declined
        at.session.ask_for(offer)
        assert at.session.offer is None
        at.open(recording)
        assert at.session.offer == offer
        at.session.give_up(offer)
        assert at.session.recoveries() == Recoveries()
        assert at.session.offer is None

    def test_what_cannot_be_read_is_said(self, desk, root, recording, crashed) -> None:
        (path,) = root.rglob("*.journal")
        path.write_bytes(b"not a journal")
        at = desk().open(recording)
        assert at.session.offer is None
        assert "is kept" in at.session.notes[0]
        at.mark(50, 60)
        assert path.with_suffix(".damaged").read_bytes() == b"not a journal"


class TestTwoWindows:
    def test_the_second_looks_on(self, desk, root, recording) -> None:
        first, second = desk().open(recording), desk().open(recording)
        first.mark(10, 20)
        assert second.session.read_only
        assert f"(process {os.getpid()})" in second.session.refusal
        second.playback.seek_frame(5)
        for refused in (
            lambda: second.marking.mark("left-to-right"),
            lambda: second.edits.apply(lambda now: random_edit(now.labels, now.timebase, None)),
            second.hand.begin_drag,
        ):
            second.said.clear()
            assert not refused()
            assert second.said == [second.session.refusal]
        assert second.spans == []
        assert not second.labels.marks
        assert not second.hand.dragging
        first.document.save()
        # The sensor, say, can be saved; the labels of the first stay.
        second.document.save()
        assert len(read_labels(recording / "labels.json").labels.spans) == 1

    def test_one_with_another_home_looks_on_as_well(self, desk, recording, tmp_path) -> None:
        first, second = desk(), desk(tmp_path / "home of another")
        first.open(recording)
        second.open(recording)
        assert second.session.read_only
        assert f"(process {os.getpid()})" in second.session.refusal
        (note,) = recording.glob(".edited-by.json")
        os.utime(note, (1.0, 1.0))
        first.session.findChild(QTimer).timeout.emit()
        assert note.stat().st_mtime > 1.0
        first.session.close()
        second.session.try_again()
        assert not second.session.refusal

    def test_it_edits_once_the_first_has_let_go(self, desk, root, recording) -> None:
        first, second = desk().open(recording), desk().open(recording)
        second.session.try_again()
        assert second.session.read_only
        assert second.said == [second.session.refusal]
        first.mark(10, 20)
        first.document.save()
        first.mark(30, 40)
        first.crash()
        second.session.try_again()
        assert not second.session.refusal
        # What was saved meanwhile, and what was not.
        assert second.spans == [("left-to-right", 10, 20)]
        assert second.session.offer.edits == 1
        second.mark(50, 60)
        second.document.save()
        assert len(read_labels(recording / "labels.json").labels.spans) == 2

    def test_a_recording_of_ones_own_is_edited(self, desk, root, recording, tmp_path) -> None:
        first, second = desk().open(recording), desk().open(recording)
        second.document.save_as(tmp_path / "mine.sd2")
        assert not second.session.refusal
        second.mark(10, 20)
        second.document.save()
        first.mark(30, 40)
        first.document.save()
        for folder, spans in ((tmp_path / "mine.sd2", second.spans), (recording, first.spans)):
            (span,) = read_labels(folder / "labels.json").labels.spans
            assert (span.label, *even(90).frames_between(span.start_s, span.end_s)) == spans[0]

    def test_it_looks_on_with_files_that_were_added(
        self, qtbot, desk, root, recording, tmp_path
    ) -> None:
        first, second = desk().open(recording), desk().open(recording)
        write_capture_of_nothing(tmp_path / "radar")
        with qtbot.waitSignal(second.document.opened, timeout=10_000):
            second.all_edits.add([tmp_path / "radar"])
        assert not second.hand.begin_drag()
        first.mark(10, 20)
        first.document.save()
        second.document.save()
        assert len(read_labels(recording / "labels.json").labels.spans) == 1

    def test_labels_that_were_damaged_meanwhile_are_not_overwritten(
        self, desk, root, recording
    ) -> None:
        first, second = desk().open(recording), desk().open(recording)
        (recording / "labels.json").write_text("{")
        first.session.close()
        second.session.try_again()
        assert "labels.json" in second.session.refusal
        assert not second.hand.begin_drag()
        second.document.save()
        assert (recording / "labels.json").read_text() == "{"

    def test_nothing_is_edited_where_nothing_is_open(self, desk) -> None:
        at = desk()
        at.marking.mark("left-to-right")
        assert not at.hand.begin_drag()
        assert not at.session.read_only
        assert set(at.said) == {at.session.refusal}


def write_capture_of_nothing(folder: Path) -> None:
    from sd2core.io.radar.infineon import write_capture
    from sd2core.radar_config import PAPER_RADAR

    shape = (30, 1, PAPER_RADAR.chirps_per_frame, PAPER_RADAR.samples_per_chirp)
    samples = np.full(shape, 2048, np.uint16)
    write_capture(folder, samples, PAPER_RADAR, np.arange(30) / 30, simulated=True)
