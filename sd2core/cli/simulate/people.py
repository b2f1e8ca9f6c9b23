"""``sd2 simulate lifter-data``, ``train-lifter`` and ``score-lifter``: how the lifter is made."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.options import add_command, add_json, positive_int
from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.simulate.people.takes import Take


def add_people(kinds: argparse._SubParsersAction) -> None:
    """Add the three commands to ``sd2 simulate``."""
    data = add_command(
        kinds,
        "lifter-data",
        "draw random people in random motion and look at them as `sd2 fit` does",
        handler=_data,
        description=(
            "Makes takes of 96 frames: what the landmark models say, and the truth. Stopped and\n"
            "started again it goes on where it was. The same seed makes the same takes."
        ),
        examples=(
            "  sd2 simulate lifter-data people --takes 400 --seed 1\n"
            "  sd2 simulate lifter-data unseen --takes 40 --held-out"
        ),
    )
    data.add_argument("out", type=Path, metavar="OUT", help="folder of the takes")
    data.add_argument(
        "--takes", type=positive_int, default=400, metavar="N", help="how many (default: 400)"
    )
    data.add_argument("--seed", type=int, default=0, metavar="S", help="of all that is random")
    data.add_argument(
        "--held-out", action="store_true", help="with the kinds of motion kept for testing"
    )
    data.add_argument(
        "--manner",
        choices=("any", "natural", "gestures"),
        default="any",
        help=(
            "how people move: with elbows any way they can be (default), as people have them,"
            " or gesturing before the camera"
        ),
    )
    data.add_argument("--processes", type=positive_int, default=2, metavar="P", help="(default: 2)")
    data.add_argument("--models", type=Path, metavar="FOLDER", help="the landmark models")
    train = add_command(
        kinds,
        "train-lifter",
        "train the lifter of `sd2 fit` on takes of lifter-data",
        handler=_train,
        examples=(
            "  sd2 simulate train-lifter people --out lifter.npz\n"
            "  sd2 simulate train-lifter people more --start lifter.npz --out better.npz"
        ),
    )
    train.add_argument("data", type=Path, nargs="+", metavar="DATA", help="folders of the takes")
    train.add_argument("--start", type=Path, metavar="FILE", help="a lifter to go on from")
    train.add_argument(
        "--steps",
        type=positive_int,
        metavar="N",
        help="of optimisation (default: %(default)s)",
        default=5000,
    )
    train.add_argument("--out", type=Path, required=True, metavar="FILE", help="to write (.npz)")
    train.add_argument("--seed", type=int, default=0, metavar="S", help="of all that is random")
    score = add_command(
        kinds,
        "score-lifter",
        "measure a lifter on takes of lifter-data",
        handler=_score,
        description="Errors of the velocity along the line of sight, joint by joint.",
        examples="  sd2 simulate score-lifter unseen",
    )
    score.add_argument("data", type=Path, metavar="DATA", help="folder of the takes")
    score.add_argument("--lifter", type=Path, metavar="FILE", help="(default: the bundled one)")
    add_json(score)
    offsets = add_command(
        kinds,
        "landmark-offsets",
        "measure where the landmark model puts each landmark beside our keypoint",
        handler=_offsets,
        description="Prints thousandths of the stature, at rest: to the left, down, backwards.",
        examples="  sd2 simulate landmark-offsets people",
    )
    offsets.add_argument("data", type=Path, metavar="DATA", help="folder of the takes")


def _data(options: argparse.Namespace) -> None:
    from sd2core.simulate.people.lifter_data import make_lifter_data

    with progress_bar("Drawing people", unit="take") as progress:
        made = make_lifter_data(
            options.out,
            options.takes,
            options.seed,
            held_out=options.held_out,
            manner=options.manner,
            processes=options.processes,
            models=options.models,
            progress=progress,
        )
    print(f"Made {made} takes in {options.out}")


def _train(options: argparse.Namespace) -> None:
    from sd2core.body.lifter import Lifter
    from sd2core.cli.reading import check_output

    check_output(options.out, ".npz")
    takes = [take for folder in options.data for take in _takes(folder)]
    start = Lifter.load(options.start) if options.start else None
    from sd2core.simulate.people.train_lifter import Recipe, save_lifter, train_on

    with progress_bar("Training", unit="step") as progress:
        recipe = Recipe(steps=options.steps, seed=options.seed)
        lifter = train_on(takes, recipe, progress, start=start)
    save_lifter(lifter, options.out)
    print(f"Wrote {options.out}")


def _score(options: argparse.Namespace) -> None:
    import json

    from sd2core.body.lifter import Lifter
    from sd2core.simulate.people.score import score

    found = score(Lifter.load(options.lifter), _takes(options.data))
    if options.json:
        joints = {joint: values._asdict() for joint, values in found.joints.items()}
        print(json.dumps({"joints": joints, "still_mps": found.still_mps}, indent=1))
        return
    print("joint       error  of true  corr.  kept  within 1σ  edge  depth")
    for joint, one in found.joints.items():
        print(
            f"{joint:10s}{one.rms_mps:7.3f}{one.truth_mps:9.3f}{one.correlation:7.2f}"
            f"{one.kept:6.2f}{one.covered:10.2f}{one.edge:7.2f}{one.depth_cm:6.1f} cm"
        )
    print(f"Nothing moves: {found.still_mps:.3f} m/s over all landmarks")


def _offsets(options: argparse.Namespace) -> None:
    from sd2core.body.track import LANDMARKS
    from sd2core.simulate.people.emulate import landmark_offsets

    for name, offset in zip(LANDMARKS, landmark_offsets(_takes(options.data)), strict=True):
        print(f"{name:14s}" + "".join(f"{1000.0 * value:8.1f}" for value in offset))


def _takes(folder: Path) -> list[Take]:
    from sd2core.simulate.people.lifter_data import load_takes

    takes = load_takes(folder)
    if not takes:
        raise Sd2Error(
            f"There are no takes in {folder}",
            "a folder made by `sd2 simulate lifter-data`",
        )
    return takes
