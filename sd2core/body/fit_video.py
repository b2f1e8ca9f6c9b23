"""Video to mesh from end to end; a stopped fit goes on where it ended."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sd2core.body.camera import PinholeCamera, Source, camera_of, check_field_of_view
from sd2core.body.fit import fit_motion
from sd2core.body.fitted import FittedMotion
from sd2core.body.landmark_files import save_track
from sd2core.body.landmark_models import DEFAULT_MODEL, landmark_models
from sd2core.body.landmarks import DEFAULT_MAX_GAP_S, SIGHTINGS, OnFrame, find_landmarks
from sd2core.body.limbs import LIMB_LANDMARKS, LIMBS
from sd2core.body.person_selection import Rectangle
from sd2core.body.roi import Sightings
from sd2core.body.shape import DEFAULT_STATURE_M, check_stature
from sd2core.body.solve import one_thread
from sd2core.body.track import LANDMARK, LandmarkTrack
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text, replace_folder
from sd2core.files.lock import FileLock
from sd2core.files.numpy_files import npz_names
from sd2core.files.resources import resource_path
from sd2core.files.stores import open_group
from sd2core.io.mesh import save_mesh
from sd2core.io.video import VideoReader, open_video
from sd2core.options.fitting import LandmarkModel, Resolution
from sd2core.processes import return_free_memory
from sd2core.progress import Progress
from sd2core.version import __version__

PARTIAL = ".partial"
"""Suffix of the folder's name, after the name of the mesh."""

MARKER = "sd2-fit.json"
"""File that marks the folder as one of a fit."""

LANDMARKS = "landmarks"
"""Sub-folder in which the search for landmarks keeps its results."""

_LOCK = "lock"

_NEVER_SEEN = 0.02
"""Share of the frames below which a limb counts as never seen."""
_DOUBTFUL_M = 0.07

Stage = Literal["models", "people", "find", "refine", "fit", "write"]

STAGES: tuple[Stage, ...] = ("find", "refine", "fit", "write")
"""Stages of a fit, in order; ``models`` comes first if they are missing."""


@dataclass(frozen=True)
class FitChoices:
    """Options of a fit."""

    person: Rectangle | None = None
    """Around the person in one frame; the most prominent one by default."""
    focal_px: float | None = None
    """Of the camera, like the field of view; see :func:`~sd2core.body.camera.camera_of`."""
    field_of_view_deg: float | None = None
    stature_m: float | None = None  # height of the person
    stature_by_floor: bool = False
    """The height follows from the floor that all people of the video stand on."""
    max_gap_s: float = DEFAULT_MAX_GAP_S  # longest gap without the person that is bridged
    resolution: Resolution = "medium"  # mesh of 1,229, 5,000 or 13,348 vertices
    landmark_model: LandmarkModel = DEFAULT_MODEL

    def __post_init__(self) -> None:
        # Here: landmarks are looked for before a stature is used.
        if self.stature_m is not None:
            check_stature(self.stature_m)
        if self.field_of_view_deg is not None:
            check_field_of_view(self.field_of_view_deg)


@dataclass(frozen=True)
class FitReport:
    """Callbacks of a running fit; each may raise ``Cancelled``."""

    progress_of: Callable[[Stage], Progress]  # gives the progress callback of a stage that begins
    started: Callable[[VideoReader, bool], None]
    """Called with the open video, and True if a stopped run is continued."""
    on_frame: OnFrame
    """Called with a stage, a frame's number, landmarks in pixels (33, 2) and visibility (33,)."""


@dataclass(frozen=True, eq=False)
class FittedVideo:
    """Summary of a finished fit."""

    camera: PinholeCamera
    camera_source: Source
    frames: int
    frames_per_s: float
    present: int  # frames with the person
    bridged: int  # those of them that were interpolated
    residual_m: float  # mean distance of the lifted landmarks from the body
    quality: float  # from 0 to 1, mean over frames with the person
    notes: tuple[str, ...]  # sentences on the video and on repairs
    doubts: tuple[str, ...]  # sentences on what of the body is not to be believed


