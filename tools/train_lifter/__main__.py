"""``python -m tools.train_lifter``: how the lifter of ``sd2 fit`` is made and measured."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

from sd2core.body.landmark_models import DEFAULT_MODEL, LandmarkModel
from sd2core.body.lifter import Lifter
from sd2core.cli.command_parser import add_command
from sd2core.cli.output import print_json, progress_bar
from sd2core.cli.output_folders import check_output
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import Role
from tools.command_line import (
    add_json,
    positive_int,
    run_tool,
)
from tools.motion_capture.bodies import load_motions
from tools.train_lifter.data import load_takes, make_lifter_data
from tools.train_lifter.deeds import Manner
from tools.train_lifter.fits import fit_law, repaired
from tools.train_lifter.pairs import make_pairs
from tools.train_lifter.score import score
from tools.train_lifter.swaps import score_sides
from tools.train_lifter.takes import Take


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit code."""
    return run_tool("train_lifter", "The lifter of `sd2 fit`.", _add_commands, arguments)


def _add_commands(kinds: argparse._SubParsersAction) -> None:
    data = add_command(
        kinds,
        "data",
        "draw random people in random motion and look at them as `sd2 fit` does",
        handler=_data,
        description=(
            "Makes takes of 96 frames: what the landmark models say, and the truth. Stopped and\n"
            "started again it goes on where it was. The same seed makes the same takes."
        ),
        examples=(
            "  python -m tools.train_lifter data people --takes 400 --seed 1\n"
            "  python -m tools.train_lifter data unseen --takes 40 --held-out\n"
            "  python -m tools.train_lifter data walkers --motions motions --takes 400"
        ),
    )
    data.add_argument("out", type=Path, metavar="OUT", help="folder of the takes")
    data.add_argument(
        "--takes", type=positive_int, default=400, metavar="N", help="how many (default: 400)"
    )
    _add_motion(data)
    data.add_argument("--processes", type=positive_int, default=2, metavar="P", help="(default: 2)")
    data.add_argument("--models", type=Path, metavar="FOLDER", help="the landmark models")
    data.add_argument(
        "--landmark-model",
        choices=get_args(LandmarkModel),
        default=DEFAULT_MODEL,
        help="which of them looks (default: %(default)s)",
    )
    pairs = add_command(
        kinds,
        "pairs",
        "make pairs to train a denoiser on: fits of such takes beside a simulated radar",
        handler=_pairs,
        description="The other options are those that the takes were made with.",
        examples=(
            "  python -m tools.train_lifter pairs people --seed 1 --out fits.zarr\n"
            "  sd2 train campaign.zarr fits.zarr --inputs kinematics --out run"
        ),
    )
    pairs.add_argument("data", type=Path, metavar="DATA", help="folder of the takes")
    pairs.add_argument("--out", type=Path, required=True, metavar="FILE", help="to write (.zarr)")
    _add_motion(pairs)
    train = add_command(
        kinds,
        "train",
        "train the lifter of `sd2 fit` on such takes",
        handler=_train,
        examples=(
            "  python -m tools.train_lifter train people walkers --kept unseen --motions motions"
            " --out lifter.npz"
        ),
    )
    _add_learning(train, steps=9000)
    train.add_argument(
        "--kept",
        type=Path,
        nargs="+",
        required=True,
        metavar="DATA",
        help="folders of takes that only calibrate: of people and motion not learnt from",
    )
    train.add_argument(
        "--start", type=Path, metavar="FILE", help="a lifter to go on from (default: from nothing)"
    )
    sides = add_command(
        kinds,
        "sides",
        "train what tells left from right, on such takes",
        handler=_sides,
        examples="  python -m tools.train_lifter sides people --motions motions --out sides.npz",
    )
    _add_learning(sides, steps=4000)
    scoring = add_command(
        kinds,
        "score",
        "measure the lifter, and what tells left from right, on such takes",
        handler=_score,
        description="Errors of the velocity along the line of sight, joint by joint, and frames in"
        " which left is taken for right.",
        examples="  python -m tools.train_lifter score unseen",
    )
    scoring.add_argument("data", type=Path, metavar="DATA", help="folder of the takes")
    scoring.add_argument("--lifter", type=Path, metavar="FILE", help="(default: the bundled one)")
    add_json(scoring)


def _add_motion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="seed of all random numbers"
    )
    parser.add_argument(
        "--held-out", action="store_true", help="with the kinds of motion kept for testing"
    )
    parser.add_argument(
        "--manner",
        choices=get_args(Manner),
        default="any",
        help=(
            "how people move: with elbows any way they can be (default), as people have them,"
            " or gesturing before the camera, with arms or with forearms alone"
        ),
    )
    parser.add_argument(
        "--motions",
        type=Path,
        metavar="FOLDER",
        help="people move as those recorded there do (made by python -m tools.motion_capture)",
    )


