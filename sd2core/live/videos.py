"""Videos of people that are not to be kept."""

from __future__ import annotations

from pathlib import Path

from sd2core.recording.recording import open_recording


def drop_video(folder: Path) -> bool:
    """Delete the video of a recording once a body was fitted to it; True if that was done.

    The body has the times of the video, and so the recording keeps its clock. A video outside of
    the recording's folder is somebody else's, and stays.
    """
    recording = open_recording(folder)
    video = recording.video
    if video is None or recording.mesh is None or "mesh" in recording.missing():
        return False
    if video.resolve().parent != folder.resolve():
        return False
    recording.learn_camera()
    # First the video: where this is interrupted, the next time goes on with the recording.
    video.unlink(missing_ok=True)
    recording.video = None
    recording.save()
    return True
