"""All runs of a study: denoisers of the folds, then trainings, each kept in a small file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.batch.pool import study_client
from sd2core.denoise.card import DENOISER_PARTS
from sd2core.denoise.files import find_model
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.digests import cached_digest
from sd2core.files.paths import make_folder
from sd2core.files.texts import read_json
from sd2core.progress import Progress, silent
from sd2core.runs.folder import RunFolder
from sd2core.study.data import Movement, StudyData, study_data_of
from sd2core.study.denoisers import learn_denoiser
from sd2core.study.plan import StudyPlan
from sd2core.study.trial import Run, Task, all_tasks, drawn, run_task

VERSION = 2
_RUN_VERSION = 2
"""Of what a run says, on which no denoiser depends."""


class StudyFolder(RunFolder):
    """Folder with the results of one study."""

    format = "sd2-study"
    file_name = "study-run.json"
    noun = "folder of a study"
    maker = "sd2 study"
    look = "sd2 study"


@dataclass(frozen=True)
class Results:
    """All runs of a study, and what they were made of."""

    plan: StudyPlan
    kind: str  # "real" or "simulated": the radar
    classes: tuple[str, ...]
    subject_of: Mapping[str, str]  # Of every movement, by title.
    others: int  # Movements of bodies that no radar saw.
    runs: tuple[Run, ...]
    lost_frames: int = 0  # Of pairs, in damaged chunks.

    @property
    def takes(self) -> dict[str, int]:
        """Number of movements of each person."""
        own = list(self.subject_of.values())
        return {one: own.count(one) for one in dict.fromkeys(own)}


def run_study(
    plan: StudyPlan,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Results:
    """Make the missing runs of a study, and read the others.

    A study that was stopped goes on; after a change of data or settings what depends on them is
    made anew.

    Parameters
    ----------
    plan : StudyPlan
        Whose paths are absolute.
    processes : int
        Runs, and denoisers that learn, at a time.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the runs; by default processes of this machine.
    progress : Progress
        Counts denoisers and runs.

    Raises
    ------
    Sd2Error
        If the study cannot be.
    """
    folder = StudyFolder(Path(plan.out))
    make_folder(folder.path / "runs")
    lock = folder.lock()
    try:
        folder.set_state("running")
        results = _made(plan, folder.path, processes, scheduler, progress)
        folder.set_state("finished")
        return results
    except KeyboardInterrupt:
        folder.set_state("stopped")
        raise
    except BaseException:
        folder.set_state("failed")
        raise
    finally:
        lock.release()


def _made(
    plan: StudyPlan, folder: Path, processes: int, scheduler: str | None, progress: Progress
) -> Results:
    text = plan.model_dump_json()
    data = study_data_of(plan)
    known = dict.fromkeys([*data.real, *data.filmed, *data.others])
    content = _digest(data, known)
    tasks = {_run_path(folder, plan, content, one): one for one in all_tasks(plan, data)}
    digest = _digest(data, data.real)  # Denoisers learn from nothing else.
    learns = plan.learns_denoisers and data.pairs is not None
    # Tasks of the same real groups have the same.
    places = {path: _model_folder(folder, plan, digest, one) for path, one in tasks.items()}
    models = {places[path]: one for path, one in tasks.items() if learns}
    total = len(models) + len(tasks)
    progress(0, total)
    with ThreadPoolExecutor(processes) as threads:
        jobs = [threads.submit(_learn, place, plan, data, task)
                for place, task in models.items()]  # fmt: skip
        try:
            for done, job in enumerate(jobs, start=1):
                job.result()
                progress(done, total)
        except BaseException:
            for job in jobs:
                job.cancel()
            raise
    runs = {path: _read(path) for path in tasks}
    missing = [path for path, run in runs.items() if run is None]
    done = total - len(missing)
    if missing:
        with study_client(folder / "begun", processes, scheduler) as (client, finished):
            futures = {}
            for path in missing:
                place = str(places[path]) if learns else None
                futures[client.submit(run_task, text, content, place, tasks[path], pure=False)] = (
                    path
                )
            for future in finished(futures):
                run = future.result()
                runs[futures[future]] = run
                text_of_run = json.dumps(run.to_json(), ensure_ascii=False)
                atomic_write_text(futures[future], text_of_run + "\n")
                done += 1
                progress(done, total)
    subject_of = {one.title: one.clip.subject for one in data.real}
    complete = tuple(run for run in runs.values() if run is not None)
    classes, others = data.known.classes, len(data.others)
    return Results(plan, data.kind, classes, subject_of, others, complete, data.lost_frames)


def _learn(place: Path, plan: StudyPlan, data: StudyData, task: Task) -> None:
    assert data.pairs is not None
    real = drawn(plan, data, task.fold.real, task.share, task.seed)
    takes = [one.take for one in real if one.take is not None]
    learn_denoiser(place, plan.denoiser, data.pairs, takes, task.seed)


def _digest(data: StudyData, movements: Iterable[Movement]) -> str:
    sums = hashlib.blake2b(digest_size=16)
    known = data.known
    head = [data.kind, known.classes, known.null_bins, known.axis.v_max_mps]
    sums.update(json.dumps([*head, known.frame_rate_hz]).encode())
    for one in movements:
        sums.update(json.dumps([*one.clip.key, one.clip.placement, one.clip.kind]).encode())
        arrays = [one.clip.energies, one.clip.label]
        if one.take is not None:
            arrays.append(one.take.synthetic)
            if one.take.limbs is not None:
                arrays.append(one.take.limbs.inputs(DENOISER_PARTS))
        for values in arrays:
            sums.update(np.ascontiguousarray(values).data)
    return sums.hexdigest()


def _hash(*content: Any) -> str:
    text = json.dumps([VERSION, *content], default=str)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def _run_path(folder: Path, plan: StudyPlan, digest: str, task: Task) -> Path:
    used = plan.model_dump(
        mode="json", include={"added", "speeds", "added_weight", "classifiers", "folds", "parts"}
    )
    denoised = any(one not in ("radar", "simulated", "synthetic") for one in plan.wanted)
    used["denoiser"] = plan.denoiser.model_dump(mode="json") if denoised else None
    if denoised and plan.denoiser.file is not None:
        used["model"] = cached_digest(find_model(plan.denoiser.file))
    used["all"], used["version"] = task.share == max(plan.shares), _RUN_VERSION
    return folder / "runs" / f"{_hash(digest, used, asdict(task))}.json"


def _model_folder(folder: Path, plan: StudyPlan, digest: str, task: Task) -> Path:
    settings = plan.denoiser.model_dump(mode="json")
    real: Sequence[str] = task.fold.real
    parts = plan.parts if plan.folds == "files" else None
    key = _hash(digest, settings, list(real), parts, task.share, task.seed)
    return folder / "denoisers" / key


def _read(path: Path) -> Run | None:
    """Read a run; None where it is missing or damaged."""
    try:
        return Run.from_json(read_json(path))
    except (ValueError, KeyError, TypeError, Sd2Error):
        return None
