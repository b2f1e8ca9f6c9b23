"""Several people of one video, each to a mesh of their own."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from sd2core.body.camera import camera_of
from sd2core.body.fit_video import (
    LANDMARKS,
    PARTIAL,
    FitChoices,
    FitReport,
    FittedVideo,
    Stage,
    check_fit_output,
    claim_folder,
    fit_video,
)
from sd2core.body.floor import standing_feet, statures_on_one_floor
from sd2core.body.landmark_models import landmark_models
from sd2core.body.landmarks import find_landmarks
from sd2core.body.people import SeenPerson, chosen_people, find_people
from sd2core.body.solve import one_thread
from sd2core.files.atomic import atomic_write_json
from sd2core.io.video import open_video
from sd2core.options.fitting import meshes_of
from sd2core.progress import Progress, silent

_RUN = "people.json"
"""File in the folder of a fit: of which run it is, and what the floor told of the height."""


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
    networks = landmark_models(models, report.progress_of("models"), model=choices.landmark_model)
    with open_video(path) as video:
        return chosen_people(find_people(video, networks, report.progress_of("people")), numbers)


def fit_people(
    path: Path,
    out: Path,
    people: Sequence[SeenPerson],
    choices: FitChoices,
    report_of: Callable[[int], FitReport],
    *,
    models: Path | None = None,
    restart: bool = False,
) -> Iterator[tuple[SeenPerson, Path, FitChoices, FittedVideo]]:
    """Fit a body to each of several people; yields them as soon as their mesh is written.

    Several people stand on one floor, which tells how tall they are beside one another. A
    stopped run goes on with the same call; who was done then is not yielded again.

    Parameters
    ----------
    path : Path
        The video.
    out : Path
        The mesh, where there is one person; of several, see
        :func:`~sd2core.options.fitting.meshes_of`.
    people : sequence of SeenPerson
        Of :func:`people_to_fit`.
    choices : FitChoices
        Of each fit; a stature is that of the first person.
    report_of : callable
        Gives the report of the fit of a person, by their number.
    models : Path, optional
        Folder of the landmark models.
    restart : bool
        Discard the results of a stopped fit.
    """
    outs = meshes_of(out, [each.number for each in people])
    partials = [each.with_name(each.name + PARTIAL) for each in outs]
    for each in outs:
        check_fit_output(each)
    run = _run_of(path, people, choices)
    stopped = not restart and any(_told(each, run) for each in partials)
    for mesh, partial in zip(outs, partials, strict=True):
        if not (stopped and mesh.exists()):
            partial.mkdir(exist_ok=True)  # what is left to do
    left = [row for row, partial in enumerate(partials) if partial.exists()]
    reports = {row: report_of(people[row].number) for row in left}
    one = len(people) == 1
    chosen = (
        {left[0]: choices}
        if one
        else _with_statures(
            path,
            {row: (people[row], partials[row], reports[row]) for row in left},
            choices,
            models,
            restart,
            run,
        )
    )
    for row in left:
        report = reports[row]
        made = fit_video(
            path,
            outs[row],
            chosen[row],
            report if one else _for_the_rest(report),
            models=models,
            restart=restart and one,
            # Alone in a video, somebody is fitted as without a list.
            sightings=None if people[row].alone else people[row].sightings,
        )
        yield people[row], outs[row], chosen[row], made


def is_stopped(path: Path, out: Path, people: Sequence[SeenPerson], choices: FitChoices) -> bool:
    """True where :func:`fit_people` was stopped with the same video, people and choices."""
    outs = meshes_of(out, [each.number for each in people])
    run = _run_of(path, people, choices)
    return any(_told(each.with_name(each.name + PARTIAL), run) for each in outs)


def _run_of(path: Path, people: Sequence[SeenPerson], choices: FitChoices) -> str:
    """What two runs have in common that give the same meshes."""
    about = path.stat()
    numbers = [each.number for each in people]
    return json.dumps([path.name, about.st_size, about.st_mtime_ns, numbers, asdict(choices)])


def _told(partial: Path, run: str) -> dict[str, Any]:
    """What the folder of a fit holds of a run; empty where it is of none, or another."""
    with suppress(OSError, ValueError):
        told: dict[str, Any] = json.loads((partial / _RUN).read_text())
        return told if told.get("run") == run else {}
    return {}


def _for_the_rest(report: FitReport) -> FitReport:
    """Report of a fit that has begun, whose landmarks are there already."""

    def progress_of(stage: Stage) -> Progress:
        return silent if stage in ("models", "refine") else report.progress_of(stage)

    return replace(report, progress_of=progress_of, started=lambda *_: None)


def _with_statures(
    path: Path,
    people: Mapping[int, tuple[SeenPerson, Path, FitReport]],
    choices: FitChoices,
    models: Path | None,
    restart: bool,
    run: str,
) -> dict[int, FitChoices]:
    """Choices of each of several people, with the stature that the common floor tells.

    Landmarks and statures are kept in the folders of the fits; statures only for the same run.
    """
    feet, known = {}, {}
    with open_video(path) as video:
        camera, _ = camera_of(video, choices.focal_px, choices.field_of_view_deg)
        networks = landmark_models(models, model=choices.landmark_model)
        _, partial, report = next(iter(people.values()))
        report.started(video, (partial / LANDMARKS).is_dir())
        for row, (person, partial, report) in people.items():
            with claim_folder(partial, restart), one_thread():
                track = find_landmarks(
                    video,
                    networks,
                    person=person.sightings,
                    max_gap_s=choices.max_gap_s,
                    progress_of=report.progress_of,
                    on_frame=report.on_frame,
                    workspace=partial / LANDMARKS,
                )
                feet[row] = standing_feet(track, camera)
            if told := _told(partial, run):
                known[row] = told["stature_m"]
    first_m = choices.stature_m if 0 in people else None
    statures_m = dict(zip(feet, statures_on_one_floor(list(feet.values()), first_m), strict=True))
    chosen = {}
    for row, (_, partial, _) in people.items():
        stature_m = known.get(row, statures_m[row])
        if row == 0 and first_m is not None:
            chosen[row] = choices
        else:
            chosen[row] = replace(choices, stature_m=stature_m, stature_by_floor=True)
        atomic_write_json(partial / _RUN, {"run": run, "stature_m": stature_m})
    return chosen
