"""The recording that is open."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoStack

from sd2app.background.latest import BackgroundModel, Emit, LatestRunner
from sd2app.session.content import (
    PARTS,
    UNTITLED,
    Content,
    MeshReader,
    OfferedCure,
    ReadMesh,
    camera_of,
    clock_of,
    load_content,
    mesh_fields,
    offers_of,
    recording_of,
    words_of,
)
from sd2app.session.tasks import Job, ListedRunner, TaskList
from sd2core.body.camera import PinholeCamera
from sd2core.doppler.options import PRESETS
from sd2core.errors import Cure, Sd2Error
from sd2core.io.bodies import at_hand, with_bodies
from sd2core.io.kinds import kind_of
from sd2core.io.things import with_things, with_walls
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.synthesis import HowCounted
from sd2core.radar_config import CLUTTER, Clutter
from sd2core.recording.edited import EDITED
from sd2core.recording.recording import Recording
from sd2core.sensor import VelocityAxis

if TYPE_CHECKING:
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.io.video import VideoReader


@dataclass(frozen=True, eq=False)
class _Asked:
    """Files to read, alone or beside those of a recording, and what is done once they are shown.

    Each of the ``groups`` goes beside, or in place of, what is before it; with it go fields of the
    recording that say how its mesh is read.
    """

    groups: tuple[tuple[Sequence[Path], Mapping[str, Any]], ...]
    base: Recording | None = None
    then: Callable[[dict[str, Any]], object] = lambda before: None
    cure: Cure | None = None


class DocumentModel(BackgroundModel):
    """One recording, its parts, and the history of its edits."""

    opened = Signal()  # another recording, or none
    changed = Signal()  # something in it, or its place on disk
    grown = Signal()  # frames were added at its end
    saved = Signal()  # on disk with all edits, maybe in another place than before
    offered = Signal()  # to read the mesh another way, or no longer
    renamed = Signal(dict)  # old names of persons and their new ones, within a step of the history
    noted = Signal(str)
    failed = Signal(str)

    def __init__(self, jobs: TaskList, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.undo_stack = QUndoStack(self)
        self.content: Content | None = None  # all parts; None while nothing is open
        self.clutter: Clutter = CLUTTER  # method that removes static echoes from the capture
        self.count = PRESETS["paper"].count  # of vertices whose mesh states its uncertainty
        self.same_recording = False  # as was open before, with other files
        self.growing = False  # a radar is listened to, and adds frames
        self.offers: tuple[OfferedCure, ...] = ()  # of reading the mesh another way
        self._asked: _Asked | None = None  # last
        self._shown: tuple[Path | None, Path | None] = None, None  # video and radar on screen
        self._runner = ListedRunner("open", jobs, self, self._receive)
        self._runner.failed.connect(lambda error: self._offer(offers_of([error]) or self.offers))
        # Not listed: cancelled, it would leave on screen what is no longer in the recording.
        self._reader = LatestRunner("files", self, self._show_parts)
        self._maps = ListedRunner("radar", jobs, self, self._receive_map)
        for runner in (self._runner, self._reader, self._maps):
            runner.failed.connect(lambda error: self.failed.emit(words_of(error)))
        self.meshes = MeshReader(jobs, self)
        self.meshes.ready.connect(self._exchange_mesh)
        self.meshes.failed.connect(self.failed)

    # --- what is there --------------------------------------------------------------------

    @property
    def recording(self) -> Recording | None:
        """Description of what belongs together."""
        return self.content.recording if self.content else None

    @property
    def video(self) -> VideoReader | None:
        """Open video file."""
        return self.content.video if self.content else None

    @property
    def mesh(self) -> MeshSequence | None:
        """Moving mesh or point cloud."""
        return self.content.mesh if self.content else None

    @property
    def capture(self) -> RadarCapture | None:
        """Raw radar capture with all channels, on its own clock."""
        return self.content.capture if self.content else None

    @property
    def radar_map(self) -> DopplerMap | None:
        """Doppler map of the capture, on its own clock."""
        return self.content.radar_map if self.content else None

    @property
    def title(self) -> str:
        """Name on the window."""
        return self.content.recording.title if self.content else ""

    def file_name(self, ending: str) -> str:
        """Proposed name of a file about the recording: its title and an ending."""
        return re.sub(r"[/\\:]", "-", self.title) + ending

    @property
    def paths(self) -> tuple[Path, ...]:
        """Folder of the recording, or its files while it has none; what opens it again."""
        recording = self.recording
        if recording is None:
            return ()
        if recording.folder != UNTITLED:
            return (recording.folder,)
        files = (recording.video, recording.mesh, recording.radar)
        return tuple(path for path in files if path is not None)

    @property
    def simulated(self) -> bool:
        """True if the recording is simulated, without camera and radar."""
        return self.content is not None and self.content.recording.simulated

    @property
    def labels(self) -> Labels:
        """Labels of the recording, or those that its radar file brings where it has none."""
        content = self.content
        if content is None:
            return Labels()
        recording, brought = content.recording, content.radar_labels
        if recording.unlabelled and brought is not None:
            return brought.shifted(recording.radar_offset_s)
        return recording.labelled

    @property
    def camera(self) -> PinholeCamera:
        """The camera that took the video, by default one with the usual field of view."""
        content = self.content
        return PinholeCamera() if content is None else camera_of(content.recording, content.video)

    @property
    def modified(self) -> bool:
        """True if there are unsaved edits; how maps are shown is saved nowhere."""
        content = self.content
        return content is not None and not self.undo_stack.isClean() and content.recording.edited

    # --- opening --------------------------------------------------------------------------

    @property
    def reading(self) -> Job | None:
        """Task of reading files; None while nothing is being read."""
        return self._runner.job

    @property
    def maps_capture(self) -> bool:
        """True while the Doppler map of the capture is being made."""
        return self._maps.job is not None

    @property
    def part_read(self) -> str:
        """Part that is being read, in words; empty before the first."""
        job = self.reading
        if job is None or not job.total:
            return ""
        return f"Reading the {PARTS[min(len(PARTS) * job.done // job.total, len(PARTS) - 1)]}"

    def open(self, paths: Sequence[Path], mesh: Mapping[str, Any] | None = None) -> None:
        """Open a recording, or files that make up one, in the background.

        ``mesh`` holds fields of the recording that say how its mesh is read, where it does not.
        """
        self._start(_Asked(((paths, mesh or {}),)))

    def read_added(
        self,
        paths: Sequence[Path],
        mesh: Mapping[str, Any] | None,
        then: Callable[[dict[str, Any]], object],
    ) -> None:
        """Read files beside those of the recording that is open, in the background.

        ``mesh`` is as for :meth:`open`; ``then`` is called with what changed fields were before.
        """
        assert self.recording is not None
        asked, pending = _Asked(((paths, mesh or {}),), replace(self.recording), then), self._asked
        if pending is not None and pending.base is not None and self._runner.busy:
            groups = (*pending.groups, *asked.groups)
            asked = replace(asked, groups=groups, cure=pending.cure)
        self._start(asked)

    @property
    def offers_of_open(self) -> bool:
        """True where the offers are of what is open, not of a file that was refused."""
        return self.content is not None and self.offers == self.content.offers

    def open_mesh_so(self, cure: Cure) -> None:
        """Open what was refused, its mesh read with a setting that puts it right."""
        assert self._asked is not None
        self._start(replace(self._asked, cure=cure))

    def decline_offers(self) -> None:
        """Leave the mesh as it was read."""
        self._offer(())

    def _offer(self, offers: tuple[OfferedCure, ...]) -> None:
        if offers != self.offers:
            self.offers = offers
            self.offered.emit()

    def follow(self, content: Content) -> None:
        """Show a recording that a radar's frames are added to, from now on by :meth:`grow`.

        Where it is the one that is open, its edits and their history stay.
        """
        for runner in (self._runner, self._reader, self._maps):
            runner.cancel()
        before, self.content = self.content, content
        self.growing = True
        if before is not None and before.recording.folder == content.recording.folder:
            self.content = replace(before, capture=content.capture)
            assert content.radar_map is not None
            self.grow(content.radar_map)
            return
        if before is not None:
            before.close()
        self.same_recording, self._shown = False, _files(content.recording)
        self._offer(content.offers)
        self._tell_opened(unsaved=False)

    def grow(self, radar_map: DopplerMap) -> None:
        """Show a longer map of the radar: it was listened to until its end."""
        self._take_growth(radar_map, radar_map=radar_map)

    def end_growth(self) -> None:
        """Take over the whole capture; Sd2Error if it cannot be read.

        Where its files were undone, or done again, meanwhile, they are read in the background.
        """
        if self.content is None or not self.growing:
            return
        self.growing = False
        if _files(self.content.recording) != self._shown:
            self._read_parts()
            return
        capture = self.content.recording.load_every_channel()
        self._take_growth(capture, capture=capture)
        self.changed.emit()
        if capture.notes:
            self.noted.emit(" ".join(capture.notes))
        self._process_capture()

    def _take_growth(self, radar: RadarCapture | DopplerMap, **parts: Any) -> None:
        content = self.content
        assert content is not None
        timebase = clock_of(content.recording, content.video, content.mesh, radar)
        self.content = replace(content, timebase=timebase, **parts)
        self.grown.emit()

    def close(self) -> None:
        """Stop all work and let go of the files."""
        super().close()
        if self.content is not None:
            self.content.close()
            self.content = None

    def _start(self, asked: _Asked) -> None:
        self._asked = asked

        def read(emit: Emit) -> Content:
            recording = None if asked.base is None else replace(asked.base)
            for paths, fields in asked.groups:
                recording = recording_of(paths, recording)
                for field, value in fields.items():
                    setattr(recording, field, value)
            assert recording is not None
            if any(kind_of(path) == "radar" for paths, _ in asked.groups for path in paths):
                with suppress(Sd2Error):  # what cannot be read is said where it is loaded
                    recording.learn_offset()
            if asked.cure is not None:
                recording.mesh_reading = recording.mesh_reading.cured(asked.cure)
            return load_content(recording, lambda done, total: emit((done, total)))

        self._runner.submit(read, f"Opening {asked.groups[-1][0][0].name}")

    def _receive(self, content: Content) -> None:
        asked = self._asked
        assert asked is not None
        if asked.base is None:
            self._open(content, unsaved=asked.cure is not None and content.saved)
        elif unread := _unread(content, asked.base):
            content.close()
            self.failed.emit(unread)
            self._offer(content.offers)
        else:
            read, base, recording = content.recording, asked.base, self.recording
            changed = [one for one in EDITED if getattr(read, one) != getattr(base, one)]
            before = {name: getattr(recording, name) for name in changed}
            for name in changed:
                setattr(recording, name, getattr(read, name))
            self._show_parts(content)  # also of the same files, which may hold something else
            asked.then(before)

    def _open(self, content: Content, *, unsaved: bool) -> None:
        before, self.content = self.content, content
        self._shown = _files(content.recording)
        self._reader.cancel()
        if before is not None:
            before.close()
        self.same_recording = self.growing = False
        self._tell_opened(unsaved=unsaved)
        self._tell_read(content)

    def _tell_read(self, content: Content) -> None:
        for problem in content.problems:
            self.failed.emit(problem)
        if content.notes:
            self.noted.emit(" ".join(content.notes))
        self._offer(content.offers)
        self._process_capture()

    def _tell_opened(self, unsaved: bool) -> None:
        assert self.content is not None
        # Chosen for the one before.
        self.clutter, self.count = CLUTTER, PRESETS["paper"].count
        fields = mesh_fields(self.content.recording)
        self.meshes.reset(ReadMesh(fields, self.content.mesh, self.content.offers))
        self.undo_stack.clear()
        if unsaved:
            self.undo_stack.resetClean()
        self.opened.emit()
        self.changed.emit()

    def _read_parts(self) -> None:
        """Read all files of the recording that is open, and show them in it."""
        assert self.recording is not None
        if self.growing:
            return  # at the end
        asked = replace(self.recording)
        self._reader.submit(lambda emit: load_content(asked, lambda *_: emit(None)))

    def _show_parts(self, content: Content) -> None:
        """Show what was read in what is open; the recording, its history and edits stay."""
        before = self.content
        assert before is not None
        recording, read_by = before.recording, mesh_fields(content.recording)
        if _files(recording) != _files(content.recording):  # undone meanwhile
            content.close()
            self._read_parts()
            return
        if recording.camera is None:
            recording.camera = content.recording.camera  # which the mesh brings
        recording.simulated |= content.recording.simulated
        self.content, self._shown = replace(content, recording=recording), _files(recording)
        self.meshes.keep(ReadMesh(read_by, content.mesh, content.offers))
        if read_by != mesh_fields(recording):  # edited meanwhile
            self.meshes.follow(recording)
        self._surround()
        self.same_recording = True
        self.opened.emit()
        self.changed.emit()
        before.close()
        self._tell_read(content)

    # --- changing -------------------------------------------------------------------------

    def assign(self, fields: Mapping[str, object]) -> None:
        """Change fields of the recording, such as ``radar_offset_s``."""
        recording = self.recording
        if recording is None or all(getattr(recording, name) == fields[name] for name in fields):
            return
        channel, mesh, files = _channel(recording), mesh_fields(recording), _files(recording)
        for name, value in fields.items():
            setattr(recording, name, value)
        if _files(recording) != files:
            self._read_parts()
        elif mesh_fields(recording) != mesh:
            self.meshes.follow(recording)
        self._surround()
        self.changed.emit()
        if _channel(recording) != channel:
            self._process_capture()

    def set_labels(self, labels: Labels | None) -> None:
        """Give the recording labels of its own, or none unless such were saved; tells nobody."""
        if (recording := self.recording) is not None:
            recording.labels = labels
            if labels is None:
                recording.labels = self.labels
                recording.unlabel()

    def _exchange_mesh(self, read: ReadMesh) -> None:
        """Show another mesh in what is open; the history and all else stay."""
        content = self.content
        assert content is not None
        radar = content.capture or content.radar_map
        if content.video is None and radar is None and read.mesh is None:
            return  # there would be nothing to show
        if content.recording.camera is None:
            content.recording.camera = read.fields["camera"]  # which the mesh brings
        timebase = clock_of(content.recording, content.video, read.mesh, radar)
        self.content = replace(content, mesh=read.mesh, timebase=timebase, offers=read.offers)
        self._surround()
        self.same_recording = True
        self.opened.emit()
        self.changed.emit()
        self._offer(read.offers)

    def _surround(self) -> None:
        """Put the recording's things, walls and other bodies around its mesh."""
        content = self.content
        if content is None or content.mesh is None:
            return
        mesh, recording = content.mesh, content.recording
        around, things = mesh.surroundings, recording.things_there
        try:
            bodies = recording.bodies_there if recording.bodies or mesh.others else ()
            if bodies != tuple(body.placed for body in mesh.others):
                ready = [body for body in bodies if at_hand(body, mesh)]
                for body in bodies:
                    if body not in ready and not self.meshes.awaits(body):
                        self.meshes.read_body(content.mesh, body, self._surround_by_read)
                mesh = with_bodies(mesh, ready, person=recording.subject)
            if recording.walls != (() if around is None else around.walls):
                mesh = with_walls(mesh, recording.walls)
            if things != (() if around is None else around.things):
                mesh = with_things(mesh, things)
        except Sd2Error as error:
            self.failed.emit(str(error))
        self.content = replace(content, mesh=mesh)

    def _surround_by_read(self) -> None:
        """Put bodies into the scene whose files have been read, as after an undo."""
        self._surround()
        self.changed.emit()

    def set_clutter(self, clutter: Clutter) -> None:
        """Remove static echoes another way."""
        if clutter == self.clutter:
            return
        self.clutter = clutter
        self.changed.emit()
        self._process_capture()

    def set_count(self, count: HowCounted) -> None:
        """Count the vertices of synthetic maps another way."""
        if count != self.count:
            self.count = count
            self.changed.emit()

    def _process_capture(self) -> None:
        """Make the Doppler map of the capture in the background."""
        capture, clutter, recording = self.capture, self.clutter, self.recording
        if capture is None or recording is None or self.growing:
            self._maps.cancel()
            return
        channel = _channel(recording)

        def process(emit: Emit) -> DopplerMap:
            from sd2core.fmcw.processing import doppler_map

            return doppler_map(
                capture.channel(*channel),
                axis=VelocityAxis(),
                clutter=clutter,
                progress=lambda done, total: emit((done, total)),
            )

        self._maps.submit(process, "Doppler map of the radar")

    def _receive_map(self, radar_map: DopplerMap) -> None:
        if self.content is not None:
            self.content = replace(self.content, radar_map=radar_map)
            self.changed.emit()

    # --- saving ---------------------------------------------------------------------------

    def save(self) -> None:
        """Write the recording where it came from; raises what :meth:`Recording.save` does."""
        if self.content is not None and self.content.saved:
            self.content.recording.save(self.content.timebase)
            self.tell_saved()

    def save_as(self, folder: Path) -> None:
        """Make a recording folder that refers to the files where they are."""
        if self.content is None:
            return
        title = "" if not self.content.saved else self.title
        made = replace(self.content.recording, title=title).save_as(
            folder, timebase=self.content.timebase
        )
        self.content = replace(self.content, recording=made)
        self.tell_saved()

    def read_labels_again(self) -> None:
        """Take over labels that another program has written; Sd2Error if the file is damaged."""
        if self.content is not None and self.content.saved:
            self.content.recording.read_labels_again()

    def tell_saved(self) -> None:
        """Take what is there as saved."""
        self.undo_stack.setClean()
        self.saved.emit()
        self.changed.emit()


def _unread(content: Content, base: Recording) -> str:
    """Why files that were to be added are of no use; empty where all were read."""
    radar = content.capture or content.radar_map
    parts = {"video": content.video, "mesh": content.mesh, "radar": radar}
    added = (name for name in parts if getattr(content.recording, name) != getattr(base, name))
    return " ".join(content.problems) if any(parts[name] is None for name in added) else ""


def _files(recording: Recording) -> tuple[Path | None, Path | None]:
    return recording.video, recording.radar


def _channel(recording: Recording) -> tuple[int | None, int | None]:
    return recording.radar_receiver, recording.radar_transmitter
