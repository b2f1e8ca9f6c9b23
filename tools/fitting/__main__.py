"""``python -m tools.fitting``: clips of known motion, scores of fits, errors that fits make."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import print_json, progress_bar
from sd2core.cli.output_folders import check_output
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from tools.command_line import add_json, run_tool
from tools.fitting.clips import CLIPS, REAL_MOTION, TUNING, clip_named, make_fit_truth
from tools.fitting.error_measurement import measure_errors
from tools.fitting.report import as_dict
from tools.fitting.report_text import as_markdown, as_text
from tools.fitting.scoring import MeshSource
from tools.fitting.truth import read_truth, truth_folders


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit code."""
    return run_tool("fitting", "How good `sd2 fit` is.", _add_commands, arguments)


def _add_commands(commands: argparse._SubParsersAction) -> None:
    _add_clips(commands)
    _add_score(commands)
    _add_errors(commands)


def _add_clips(commands: argparse._SubParsersAction) -> None:
    parser = add_command(
        commands,
        "clips",
        "make videos of simulated people whose motion is known, to measure a fit against",
        handler=_clips,
        description=(
            "Six people in different clothes and light swipe at three speeds, stand still,\n"
            "walk to the camera and turn: 640 × 480 pixels, 30 frames/s, 3 to 7 s. A clip is a\n"
            "folder with video.mp4, mesh.zarr, keypoints.npz and truth.json. Clips that are there\n"
            "already are kept, so a run that was stopped goes on where it was."
        ),
        examples=(
            "  python -m tools.fitting clips truth\n"
            "  python -m tools.fitting clips truth --clips still,walk"
        ),
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="the folder to fill")
    parser.add_argument(
        "--clips",
        metavar="NAMES",
        help=(
            "only these, separated by commas, or `tuning`: ten other clips by which the weights"
            " of the fit were chosen (default: all but those)"
        ),
    )
    parser.add_argument(
        "--motions",
        type=Path,
        metavar="FOLDER",
        help=(
            "also clips with the motion of real people, from the folder that"
            " `python -m tools.motion_capture drive` made"
        ),
    )


def _add_score(commands: argparse._SubParsersAction) -> None:
    parser = add_command(
        commands,
        "score",
        "fit the clips, and measure how good that is",
        handler=_score,
        description=(
            "Runs `sd2 fit` on every clip, or takes meshes that are fitted already, and prints\n"
            "the table of docs/fitting.md: velocities of hands and elbows along the line of\n"
            "sight, peak speeds, false motion of a person who stands still, Doppler maps, ends of\n"
            "clips, uncertainty, time. The fit is given the camera's focal length, and the\n"
            "person's height unless --stature unknown."
        ),
        examples=(
            "  python -m tools.fitting score truth\n"
            "  python -m tools.fitting score truth --keep fitted --markdown table.md\n"
            "  python -m tools.fitting score truth --meshes fitted --json\n"
            "  python -m tools.fitting score truth --clips still --real walk.mkv help.mkv"
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
            "also fit these videos, whose motion is not known, and measure whether the body lies"
            " on the person that the landmark model sees; their meshes are called real-NAME"
        ),
    )
    parser.add_argument(
        "--stature",
        choices=("known", "unknown"),
        default="known",
        help="give the fit the person's height, or not (default: known)",
    )
    parser.add_argument(
        "--markdown", type=Path, metavar="FILE", help="also write the tables as Markdown"
    )
    add_json(parser)


def _add_errors(commands: argparse._SubParsersAction) -> None:
    parser = add_command(
        commands,
        "errors",
        "measure how fits of videos err, for simulated campaigns",
        handler=_errors,
        description=(
            "Compares fits of the clips with the true bodies: place, turns of the trunk,\n"
            "directions of the limbs, shape."
        ),
        examples=(
            "  python -m tools.fitting clips truth\n"
            "  python -m tools.fitting score truth --keep fits\n"
            "  python -m tools.fitting errors truth fits --out fit_errors.json"
        ),
    )
    parser.add_argument("truth", type=Path, metavar="TRUTH", help="folder of the clips")
    parser.add_argument("fits", type=Path, metavar="FITS", help="folder that score --keep filled")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="to write (.json)")


def _clips(options: argparse.Namespace) -> None:
    names = [name for name in (options.clips or "").split(",") if name]
    standard = CLIPS if options.motions is None else (*CLIPS, *REAL_MOTION)
    clips = TUNING if names == ["tuning"] else [clip_named(name) for name in names] or standard
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_fit_truth(options.out, clips, progress, options.motions)
    print(f"{len(made)} clips in {options.out}")


def _score(options: argparse.Namespace) -> None:
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
        source = MeshSource(options.meshes, Path(folder), options.stature == "known")
        scores = [source.score(truth) for truth in truths]
        real = [source.score_real(video) for video in options.real]
    if options.markdown is not None:
        atomic_write_text(options.markdown, as_markdown(scores, real))
    if options.json:
        print_json(as_dict(scores, real))
    else:
        print(as_text(scores, real))


def _errors(options: argparse.Namespace) -> None:
    check_output(options.out, ".json")
    truths = [read_truth(folder) for folder in truth_folders(options.truth)]
    with progress_bar("Measuring", unit="clip") as progress:
        errors = measure_errors(truths, options.fits, progress)
    errors.save(options.out)
    print(f"Wrote {options.out}: {len(truths)} clips, {errors.provenance['frames']} frames")


if __name__ == "__main__":
    sys.exit(main())