def _add_learning(parser: argparse.ArgumentParser, steps: int) -> None:
    parser.add_argument("data", type=Path, nargs="+", metavar="DATA", help="folders of the takes")
    parser.add_argument(
        "--motions", type=Path, metavar="FOLDER", help="real motion to emulate (see data --motions)"
    )
    parser.add_argument(
        "--steps",
        type=positive_int,
        metavar="N",
        help="of optimisation (default: %(default)s)",
        default=steps,
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="to write (.npz)")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="seed of all random numbers"
    )


def _data(options: argparse.Namespace) -> None:
    with progress_bar("Drawing people", unit="take") as progress:
        made = make_lifter_data(
            options.out,
            options.takes,
            options.seed,
            held_out=options.held_out,
            manner=options.manner,
            motions=options.motions,
            processes=options.processes,
            models=options.models,
            landmark_model=options.landmark_model,
            progress=progress,
        )
    print(f"Made {made} takes in {options.out}")


def _pairs(options: argparse.Namespace) -> None:
    role: Role = "calibrate" if options.held_out else "learn"
    with progress_bar("Fitting", unit="take") as progress:
        made = make_pairs(
            options.out,
            options.data,
            options.seed,
            held_out=options.held_out,
            manner=options.manner,
            motions=load_motions(options.motions, role) if options.motions else (),
            progress=progress,
        )
    print(f"Added pairs of {made} takes to {options.out}")


def _train(options: argparse.Namespace) -> None:
    check_output(options.out, ".npz")
    takes = [repaired(take) for folder in options.data for take in _takes(folder)]
    kept = [take for folder in options.kept for take in _takes(folder)]
    motions = load_motions(options.motions, "learn") if options.motions else []
    from tools.train_lifter.training import Recipe, material, save_lifter, train  # needs torch

    with progress_bar("Training", unit="step") as progress:
        recipe = Recipe(steps=options.steps, seed=options.seed)
        start = None if options.start is None else Lifter.load(options.start)
        lifter = train(material(takes, kept, motions, recipe), recipe, progress, start=start)
    with progress_bar("Fitting", unit="take") as progress:
        lifter = replace(lifter, fit_law=fit_law(kept, lifter, progress))
    save_lifter(lifter, options.out)
    print(f"Wrote {options.out}")


def _sides(options: argparse.Namespace) -> None:
    check_output(options.out, ".npz")
    takes = [take for folder in options.data for take in _takes(folder)]
    motions = load_motions(options.motions, "learn") if options.motions else []
    from tools.train_lifter.network import save_network  # needs torch
    from tools.train_lifter.sides import SidesRecipe, train_sides
    from tools.train_lifter.training import Recipe, material

    recipe = SidesRecipe(steps=options.steps, seed=options.seed)
    with progress_bar("Training", unit="step") as progress:
        known = material(takes, (), motions, Recipe(seed=options.seed))
        network, meta = train_sides(known, recipe, progress)
    save_network(network, options.out, meta)
    print(f"Wrote {options.out}")


def _score(options: argparse.Namespace) -> None:
    takes = _takes(options.data)
    found, sides = score(Lifter.load(options.lifter), takes), score_sides(takes)
    if options.json:
        joints = {joint: values._asdict() for joint, values in found.joints.items()}
        likeness = [row._asdict() for row in found.likeness]
        print_json(
            {"joints": joints, "likeness": likeness, "still_mps": found.still_mps}
            | {"sides": {part: values._asdict() for part, values in sides.items()}}
        )
        return
    print("joint       error  of true  corr.  kept  within 1σ  edge  depth")
    for joint, one in found.joints.items():
        print(
            f"{joint:10s}{one.rms_mps:7.3f}{one.truth_mps:9.3f}{one.correlation:7.2f}"
            f"{one.kept:6.2f}{one.covered:10.2f}{one.edge:7.2f}{one.depth_cm:6.1f} cm"
        )
    print("frames up to    depth  landmark model's  velocity  landmark model's")
    for row in found.likeness:
        print(
            f"{row.distance:12.2f}{row.depth_cm:6.1f} cm{row.own_depth_cm:15.1f} cm"
            f"{row.velocity_mps:6.2f} m/s{row.own_velocity_mps:14.2f} m/s"
        )
    print("mirrored         found  undone   put in  undone")
    for part, shares in sides.items():
        print(f"{part:15s}" + "".join(f"{100.0 * share:6.1f} %" for share in shares))
    print(f"Nothing moves: {found.still_mps:.3f} m/s over all landmarks")


def _takes(folder: Path) -> list[Take]:
    takes = load_takes(folder)
    if not takes:
        raise Sd2Error(
            f"There are no takes in {folder}",
            "a folder made by `python -m tools.train_lifter data`",
        )
    return takes


if __name__ == "__main__":
    sys.exit(main())
