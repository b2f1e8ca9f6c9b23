"""A recording on disk: video, mesh, radar capture and labels on one clock.

A recording is a folder ``NAME.sd2/`` that holds ``recording.json``. The files it
speaks of lie inside the folder or anywhere else; their paths are stored relative
to the folder, so that a whole data set can move. See ``docs/formats.md``.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_json, full_disk_named
from sd2core.files.paths import (
    as_path,
    files_at,
    free_path,
    is_absolute,
    is_there,
    located_path,
    plain_path,
    remove,
    stored_path,
)
from sd2core.files.recording_json import FILE_NAME, CameraEntry, MeshReading, Span
from sd2core.files.resources import resource_path
from sd2core.files.texts import errors_in, faults_in
from sd2core.labels.files import FILE_NAME as LABELS_NAME
from sd2core.labels.files import labels_of, read_labels, write_labels
from sd2core.mesh.bodies import Body, persons_of
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.placements.placements import Placements, placements_from_dict
from sd2core.plausibility.clock import judge_assumed_rate
from sd2core.progress import Progress, silent
from sd2core.recording.divergence import Divergence, State
from sd2core.recording.document import VERSION, Document, read_document
from sd2core.recording.relinking import (
    ROLES,
    Relinked,
    Role,
    exists,
    find_again,
    is_many,
    is_thing,
    role_words,
)
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.io.radar.kkt import RecordedMap
    from sd2core.io.video import VideoReader
    from sd2core.labels.spans import Labels
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.sensor import VelocityAxis
    from sd2core.timebase import Timebase

SUFFIX = ".sd2"

_AS_THEY_ARE = (
    *("title", "subject", "simulated", "camera", "mesh_reading", "bundled_denoiser", "walls"),
    *("radar_receiver", "radar_transmitter", "radar_offset_s", "imu_places", "imu_offset_s"),
)
"""Settings that ``recording.json`` holds as a recording does."""

_SHOWN: set[Role] = {"video", "mesh", "radar"}
"""Files that are something to look at by themselves."""


class GoneError(Sd2Error):
    """Error for a recording that is no longer in its folder."""


class SavedElsewhereError(Sd2Error):
    """Error for a recording that something else has changed since it was read."""

    def __init__(self, theirs: Recording, divergence: Divergence) -> None:
        self.theirs = theirs  # as it is on disk
        self.divergence = divergence
        super().__init__(
            f"{theirs.folder} was saved by another window or program since it was read:"
            f" {', '.join(divergence.changes)}",
            "the recording as it was read",
            "Read it again, and repeat what is to be changed",
        )


@dataclass(eq=False)
class Recording:
    """A recording and its settings; change the fields, then :meth:`save`.

    Parameters
    ----------
    folder : Path
        The ``NAME.sd2`` folder.
    video, mesh, faces, radar : Path or None
        Absolute paths, which need not exist (see :meth:`missing`).
    mesh_reading : MeshReading
        Options for a mesh that does not state its frame rate, unit or place.
    radar_offset_s : float
        Time on the recording's clock at which the first radar frame was taken.
        The clock is the video's, or the mesh's where there is no video.
    radar_receiver, radar_transmitter : int or None
        The one of the capture whose signal is used, counted from 1. None: the mean power of all.
    imu : Path or None
        Samples of a real inertial sensor; see :func:`sd2core.imu.files.read_signals`.
    imu_offset_s : float
        Time on the recording's clock at which the first of them was taken.
    imu_places : tuple of str
        Places of virtual inertial sensors: named ones, and numbers of vertices, each once; see
        :func:`sd2core.imu.mounting.mounted`.
    denoiser : Path or None
        Model file that the synthetic map is denoised with.
    bundled_denoiser : str or None
        Name of a model that comes with the program, instead; empty if the map is not to be
        denoised. None: not chosen.
    placements : PlacementGrid, PlacementCloud or None
        Planned sensors around the body.
    things : tuple of Thing
        What stands still around the body; paths of their files are absolute.
    bodies : tuple of Body
        Other people in the same scene, on the same clock; paths of their meshes are absolute.
    walls : tuple of Wall
        What mirrors waves.
    spans : tuple of Span
        Labels in ``recording.json`` itself, of a recording that was not labelled here.
    labels : Labels or None
        Those in ``labels.json``, which replace ``spans``; see :attr:`labelled`.
    labels_elsewhere : bool
        True while another process edits them: ``labels.json`` is then left as it is.
    subject : str
        Name or pseudonym of the person, empty where it is not known.
    simulated : bool
        True for a recording without a real camera and radar.
    camera : CameraEntry or None
        See :meth:`focal_px`.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> video = resource_path("swipes.sd2") / "video.mp4"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = sd2.Recording.create(Path(folder) / "walk.sd2", video=video, title="Walk")
    ...     made.sensor = sd2.VirtualSensor(position_m=(0, 0, 1))
    ...     made.save()
    ...     sd2.open_recording(made.folder).sensor.position_m
    (0.0, 0.0, 1.0)
    """

    folder: Path
    video: Path | None = None
    mesh: Path | None = None
    faces: Path | None = None
    radar: Path | None = None
    mesh_reading: MeshReading = field(default_factory=MeshReading)
    radar_offset_s: float = 0.0
    radar_receiver: int | None = None
    radar_transmitter: int | None = None
    imu: Path | None = None
    imu_offset_s: float = 0.0
    imu_places: tuple[str, ...] = ()
    denoiser: Path | None = None
    bundled_denoiser: str | None = None
    sensor: VirtualSensor = field(default_factory=VirtualSensor)
    placements: Placements | None = None
    things: tuple[Thing, ...] = ()
    bodies: tuple[Body, ...] = ()
    walls: tuple[Wall, ...] = ()
    spans: tuple[Span, ...] = ()
    labels: Labels | None = None
    labels_elsewhere: bool = False
    title: str = ""
    subject: str = ""
    simulated: bool = False
    camera: CameraEntry | None = None
    # As the files were last read or written; None before.
    _read: Document = field(default_factory=Document, repr=False)
    _base: State | None = field(default=None, repr=False)

    @classmethod
    def create(
        cls, folder: Path, *, copy: bool = False, progress: Progress = silent, **fields: Any
    ) -> Recording:
        """Make ``folder`` a recording with these fields, whose files exist; see :meth:`save_as`.

        A field that is None is as it is by default.
        """
        given = {name: value for name, value in fields.items() if value is not None}
        return cls(Path(folder), **given).save_as(Path(folder), copy=copy, progress=progress)

    def save_as(
        self,
        folder: Path,
        *,
        copy: bool = False,
        timebase: Timebase | None = None,
        progress: Progress = silent,
    ) -> Recording:
        """Make ``folder`` a recording with the same content, and return it.

        Without a title it is called as its folder.

        Parameters
        ----------
        folder : Path
            ``.sd2`` is appended to a name without it. One that exists is taken when it is no
            recording yet, so that files may be put into it first.
        copy : bool
            Copies the files outside the folder into it; otherwise files are referred to where they
            are.
        timebase : Timebase, optional
            As for :meth:`save`.
        progress : Progress
            Counts the files that are copied.

        Raises
        ------
        Sd2Error
            When the folder is a recording already, a file does not exist, or
            there is nothing to record.
        """
        folder = new_folder(Path(folder))
        files: dict[Role, Path] = {}
        for role, path in self._files().items():
            # What went with the folder that it was in can be found again.
            if not exists(role, path) and (copy or not self._is_gone):
                if role == "denoiser" or is_thing(role):  # what else there is is shown without it
                    continue
                raise Sd2Error(f"The {role_words(role)} {path} does not exist", "a file or folder")
            files[role] = plain_path(path)
        if not files.keys() & _SHOWN:
            raise Sd2Error(
                f"{folder} would hold nothing", "a video, a mesh or a radar capture, or several"
            )
        created = not folder.exists()
        folder.mkdir(exist_ok=True)
        copied: list[Path] = []
        try:
            if copy:
                files = _copied(files, folder, copied, progress)
            made = replace(
                self,
                folder=folder,
                **{role: path for role, path in files.items() if role in ROLES},  # type: ignore[arg-type]
                **_with_files(self.things, self.bodies, files.get),
                title=self.title or folder.stem,
                labels_elsewhere=False,
                _base=None,
            )
            made.save(timebase)
        except BaseException:
            for path in [*copied, *([folder] if created else [])]:
                remove(path)
            raise
        return made

    @property
    def notes(self) -> tuple[str, ...]:
        """Hints for the user on the places of the files."""
        return tuple(
            f"The {role_words(role)} {path} is on another drive than the recording: its path is"
            " stored in full and does not move with the recording."
            for role, path in self._files().items()
            if is_absolute(stored_path(path, self.folder))
        )

    @property
    def bodies_there(self) -> tuple[Body, ...]:
        """Other bodies whose meshes are where the recording says."""
        return tuple(
            one
            for one in self.bodies
            if is_there(Path(one.path)) and (one.faces is None or Path(one.faces).exists())
        )

    @property
    def labelled(self) -> Labels:
        """The labels, wherever they are stored."""
        return labels_of(self.spans) if self.labels is None else self.labels

    @property
    def persons(self) -> tuple[str, ...]:
        """Name of each of the bodies of its scene, its own mesh first; each once."""
        return persons_of([self.subject, *(one.person for one in self.bodies)])

    @property
    def unlabelled(self) -> bool:
        """True if it was not labelled here; a radar file's own labels may then stand for it."""
        return self.labels is None and not self.spans

    def unlabel(self) -> None:
        """Take it back that it was labelled here, unless that was saved."""
        if not (self.folder / LABELS_NAME).exists():
            self.labels = None

    def effective_labels(self) -> Labels:
        """The labels; if it was not labelled here, those of its radar's file."""
        if self.unlabelled and self.holds_radar_map:
            return self.load_radar_map().labels.shifted(self.radar_offset_s)
        return self.labelled

    def missing(self) -> dict[str, Path]:
        """Files that are not where the recording says, by their roles; those of things last."""
        return {role: path for role, path in self._files().items() if not exists(role, path)}

    @property
    def things_there(self) -> tuple[Thing, ...]:
        """Things without those whose mesh file is missing."""
        return tuple(one for one in self.things if not one.is_file or Path(one.shape).exists())

    def relink(self, folder: Path, progress: Progress = silent) -> Relinked:
        """Find all missing files by name under one folder, and save where it was saved before."""
        relinked = self.find_missing(folder, progress)
        if relinked.paths and (self.folder / FILE_NAME).exists():
            self.save()
        return relinked

    def find_missing(self, folder: Path, progress: Progress = silent) -> Relinked:
        """Find all missing files by name under one folder; nothing is saved.

        See :func:`~sd2core.recording.relinking.find_again`.
        """
        relinked = find_again(self.missing(), Path(folder), progress)
        found = {role: path for role, path in relinked.paths.items() if role in ROLES}
        scene = _with_files(self.things, self.bodies, relinked.paths.get)
        for name, value in (found | scene).items():
            setattr(self, name, value)
        return relinked

    def save(self, timebase: Timebase | None = None) -> None:
        """Write ``recording.json`` in one step, keeping fields this version does not know.

        Labels are written before, to ``labels.json``, with their frames where a timebase
        is given; but see :attr:`labels_elsewhere`.

        Raises
        ------
        GoneError
            When the recording is no longer in its folder.
        SavedElsewhereError
            When something else has changed it since it was read; see :meth:`accept`.
        OSError
            When a file cannot be written; it is then as it was.
        """
        self._check_unchanged()
        document = self._document()
        if self._writes_labels:
            assert self.labels is not None
            write_labels(
                self.folder / LABELS_NAME,
                self.labels,
                timebase=timebase,
                recording=self.folder,
                video=self.video,
            )
            self.spans = ()
            if self._base is not None:
                self._base = replace(self._base, labels=self.labels)
        atomic_write_json(self.folder / FILE_NAME, document.model_dump(mode="json"))
        self._read, self._base = document, self.state()

    def _document(self) -> Document:
        def stored(_: Role, path: Path | str) -> str:
            return stored_path(Path(path), self.folder)

        document = self._read.model_copy()
        scene = _with_files(self.things, self.bodies, stored)
        settings = {name: getattr(self, name) for name in _AS_THEY_ARE} | {
            "version": VERSION,
            "sensor": document.sensor.model_dump() | {"beam": None} | self.sensor.as_dict(),
            "placements": None if self.placements is None else self.placements.as_dict(),
            **scene,
            "bodies": [asdict(one) for one in scene["bodies"]],
            "spans": () if self._writes_labels else self.spans,
        }
        for role in ROLES:
            path = getattr(self, role)
            settings[role] = None if path is None else stored(role, path)
        with faults_in(self.folder, "what docs/formats.md says of a recording"):
            for name, value in settings.items():
                setattr(document, name, value)
        return document

    @property
    def _writes_labels(self) -> bool:
        return self.labels is not None and not self.labels_elsewhere

    # --- what others save -----------------------------------------------------------------

    def state(self) -> State:
        """Settings and labels as they would be read again, to be compared with others."""
        return State(settings_of(self._document(), self.folder), self.labelled)

    @property
    def edited(self) -> bool:
        """True unless it is as it was last read or written."""
        return self._base is None or self.state() != self._base

    def accept(self, theirs: Recording) -> None:
        """Take what is on disk as known, so that :meth:`save` writes over it."""
        self._read, self._base = theirs._read, theirs._base

    def _check_unchanged(self) -> None:
        if self._base is None:
            return
        if self._is_gone:
            raise GoneError(
                f"{self.folder} was renamed, moved or deleted, or its drive is not connected",
                f"the folder that holds {FILE_NAME}",
                "Bring it back, or save the recording in another folder",
            )
        theirs = _opened(self.folder, labels=not self.labels_elsewhere)
        mine, stored = self.state(), theirs.state()
        if self.labels_elsewhere:  # this one writes no labels
            stored = replace(stored, labels=mine.labels)
        divergence = Divergence(self._base, mine, stored)
        if divergence.changes:
            raise SavedElsewhereError(theirs, divergence)
        self._read = theirs._read  # with fields that only a later version knows

    @property
    def _is_gone(self) -> bool:
        """True if it was in its folder, and is not any more."""
        return self._base is not None and not (self.folder / FILE_NAME).is_file()

    def read_labels_again(self) -> None:
        """Read ``labels.json`` again, if there is one; Sd2Error if it is damaged."""
        labels = self.folder / LABELS_NAME
        if labels.exists():
            self.labels = read_labels(labels).labels
            if self._base is not None:
                self._base = replace(self._base, labels=self.labels)

    def focal_px(self, width: int, height: int) -> float | None:
        """Focal length in pixels of pictures of this size, None if unknown.

        The camera's, if known, rather than the one that a mesh was placed with.
        """
        if self.camera is not None:
            return self.camera.focal_for(width, height)
        return self.mesh_reading.focal_px

    def learn_camera(self) -> None:
        """Take over the camera that the mesh was fitted with, where nothing is known of it."""
        from sd2core.io.fitted import fitted_camera

        if self.camera is None and self.mesh is not None and self.mesh_reading.focal_px is None:
            self.camera = fitted_camera(self.mesh)

    def learn_simulated(self) -> None:
        """Take over from the folder of video or mesh that the recording is simulated."""
        seen = self.video or self.mesh
        if self.simulated or seen is None or seen.parent == self.folder:
            return
        if (seen.parent / FILE_NAME).is_file():
            with suppress(Sd2Error):
                self.simulated = open_recording(seen.parent).simulated

    def learn_offset(self) -> None:
        """Put a simulated capture where its first frame stood on the clock of its mesh."""
        if self.radar is None or self.holds_radar_map:
            return
        simulation = self.load_every_channel().meta.get("simulation")
        first_s = simulation.get("first_frame_s") if isinstance(simulation, dict) else None
        if isinstance(first_s, float) and math.isfinite(first_s):
            self.radar_offset_s = first_s

    def open_video(self, progress: Progress = silent) -> VideoReader:
        """Open the video."""
        from sd2core.io.video import open_video

        return open_video(self._present("video"), progress)

    def load_mesh(self, progress: Progress = silent) -> MeshSequence:
        """Load the mesh as :attr:`mesh_reading` says, placed by the video where that helps.

        Things and other bodies of the scene go along with it.
        """
        from sd2core.io.bodies import load_scene
        from sd2core.io.mesh import NO_TIMES

        mesh = load_scene(self._present("mesh"), **self.mesh_options(), progress=progress)
        if NO_TIMES not in mesh.notes or self.video is None or not self.video.exists():
            return mesh
        with suppress(Sd2Error), self.open_video() as video:  # a damaged one is told by itself
            rate = video.timebase.frames_per_s
            if finding := judge_assumed_rate(mesh.timebase.frames_per_s, rate):
                findings, notes = (*mesh.findings, finding), (*mesh.notes, str(finding))
                return replace(mesh, findings=findings, notes=notes)
        return mesh

    @property
    def scene_files(self) -> list[Path]:
        """Files that the mesh, and what stands and moves around it, are read from."""
        files = [] if self.mesh is None else files_at(self.mesh)
        files += [Path(one.shape) for one in self.things if one.is_file]
        files += [file for one in self.bodies for file in one.files]
        return files if self.faces is None else [*files, self.faces]

    def mesh_options(self) -> dict[str, Any]:
        """Arguments with which :func:`sd2core.io.bodies.load_scene` reads the mesh."""
        from sd2core.io.mesh_models import is_estimate

        path = self._present("mesh")
        options = self.mesh_reading.options()
        if self.simulated:
            options["simulated"] = True
        if self.faces is not None:
            options["faces"] = self._present("faces")
        if self.things:
            options["things"] = self.things
        if self.bodies:
            options |= {"bodies": self.bodies, "called": self.subject}
        if self.walls:
            options["walls"] = self.walls
        has_video = self.video is not None and self.video.exists()
        if has_video and "image_size" not in options and is_estimate(path):
            with self.open_video() as video:
                options["image_size"] = (video.width, video.height)
        return options

    def load_capture(
        self, receiver: int | None = None, transmitter: int | None = None
    ) -> RadarCapture:
        """Load the radar capture on its own clock; the recording's is ``radar_offset_s`` later.

        Of several channels it holds those that the recording chooses; a number replaces the choice.
        Raises Sd2Error where the capture has none of that number.
        """
        return self.load_every_channel().channel(
            self.radar_receiver if receiver is None else receiver,
            self.radar_transmitter if transmitter is None else transmitter,
        )

    def load_every_channel(self) -> RadarCapture:
        """Load the radar capture with all channels, whatever the recording chooses."""
        from sd2core.io.radar import load_capture

        return load_capture(self._present("radar"))

    @property
    def channel_in_words(self) -> str:
        """Channel of the radar that it chooses, such as ``receiver 2``; empty for all."""
        chosen = (("receiver", self.radar_receiver), ("transmitter", self.radar_transmitter))
        return ", ".join(f"{name} {number}" for name, number in chosen if number is not None)

    @property
    def holds_radar_map(self) -> bool:
        """True if its radar file holds a map: :meth:`load_radar_map`, not a capture."""
        from sd2core.io.radar import holds_map

        return self.radar is not None and holds_map(self.radar)

    def load_radar_map(self, axis: VelocityAxis | None = None) -> RecordedMap:
        """Load the radar's own map and labels on their own clock; of points, on an axis."""
        from sd2core.io.radar import load_recorded_map

        return load_recorded_map(self._present("radar"), axis)

    def _files(self) -> dict[Role, Path]:
        paths = {role: getattr(self, role) for role in ROLES}
        for number, one in enumerate(self.bodies, start=2):  # the mesh is of body 1
            paths |= {f"body {number}": one.path, f"faces of body {number}": one.faces}
        for number, thing in enumerate(self.things, start=1):
            paths[f"thing {number}"] = thing.shape if thing.is_file else None
        return {role: Path(path) for role, path in paths.items() if path is not None}

    def _present(self, role: Role) -> Path:
        path: Path | None = getattr(self, role)
        if path is None:
            has = ", ".join(self._files()) or "nothing"
            raise Sd2Error(f"{self.folder} holds no {role}", f"a {role}; it has {has}")
        if not exists(role, path):
            raise Sd2Error(
                f"The {role} of {self.folder} is not at {path}",
                "the file where the recording says",
                "Move it back, or find it again (File → Find missing files…, or `sd2 relink`)",
            )
        return path


