"""``sd2 simulate fit-truth``: clips of known motion to measure a fit against."""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.cli.options import add_command
from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error


def add_fit_truth(kinds: argparse._SubParsersAction) -> None:
    """Add ``simulate fit-truth``."""
    parser = add_command(
        kinds,
        "fit-truth",
        "make videos of simulated people whose motion is known, to measure a fit against",
        handler=_fit_truth,
        description=(
            "Six people in different clothes and light swipe at three speeds, stand still,\n"
            "walk to the camera and turn: 640 × 480 pixels, 30 frames/s, 3 to 7 s. A clip is a\n"
            "folder with video.mp4, mesh.zarr, keypoints.npz and truth.json. Clips that are there\n"
            "already are kept, so a run that was stopped goes on where it was.\n"
            "`sd2 score-fit` measures fits against them."
        ),
        examples=(
            "  sd2 simulate fit-truth --list\n"
            "  sd2 simulate fit-truth truth\n"
            "  sd2 simulate fit-truth truth --clips still,walk"
        ),
    )
    parser.add_argument("out", type=Path, nargs="?", metavar="OUT", help="the folder to fill")
    parser.add_argument(
        "--clips",
        metavar="NAMES",
        help=(
            "only these, separated by commas, or `tuning`: ten other clips by which the weights"
            " of the fit were chosen (default: all but those)"
        ),
    )
    parser.add_argument("--list", action="store_true", help="name the clips and make nothing")


def _fit_truth(options: argparse.Namespace) -> None:
    from sd2core.simulate.fit_truth import CLIPS, TUNING, clip_named, make_fit_truth

    if options.list:
        width = max(len(clip.name) for clip in (*CLIPS, *TUNING))
        for clip in (*CLIPS, *TUNING):
            print(
                f"{clip.name:<{width}}  {clip.person}, {clip.room}, at {clip.distance_m:g} m,"
                f" camera {clip.camera_m:g} m high"
            )
        return
    if options.out is None:
        raise Sd2Error("No folder is given", "sd2 simulate fit-truth OUT")
    names = [name for name in (options.clips or "").split(",") if name]
    clips = TUNING if names == ["tuning"] else [clip_named(name) for name in names] or CLIPS
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_fit_truth(options.out, clips, progress)
    print(f"{len(made)} clips in {options.out}")
