"""``python -m tools.fitting``: clips of known motion, scores of fits, errors that fits make."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from sd2core.cli.output import progress_bar
from sd2core.files.atomic import atomic_write_text
from sd2core.options.records import ARGUMENT, OptionRecord, Place
from tools.command_line import tool
from tools.fitting.clips import CLIPS, REAL_MOTION, TUNING, make_fit_truth
from tools.fitting.error_measurement import measure_errors
from tools.fitting.people import as_table, measure_people
from tools.fitting.report import as_csv, as_markdown
from tools.fitting.scoring import Fits
from tools.fitting.truth import truths_in


class Clips(OptionRecord):
    """Options of ``clips``.

    Parameters
    ----------
    out : OUT
        the folder to fill
    tuning
        make the other clips, by which the weights of the fit were chosen
    motions : FOLDER
        also clips with the motion of real people, from the folder that
        `python -m tools.motion_capture drive` made
    """

    out: Annotated[Path, ARGUMENT]
    tuning: bool = False
    motions: Path | None = None


class Score(OptionRecord):
    """Options of ``score``.

    Parameters
    ----------
    truth : TRUTH
        a folder of clips
    keep : FOLDER
        keep what is fitted as NAME.zarr in FOLDER, and its landmarks as NAME.landmarks.npz; what
        is there is not fitted again
    real : VIDEO
        also fit these videos, whose motion is not known, and measure whether the body lies on the
        person that the landmark model sees; their meshes are called real-NAME
    markdown : FILE
        also write the tables as Markdown, and every clip beside it, as NAME.csv
    """

    truth: Annotated[Path, ARGUMENT]
    keep: Path
    real: Annotated[tuple[Path, ...], Place(many="together")] = ()
    markdown: Annotated[Path | None, Place(endings=(".md",))] = None


class Errors(OptionRecord):
    """Options of ``errors``.

    Parameters
    ----------
    truth : TRUTH
        folder of the clips
    fits : FITS
        folder that score --keep filled
    out : FILE
        to write (.json)
    """

    truth: Annotated[Path, ARGUMENT]
    fits: Annotated[Path, ARGUMENT]
    out: Annotated[Path, Place(endings=(".json",))]


def _people(options: OptionRecord) -> None:
    """Measure how well two people who meet are told apart, and what that costs their fits.

    Prints a table; docs/how-to/correct-a-body-fit.md tells what it says.
    """
    with progress_bar("Meeting", unit="meeting") as progress:
        print(as_table(measure_people(progress)))


def _clips(options: Clips) -> None:
    """Make videos of simulated people whose motion is known, to measure a fit against.

    A clip is a folder with video.mp4, mesh.zarr and truth.json. Clips that are there already are
    kept, so a run that was stopped goes on where it was.
    """
    standard = CLIPS if options.motions is None else (*CLIPS, *REAL_MOTION)
    chosen = TUNING if options.tuning else standard
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_fit_truth(options.out, chosen, progress, options.motions)
    print(f"{len(made)} clips in {options.out}")


def _score(options: Score) -> None:
    """Fit the clips, and measure how good that is.

    Runs `sd2 fit` on every clip and prints the tables of docs/fitting.md. The fit is given the
    camera's focal length and the person's height.
    """
    truths = truths_in(options.truth)
    options.keep.mkdir(exist_ok=True)
    fits = Fits(options.keep)
    scores = [fits.score(truth) for truth in truths]
    real = [fits.score_real(video) for video in options.real]
    tables = as_markdown(scores, real)
    if options.markdown is not None:
        atomic_write_text(options.markdown, tables)
        atomic_write_text(options.markdown.with_suffix(".csv"), as_csv(scores))
    print(tables, end="")


def _errors(options: Errors) -> None:
    """Measure how fits of videos err, for simulated campaigns.

    Compares fits of the clips with the true bodies: place, turns of the trunk, directions of
    the limbs, shape.
    """
    truths = truths_in(options.truth)
    with progress_bar("Measuring", unit="clip") as progress:
        errors = measure_errors(truths, options.fits, progress)
    errors.save(options.out)
    print(f"Wrote {options.out}: {len(truths)} clips, {errors.provenance['frames']} frames")


main = tool("fitting", _clips, _score, _errors, _people)


if __name__ == "__main__":
    sys.exit(main())
