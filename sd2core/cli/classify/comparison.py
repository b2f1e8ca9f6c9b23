"""``sd2 classify table``: networks and amounts of data compared, as a study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.cli.classify.data import DATA_HELP, Sources
from sd2core.cli.classify.train import Network
from sd2core.cli.command_parser import command
from sd2core.cli.study import Running, make_study
from sd2core.options.bounds import STEPS
from sd2core.options.kinds import Count, Typed, joined, share

if TYPE_CHECKING:
    from sd2core.study.plan import Learner, StudyPlan


class Table(Sources, Network, Running):
    """Options of ``sd2 classify table``.

    Parameters
    ----------
    out : FOLDER
        the study to write
    seeds : N
        number of draws (default: 5; quick: 2)
    shares : LIST
        shares of the real data for the learning curve (default: 1%,2%,5%,10%,25%,50%,100%;
        quick: 10%,100%)
    quick
        few trainings, for a first look
    radar_only
        add no synthetic maps: compare networks and amounts of radar data only
    same_people
        judge other movements of the people trained on, instead of other people
    steps : N
        batches per training
    """

    out: Path
    seeds: Count | None = None
    shares: Annotated[tuple[float, ...], Typed(_shares, joined)] | None = None
    quick: bool = False
    radar_only: bool = False
    same_people: bool = False
    steps: Annotated[int, STEPS] | None = None


@command("table", Table, DATA_HELP)
def _table(options: Table) -> None:
    """Compare networks, and trainings with and without synthetic data.

    A study (`sd2 study`) in which everybody is judged once: by the chosen network, of the
    radar's maps alone and with synthetic maps of somebody else added, denoised or not, and
    with less and less of the real data; and by other networks. With one person, or too few,
    movements are kept apart instead.

    OUT gets study.toml, to go on from with `sd2 study`, and what that writes: study.md,
    study.json, confusion.png and curve.png. Run again, only what is missing is trained.

      sd2 classify table campaign.zarr --out tables
      sd2 classify table campaign.zarr --out tables --quick
      sd2 classify table anna=a.sd2 ben=b.sd2 --out own --seeds 2
    """
    from sd2core.files.atomic import atomic_write_text
    from sd2core.files.paths import make_folder
    from sd2core.study.plan import study_text

    plan = _plan(options)
    make_folder(options.out)
    atomic_write_text(options.out / "study.toml", study_text(plan, options.out))
    make_study(plan, options)


def _plan(options: Table) -> StudyPlan:
    from sd2core.denoise.files import MAP_MODEL
    from sd2core.study.data import study_data_of
    from sd2core.study.plan import Denoiser, StudyPlan

    quick = options.quick
    plan = StudyPlan(
        title=f"Gestures of {', '.join(one.path.stem for one in options.data)}",
        out=str(options.out.absolute()),
        data=tuple(str(one._replace(path=one.path.absolute())) for one in options.data),
        turns="once",
        seeds=options.seeds or (2 if quick else 5),
        shares=options.shares or ((0.1, 1.0) if quick else (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0)),
        added=() if options.radar_only else ("synthetic", "denoised", "radar"),
        added_weight=1.0,
        classifiers=_learners(options),
        denoiser=Denoiser(file=options.denoiser or MAP_MODEL),
    )
    # What the data do not hold is left out; with too few people movements are kept apart.
    data = study_data_of(plan)
    added = plan.added if data.filmed else ()
    least = 3 if added else 2
    folds = "files" if options.same_people or len(data.people) < least else "people"
    return plan.model_copy(update={"added": added, "folds": folds})


def _shares(text: str) -> tuple[float, ...]:
    return tuple(sorted({share(part) for part in text.split(",")}))


def _learners(options: Table) -> tuple[Learner, ...]:
    """The chosen network, then those that it is compared with."""
    from sd2core.study.plan import Learner

    steps = options.steps
    chosen = Learner(
        model=options.model, features=options.features, width=options.width,
        delay_s=options.delay_s, steps=steps,
    )  # fmt: skip
    paper = Learner(model="lstm", features="peak", width=16, delay_s=0.0, steps=steps)
    others = (
        paper,
        paper.model_copy(update={"features": "columns"}),
        Learner(model="lstm", delay_s=0.0, steps=steps),
        Learner(model="s4", steps=steps),
        Learner(model="kernel", delay_s=0.9),
        Learner(),
    )
    return (chosen, *(one for one in others if one != chosen))
