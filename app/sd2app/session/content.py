"""Content of one recording, read from disk in the background, its mesh also another way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, Emit
from sd2app.session.tasks import ListedRunner, TaskList
from sd2core.body.camera import PinholeCamera
from sd2core.errors import Cure, Sd2Error, of_the_system
from sd2core.files.resources import is_bundled
from sd2core.io.bodies import with_bodies
from sd2core.io.kinds import Kind, kind_of
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.plausibility.spans import judge_spans
from sd2core.progress import Progress
from sd2core.recording.edited import MESH
from sd2core.recording.recording import Recording, open_recording
from sd2core.recording.relinking import role_words
from sd2core.timebase import Timebase, common_clock

if TYPE_CHECKING:
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.io.video import VideoReader


PARTS = ("video", "mesh", "radar")
"""Parts of a recording in the order in which they are read, each a share of the progress."""

UNTITLED = Path()
"""Folder of a recording that was not saved yet."""


def folder_for_command(recording: Recording) -> Path:
    """Folder by which a command finds a recording. Raises Sd2Error where it was never saved."""
    if recording.folder == UNTITLED:
        raise Sd2Error(
            f"{recording.title} was never saved", "a recording, which the command reads", "Save it"
        )
    return recording.folder


_TOLD: dict[str, tuple[str, str]] = {
    "map": ("is a Doppler map", "Look at it with `sd2 info`"),
    "pairs": ("holds pairs to learn from", "Train with them in the Train panel"),
    "dataset": ("is a data set", "Look at its card and its preview sheet, or use `sd2 info`"),
    "model": ("is a model", "Open a recording, then choose the model under Model"),
}
"""Message and remedy for known kinds of files that are no part of a recording."""


@dataclass(frozen=True)
class OfferedCure:
    """Something unlikely about the mesh in words, and how it can be read instead."""

    text: str
    cure: Cure


@dataclass(frozen=True, eq=False)
class Content:
    """A recording with its parts opened; what could not be opened is in ``problems``.

    ``capture`` has all channels, of which the recording may choose one, as ``radar_map`` shows.
    ``radar_labels`` are those that a radar file brings with it, on the radar's clock.
    """

    recording: Recording
    timebase: Timebase
    video: VideoReader | None = None
    mesh: MeshSequence | None = None
    capture: RadarCapture | None = None
    radar_map: DopplerMap | None = None
    radar_labels: Labels | None = None
    notes: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    offers: tuple[OfferedCure, ...] = ()

    @property
    def saved(self) -> bool:
        """True if the recording has a folder of its own that may be written to."""
        return self.recording.folder != UNTITLED and not is_bundled(self.recording.folder)

    def close(self) -> None:
        """Release the video file."""
        if self.video is not None:
            self.video.close()


def recording_of(paths: Sequence[Path], base: Recording | None = None) -> Recording:
    """A recording made of the paths, added to those of ``base``.

    Raises Sd2Error if a path is of no known kind, two are of the same, or a recording is to
    be added.
    """
    from sd2core.io.radar import without_companions

    kinds: dict[Kind, Path] = {}
    for path in without_companions(paths):
        kind = kind_of(path)
        if kind in _TOLD:
            words, remedy = _TOLD[kind]
            raise Sd2Error(f"{path} {words}", "a recording, video, mesh or radar capture", remedy)
        if kind in kinds:
            raise Sd2Error(
                f"{kinds[kind]} and {path} are both of kind {kind}", "at most one file of each kind"
            )
        kinds[kind] = Path(path)
    if base is None and kinds.keys() == {"imu"}:
        raise Sd2Error(
            f"{kinds['imu']} holds samples of an inertial sensor, which are shown beside something",
            "a recording, video, mesh or radar capture",
            "Open that first, then add the file",
        )
    if "recording" in kinds:
        if len(kinds) > 1:
            raise Sd2Error(
                f"{kinds['recording']} was given together with other files",
                "a recording alone",
                "Open it first, then add the others",
            )
        if base is not None:
            raise Sd2Error(
                f"{kinds['recording']} is a recording: it cannot be added to another",
                "a video, mesh or radar capture",
                "Open it with File → Open…",
            )
        return open_recording(kinds["recording"])
    recording = base or Recording(UNTITLED, title=Path(paths[0]).stem)
    for kind, path in kinds.items():
        setattr(recording, kind, path)
    if "radar" in kinds:  # which may have other channels
        recording.radar_receiver = recording.radar_transmitter = None
    return recording


def load_content(recording: Recording, progress: Progress) -> Content:
    """Open every part of a recording; the Doppler map of a capture is made later.

    A part that is missing or damaged does not keep the others from being
    shown; it is named in ``problems``. Only when nothing can be opened the
    first problem is raised.
    """
    problems: list[Sd2Error] = []

    recording.learn_camera()
    recording.learn_simulated()
    missing = recording.missing()
    for role, path in missing.items():
        problems.append(
            Sd2Error(
                f"The {role_words(role)} is not at {path}",
                remedy="File → Find missing files… looks for it in another folder",
            )
        )

    def attempt(present: object, read: Callable[[], Any]) -> Any:
        if present is None or present in missing.values():
            return None
        try:
            return read()
        except Sd2Error as error:
            problems.append(error)
            return None

    def step(number: int) -> Progress:
        """Progress of one of the parts; it is also where cancelling takes effect."""
        return lambda done, total: progress(
            100 * number + (100 * min(done, total) // total if total else 0), 100 * len(PARTS)
        )

    video = attempt(recording.video, lambda: recording.open_video(step(0)))
    available = replace(recording, bodies=recording.bodies_there, things=recording.things_there)
    mesh = attempt(recording.mesh, lambda: available.load_mesh(step(1)))
    capture = recorded = None
    if recording.holds_radar_map:
        recorded = attempt(recording.radar, recording.load_radar_map)
        radar_map = None if recorded is None else recorded.doppler
    else:
        capture, radar_map = attempt(recording.radar, recording.load_every_channel), None
    progress(100 * len(PARTS), 100 * len(PARTS))
    parts = [part for part in (video, mesh, capture, recorded) if part is not None]
    if not parts:
        raise (
            problems[0]
            if problems
            else Sd2Error(
                f"{recording.folder} holds nothing to show", "a video, a mesh or a radar capture"
            )
        )
    notes = [*recording.notes] if recording.folder != UNTITLED else []
    for part in parts:
        notes.extend(part.notes if part is not mesh else notes_of(mesh))
    radar = capture or (None if recorded is None else recorded.doppler)
    timebase = clock_of(recording, video, mesh, radar)
    spans_s = [(span.start_s, span.end_s) for span in recording.labelled.spans]
    notes.extend(map(str, judge_spans(spans_s, timebase.start_s, timebase.end_s)))
    return Content(
        recording=recording,
        timebase=timebase,
        video=video,
        mesh=mesh,
        capture=capture,
        radar_map=radar_map,
        radar_labels=None if recorded is None else recorded.labels,
        notes=tuple(notes),
        problems=tuple(problem.words for problem in problems),
        offers=offers_of([*problems, *(() if mesh is None else mesh.findings)]),
    )


def offers_of(unlikely: Iterable[Exception]) -> tuple[OfferedCure, ...]:
    """Offers to read a mesh another way, of errors and findings."""
    known = [one for one in unlikely if isinstance(one, Sd2Error)]
    return tuple(OfferedCure(one.words, one.cure) for one in known if one.cure is not None)


def words_of(error: Exception) -> str:
    """An error in words; what puts it right is offered by a button, not as an option."""
    return error.words if isinstance(error, Sd2Error) else str(error)


def notes_of(mesh: MeshSequence) -> list[str]:
    """Notes on what was assumed about a mesh, or is unlikely and has no offer."""
    offered = {str(one) for one in mesh.findings if one.cure is not None}
    return [note for note in mesh.notes if note not in offered]


def camera_of(recording: Recording, video: VideoReader | None) -> PinholeCamera:
    """The camera that took a video, by default one with the usual field of view."""
    if video is None:
        return PinholeCamera()
    focal_px = recording.focal_px(video.width, video.height)
    if focal_px is None:
        return PinholeCamera.default(video.width, video.height)
    return PinholeCamera(video.width, video.height, focal_px)


def clock_of(
    recording: Recording,
    video: VideoReader | None,
    mesh: MeshSequence | None,
    radar: RadarCapture | DopplerMap | None,
) -> Timebase:
    """The one clock of those parts of a recording that are there, at least one."""
    clocks = [part.timebase for part in (video, mesh) if part is not None]
    if radar is not None:
        clocks.append(radar.timebase.shifted(recording.radar_offset_s))
    return common_clock(clocks)


def reference_of(values: np.ndarray, bins: Iterable[int] = ()) -> float:
    """Largest value of a map outside ``bins``: what is shown as 0 dB."""
    keep = np.ones(values.shape[0], bool)
    keep[list(bins)] = False
    top = float(values[keep].max(initial=0.0))
    return top if top > 0 else 1.0


_KEPT = 2
"""Meshes that are kept: that on screen, and the one that an undo brings back."""


@dataclass(frozen=True, eq=False)
class ReadMesh:
    """A mesh, or none and why it could not be read, and the recording's fields that say which."""

    fields: dict[str, Any]
    mesh: MeshSequence | None
    offers: tuple[OfferedCure, ...] = ()
    problem: str = ""


