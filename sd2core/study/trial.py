"""One trial of a study: all conditions of one fold, share and draw, in a worker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from sd2core.classify.data import Clip, ClipSet, frame_counts
from sd2core.classify.metrics import Score, mean_recall, score
from sd2core.classify.training import TrainOptions, train
from sd2core.denoise.files import load_model
from sd2core.denoise.resample_to_model import SAME_RATE
from sd2core.errors import Sd2Error
from sd2core.labels.per_frame import BACKGROUND
from sd2core.pairs.store import Take
from sd2core.study.data import Movement, StudyData, kept_study_data
from sd2core.study.denoisers import denoiser_in
from sd2core.study.folds import Fold, folds_of, groups_of, share_of
from sd2core.study.plan import Learner, StudyPlan
from sd2core.study.windows import Features, Ridge, at_speed, half_window, window_features

REAL = "real"
"""Condition of nothing added."""

Scores = NDArray[np.floating]
"""(frames, classes)."""
Describe = Callable[[Clip], Features]


@dataclass(frozen=True)
class Task:
    """Fold, share of the real data, and seed of one training of each condition."""

    fold: Fold
    share: float
    seed: int


_TASK = TypeAdapter(Task)


@dataclass(frozen=True, eq=False)
class Run:
    """Scores of all conditions of one task."""

    task: Task
    real_frames: int
    # Of each condition, and each judged movement: recall of its frames over its classes, and share
    # of its gestures that are found (None of background alone).
    takes: Mapping[str, Mapping[str, tuple[float, float | None]]]
    scores: Mapping[str, Score]  # Of all judged movements.
    missing: Mapping[str, str]  # Conditions that could not be tried, and why.

    def to_json(self) -> dict[str, Any]:
        """Return the content of a run's file."""
        return {
            **asdict(self.task),
            "real_frames": self.real_frames,
            "takes": {name: dict(by_take) for name, by_take in self.takes.items()},
            "scores": {name: score.to_json() for name, score in self.scores.items()},
            "missing": dict(self.missing),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Run:
        """Parse :meth:`to_json`; raises KeyError, TypeError or ValueError."""
        takes = {
            name: {take: (pair[0], pair[1]) for take, pair in own.items()}
            for name, own in content["takes"].items()
        }
        scores = {name: Score.from_json(one) for name, one in content["scores"].items()}
        missing = dict(content["missing"])
        task = _TASK.validate_python(content)
        return cls(task, int(content["real_frames"]), takes, scores, missing)


def drawn(plan: StudyPlan, data: StudyData, real: Sequence[str], share: float, seed: int
          ) -> list[Movement]:  # fmt: skip
    """Return the real movements that are learnt from.

    Parameters
    ----------
    plan : StudyPlan
    data : StudyData
    real : sequence of str
        Groups whose radar is looked at.
    share : float
        As for :func:`~sd2core.study.folds.share_of`.
    seed : int
        Of the parts and of the share.
    """
    group = grouped(plan, data, seed)
    own = [one for one in data.real if group[one.clip.key] in real]
    return share_of(data.known, own, share, seed)


def grouped(plan: StudyPlan, data: StudyData, seed: int) -> Mapping[tuple[str, str], str]:
    """Return the group of every movement."""
    parts = None if plan.folds == "people" else plan.parts
    return groups_of(data.known, data.real, parts, seed)


def run_task(plan_text: str, content: str, denoiser: str | None, task: Task) -> Run:
    """Judge all conditions of a task.

    Parameters
    ----------
    plan_text : str
        The plan, as JSON.
    content : str
        Digest of its data: a process that knows others reads them again.
    denoiser : str, optional
        Folder of the task's own.
    task : Task
    """
    plan = StudyPlan.model_validate_json(plan_text)
    data = kept_study_data(plan, content)
    group = grouped(plan, data, task.seed)
    real = drawn(plan, data, task.fold.real, task.share, task.seed)
    judged = [one for one in data.real if group[one.clip.key] == task.fold.judged]
    filmed = [
        one
        for one in data.filmed
        # Of a movement that no radar saw the person tells; of parts it is in none.
        if group.get(one.clip.key, one.clip.subject) == task.fold.video
    ]
    model, reason = _denoiser(plan, data, denoiser)
    scores: dict[str, dict[str, Score]] = {}
    missing: dict[str, str] = {}
    learner = plan.classifiers[0]
    describe = _describing_once(data, learner)
    for condition in (REAL, *plan.wanted):
        try:
            added = _added(plan, data, condition, filmed, model, reason, task.seed)
        except Sd2Error as error:
            missing[condition] = error.found
            continue
        if condition != REAL and not added:
            missing[condition] = "the data hold no such maps to add"
            continue
        scores[condition] = _judged(learner, plan, data, real, added, judged, task.seed, describe)
    if task.share == max(plan.shares):
        for other in plan.classifiers[1:]:
            scores[other.title] = _judged(
                other, plan, data, real, [], judged, task.seed, _describing_once(data, other)
            )
    return Run(
        task,
        sum(int((one.clip.label >= 0).sum()) for one in real),
        {name: {key: _of_take(one) for key, one in own.items()} for name, own in scores.items()},
        {name: reduce(add, own.values()) for name, own in scores.items()},
        missing,
    )


def _added(
    plan: StudyPlan,
    data: StudyData,
    condition: str,
    filmed: Sequence[Movement],
    model: Any,
    reason: str,
    seed: int,
) -> list[Clip]:
    """Clips that are added to the real ones."""
    if condition == REAL:
        return []
    if condition == "radar":
        own = {id(one) for one in data.real}
        return [one.clip for one in filmed if id(one) in own]
    if condition == "simulated":
        made = [one.clip for one in data.others if one.clip.kind == "simulated"]
    else:
        made = [
            replace(one.clip, energies=_made_of(condition, one.take, model, reason, (seed, at)))
            for at, one in enumerate([*filmed, *data.others])
            if one.take is not None
        ]
    known = data.known
    return [*made, *(_played(one, known, speed) for speed in plan.speeds for one in made)]


def _made_of(
    condition: str, take: Take, model: Any, reason: str, seed: tuple[int, int]
) -> NDArray[np.float32]:
    """Map of a take that is added; Sd2Error with the reason where it needs a missing denoiser."""
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
    return card.needed_texture().drawn(np.ascontiguousarray(denoised), seed)


def _played(clip: Clip, known: ClipSet, speed: float) -> Clip:
    frames = np.arange(0.0, len(clip) - 0.5, speed).astype(int)
    energies = at_speed(clip.energies, known.axis, speed)
    energies[:, list(known.null_bins)] = 0.0  # slower, what was beside them comes in
    return replace(clip, energies=energies, label=clip.label[frames])


def _judged(
    learner: Learner,
    plan: StudyPlan,
    data: StudyData,
    real: Sequence[Movement],
    added: Sequence[Clip],
    judged: Sequence[Movement],
    seed: int,
    describe: Describe,
) -> dict[str, Score]:
    """Scores of all judged movements, by title; clips of one movement are taken together."""
    known = data.known
    own = [one.clip for one in real]
    scores_of = learnt(learner, known, own, added, plan.added_weight, seed, describe)
    late_s, rate_hz = learner.delay_s, known.frame_rate_hz
    if learner.model == "ridge":  # The window around a frame ends after it.
        late_s = (half_window(rate_hz, learner.window_s) - 1) / rate_hz
    background = known.classes.index(BACKGROUND) if BACKGROUND in known.classes else None
    scores: dict[str, Score] = {}
    for one in judged:
        answers = scores_of(one.clip).argmax(axis=1)
        this = score([one.clip.label], [answers], known.classes, rate_hz, background, late_s)
        scores[one.title] = scores[one.title] + this if one.title in scores else this
    return scores


def _of_take(result: Score) -> tuple[float, float | None]:
    whole = int(result.gestures.sum())
    return (
        mean_recall(result.frames),
        float(np.trace(result.gestures)) / whole if whole else None,
    )


def _denoiser(plan: StudyPlan, data: StudyData, folder: str | None) -> tuple[Any, str]:
    """The denoiser of a fold, or none and the reason."""
    known = data.known
    if plan.denoiser.file is None:
        return (None, "no pairs to learn from") if folder is None else denoiser_in(Path(folder))
    model = load_model(plan.denoiser.file)
    if (
        model.card.axis != known.axis
        or abs(known.frame_rate_hz / model.card.frame_rate_hz - 1.0) > SAME_RATE
        or not {*known.null_bins} <= {*model.card.null_bins}
    ):
        return None, f"{plan.denoiser.file} is made for other maps"
    return model, ""


def _describing_once(data: StudyData, learner: Learner) -> Describe:
    """Describe clips for ridge regression; what the radar saw of whole movements only once."""
    describe = describing(learner, data.known)
    whole = {id(one.clip) for one in data.real}
    kept: dict[int, Features] = data.described.setdefault(learner, {})

    def described(clip: Clip) -> Features:
        if id(clip) not in whole:
            return describe(clip)
        if id(clip) not in kept:
            kept[id(clip)] = describe(clip)
        return kept[id(clip)]

    return described


def all_tasks(plan: StudyPlan, data: StudyData) -> list[Task]:
    """Return the tasks of a study, small shares first."""
    groups = dict.fromkeys(grouped(plan, data, 0).values())
    filmed = bool(data.filmed) and any(one != "simulated" for one in plan.wanted)
    folds = folds_of(list(groups), filmed=filmed, turns=plan.turns)
    return [
        Task(fold, share, seed)
        for share in sorted(plan.shares)
        for fold in folds
        for seed in range(plan.seeds)
    ]


def describing(learner: Learner, known: ClipSet) -> Describe:
    """Return what ridge regression is shown of a clip; the caller may keep it."""

    def describe(clip: Clip) -> Features:
        return window_features(clip.energies, known.axis, known.frame_rate_hz, learner.window_s)

    return describe


def learnt(
    learner: Learner,
    known: ClipSet,
    real: Sequence[Clip],
    added: Sequence[Clip],
    added_weight: float,
    seed: int,
    describe: Describe,
) -> Callable[[Clip], Scores]:
    """Learn from real and added clips, and return what scores another one.

    Parameters
    ----------
    learner : Learner
    known : ClipSet
        Classes, axis and frame rate of the clips.
    real, added : sequence of Clip
    added_weight : float
        All added frames together weigh this many times as much as all real ones.
    seed : int
        Of a network's training; ridge regression has none.
    describe : callable
        Of :func:`describing`; only ridge regression is shown it.
    """
    clips = [*real, *added]
    counts = [int(frame_counts(part, len(known.classes)).sum()) for part in (real, added)]
    heavy = added_weight * counts[0] / max(counts[1], 1)
    weights = [1.0] * len(real) + [heavy] * len(added)
    if learner.model == "ridge":
        ridge = Ridge.fitted(clips, weights, len(known.classes), describe)
        return lambda clip: ridge.scores(describe(clip))
    options = TrainOptions(
        model=learner.model,
        features=learner.features,
        delay_s=learner.delay_s,
        options={"width": learner.width},
        seed=seed,
    )
    if learner.steps is not None:
        options = replace(options, steps=learner.steps)
    # Weights even where nothing is added: clips are drawn alike, by their frames.
    made = train(clips, (), known, options, weights=weights)
    return lambda clip: made.classifier.probabilities_of(clip.energies)
