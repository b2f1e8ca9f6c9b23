"""From a finished fit to a recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sd2app.fit.request import FitRequest
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import CameraEntry
from sd2core.io.fitted import fitted_camera
from sd2core.recording.recording import FILE_NAME, Recording, open_recording


def make_recording(
    request: FitRequest, size: tuple[int, int] | None, base: Recording | None
) -> Recording:
    """Record video, mesh and camera.

    Parameters
    ----------
    request : FitRequest
        Its mesh has been written.
    size : (int, int), optional
        Width and height of the upright picture, where it is known.
    base : Recording, optional
        What is open: where it is of the same video and has no mesh, its radar, labels
        and sensor are taken along.

    Raises
    ------
    Sd2Error, OSError
        When the recording cannot be written.
    """
    camera = camera_of(request, size)
    if (request.folder / FILE_NAME).exists():
        recording = open_recording(request.folder)
        recording.mesh, recording.camera = request.mesh, camera
        recording.save()
    elif base is not None and awaits(base, request.video):
        title = request.folder.stem
        recording = replace(base, mesh=request.mesh, camera=camera, title=title)
        recording = recording.save_as(request.folder)
    else:
        recording = Recording.create(
            request.folder, video=request.video, mesh=request.mesh, camera=camera
        )
    request.forget()
    return recording


def awaits(recording: Recording, video: Path) -> bool:
    """True if a recording is of this video and has no mesh."""
    if recording.video is None or recording.mesh is not None:
        return False
    return plain_path(recording.video) == plain_path(video)


def camera_of(request: FitRequest, size: tuple[int, int] | None) -> CameraEntry | None:
    """The camera that the body was fitted with, as the mesh says."""
    stated = fitted_camera(request.mesh)
    if stated is not None:
        return stated
    if request.focal_px is None:
        return None
    width, height = size or (None, None)
    return CameraEntry(focal_px=request.focal_px, width=width, height=height, source="user")
