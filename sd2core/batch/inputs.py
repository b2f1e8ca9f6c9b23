"""Inputs of a batch: files found by patterns, inspected once."""

from __future__ import annotations

import glob
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan import Recordings
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.digests import Signature, cached_digest, deep_signature, signature
from sd2core.files.keys import code_digest, key_of
from sd2core.files.paths import files_at, is_there
from sd2core.files.texts import read_json
from sd2core.mesh.bodies import Body
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.sensor import Vector, VirtualSensor

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.recording.recording import Recording

LARGEST_IN_MEMORY_BYTES = 256 << 20
"""Of a mesh: what is larger is streamed."""


@dataclass(frozen=True)
class Origin:
    """Recording, video or mesh of a batch."""

    path: str
    name: str  # path from the folder that holds all of them: unique within the batch
    subject: str


@dataclass(frozen=True)
class MeshInput:
    """Facts of a moving mesh that tasks need."""

    path: str
    identity: str  # hash of its content and of how it is read
    frames: int
    vertices: int
    target_m: Vector  # see sd2core.placements.body_extent.BodyExtent
    faces: str | None = None
    reading: Mapping[str, Any] | None = None  # arguments for load_mesh
    others_m: tuple[Vector, ...] = ()  # as target_m, of the other bodies of a scene
    damaged: int = 0  # frames that are lost


@dataclass(frozen=True)
class VideoInput:
    """Video to fit a body to."""

    path: str
    identity: str  # hash of its content
    frames: int
    focal_px: float | None = None  # as far as the recording knows it


@dataclass(frozen=True)
class Somebody:
    """Person of a data set's source: one whom labels of a recording name, or everybody."""

    person: str = ""  # empty: everybody
    subject: str = ""  # empty: the recording's, as the plan says
    body: int | None = 0  # number in the scene; None where they are not in it


@dataclass(frozen=True)
class Inspection:
    """Content of a recording; a mesh takes precedence over a video."""

    sensor: VirtualSensor  # the recording's own
    mesh: MeshInput | None = None
    video: VideoInput | None = None
    about: str = ""  # hash of what else a data set takes from it: labels, and what its radar saw
    people: tuple[Somebody, ...] = ()  # whom labels name


_INSPECTION = TypeAdapter(Inspection)


def find_origins(recordings: Recordings, apart_from: Path) -> list[Origin]:
    """Return all files that match the (absolute) patterns, sorted.

    What lies inside of a recording or of a Zarr store that is found belongs to it. The
    batch's own folder, ``apart_from``, is not searched.
    """
    matched: set[str] = set()
    for pattern in recordings.files:
        matches = [pattern] if os.path.exists(pattern) else glob.glob(pattern, recursive=True)
        matches = [path for path in matches if not Path(path).is_relative_to(apart_from)]
        if not matches:
            raise Sd2Error(
                f"{pattern} matches nothing",
                "recordings (.sd2), videos or meshes",
                "Check `files` of [recordings] in the plan",
            )
        matched.update(matches)
    paths = [Path(path) for path in sorted(matched)]
    paths = [path for path in paths if not {".sd2", ".zarr"} & {at.suffix for at in path.parents}]
    if not paths:
        raise Sd2Error(
            f"{', '.join(recordings.files)}: all that matches lies inside of recordings or stores",
            "recordings (.sd2), videos or meshes",
            "Name the recordings themselves in `files` of [recordings] in the plan",
        )
    root = Path(os.path.commonpath([path.parent for path in paths]))
    return [
        Origin(str(path), name, subject_of(recordings, path, name))
        for path in paths
        if (name := path.relative_to(root).as_posix())
    ]


def subject_of(recordings: Recordings, path: Path, name: str) -> str:
    """Return the subject of a recording."""
    for pattern, subject in recordings.subject_of.items():
        if path.match(pattern):
            return subject
    own = PurePath(name)
    if recordings.subjects == "folder":
        return own.parent.as_posix() if own.parent.name else path.parent.name
    return _named_in(path) or own.with_suffix("").as_posix()


def _named_in(path: Path) -> str:
    """Return whom a recording names; nobody where it cannot be read, as its inspection tells."""
    from sd2core.recording.recording import is_recording, open_recording

    try:
        return open_recording(path).subject if is_recording(path) else ""
    except Sd2Error:
        return ""


