"""``sd2 score-fit``: how good fits are where the motion is known."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from sd2core.cli.options import add_command, add_json
from sd2core.cli.output import print_json, progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.compare.fit_score import ClipScore
    from sd2core.compare.real_score import RealScore
    from sd2core.compare.truth import Truth

_SUFFIXES = (".zarr", ".npz")


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``score-fit``."""
    parser = add_command(
        commands,
        "score-fit",
        "fit simulated videos whose motion is known, and measure how good that is",
        handler=_score,
        description=(
            "Runs `sd2 fit` on every clip of a folder that `sd2 simulate fit-truth` made, or\n"
            "takes meshes that are fitted already, and prints the table of docs/fitting.md:\n"
            "velocities of hands and elbows along the line of sight, peak speeds, false motion\n"
            "of who stands still, Doppler maps, ends of clips, uncertainty, time.\n"
            "The fit is told the camera's focal length, and the person's height unless\n"
            "--stature unknown."
        ),
        examples=(
            "  sd2 score-fit truth\n"
            "  sd2 score-fit truth --keep fitted --markdown table.md\n"
            "  sd2 score-fit truth --meshes fitted --json\n"
            "  sd2 score-fit truth --clips still --real walk.mkv help.mkv"
        ),
    )
    parser.add_argument("truth", type=Path, metavar="TRUTH", help="a folder of clips, or one clip")
    parser.add_argument(
        "--clips", metavar="NAMES", help="only these, separated by commas (default: all)"
    )
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        "--meshes",
        type=Path,
        metavar="FOLDER",
        help="measure NAME.zarr, NAME.npz or NAME/mesh.zarr of this folder instead of fitting",
    )
    source.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help=(
            "keep what is fitted as NAME.zarr in FOLDER, and its landmarks as"
            " NAME.landmarks.npz; what is there is not fitted again"
        ),
    )
    parser.add_argument(
        "--real",
        type=Path,
        nargs="+",
        default=[],
        metavar="VIDEO",
        help=(
            "also fit these videos, whose motion nobody knows, and measure whether the body lies"
            " on the person that the landmark model sees; their meshes are called real-NAME"
        ),
    )
    parser.add_argument(
        "--stature",
        choices=("known", "unknown"),
        default="known",
        help="whether the fit is told how tall the person is (default: known)",
    )
    parser.add_argument(
        "--markdown", type=Path, metavar="FILE", help="also write the tables as Markdown"
    )
    add_json(parser)


def _score(options: argparse.Namespace) -> None:
    from sd2core.cli.reading import check_output
    from sd2core.compare.fit_report import as_dict
    from sd2core.compare.fit_text import as_markdown, as_text
    from sd2core.compare.truth import read_truth, truth_folders
    from sd2core.files.atomic import atomic_write_text

    if options.markdown is not None:
        check_output(options.markdown, ".md")
    truths = [read_truth(folder) for folder in truth_folders(options.truth)]
    if options.clips is not None:
        names = options.clips.split(",")
        known = {truth.name: truth for truth in truths}
        for name in names:
            if name not in known:
                raise Sd2Error(f"There is no clip {name!r}", ", ".join(known))
        truths = [known[name] for name in names]
    if options.keep is not None:
        options.keep.mkdir(exist_ok=True)
    with TemporaryDirectory() if options.keep is None else nullcontext(options.keep) as folder:
        source = _Source(options.meshes, Path(folder), options.stature == "known")
        scores = [_scored(truth, source) for truth in truths]
        real = [_scored_real(video, source) for video in options.real]
    if options.markdown is not None:
        atomic_write_text(options.markdown, as_markdown(scores, real))
    if options.json:
        print_json(as_dict(scores, real))
    else:
        print(as_text(scores, real))


class _Source(NamedTuple):
    """Where fitted meshes come from: a folder of them, or a fit into another."""

    meshes: Path | None
    folder: Path
    stature_known: bool

    def fitted(
        self, name: str, video: Path, known: list[str]
    ) -> tuple[Path, tuple[float, float] | None]:
        """Path of the mesh, and the seconds its fit took if it was made now."""
        if self.meshes is not None:
            return _mesh_in(self.meshes, name), None
        path = self.folder / f"{name}.zarr"
        if path.exists():
            return path, None
        return path, _fit(name, video, path, [*known, "--landmarks", str(landmarks_of(path))])


def _scored(truth: Truth, source: _Source) -> ClipScore:
    from sd2core.body.landmark_files import load_track
    from sd2core.compare.fit_score import score_clip
    from sd2core.io.mesh import load_mesh

    known = ["--focal-px", f"{truth.camera.focal_px:g}"]
    if source.stature_known:
        known += ["--stature-m", f"{truth.stature_m:g}"]
    path, seconds = source.fitted(truth.name, truth.video, known)
    landmarks = landmarks_of(path)
    track = load_track(landmarks) if landmarks.exists() else None
    with progress_bar(f"Measuring {truth.name}") as progress:
        return score_clip(truth, load_mesh(path), seconds=seconds, track=track, progress=progress)


def _scored_real(video: Path, source: _Source) -> RealScore:
    from sd2core.body.camera import PinholeCamera
    from sd2core.body.landmark_models import landmark_models
    from sd2core.body.landmarks import find_landmarks
    from sd2core.compare.real_score import score_real
    from sd2core.io.mesh import load_mesh
    from sd2core.io.video import open_video

    name = f"real-{video.stem}"
    path, _ = source.fitted(name, video, [])
    with progress_bar(f"Looking at {video.name}") as progress, open_video(video) as reader:
        found = find_landmarks(reader, landmark_models(), silhouettes=None, progress=progress)
    track = found.part(0, len(found))
    camera = PinholeCamera.default(track.width, track.height)
    return score_real(name, load_mesh(path), track, camera)


def landmarks_of(mesh: Path) -> Path:
    """Where the landmarks are kept that a mesh was fitted to."""
    return mesh.with_name(f"{mesh.stem}.landmarks.npz")


def _mesh_in(folder: Path, name: str) -> Path:
    places = [folder / f"{name}{suffix}" for suffix in _SUFFIXES]
    places += [folder / name / f"mesh{suffix}" for suffix in _SUFFIXES]
    for path in places:
        if path.exists():
            return path
    raise Sd2Error(
        f"{folder} holds no mesh of the clip {name!r}",
        f"{name}.zarr, {name}.npz or {name}/mesh.zarr",
    )


def _fit(name: str, video: Path, out: Path, known: list[str]) -> tuple[float, float]:
    """Fit one video in a process of its own, as a user does; seconds and processor seconds."""
    command = [sys.executable, "-m", "sd2core.cli", "fit", str(video), "--out", str(out), *known]
    started, before = time.perf_counter(), os.times()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        raise Sd2Error(f"{name} could not be fitted: {said[0].removeprefix('sd2: ')}")
    after = os.times()
    worked_s = after.children_user - before.children_user
    worked_s += after.children_system - before.children_system
    return time.perf_counter() - started, worked_s