def fit_video(
    path: Path,
    out: Path,
    choices: FitChoices,
    report: FitReport,
    *,
    models: Path | None = None,
    landmarks_out: Path | None = None,
    restart: bool = False,
    sightings: Sightings | None = None,
) -> FittedVideo:
    """Fit a body to the person in a video and write it as a mesh.

    Results are kept in ``OUT.partial`` until the mesh is complete; the same call goes on
    from there, even after a kill.

    Parameters
    ----------
    path : Path
        The video.
    out : Path
        The mesh to be written (.zarr or .npz); an earlier mesh is replaced.
    models : Path, optional
        Folder of the landmark models.
    landmarks_out : Path, optional
        File (.npz) for the landmarks.
    restart : bool
        Discard the results of a stopped fit.
    sightings : Sightings, optional
        Of the person, who is not looked for then.

    Raises
    ------
    Sd2Error
        If something is wrong with the video, the choices or the output.
    """
    check_fit_output(out)
    partial = out.with_name(out.name + PARTIAL)
    with open_video(path) as video:
        camera, camera_source = camera_of(video, choices.focal_px, choices.field_of_view_deg)
        networks = landmark_models(
            models, report.progress_of("models"), model=choices.landmark_model
        )
        with claim_folder(partial, restart), remove_without_landmarks(partial), one_thread():
            report.started(video, (partial / LANDMARKS).is_dir())
            track = find_landmarks(
                video,
                networks,
                person=sightings or choices.person,
                max_gap_s=choices.max_gap_s,
                progress_of=report.progress_of,
                on_frame=report.on_frame,
                workspace=partial / LANDMARKS,
            )
            video.close()
            return_free_memory()
            motion = fit_motion(
                track,
                camera,
                stature_m=choices.stature_m,
                workspace=_fit_folder(partial, track, choices, camera),
                progress=report.progress_of("fit"),
            )
            made = FittedVideo(
                camera,
                camera_source,
                len(track),
                track.timebase.frames_per_s,
                int(track.present.sum()),
                int(track.bridged.sum()),
                motion.residual_m,
                motion.quality,
                (*video.notes, *track.notes),
                fit_doubts(motion),
            )
            new = partial / f"mesh{out.suffix.lower()}"
            save_mesh(motion.mesh(choices.resolution), new, report.progress_of("write"))
            _describe(new, provenance(made, path, choices))
            if landmarks_out is not None:
                save_track(track, landmarks_out)
            _take_place(new, out)
    shutil.rmtree(partial, ignore_errors=True)
    return made


def fit_doubts(motion: FittedMotion) -> tuple[str, ...]:
    """Sentences on what of a fit is not to be believed."""
    doubts = []
    unseen = [
        limb for limb in LIMBS if motion.seen[LANDMARK[LIMB_LANDMARKS[limb][-1]]] < _NEVER_SEEN
    ]
    if unseen:
        sides = {"L": "left", "R": "right", "": ""}
        names = [limb.replace("_", " ").partition(".") for limb in unseen]
        listed = ", ".join(f"{sides[side]} {name}".strip() for name, _, side in names)
        doubts.append(f"Never seen: {listed}. They are held at rest and move with the body only.")
    if motion.residual_m > _DOUBTFUL_M:
        doubts.append(
            f"This fit is not to be believed: the body is {100.0 * motion.residual_m:.1f} cm from"
            f" the landmarks on average, and good ones stay below {100.0 * _DOUBTFUL_M:.0f} cm."
            " Give the camera's focal length and the person's height where they are guessed, and"
            " turn a video that is not upright."
        )
    return tuple(doubts)


def provenance(made: FittedVideo, path: Path, choices: FitChoices) -> dict[str, Any]:
    """Provenance that is stored in a mesh file."""
    stature_m = choices.stature_m
    return {
        "made_by": f"SD² Studio {__version__}, sd2 fit",
        "video": path.name,
        "camera": {
            "width": made.camera.width,
            "height": made.camera.height,
            "focal_px": made.camera.focal_px,
            "source": made.camera_source,
        },
        "stature_m": DEFAULT_STATURE_M if stature_m is None else stature_m,
        "stature_source": "default"
        if stature_m is None
        else "floor"
        if choices.stature_by_floor
        else "user",
        "max_gap_s": choices.max_gap_s,
        "landmark_model": choices.landmark_model,
        "notes": list(made.notes),
        "doubts": list(made.doubts),
    }