def is_recording(path: Path) -> bool:
    """True if ``path`` is a recording's folder or its ``recording.json``."""
    path = Path(path)
    return path.name == FILE_NAME or path.suffix == SUFFIX or (path / FILE_NAME).is_file()


def open_recording(path: Path) -> Recording:
    """Open a recording by its folder or its ``recording.json``.

    Files that it names may be missing: see :meth:`Recording.missing`.

    Raises
    ------
    Sd2Error
        When it is not a recording, is damaged, or was written by a newer version.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> recording = sd2.open_recording(resource_path("swipes.sd2"))
    >>> recording.title, recording.missing()
    ('Eight swipes at 2.2 m', {})
    >>> len(recording.labelled.spans)
    8
    """
    path = as_path(path)
    return _opened(plain_path(path.parent if path.name == FILE_NAME else path))


def _opened(folder: Path, *, labels: bool = True) -> Recording:
    document = read_document(folder / FILE_NAME)
    with errors_in(folder / FILE_NAME):
        settings = settings_of(document, folder)
    recording = Recording(folder, **settings, spans=document.spans, _read=document)
    if labels:
        recording.read_labels_again()
    recording._base = recording.state()
    return recording


def settings_of(document: Document, folder: Path) -> dict[str, Any]:
    """Fields of a recording by their names, but for labels, as its file holds them.

    Raises Sd2Error where the sensor, the placements or a body cannot be.
    """

    def located(_: Role, path: str | None) -> Path | None:
        return located_path(path, folder)

    planned = document.placements
    bodies = [
        Body(**one.model_dump(exclude={"reading"}), reading=one.reading.options())
        for one in document.bodies
    ]
    return {
        **{name: getattr(document, name) for name in _AS_THEY_ARE},
        **{role: located(role, getattr(document, role)) for role in ROLES},
        "title": document.title or folder.stem,
        "imu_places": tuple(dict.fromkeys(document.imu_places)),
        "sensor": VirtualSensor.from_dict(document.sensor.model_dump()),
        "placements": None if planned is None else placements_from_dict(planned),
        **_with_files(document.things, bodies, located),
    }


