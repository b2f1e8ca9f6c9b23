"""Videos of people that are not to be kept as they are, once a body was fitted.

The head is found where the fitted body has it; its place in the picture gets one colour, so that
nothing of it can be won back. Of other people in the picture nothing is known.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_file
from sd2core.io.video import VideoReader, open_video
from sd2core.io.video_writing import HEADS_COVERED, write_video
from sd2core.progress import Progress, silent
from sd2core.recording.recording import Recording, open_recording

if TYPE_CHECKING:
    from sd2core.body.camera import PinholeCamera
    from sd2core.mesh.sequence import MeshSequence

_MARGIN = 1.5
"""Radius of what is covered, in those of the head: a fit is some centimetres off, hair is not in
it."""
_REACH_S = 0.12
"""A picture is covered where the head was so long before and after, too."""
_CRF, _PRESET = 19, "fast"
_SAME_S = 1e-4
_SAME_SHAPE = 0.02


def hide_person(folder: Path, how: Literal["blur", "drop"], progress: Progress = silent) -> bool:
    """Cover the head in a recording's video, or delete that; True if it was done.

    False where it was done before. The body has the times of the video, and so the recording
    keeps its clock.

    Parameters
    ----------
    folder : Path
    how : {"blur", "drop"}
    progress : Progress
        Counts the pictures that are written.

    Raises
    ------
    Sd2Error
        Where there is no body that was fitted here, or the video lies outside of the recording,
        and so is somebody else's.
    """
    recording = open_recording(folder)
    video = recording.video
    if video is None:
        return False
    if recording.mesh is None or "mesh" in recording.missing():
        raise Sd2Error(f"{folder} has no body", "a recording after sd2 fit")
    if video.resolve().parent != folder.resolve():
        raise Sd2Error(f"The video {video} lies outside of {folder}", "one inside the recording")
    recording.learn_camera()
    if how == "blur":
        return _cover(recording, progress)
    # First the video: where this is interrupted, the next time goes on with the recording.
    video.unlink(missing_ok=True)
    recording.video = None
    recording.save()
    return True


def _cover(recording: Recording, progress: Progress) -> bool:
    """Put a video with its head covered in the place of the original, once it is whole."""
    with recording.open_video() as video:
        if video.metadata.get("comment") == HEADS_COVERED:
            return False
        mesh, camera = _as_fitted(recording, video)
        size = (video.width // 2 * 2, video.height // 2 * 2)
        covered = _covered(video, mesh, head_circles(mesh, camera), size, progress)
        clock = video.timebase
        with atomic_file(video.path) as part:  # there is no moment with both, or with neither
            write_video(
                part, covered, max(round(clock.frames_per_s), 1), size,
                times_s=clock.times_s, crf=_CRF, preset=_PRESET, comment=HEADS_COVERED,
            )  # fmt: skip
            with open_video(part) as written:
                written_s = written.timebase.times_s
            if len(written_s) != len(clock) or np.abs(written_s - clock.times_s).max() > _SAME_S:
                raise Sd2Error(f"{part} has other times than {video.path}", "the same times")
    recording.save()
    return True


def _as_fitted(recording: Recording, video: VideoReader) -> tuple[MeshSequence, PinholeCamera]:
    """The body where it lies on the person, whatever the recording says of it or of its camera."""
    from sd2core.body.camera import PinholeCamera, camera_of
    from sd2core.io.fitted import fitted_camera
    from sd2core.io.mesh import load_mesh

    assert recording.mesh is not None
    width, height = video.width, video.height
    known = fitted_camera(recording.mesh)
    if known is None:
        return recording.load_mesh(), camera_of(video, recording.focal_px(width, height))[0]
    shape = (known.width or width) / (known.height or height)
    if abs(shape * height / width - 1.0) > _SAME_SHAPE:
        raise Sd2Error(
            f"{recording.mesh} was fitted to pictures of {known.width} × {known.height} pixels,"
            f" those of {video.path} are of {width} × {height}",
            "a body that was fitted to this video",
            "Fit it again",
        )
    return load_mesh(recording.mesh), PinholeCamera(width, height, known.focal_for(width, height))


def head_circles(mesh: MeshSequence, camera: PinholeCamera) -> NDArray[np.float64]:
    """Circles around the head of a fitted body: centre x, y and radius in pixels, (frames, 3).

    Infinite where the head is not in front of the camera, and where nobody is there. Raises
    Sd2Error for a mesh whose head is not known.
    """
    from sd2core.body.limbs import LIMBS, vertex_limbs
    from sd2core.body.model import Body, own_resolution

    resolution = own_resolution(mesh)
    if resolution is None:
        raise Sd2Error(
            f"Of {mesh.source or 'the mesh'} it is not known where its head is", "a body of sd2 fit"
        )
    head = np.flatnonzero(vertex_limbs(Body.load(resolution)) == LIMBS.index("head"))
    circles_px = np.full((mesh.frame_count, 3), np.inf)
    for frame in np.flatnonzero(mesh.presence.present):
        points_m = mesh.frame(int(frame))[head].astype(np.float64)
        if not (points_m[:, 2] > 0.0).all():
            continue
        points_px = camera.project(points_m)
        centre_px = 0.5 * (points_px.min(axis=0) + points_px.max(axis=0))
        reach_px = np.linalg.norm(points_px - centre_px, axis=1).max()
        circles_px[frame] = *centre_px, _MARGIN * reach_px
    return circles_px


def _covered(
    video: VideoReader,
    mesh: MeshSequence,
    circles_px: NDArray[np.float64],
    size: tuple[int, int],
    progress: Progress,
) -> Iterator[NDArray[np.uint8]]:
    """Pictures with one colour in the circles near their times; all of it where there are none."""
    width, height = size
    y, x = np.ogrid[:height, :width]
    for number, time_s in enumerate(video.timebase.times_s):
        picture = video.read(number)[:height, :width]
        near = circles_px[np.abs(mesh.timebase.times_s - time_s) <= _REACH_S]
        hidden = np.full((height, width), not (len(near) and np.isfinite(near).all()))
        for centre_x, centre_y, radius in near:
            hidden |= (x + 0.5 - centre_x) ** 2 + (y + 0.5 - centre_y) ** 2 <= radius**2
        if hidden.any():
            picture[hidden] = picture[hidden].mean(axis=0)
        yield picture
        progress(number + 1, len(video))
