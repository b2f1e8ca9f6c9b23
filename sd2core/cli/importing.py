"""``sd2 import``, ``sd2 set`` and ``sd2 relink``: recordings from files."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, print_json, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.bounds import AZIMUTH_DEG, ELEVATION_DEG, RANGE_M
from sd2core.options.kinds import DemoScene, Names, Vector
from sd2core.options.records import ARGUMENT, Group, OptionError, Place, changed, given, given_flags
from sd2core.options.shared import Channel, Json, Looking, MeshReading

if TYPE_CHECKING:
    from sd2core.mesh.bodies import Body
    from sd2core.mesh.things import Thing
    from sd2core.mesh.walls import Wall
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VirtualSensor

_VERTICES = "mesh.zarr"
_CHANNEL = ("receiver", "transmitter")
_ABOUT_THE_BODY = ("range_m", "azimuth_deg", "elevation_deg")
_SEVERAL = ("things", "bodies", "walls")
_LEFT_OUT = {
    **{name: name for name in ("video", "mesh", "radar", "imu", "denoiser")},
    **{name: f"radar_{name}" for name in _CHANNEL},
    **{name: name for name in _SEVERAL},
}
"""What `sd2 set --without` names, and the fields that it empties."""


class Content(MeshReading, Channel):
    """Files of a recording and what they do not say.

    Parameters
    ----------
    video : FILE
        video of the person
    mesh : FILE
        body mesh fitted to the video (.npz, .zarr, a folder of .obj/.ply/.glb), the output of an
        estimator of bodies, or motion capture; with --body-model its vertices are kept instead
    radar : CAPTURE
        radar capture of the same scene
    radar_offset_s : S
        time in the video, in seconds, of the first radar frame (default: 0, or where the mesh of a
        simulated capture stood in time)
    imu : FILE
        samples of an inertial sensor (.csv, .sto, .npz)
    imu_offset_s : S
        time in the video, in seconds, of their first sample (default: 0, or their own time where
        they are simulated)
    title : TEXT
        what to call it (default: its name)
    """

    video: Path | None = None
    mesh: Path | None = None
    radar: Path | None = None
    radar_offset_s: float | None = None
    imu: Path | None = None
    imu_offset_s: float | None = None
    title: str | None = None


class Import(Content, Json):
    """Options of ``sd2 import``.

    Parameters
    ----------
    out : NAME.sd2
        the recording to make; new
    sensor : X,Y,Z
        where the radar is, in metres, as seen from the camera (default: the camera)
    copy
        copy the files into the recording
    """

    out: Path
    sensor: Vector | None = None
    copy: bool = False


class SensorPlace(Looking):
    """Place of the radar.

    Parameters
    ----------
    sensor : X,Y,Z
        in metres, as seen from the camera
    range_m : M
        range: distance from the body's centre
    azimuth_deg : DEG
        azimuth: 0 is between body and camera, positive to the right
    elevation_deg : DEG
        elevation: positive is above the body's centre
    """

    GROUP = Group("sensor", "where the radar is; about the body, what is not given stays")

    sensor: Vector | None = None
    range_m: Annotated[float, RANGE_M] | None = None
    azimuth_deg: Annotated[float, AZIMUTH_DEG] | None = None
    elevation_deg: Annotated[float, ELEVATION_DEG] | None = None


class Set(Content, SensorPlace, Json):
    """Options of ``sd2 set``.

    Parameters
    ----------
    recording : RECORDING
        a recording (.sd2)
    thing : SHAPE@X,Y,Z[,TURN[,W,H,D]]
        what stands in the scene, in place of what did: a box, table, screen, doorway or mesh file,
        the middle of its foot, degrees about the vertical, and width, height, depth in metres;
        again for another
    body : [NAME=]FILE[,FACES][@X,Y,Z[,TURN[,LATER]]]
        who else moves in the scene, in place of who did: a mesh or another recording's, a file of
        its faces where it has none, how far it is moved from where it is, degrees about the
        vertical, and seconds later; again for another
    wall : DIRECTION@M[,DB]
        what mirrors waves, in place of what did: a floor, a ceiling, a wall ahead, behind, left or
        right of the camera, or in a direction in degrees to the right, how far away it is, and the
        loss of a reflection; again for another
    without : LIST
        take out what is named, some of video, mesh, radar, imu, denoiser, receiver, transmitter,
        things, bodies, walls
    anonymise : HOW
        after a fit, in the recording's own video: cover the head (blur), or delete it (drop); what
        is covered or deleted is gone
    """

    recording: Annotated[Path, ARGUMENT]
    thing: Annotated[tuple[str, ...], Place(many="again")] = ()
    body: Annotated[tuple[str, ...], Place(many="again")] = ()
    wall: Annotated[tuple[str, ...], Place(many="again")] = ()
    without: Names = ()
    anonymise: Literal["blur", "drop"] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not {*changed(self)} - {"recording", "json"}:
            raise OptionError("Nothing is to be set", "one option at least")
        for name in self.without:
            if name not in _LEFT_OUT:
                raise OptionError(f"--without names {name!r}", f"some of {', '.join(_LEFT_OUT)}")
        if self.sensor is not None:
            self.refuse_place_about_body("beside --sensor")

    def refuse_place_about_body(self, why: str) -> None:
        """Refuse a distance and angles about the body."""
        for name in given_flags(self, _ABOUT_THE_BODY):
            raise OptionError(
                f"{name} is given {why}",
                "either --sensor, or a distance and angles about the body of a mesh",
            )


class Relink(Json):
    """Options of ``sd2 relink``.

    Parameters
    ----------
    recording : RECORDING
        a recording (.sd2)
    folder : FOLDER
        where to look, and in all folders below
    """

    recording: Annotated[Path, ARGUMENT]
    folder: Annotated[Path, ARGUMENT]


def copy_sample(out: Path, scene: DemoScene = "one") -> None:
    """Write a copy of the bundled sample recording, with the true body of its person, or two."""
    import shutil

    from sd2core.files.resources import resource_path
    from sd2core.recording.recording import open_recording

    if scene == "two":
        from sd2core.simulate.two_people import two_people

        print(f"Wrote {two_people(out).folder}")
        return
    sample = resource_path("swipes.sd2")
    copy = open_recording(sample).save_as(out, copy=True)
    shutil.copytree(sample / "mesh.zarr", copy.folder / "mesh.zarr")
    print(f"Wrote {copy.folder}")


@command("import", Import)
def _import(options: Import) -> Report:
    """Make a recording from a video, a mesh and a radar capture.

    A recording is a folder NAME.sd2 that says what belongs together. The files stay
    where they are and are referred to by relative paths; --copy copies them into
    the folder, which can then be handed on as it is. Every file is opened once, so
    that what cannot be read is said here and not later.

      sd2 import --video walk.mkv --mesh walk.npz --out walk.sd2
      sd2 import --mesh walk_poses.npz --body-model SMPLH_NEUTRAL.npz --distance-m 3 --out a.sd2
      sd2 import --radar capture/ --title 'Empty lab' --out lab.sd2
      sd2 import --radar capture/ --receiver 2 --out lab.sd2
      sd2 import --video a.mkv --radar capture/ --radar-offset-s -0.35 --copy --out a.sd2
    """
    from sd2core.cli.info.description import describe_parts, describe_recording
    from sd2core.cli.reading import mesh_reading, refuse_unused_mesh_options
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VirtualSensor

    # The window lays any mesh over the video by its focal length.
    refuse_unused_mesh_options(options, options.out, options.mesh, but=("focal_px",))
    recording = Recording(options.out, mesh_reading=mesh_reading(options), **_content(options))
    _refuse_unused_channel(recording, options)
    if options.sensor is not None:
        recording.sensor = VirtualSensor(options.sensor)
    recording.learn_camera()
    recording.learn_simulated()
    _learn_offsets(recording, options)
    with ExitStack() as made:
        if options.body_model is not None:
            _keep_vertices(recording, _new_folder_for_vertices(options.out, made))
        # Opens every file, so that nothing is made of what cannot be read.
        parts = describe_parts(recording)
        with progress_bar("Copying", unit="file") as progress:
            recording = recording.save_as(options.out, copy=options.copy, progress=progress)
        made.pop_all()
    if options.copy:
        parts = describe_parts(recording)
    return describe_recording(recording, parts)


def _new_folder_for_vertices(out: Path, made: ExitStack) -> Path:
    """Folder of the recording that is made, before it is one; gone again if it comes to nothing."""
    from sd2core.files.paths import remove
    from sd2core.recording.recording import new_folder

    folder = new_folder(out)
    if not folder.exists():
        folder.mkdir()
        made.callback(remove, folder)
    return folder


def _keep_vertices(recording: Recording, folder: Path) -> None:
    """Put the vertices that a body model makes in place of parameters, which no one else can read.

    The model itself is licensed to its user, and is not kept.
    """
    from sd2core.files.paths import free_path
    from sd2core.io.mesh import save_mesh

    with progress_bar("Posing the body", unit="frame") as progress:
        mesh = recording.load_mesh(progress)
    for note in mesh.notes:
        print(f"note: {note}", file=sys.stderr)
    vertices = free_path(folder, _VERTICES, "posed", reserved="")
    with progress_bar("Writing the mesh", unit="frame") as progress:
        save_mesh(replace(mesh, others=()), vertices, progress)
    recording.mesh, recording.faces = vertices, None
    focal_px = recording.mesh_reading.focal_px
    recording.mesh_reading = type(recording.mesh_reading)(focal_px=focal_px)


def _content(options: Content) -> dict[str, Any]:
    """Fields of a recording that were given."""
    names = ("video", "mesh", "faces", "radar", "imu", "title", "radar_offset_s", "imu_offset_s")
    channel = {f"radar_{name}": value for name, value in given(options, _CHANNEL).items()}
    return given(options, names) | channel


def _learn_offsets(recording: Recording, options: Content) -> None:
    """Put what is new and simulated where it stood on the clock of its mesh."""
    from sd2core.imu.files import read_signals

    if options.radar is not None and options.radar_offset_s is None:
        recording.learn_offset()
    if options.imu is not None and options.imu_offset_s is None:
        signals = read_signals(options.imu)
        if signals.simulated:
            recording.imu_offset_s = float(signals.times_s[0])


def _refuse_unused_channel(recording: Recording, options: Content) -> None:
    if recording.radar is None or recording.holds_radar_map:
        for name in given_flags(options, _CHANNEL):
            raise Sd2Error(f"{name} is given without raw samples", f"{name} with --radar CAPTURE")


@command("set", Set)
def _set(options: Set) -> Report:
    """Change what a recording is made of: its files, its clocks, where its radar is.

    What is not named stays. Pairs, alignment, exports and the window use what is set.
    Every file is opened before anything is written. Labels stay as they are, but for the names of
    persons who are called otherwise.

      sd2 set walk.sd2 --sensor 0.1,0,0
      sd2 set walk.sd2 --range-m 3 --azimuth-deg 30
      sd2 set walk.sd2 --mesh better.zarr --radar-offset-s 0.35
      sd2 set walk.sd2 --without receiver,denoiser
      sd2 set walk.sd2 --anonymise blur
      sd2 set walk.sd2 --thing table@0,1.1,1.5,20 --thing chair.obj@0.8,1.1,2
      sd2 set walk.sd2 --body anna=anna.npz@0.8,0,0.5,90 --body bert.sd2
      sd2 set walk.sd2 --wall floor@1.1 --wall right@2,6
    """
    from sd2core.cli.info.description import describe_parts, describe_recording
    from sd2core.cli.reading import mesh_reading, refuse_unused_mesh_options
    from sd2core.files.paths import plain_path
    from sd2core.files.resources import is_bundled
    from sd2core.io.mesh_models import is_estimate
    from sd2core.labels.field_edits import rename_persons
    from sd2core.mesh.bodies import renamed
    from sd2core.recording.recording import open_recording

    recording = open_recording(options.recording)
    if is_bundled(recording.folder):
        raise Sd2Error(f"{recording.folder} comes with the program", "a recording of your own")
    for name in options.without:
        setattr(recording, _LEFT_OUT[name], () if name in _SEVERAL else None)
    if options.body:
        others, recording.bodies = recording.bodies, tuple(map(_body, options.body))
        if names := renamed(recording.subject, others, recording.bodies):
            recording.labels = rename_persons(recording.labelled, names).labels
    if options.thing:
        recording.things = tuple(map(_thing, options.thing))
    if options.wall:
        recording.walls = tuple(map(_wall, options.wall))
    for name, value in _content(options).items():
        if isinstance(value, Path) and not value.exists():
            raise Sd2Error(f"The {name} {value} does not exist", "a file or folder")
        setattr(recording, name, plain_path(value) if isinstance(value, Path) else value)
    if not (recording.video or recording.mesh or recording.radar):
        raise Sd2Error(f"{recording.folder} would hold nothing", "a video, a mesh or a radar")
    if options.mesh is not None and not options.faces:
        recording.faces = None
    refuse_unused_mesh_options(options, recording.folder, recording.mesh, but=("focal_px",))
    before = recording.mesh_reading if options.mesh is None else type(recording.mesh_reading)()
    reading = mesh_reading(options).options()
    recording.mesh_reading = before.model_copy(update=reading)
    _refuse_unused_channel(recording, options)
    if given(options, ("video", "mesh", "focal_px")):
        # Where an estimator's mesh lies depends on the focal length that it assumed.
        told = options.video or options.focal_px or (options.mesh and is_estimate(options.mesh))
        known, recording.camera = recording.camera, None
        recording.learn_camera()
        if recording.camera is None and not told:
            recording.camera = known
    _learn_offsets(recording, options)
    if options.body_model is not None:
        _keep_vertices(recording, recording.folder)
    recording.sensor = _placed(recording, options)
    if options.anonymise is None:
        parts = describe_parts(recording)
        recording.save()
    else:
        from sd2core.live.videos import hide_person

        recording.save()
        with progress_bar("Covering the head", unit="frame") as progress:
            done = hide_person(recording.folder, options.anonymise, progress)
        if not done:
            print("note: that was done before, or there is no video", file=sys.stderr)
        recording = open_recording(recording.folder)
        parts = describe_parts(recording)
    return describe_recording(recording, parts)


def _thing(text: str) -> Thing:
    """Thing as it is typed."""
    from sd2core.files.paths import plain_path
    from sd2core.mesh.things import SHELF, Thing

    shape, _, place = text.rpartition("@")
    try:
        numbers = tuple(map(float, place.split(",")))
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 4, 7):
        raise Sd2Error(f"--thing is {text!r}", "SHAPE@X,Y,Z[,TURN[,W,H,D]], e.g. box@0,1,2,30")
    path = shape if shape in SHELF or "." not in shape else str(plain_path(Path(shape)))
    x, y, z, turn_deg, *size = (*numbers, 0.0) if len(numbers) == 3 else numbers
    thing = Thing(path, (x, y, z), turn_deg, (size[0], size[1], size[2]) if size else None)
    if thing.is_file and not Path(path).is_file():
        raise Sd2Error(f"The mesh {path} of a thing is not there", "a file")
    return thing


def _body(text: str) -> Body:
    """Body as it is typed."""
    from sd2core.files.paths import is_there, plain_path
    from sd2core.mesh.bodies import Body
    from sd2core.recording.recording import is_recording, open_recording

    what, _, place = text.rpartition("@")
    try:
        numbers = list(map(float, place.split(",")))
    except ValueError:
        what, numbers = text, []
    if len(numbers) not in (0, 3, 4, 5):
        expected = "[NAME=]FILE[,FACES][@X,Y,Z[,TURN[,LATER]]], e.g. anna=anna.npz@0.8,0,0.5,90"
        raise Sd2Error(f"--body is {text!r}", expected)
    x, y, z, turn_deg, start_s = numbers + [0.0] * (5 - len(numbers))
    person, _, file = ("", "", what) if Path(what).exists() else what.rpartition("=")
    faces = None
    if "," in file and not is_there(Path(file)):
        file, _, own = file.rpartition(",")
        faces = plain_path(Path(own))
        if not faces.exists():
            raise Sd2Error(f"The faces file {own} does not exist", "a file of triangles")
    path, reading = plain_path(Path(file)), {}
    if not is_there(path):
        raise Sd2Error(f"The mesh {file} does not exist", "a file or folder")
    if is_recording(path):
        of = open_recording(path)
        if of.mesh is None:
            raise Sd2Error(f"{path} holds no mesh", "a recording with one")
        path, person, reading = of.mesh, person or of.subject, of.mesh_reading.options()
        faces = faces or of.faces
    faces_path = None if faces is None else str(faces)
    return Body(str(path), (x, y, z), turn_deg, start_s, person, reading, faces_path)


def _wall(text: str) -> Wall:
    """Wall as it is typed."""
    from sd2core.mesh.walls import DIRECTIONS, Wall

    direction, _, rest = text.rpartition("@")
    try:
        numbers = tuple(map(float, rest.split(",")))
        azimuth_deg, elevation_deg = DIRECTIONS.get(direction) or (float(direction), 0.0)
    except ValueError:
        numbers = ()
    if len(numbers) not in (1, 2):
        known = ", ".join(DIRECTIONS)
        raise Sd2Error(
            f"--wall is {text!r}", f"DIRECTION@M[,DB] with one of {known}, or degrees, e.g. right@2"
        )
    loss_db = numbers[1] if len(numbers) == 2 else Wall.loss_db
    return Wall(numbers[0], azimuth_deg, elevation_deg, loss_db)


def _placed(recording: Recording, options: Set) -> VirtualSensor:
    """Sensor of a recording at a place in the room, or about its body, or as it was."""
    from sd2core.cli.reading import looking
    from sd2core.placements.body_extent import BodyExtent
    from sd2core.sensor import position_from_spherical, spherical_from_position

    position_m = options.sensor
    if about := given(options, _ABOUT_THE_BODY):
        if recording.mesh is None:
            options.refuse_place_about_body("without a mesh")
        target_m = BodyExtent.of(recording.load_mesh()).target_m
        now = spherical_from_position(target_m, recording.sensor.position_m)
        wanted = [about.get(name, value) for name, value in zip(_ABOUT_THE_BODY, now, strict=True)]
        position_m = position_from_spherical(target_m, *wanted)
    sensor = recording.sensor
    if position_m is not None:
        sensor = replace(sensor, position_m=position_m)
    if options.aim == "body" and recording.mesh is None:
        raise Sd2Error("--aim body is given without a mesh", "AZ,EL in degrees")
    return looking(sensor, options, recording.load_mesh)


@command("relink", Relink)
def _relink(options: Relink) -> int:
    """Find the missing files of a recording in another folder.

    Files that are not where the recording says are looked for by name in FOLDER and
    everything below it. Of several files with the same name, the one whose folders
    agree best with the old path is taken; when two agree equally well, neither is.

      sd2 relink walk.sd2 /media/disk/experiments
    """
    from sd2core.recording.recording import open_recording

    recording = open_recording(options.recording)
    sought = recording.missing()
    with progress_bar("Searching", unit="folder") as progress:
        result = recording.relink(options.folder, progress)
    if options.json:
        print_json(
            {
                "found": {role: str(path) for role, path in result.paths.items()},
                "ambiguous": {
                    role: [str(path) for path in paths] for role, paths in result.ambiguous.items()
                },
                "missing": list(result.missing),
            }
        )
    else:
        for role, path in result.paths.items():
            print(f"{role}: found at {path}")
        for role, paths in result.ambiguous.items():
            print(f"{role}: several files fit equally well, so none was taken:")
            print(*(f"  {path}" for path in paths), sep="\n")
        for role in result.missing:
            print(f"{role}: {sought[role].name} is not under {options.folder}")
        if not (result.paths or result.ambiguous or result.missing):
            print("No file of this recording is missing.")
    return 1 if result.ambiguous or result.missing else 0
