"""Several people of one video, each to a mesh of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from sd2core.body.fit_video import (
    PARTIAL,
    FitChoices,
    FitReport,
    FittedVideo,
    check_fit_output,
    fit_video,
)
from sd2core.body.landmark_models import landmark_models
from sd2core.body.people import SeenPerson, chosen_people, find_people
from sd2core.io.video import open_video


def meshes_of(out: Path, people: Sequence[SeenPerson]) -> list[Path]:
    """File of each person: as it is called for one, ``NAME-2.zarr`` for the second of several."""
    if len(people) == 1:
        return [out]
    return [out.with_name(f"{out.stem}-{each.number}{out.suffix}") for each in people]


def people_to_fit(
    path: Path,
    numbers: Sequence[int],
    choices: FitChoices,
    report: FitReport,
    models: Path | None = None,
) -> list[SeenPerson]:
    """Follow everybody in a video, and pick those with some numbers, or all without any.

    Parameters
    ----------
    path : Path
        The video.
    numbers : sequence of int
        Of :attr:`SeenPerson.number`.
    choices, report : FitChoices, FitReport
        As for a fit.
    models : Path, optional
        Folder of the landmark models.
    """
    found = landmark_models(models, report.progress_of("models"), model=choices.landmark_model)
    with open_video(path) as video:
        return chosen_people(find_people(video, found, report.progress_of("people")), numbers)


def fit_people(
    path: Path,
    out: Path,
    people: Sequence[SeenPerson],
    choices: FitChoices,
    report_of: Callable[[int], FitReport],
    *,
    models: Path | None = None,
    restart: bool = False,
) -> Iterator[tuple[SeenPerson, Path, FittedVideo]]:
    """Fit a body to each of several people; yields them as soon as their mesh is written.

    A stopped run goes on with the same call; who was done then is not yielded again.

    Parameters
    ----------
    path : Path
        The video.
    out : Path
        The mesh, where there is one person; of several, see :func:`meshes_of`.
    people : sequence of SeenPerson
        Of :func:`people_to_fit`.
    choices : FitChoices
        Of each fit.
    report_of : callable
        Gives the report of the fit of a person, by their number.
    models : Path, optional
        Folder of the landmark models.
    restart : bool
        Discard the results of a stopped fit.
    """
    outs = meshes_of(out, people)
    partials = [each.with_name(each.name + PARTIAL) for each in outs]
    for each in outs:
        check_fit_output(each)
    stopped = not restart and any(each.exists() for each in partials)
    for mesh, partial in zip(outs, partials, strict=True):
        if not (stopped and mesh.exists()):
            partial.mkdir(exist_ok=True)  # what is left to do
    for person, mesh, partial in zip(people, outs, partials, strict=True):
        if partial.exists():
            made = fit_video(
                path,
                mesh,
                choices,
                report_of(person.number),
                models=models,
                restart=restart,
                sightings=person.sightings,
            )
            yield person, mesh, made