def mesh_fields(recording: Recording) -> dict[str, Any]:
    """Fields of a recording on which its mesh depends."""
    return {name: getattr(recording, name) for name in MESH}


def read_mesh(asked: Recording, emit: Emit) -> ReadMesh:
    """Read the mesh of a recording, whose camera it may bring; ``emit`` gets how much is read."""
    try:
        asked.learn_camera()
        mesh = asked.load_mesh(lambda done, total: emit((done, total)))
    except (Sd2Error, OSError) as error:
        told = error if isinstance(error, Sd2Error) else of_the_system(error)
        return ReadMesh(mesh_fields(asked), None, offers_of([told]), told.words)
    return ReadMesh(mesh_fields(asked), mesh, offers_of(mesh.findings))


class MeshReader(BackgroundModel):
    """Reads meshes in the background, and keeps the last ones."""

    ready = Signal(object)  # ReadMesh of the fields that were followed
    failed = Signal(str)

    def __init__(self, jobs: TaskList, parent: QObject) -> None:
        super().__init__(parent)
        self._kept: list[ReadMesh] = []  # the newest first
        self._jobs = jobs
        self._bodies: list[tuple[Body, ListedRunner]] = []  # and what reads the file of each
        self._runner = ListedRunner("mesh", jobs, self, self._receive, self._say)

    def reset(self, read: ReadMesh) -> None:
        """Begin with the mesh of another recording."""
        for runner in self.findChildren(ListedRunner):
            runner.cancel()
        self._kept = [read]

    def keep(self, read: ReadMesh) -> None:
        """Have a mesh ready, the last but one no more."""
        others = [one for one in self._kept if one.fields != read.fields]
        self._kept = [read, *others][:_KEPT]

    def read(
        self, recording: Recording, fields: Mapping[str, Any], then: Callable[..., object]
    ) -> None:
        """Read a mesh by other fields, and call ``then`` with all that it depends on.

        It is then kept, so that it is there at once where these fields are followed.
        """

        def take(read: ReadMesh) -> None:
            if read.mesh is not None:
                self.keep(read)
                then(read.fields)

        self._submit(replace(recording, **fields), take)

    def read_body(self, mesh: MeshSequence, body: Body, then: Callable[[], object]) -> None:
        """Read the file of another body beside a mesh, and call ``then``: it is then at hand."""
        runner = ListedRunner("body", self._jobs, self, lambda _: then(), self._say)
        for done in (runner.finished, runner.failed):
            done.connect(lambda _: runner.close())
        self._bodies.append((body, runner))
        runner.submit(lambda emit: with_bodies(mesh, [body]), f"Reading {body.file_name}")

    def awaits(self, body: Body) -> bool:
        """True while the file of a body is read."""
        return any(one == body and runner.busy for one, runner in self._bodies)

    def follow(self, recording: Recording) -> None:
        """Say that the mesh of a recording's fields is ready, at once or once it is read."""
        fields = mesh_fields(recording)
        kept = next((one for one in self._kept if one.fields == fields), None)
        if kept is not None or recording.mesh is None:
            self._runner.cancel()
            self._tell(kept or ReadMesh(fields, None))
        else:
            self._submit(replace(recording), self._tell)

    def _submit(self, asked: Recording, take: Callable[[ReadMesh], object]) -> None:
        name = "" if asked.mesh is None else asked.mesh.name
        self._runner.submit(lambda emit: (take, read_mesh(asked, emit)), f"Reading {name}")

    def _receive(self, result: tuple[Callable[[ReadMesh], object], ReadMesh]) -> None:
        take, read = result
        take(read)
        if read.problem:
            self.failed.emit(read.problem)

    def _say(self, error: Exception) -> None:
        self.failed.emit(words_of(error))

    def _tell(self, read: ReadMesh) -> None:
        self.keep(read)
        self.ready.emit(read)