def _with_files(
    things: Iterable[Thing], bodies: Iterable[Body], path_of: Callable[[Role, str], object]
) -> dict[str, Any]:
    """Things and bodies of a recording with other paths of their files."""
    return {
        "things": tuple(
            replace(one, shape=str(path_of(f"thing {number}", one.shape))) if one.is_file else one
            for number, one in enumerate(things, start=1)
        ),
        "bodies": tuple(
            replace(
                one,
                path=str(path_of(f"body {number}", one.path)),
                faces=one.faces and str(path_of(f"faces of body {number}", one.faces)),
            )
            for number, one in enumerate(bodies, start=2)
        ),
    }


def open_sample() -> Recording:
    """Open the recording that comes with the program, all of it simulated; it stays as it is.

    Examples
    --------
    >>> import sd2core as sd2
    >>> sd2.open_sample().load_mesh().frame_count
    450
    """
    return open_recording(resource_path("swipes.sd2"))


def folder_named(path: Path | str) -> Path:
    """Folder of a recording that is named with or without its suffix."""
    folder = plain_path(Path(path))
    return folder if folder.suffix == SUFFIX else folder.with_name(folder.name + SUFFIX)


def new_folder(folder: Path) -> Path:
    """Folder of a recording to be made; Sd2Error if it is one already, or cannot be made."""
    folder = folder_named(folder)
    if (folder / FILE_NAME).exists():
        raise Sd2Error(
            f"{folder} is a recording already",
            "a new folder",
            "Choose another name, change it with `sd2 set`, or delete that folder first",
        )
    if not folder.parent.is_dir():
        raise Sd2Error(f"The folder {folder.parent} does not exist", "an existing folder")
    return folder


