"""Scores of fits of clips and of real videos, each fitted as a user does it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

from sd2core import load_mesh, open_video
from sd2core.body.camera import PinholeCamera
from sd2core.body.landmark_files import load_track
from sd2core.body.landmark_models import landmark_models
from sd2core.body.landmarks import find_landmarks
from sd2core.cli.output import progress_bar
from tools.documentation.runs import sd2
from tools.fitting.clip_score import ClipScore, RealScore, score_clip, score_real
from tools.fitting.truth import Truth


class Fits(NamedTuple):
    """Fits into a folder; what is there is not fitted again."""

    folder: Path

    def score(self, truth: Truth) -> ClipScore:
        """Score the fit of one clip, which is told the focal length and the person's height."""
        known = ["--focal-px", f"{truth.camera.focal_px:g}", "--stature-m", f"{truth.stature_m:g}"]
        path, seconds = self._fitted(truth.name, truth.video, known)
        landmarks = landmarks_of(path)
        track = load_track(landmarks) if landmarks.exists() else None
        with progress_bar(f"Measuring {truth.name}") as progress:
            return score_clip(
                truth, load_mesh(path), seconds=seconds, track=track, progress=progress
            )

    def score_real(self, video: Path) -> RealScore:
        """Score the fit of a video whose motion is not known."""
        name = f"real-{video.stem}"
        path, _ = self._fitted(name, video, [])
        with progress_bar(f"Looking at {video.name}") as progress, open_video(video) as reader:
            landmarks = find_landmarks(
                reader, landmark_models(), silhouettes=None, progress_of=lambda _: progress
            )
        track = landmarks.part(0, len(landmarks))
        camera = PinholeCamera.default(track.width, track.height)
        return score_real(name, load_mesh(path), track, camera)

    def _fitted(self, name: str, video: Path, known: list[str]) -> tuple[Path, float | None]:
        """Path of the mesh, and the seconds its fit took, as a user does it, if it was made now."""
        path = self.folder / f"{name}.zarr"
        if path.exists():
            return path, None
        started = time.perf_counter()
        sd2("fit", video, "--out", path, *known, "--landmarks", landmarks_of(path))
        return path, time.perf_counter() - started


def landmarks_of(mesh: Path) -> Path:
    """Path of the landmarks that a mesh was fitted to."""
    return mesh.with_name(f"{mesh.stem}.landmarks.npz")
