"""One run of a study: denoisers of the folds, then trainings, each kept in a small file."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.batch.pool import local_client
from sd2core.denoise.card import DENOISER_PARTS
from sd2core.denoise.files import load_model
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import make_folder, remove
from sd2core.files.texts import read_json
from sd2core.pairs.labelling import labelled, read_take_labels
from sd2core.pairs.segments import OVERLAP
from sd2core.pairs.store import PairSet, PairWriter
from sd2core.progress import Progress, silent
from sd2core.runs.folder import RunFolder
from sd2core.study.folds import UNKNOWN, Fold, Labelled, folds_of, labelled_takes, share_of
from sd2core.study.plan import Added, StudyPlan
from sd2core.study.windows import Ridge, at_speed, window_features
from sd2core.train.data import read_mixed

VERSION = 1
REAL = "real"
"""Condition of nothing added."""

Features = NDArray[np.float64]


class StudyFolder(RunFolder):
    """Folder with the results of one study."""

    format = "sd2-study"
    file_name = "study-run.json"
    noun = "folder of a study"
    maker = "sd2 study"
    look = "sd2 study"


@dataclass(frozen=True)
class Run:
    """Scores of all conditions of one fold, share and draw."""

    fold: Fold
    share: float
    seed: int
    real_frames: int
    # Of each condition and judged take: shares of frames and of movements that are found.
    scores: Mapping[str, Mapping[str, tuple[float, float]]]
    missing: Mapping[str, str]  # Conditions that could not be tried, and why.

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Run:
        """Parse what :func:`dataclasses.asdict` gave."""
        fold = content["fold"]
        return cls(
            Fold(fold["judged"], fold["video"], tuple(fold["real"])),
            content["share"],
            content["seed"],
            content["real_frames"],
            {
                name: {take: (found[0], found[1]) for take, found in takes.items()}
                for name, takes in content["scores"].items()
            },
            dict(content["missing"]),
        )


@dataclass(frozen=True)
class Results:
    """All runs of a study, and what they were made of."""

    plan: StudyPlan
    kind: str  # "real" or "simulated": the radar
    classes: tuple[str, ...]
    takes: Mapping[str, int]  # Of each person.
    runs: tuple[Run, ...]


def run_study(
    plan: StudyPlan,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Results:
    """Make the missing runs of a study, whose paths are absolute, and read the others.

    A study that was stopped goes on; after a change of data or settings what depends on them is
    made anew. Progress counts denoisers and runs. Raises Sd2Error if the study cannot be.
    """
    folder = StudyFolder(Path(plan.out))
    make_folder(folder.path / "runs")
    lock = folder.lock()
    try:
        folder.set_state("running")
        results = _made(_with_pairs(plan), folder.path, processes, scheduler, progress)
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


def _with_pairs(plan: StudyPlan) -> StudyPlan:
    """The same study of pairs; those of recordings are made, or gone on with."""
    if not plan.recordings:
        return plan
    from sd2core.doppler import PRESETS
    from sd2core.mocap.recording_pairs import make_recording_pairs

    made = Path(plan.out) / "pairs.zarr"
    recordings = [Path(path) for path in plan.recordings]
    subjects = plan.subjects or None
    make_recording_pairs(recordings, made, PRESETS["paper"], subjects=subjects, limbs=True)
    return plan.model_copy(update={"pairs": (str(made),), "recordings": (), "subjects": ()})


def _made(
    plan: StudyPlan, folder: Path, processes: int, scheduler: str | None, progress: Progress
) -> Results:
    text = plan.model_dump_json()
    pairs = _pairs(text)
    names, takes = labelled_takes(pairs, plan.classes)
    people = tuple(dict.fromkeys(one.take.subject for one in takes))
    tasks = [
        (fold, share, seed)
        for share in plan.shares
        for fold in folds_of(people)
        for seed in range(plan.seeds)
    ]
    digest = _digest(pairs)
    paths = [_run_path(folder, plan, digest, *task) for task in tasks]
    models = sorted({(task[0].real, *task[1:]) for task in tasks}) if _learns(plan) else []
    total = len(models) + len(tasks)
    progress(0, total)
    with ThreadPoolExecutor(processes) as threads:
        jobs = [threads.submit(_train, folder, text, digest, *one) for one in models]
        try:
            for done, job in enumerate(jobs, start=1):
                job.result()
                progress(done, total)
        except BaseException:
            for job in jobs:
                job.cancel()
            raise
    missing = [number for number, path in enumerate(paths) if _read(path) is None]
    done = total - len(missing)
    with ExitStack() as stack:
        if missing:
            client = stack.enter_context(_client(folder, scheduler, processes))
            futures = {
                client.submit(_run, text, str(folder), digest, *tasks[number], pure=False): number
                for number in missing
            }
            from distributed import as_completed

            for future in as_completed(futures, loop=client.loop):
                content = json.dumps(asdict(future.result()), ensure_ascii=False)
                atomic_write_text(paths[futures[future]], content + "\n")
                done += 1
                progress(done, total)
    found = tuple(run for path in paths if (run := _read(path)) is not None)
    counts = {one: sum(take.take.subject == one for take in takes) for one in people}
    return Results(plan, pairs.kind, names, counts, found)


def _learns(plan: StudyPlan) -> bool:
    """True if a condition needs the fold's denoiser; a texture is known by it as well."""
    return any("denoised" in one or "texture" in one for one in plan.added)