def _copied(
    files: dict[Role, Path], folder: Path, made: list[Path], progress: Progress
) -> dict[Role, Path]:
    """Copy what lies outside ``folder`` into it, each once; ``made`` lists copies, for undoing."""
    from sd2core.io.radar import companions

    inside: dict[Role, Path] = {}
    copies: dict[Path, Path] = {}
    for done, (role, source) in enumerate(files.items()):
        progress(done, len(files))
        if is_many(role, source):
            raise Sd2Error(
                f"{source} stands for several files", "a folder, for copying", "Give their folder"
            )
        if source.is_relative_to(folder) or source in copies:
            inside[role] = copies.get(source, source)
            continue
        beside = companions(source) if role == "radar" else []
        # Files that belong together keep their names, in a folder of their own.
        name = source.stem if beside else source.name
        target = free_path(folder, name, role, reserved=FILE_NAME)
        with full_disk_named(target), tempfile.TemporaryDirectory("", ".copy-", folder) as place:
            part = Path(place, target.name)
            if source.is_dir():
                shutil.copytree(source, part)
            elif beside:
                part.mkdir()
                for one in (source, *beside):
                    shutil.copy2(one, part / one.name)
            else:
                shutil.copy2(source, part)
            part.rename(target)
        made.append(target)
        inside[role] = copies[source] = target / source.name if beside else target
    progress(len(files), len(files))
    return inside