def _fit_folder(
    partial: Path, track: LandmarkTrack, choices: FitChoices, camera: PinholeCamera
) -> Path:
    """Folder of a fit, named by its landmarks and choices."""
    landmarks = hashlib.sha256()
    for each in (track.image_px, track.world_m, track.visibility, track.silhouettes):
        landmarks.update(np.ascontiguousarray(each).tobytes())
    about = {
        "choices": asdict(choices) | {"resolution": None},
        "camera": asdict(camera),
        "version": __version__,
        "lifter": hashlib.sha256(resource_path("lifter.npz").read_bytes()).hexdigest(),
        "landmarks": landmarks.hexdigest(),
    }
    key = hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()[:16]
    folder = partial / f"fit-{key}"
    folder.mkdir(exist_ok=True)
    return folder


def _describe(mesh: Path, about: Mapping[str, Any]) -> None:
    """Write provenance into a mesh file."""
    if mesh.is_dir():
        open_group(mesh, "r+").attrs["fit"] = dict(about)
        return
    with (
        zipfile.ZipFile(mesh, "a", zipfile.ZIP_DEFLATED) as archive,
        archive.open("fit.npy", "w") as member,
    ):
        text = np.array(json.dumps(about, ensure_ascii=False))
        np.lib.format.write_array(member, text, allow_pickle=False)


def _take_place(new: Path, out: Path) -> None:
    """Rename the complete mesh, replacing an earlier one."""
    if new.is_dir():
        replaced = new.with_name("replaced")
        if replaced.exists():
            shutil.rmtree(replaced)
        replace_folder(new, out, replaced)
    else:
        with new.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(new, out)


def check_fit_output(out: Path) -> None:
    """Raise Sd2Error for an output mesh that cannot be written, before the work starts."""
    if out.suffix.lower() not in (".zarr", ".npz"):
        raise Sd2Error(
            f"The mesh is to be written as {out.name}", "a name that ends in .zarr or .npz"
        )
    if not out.absolute().parent.is_dir():
        raise Sd2Error(
            f"The folder {out.absolute().parent} does not exist", "an existing folder for the mesh"
        )
    # `mktemp` leaves an empty file to be filled.
    if out.exists() and not (_is_mesh(out) or (out.is_file() and not out.stat().st_size)):
        raise Sd2Error(
            f"{out} exists and is no mesh",
            "a new name, or a mesh to replace",
            "Choose another name, or delete it first",
        )
    partial = out.with_name(out.name + PARTIAL)
    if partial.exists() and not _is_ours(partial):
        raise Sd2Error(
            f"{partial} exists and is not what a stopped fit has left",
            "that name free for the work",
            "Choose another name, or move it away",
        )


def _is_mesh(path: Path) -> bool:
    """True if a file or folder holds an array named ``vertices``."""
    return (path / "vertices").is_dir() if path.is_dir() else "vertices" in npz_names(path)


def _is_ours(partial: Path) -> bool:
    if not partial.is_dir():
        return False
    names = {path.name for path in partial.iterdir()}
    return MARKER in names or names <= {_LOCK}


@contextmanager
def claim_folder(partial: Path, restart: bool) -> Iterator[None]:
    """Make or take over the folder of a fit and lock it against other processes.

    Raises Sd2Error if another process uses it.
    """
    partial.mkdir(exist_ok=True)
    lock = FileLock(partial / _LOCK)
    if not lock.take():
        raise Sd2Error(
            f"{partial} is in use: another process fits the same mesh",
            "one at a time",
            "Wait until it is done, or write another mesh",
        )
    try:
        if restart:
            for path in partial.iterdir():
                if path.is_dir():
                    shutil.rmtree(path)
                elif path.name != _LOCK:
                    path.unlink()
        text = json.dumps({"format": "sd2-fit-partial", "version": 1, "made_by": __version__})
        atomic_write_text(partial / MARKER, text + "\n")
        yield
    finally:
        lock.release()


@contextmanager
def remove_without_landmarks(partial: Path) -> Iterator[None]:
    """Remove the folder when the fit fails before the person was found."""
    try:
        yield
    except Sd2Error:
        if not (partial / LANDMARKS / SIGHTINGS).exists():
            shutil.rmtree(partial, ignore_errors=True)
        raise