@lru_cache(maxsize=1)
def _pairs(plan_text: str) -> PairSet:
    plan = StudyPlan.model_validate_json(plan_text)
    pairs = read_mixed([Path(path) for path in plan.pairs])
    if plan.labels is None:
        return pairs
    return labelled(pairs, read_take_labels(Path(plan.labels)))


def _digest(pairs: PairSet) -> str:
    sums = hashlib.blake2b(digest_size=16)
    sums.update(json.dumps([pairs.kind, pairs.labels, pairs.null_bins]).encode())
    for take in pairs.takes:
        sums.update(json.dumps(take.key).encode())
        for values in (take.synthetic, take.radar, take.label):
            sums.update(np.ascontiguousarray(values).data)
        if take.limbs is not None:
            sums.update(take.limbs.inputs(DENOISER_PARTS).data)
    return sums.hexdigest()


def _hash(*content: Any) -> str:
    text = json.dumps([VERSION, *content], default=str)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def _run_path(
    folder: Path, plan: StudyPlan, digest: str, fold: Fold, share: float, seed: int
) -> Path:
    used = plan.model_dump(mode="json", include={"classes", "added", "added_weight", "window_s"})
    if plan.speeds:
        used["speeds"] = list(plan.speeds)
    used["denoiser"] = plan.denoiser.model_dump(mode="json") if _learns(plan) else None
    key = _hash(digest, used, asdict(fold), share, seed)
    return folder / "runs" / f"{key}.json"


def _model_folder(
    folder: Path, plan: StudyPlan, digest: str, real: Sequence[str], share: float, seed: int
) -> Path:
    settings = plan.denoiser.model_dump(mode="json")
    key = _hash(digest, settings, plan.classes, list(real), share, seed)
    return folder / "denoisers" / key


def _real(plan: StudyPlan, pairs: PairSet, people: Sequence[str], share: float, seed: int) -> Any:
    _, takes = labelled_takes(pairs, plan.classes)
    return share_of([one for one in takes if one.take.subject in people], share, seed)


# -- Denoisers of the folds ----------------------------------------------------------------------