# -- Looking at a recording, once ---------------------------------------------------------------


def known_inspection(folder: BatchFolder, origin: Origin) -> Inspection | None:
    """Return the kept inspection, if by names and times no file has changed since."""
    record = _record(folder, origin)
    if record is None or signature(entry[0] for entry in record["files"]) != record["files"]:
        return None
    inspection = _INSPECTION.validate_python(record["inspection"])
    # A mesh of ours may have been deleted.
    return inspection if inspection.mesh is None or is_there(Path(inspection.mesh.path)) else None


def inspect(folder: BatchFolder, origin: Origin) -> Inspection:
    """Inspect a recording and keep the result."""
    look = _Look(folder)
    inspection = look.at(Path(origin.path))
    content = {
        "code": code_digest("inspect"),
        "files": look.files,
        "inspection": asdict(inspection),
    }
    path = _record_path(folder, origin)
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic_write_text(path, json.dumps(content) + "\n")
    return inspection


def glance(origin: Origin) -> Inspection:
    """Inspect a recording without hashing it: its identities are empty."""
    return _Look(None).at(Path(origin.path))


class _Look:
    """Inspection that notes the files it depends on; without a folder nothing is hashed."""

    def __init__(self, folder: BatchFolder | None) -> None:
        self._folder = folder
        self.files: Signature = []

    def at(self, path: Path) -> Inspection:
        from sd2core.datasets.people import People
        from sd2core.datasets.people import subject_of as subject_in
        from sd2core.files.recording_json import FILE_NAME
        from sd2core.io.kinds import kind_of
        from sd2core.labels.files import FILE_NAME as LABELS_NAME
        from sd2core.recording.recording import Recording, open_recording

        kind = kind_of(path)
        if kind == "recording":
            recording = open_recording(path)
            for name in (FILE_NAME, LABELS_NAME):
                self.files += deep_signature([recording.folder / name])
        elif kind == "mesh":
            recording = Recording(path.parent, mesh=path)
        elif kind == "video":
            recording = Recording(path.parent, video=path)
        else:
            raise Sd2Error(f"{path} is of kind {kind}", "a recording, a video or a mesh")
        mesh = self._mesh(recording) if recording.mesh is not None else None
        # Of the video only its size matters to a mesh that has been made.
        video = self._video(recording) if mesh is None and recording.video is not None else None
        if mesh is None and video is None:
            raise Sd2Error(f"{path} holds neither a mesh nor a video", "one of them")
        labels = recording.effective_labels()
        people = People(recording, None, labels)
        named = (
            Somebody(one, subject_in(recording, one, ""), people.number(one))
            for one in labels.persons
        )
        about = self._about(recording, labels)
        return Inspection(recording.sensor, mesh, video, about, tuple(named))

    def _mesh(self, recording: Recording) -> MeshInput:
        from sd2core.datasets.kept_maps import mesh_identity
        from sd2core.io.unpacking import npz_vertices

        path = recording.mesh
        assert path is not None
        reading = recording.mesh_options()
        faces = reading.pop("faces", None)
        key = mesh_identity(recording, self._digest) if self._folder is not None else ""
        is_npz = path.suffix.lower() == ".npz" and path.is_file()
        if is_npz and _bytes_in_memory(path) > LARGEST_IN_MEMORY_BYTES:
            if self._folder is None:
                # The place of the body needs the whole file; it is not asked for before streaming.
                return MeshInput(str(path), "", *npz_vertices(path), (0.0, 0.0, 0.0))
            path = self._unpacked(path)
        return mesh_input_of(path, key, None if faces is None else str(faces), reading)

    def _unpacked(self, path: Path) -> Path:
        from sd2core.io.unpacking import unpack_npz

        assert self._folder is not None
        out = self._folder.result("meshes", cached_digest(path)[:32], ".zarr")
        if not out.exists():
            out.parent.mkdir(parents=True, exist_ok=True)
            unpack_npz(path, out)
        return out

    def _video(self, recording: Recording) -> VideoInput:
        path = recording.video
        assert path is not None
        identity = self._digest(path)
        with recording.open_video() as video:
            focal_px = recording.focal_px(video.width, video.height)
            return VideoInput(str(path), identity, len(video), focal_px)

    def _about(self, recording: Recording, labels: Labels) -> str:
        if self._folder is None:
            return ""
        radar = recording.radar
        return key_of(
            "inspect",
            {
                "spans": [repr(span) for span in labels.decided],
                "set": repr(labels.label_set),
                "title": recording.title,
                "simulated": recording.simulated,
                "radar_offset_s": recording.radar_offset_s,
                "radar_channel": [recording.radar_receiver, recording.radar_transmitter],
                "radar": None if radar is None else self._radar_digest(radar),
            },
        )

    def _radar_digest(self, radar: Path) -> str:
        """Identity of a radar recording: of its file, and of those that describe it."""
        from sd2core.io.radar import companions

        return " ".join(map(self._digest, [radar, *companions(radar)]))

    def _digest(self, path: Path) -> str:
        if self._folder is None:
            return ""
        self.files += deep_signature([path])
        return cached_digest(path)


