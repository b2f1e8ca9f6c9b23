"""``python -m tools.train_lifter``: how the lifter of ``sd2 fit`` is made and measured."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from sd2core.body.lifter import Lifter
from sd2core.cli.output import progress_bar
from sd2core.files.tables import numbers_table
from sd2core.mocap.body_motion import load_motions
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, ARGUMENTS, OptionRecord, Place
from tools.command_line import tool
from tools.train_lifter.fits import Pairs, fit_law, make_pairs, repaired
from tools.train_lifter.swaps import score_sides
from tools.train_lifter.takes import Data, load_takes, make_lifter_data


class Learning(OptionRecord):
    """What is learnt from, how long, and where it goes.

    Parameters
    ----------
    data : DATA
        folders of the takes
    motions : FOLDER
        real motion to emulate (see data --motions)
    steps : N
        of optimisation
    out : FILE
        to write (.npz)
    seed : S
        seed of all random numbers
    """

    data: Annotated[tuple[Path, ...], ARGUMENTS]
    motions: Path | None = None
    steps: Count = 4000
    out: Annotated[Path, Place(endings=(".npz",))]
    seed: int = 0


class Train(Learning):
    """Options of ``train``.

    Parameters
    ----------
    kept : DATA
        folders of takes that only calibrate: of people and motion not learnt from
    start : FILE
        a lifter to go on from (default: from nothing)
    """

    steps: Count = 9000
    kept: Annotated[tuple[Path, ...], Place(many="together")]
    start: Path | None = None


class Score(OptionRecord):
    """Options of ``score``.

    Parameters
    ----------
    data : DATA
        folder of the takes
    """

    data: Annotated[Path, ARGUMENT]


def _data(options: Data) -> None:
    """Draw random people in random motion and look at them as `sd2 fit` does.

    Makes takes of 96 frames: what the landmark models say, and the truth. Stopped and started
    again it goes on where it was. The same seed makes the same takes.
    """
    with progress_bar("Drawing people", unit="take") as progress:
        made = make_lifter_data(options, progress)
    print(f"Made {made} takes in {options.out}")


def _pairs(options: Pairs) -> None:
    """Make pairs to train a denoiser on: fits of such takes beside a simulated radar.

    The other options are those that the takes were made with.
    """
    with progress_bar("Fitting", unit="take") as progress:
        made = make_pairs(options, progress)
    print(f"Added pairs of {made} takes to {options.out}")


def _train(options: Train) -> None:
    """Train the lifter of `sd2 fit` on such takes."""
    takes = [repaired(take) for folder in options.data for take in load_takes(folder)]
    kept = [take for folder in options.kept for take in load_takes(folder)]
    motions = load_motions(options.motions, "learn") if options.motions else []
    from tools.train_lifter.training import Recipe, make_arrays, save_lifter, train  # needs torch

    with progress_bar("Training", unit="step") as progress:
        recipe = Recipe(steps=options.steps, seed=options.seed)
        start = None if options.start is None else Lifter.load(options.start)
        lifter = train(make_arrays(takes, kept, motions, recipe), recipe, progress, start=start)
    with progress_bar("Fitting", unit="take") as progress:
        lifter = replace(lifter, fit_law=fit_law(kept, lifter, progress))
    save_lifter(lifter, options.out)
    print(f"Wrote {options.out}")


def _sides(options: Learning) -> None:
    """Train what tells left from right, on such takes."""
    takes = [take for folder in options.data for take in load_takes(folder)]
    motions = load_motions(options.motions, "learn") if options.motions else []
    from tools.train_lifter.network import save_network  # needs torch
    from tools.train_lifter.sides import SidesRecipe, train_sides
    from tools.train_lifter.training import Recipe, make_arrays

    recipe = SidesRecipe(steps=options.steps, seed=options.seed)
    with progress_bar("Training", unit="step") as progress:
        known = make_arrays(takes, (), motions, Recipe(seed=options.seed))
        network, meta = train_sides(known, recipe, progress)
    save_network(network, options.out, meta)
    print(f"Wrote {options.out}")


def _score(options: Score) -> None:
    """Measure what tells left from right on such takes: frames in which left is taken for right."""
    sides = [["mirrored", "found", "undone", "put in", "undone"]]
    for part, shares in score_sides(load_takes(options.data)).items():
        sides.append([part, *(f"{100.0 * share:.1f} %" for share in shares)])
    print("\n".join(numbers_table(sides)))


main = tool("train_lifter", _data, _pairs, _train, _sides, _score)


if __name__ == "__main__":
    sys.exit(main())