def _train(
    folder: Path, plan_text: str, digest: str, real: tuple[str, ...], share: float, seed: int
) -> None:
    """Have the denoiser of a draw learnt, in a process of its own; a reason is kept if it fails."""
    plan = StudyPlan.model_validate_json(plan_text)
    place = _model_folder(folder, plan, digest, real, share, seed)
    if (place / "done").exists() and (place / "run" / "best.safetensors").exists():
        return
    if place.exists():  # It failed, or was stopped.
        remove(place)
    place.mkdir(parents=True)
    chosen = plan.denoiser
    pairs = _pairs(plan_text)
    takes = [
        one.take
        for one in _real(plan, pairs, real, share, seed)
        if len(one.classes) >= chosen.segment_frames
    ]
    first = takes[0].limbs if takes else None
    writer = PairWriter(
        place / "pairs.zarr",
        kind=pairs.kind,
        axis=pairs.axis,
        null_bins=pairs.null_bins,
        frame_rate_hz=pairs.frame_rate_hz,
        labels=pairs.labels,
        provenance=pairs.provenance,
        parts=() if first is None else first.parts,
    )
    for number, take in enumerate(takes):
        # Pieces of one take are kept apart by their names.
        writer.append(replace(take, name=f"{take.name}-{number}"))
    words = [sys.executable, "-m", "sd2core.cli", "train", str(place / "pairs.zarr")]
    words += ["--out", str(place / "run"), "--model", chosen.model, "--inputs", chosen.inputs]
    words += ["--minutes", f"{chosen.minutes:g}", "--segment-frames", str(chosen.segment_frames)]
    words += ["--overlap-frames", str(min(OVERLAP, chosen.segment_frames // 4))]
    words += ["--velocity-weight", f"{chosen.velocity_weight:g}", "--batch-size", "16"]
    words += ["--test-subjects", "none", "--threads", "1", "--seed", str(seed)]
    for name, value in chosen.options.items():
        words += ["--set", f"{name}={json.dumps(value)}"]
    done = subprocess.run(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
    )
    reason = done.stderr.strip().splitlines()[-1] if done.returncode and done.stderr else ""
    if done.returncode < 0 or done.returncode == 130:
        raise KeyboardInterrupt
    atomic_write_text(place / "done", json.dumps({"reason": reason}))


def _denoiser(place: Path) -> tuple[Any, str]:
    """The denoiser of a draw; or none, and the reason."""
    model = place / "run" / "best.safetensors"
    if model.exists():
        return load_model(model), ""
    return None, str(read_json(place / "done").get("reason", "")) or "it could not be trained"


# -- One run, in a worker ------------------------------------------------------------------------


def _run(plan_text: str, folder: str, digest: str, fold: Fold, share: float, seed: int) -> Run:
    """Judge all conditions of one fold, share and draw."""
    plan = StudyPlan.model_validate_json(plan_text)
    pairs = _pairs(plan_text)
    names, takes = labelled_takes(pairs, plan.classes)
    of = {who: [one for one in takes if one.take.subject == who] for who in pairs.subjects}

    def shown(maps: Sequence[NDArray[np.float32]]) -> list[Features]:
        return [
            window_features(one, pairs.axis, pairs.frame_rate_hz, plan.window_s) for one in maps
        ]

    real = _real(plan, pairs, fold.real, share, seed)
    known = shown([one.take.radar for one in real])
    judged = of[fold.judged]
    asked = _seen(plan_text, fold.judged)
    scores: dict[str, Any] = {}
    missing: dict[str, str] = {}
    model, reason = None, ""
    if _learns(plan):
        model, reason = _denoiser(_model_folder(Path(folder), plan, digest, fold.real, share, seed))
    for condition in (REAL, *plan.added):
        video = of[fold.video] if condition != REAL else []
        try:
            maps = [
                _added_map(condition, one, model, reason, (seed, number))
                for number, one in enumerate(video)
            ]
        except Sd2Error as error:
            missing[condition] = str(error)
            continue
        added = _seen(plan_text, fold.video) if condition == "radar" else shown(maps)
        if condition != "radar":
            for speed in plan.speeds if video else ():
                played = [at_speed(one, pairs.axis, speed) for one in maps]
                added = [*added, *shown(played)]
                video = [*video, *(one.at_speed(speed) for one in of[fold.video])]
        weights = (1.0, plan.added_weight)
        ridge = _fitted([*real, *video], [*known, *added], len(real), weights, len(names))
        scores[condition] = {
            one.title: _score(ridge.scores(features), one.classes)
            for one, features in zip(judged, asked, strict=True)
        }
    return Run(fold, share, seed, sum(len(one.classes) for one in real), scores, missing)


@lru_cache(maxsize=8)
def _seen(plan_text: str, who: str) -> list[Features]:
    """Features of what the radar saw of a person, the same in all runs."""
    plan, pairs = StudyPlan.model_validate_json(plan_text), _pairs(plan_text)
    _, takes = labelled_takes(pairs, plan.classes)
    return [
        window_features(one.take.radar, pairs.axis, pairs.frame_rate_hz, plan.window_s)
        for one in takes
        if one.take.subject == who
    ]


def _added_map(
    condition: Added | str, one: Labelled, model: Any, reason: str, seed: tuple[int, int]
) -> NDArray[np.float32]:
    take = one.take
    if condition == "radar":
        return take.radar
    if condition == "synthetic":
        return take.synthetic
    if model is None:
        raise Sd2Error(f"The fold has no denoiser ({reason})", "one for denoised maps and textures")
    card = model.card
    denoised: NDArray[np.float32]
    if condition.startswith("denoised"):
        denoised = model.denoise_values(take.inputs(card.parts))
    else:
        denoised = np.float32(1.0 if card.known is None else card.known.gain) * take.synthetic
    if not condition.endswith("+texture"):
        return denoised
    drawn: NDArray[np.float32] = card.needed_texture().drawn(np.ascontiguousarray(denoised), seed)
    return drawn


def _fitted(
    takes: Sequence[Labelled],
    features: Sequence[Features],
    real: int,
    whole: tuple[float, float],
    classes: int,
) -> Ridge:
    """Learn from real and added takes, whose frames weigh together what ``whole`` says."""
    weights = []
    counts = [
        sum(int((one.classes != UNKNOWN).sum()) for one in part)
        for part in (takes[:real], takes[real:])
    ]
    for number, one in enumerate(takes):
        weight = whole[number >= real] / max(counts[number >= real], 1)
        weights.append(np.full(len(one.classes), weight))
    known = [one.classes != UNKNOWN for one in takes]
    return Ridge.fitted(
        [values[inside] for values, inside in zip(features, known, strict=True)],
        [one.classes[inside] for one, inside in zip(takes, known, strict=True)],
        [values[inside] for values, inside in zip(weights, known, strict=True)],
        classes,
    )


def _score(scores: Features, truth: NDArray[np.int64]) -> tuple[float, float]:
    """Mean recall of frames over the classes of a take, and share of its movements found."""
    found = scores.argmax(axis=1)
    frames = [float((found[truth == one] == one).mean()) for one in np.unique(truth) if one >= 0]
    edges = np.flatnonzero(np.diff(truth)) + 1
    whole = [
        float(scores[start:stop].sum(axis=0).argmax() == truth[start])
        for start, stop in zip([0, *edges], [*edges, len(truth)], strict=True)
        if truth[start] >= 0
    ]
    return float(np.mean(frames)), float(np.mean(whole))


@contextmanager
def _client(folder: Path, scheduler: str | None, processes: int) -> Iterator[Any]:
    if scheduler is None:
        with local_client(folder / "begun", processes) as client:
            yield client
        return
    from distributed import Client

    try:
        client = Client(scheduler, timeout=20.0, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise Sd2Error(
            f"No scheduler answers at {scheduler} ({error})", "the address of a dask-scheduler"
        ) from error
    with client:
        yield client


def _read(path: Path) -> Run | None:
    """Read a run; None where it is missing or damaged."""
    try:
        return Run.from_json(read_json(path))
    except (ValueError, KeyError, TypeError, Sd2Error):
        return None
