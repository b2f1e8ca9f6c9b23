"""``sd2 eval``: how good denoisers are, beside what needs no training."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_json, progress_bar, tell_lost
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENTS, Place
from sd2core.options.shared import Figure, Json

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser


class Judging(Figure, Json):
    """People and maps of an evaluation, and the picture of its result.

    Parameters
    ----------
    subjects : LIST
        people to evaluate on, separated by commas, or `all` (default: those kept for the test)
    placements
        evaluate on maps from all places of the sensor, or the first only
    """

    subjects: str | None = None
    placements: Literal["all", "first"] = "first"


class Evaluate(Judging):
    """Options of ``sd2 eval``.

    Parameters
    ----------
    models : MODEL
        a run, a model file, or the name of a model that is installed
    data : PAIRS
        stores of pairs
    subjects : LIST
        people to evaluate on, separated by commas, or `all` (default: those that the first
        model's run kept for the test, or all)
    figure : FILE
        draw the errors, as .png, .svg or .pdf
    markdown : FILE.md
        write the tables
    """

    models: Annotated[tuple[str, ...], ARGUMENTS]
    data: Annotated[tuple[Path, ...], Place(many="together")]
    markdown: Annotated[Path | None, Place(endings=(".md",))] = None


def named_subjects(text: str, everybody: tuple[str, ...]) -> tuple[str, ...]:
    """Parse ``--subjects``."""
    return everybody if text == "all" else tuple(name for name in text.split(",") if name)


@command("eval", Evaluate)
def _eval(options: Evaluate) -> None:
    """Measure denoisers on people that they have not learnt from.

    Denoises whole takes and compares them with the radar's: the velocity of the
    strongest bin per frame (mean absolute error and standard deviation in m/s), the
    mean velocity, and the map itself; in all, per gesture and per person. Beside the
    models stand `none`, and a median, a Wiener filter and a ridge regression fitted to
    the training.
    Several models of one architecture, trained with different seeds, make one row:
    mean ± standard deviation.

      sd2 eval runs/s4 --data campaign.zarr
      sd2 eval runs/s4-0 runs/s4-1 runs/s4-2 runs/gru-0 --data campaign.zarr
      sd2 eval denoiser --data mars.zarr --subjects subject4 --json
      sd2 eval runs/s4 runs/unet --data campaign.zarr --figure scores.png
    """
    from sd2core.files.atomic import atomic_write_text
    from sd2core.files.figure_files import save_figure
    from sd2core.train.data import read_mixed
    from sd2core.train.evaluation import evaluate
    from sd2core.train.evaluation_text import as_markdown, as_text, draw

    pairs = read_mixed(options.data)
    tell_lost(pairs.lost_frames)
    subjects = None
    if options.subjects is not None:
        subjects = named_subjects(options.subjects, pairs.subjects)
    with progress_bar("Denoising", unit="take") as progress:
        evaluation = evaluate(
            [_loaded(model) for model in options.models],
            pairs,
            subjects,
            first_only=options.placements == "first",
            progress=progress,
        )
    if options.json:
        print_json(evaluation.to_json())
    else:
        print(as_text(evaluation))
    if options.figure is not None:
        save_figure(draw(evaluation), options.figure)
    if options.markdown is not None:
        atomic_write_text(options.markdown, as_markdown(evaluation))


def _loaded(model: str) -> TrainedDenoiser:
    from sd2core.denoise.files import load_model
    from sd2core.train.folder import TrainingFolder

    run = TrainingFolder(Path(model))
    if not run.exists:
        return load_model(model)
    if not run.best.exists():
        raise Sd2Error(
            f"The run {model} has no model yet",
            "a run that came as far as the end of its first epoch",
            f"See how far it is: `sd2 runs {model}`",
        )
    return load_model(run.best)