def open_mesh(path: Path, faces: str | None, reading: Mapping[str, Any]) -> MeshSequence:
    """Open a mesh that can be streamed or is small enough for memory, and the scene around it."""
    from sd2core.io.bodies import load_scene

    files = files_at(path)
    size = 0 if ".zarr" in path.name.lower() else sum(map(_bytes_in_memory, files))
    if size > LARGEST_IN_MEMORY_BYTES:
        raise Sd2Error(
            f"The mesh {path} is {size >> 20:,} MiB large and would be in memory as a whole",
            f"at most {LARGEST_IN_MEMORY_BYTES >> 20} MiB, or a .zarr or .npz mesh, which is not",
            "Save it as .zarr: sd2core.io.mesh.save_mesh(sd2core.load_mesh(PATH), 'mesh.zarr')",
        )
    # JSON knows no tuples.
    settings: dict[str, Any] = {
        key: tuple(one) if isinstance(one, list) else one for key, one in reading.items()
    }
    things = (one if isinstance(one, Thing) else Thing(**one) for one in settings.pop("things", ()))
    bodies = (one if isinstance(one, Body) else Body(**one) for one in settings.pop("bodies", ()))
    walls = (one if isinstance(one, Wall) else Wall(**one) for one in settings.pop("walls", ()))
    return load_scene(path, bodies=bodies, faces=faces, things=things, walls=walls, **settings)


def _bytes_in_memory(path: Path) -> int:
    from sd2core.io.unpacking import npz_bytes

    if path.suffix.lower() == ".npz":
        return npz_bytes(path)
    if path.is_dir():
        return sum(one.stat().st_size for one in path.iterdir())
    return path.stat().st_size


def mesh_input_of(
    path: Path, identity: str, faces: str | None = None, reading: Mapping[str, Any] | None = None
) -> MeshInput:
    """Open a mesh and return the facts that tasks need.

    Parameters
    ----------
    path : Path
        The mesh; Sd2Error if it can neither be streamed nor is small enough for memory.
    identity : str
        Hash of its content and of how it is read, or "" if that is not asked for.
    faces : str, optional
        File with the triangles, in place of those of the mesh.
    reading : mapping, optional
        Further arguments for :func:`~sd2core.io.mesh.load_mesh`.
    """
    from sd2core.io.stored_vertices import damaged_frames
    from sd2core.placements.body_extent import BodyExtent

    mesh = open_mesh(path, faces, reading or {})
    x, y, z = (round(value, 6) for value in BodyExtent.of(mesh).target_m)
    # Who comes in too late is nowhere.
    bodies = (body if body.presence.present.any() else mesh for body in mesh.others)
    others_m = tuple(BodyExtent.of(body).target_m for body in bodies)
    shape, lost = (mesh.frame_count, mesh.vertex_count), damaged_frames(mesh.vertices)
    return MeshInput(str(path), identity, *shape, (x, y, z), faces, reading, others_m, lost)


def _record_path(folder: BatchFolder, origin: Origin) -> Path:
    return folder.result("inputs", key_of("inspect", {"path": origin.path}), ".json")


def _record(folder: BatchFolder, origin: Origin) -> dict[str, Any] | None:
    try:
        content = read_json(_record_path(folder, origin))
    except Sd2Error:
        return None
    usable = isinstance(content, dict) and content.get("code") == code_digest("inspect")
    return content if usable else None
