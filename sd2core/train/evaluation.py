"""Evaluation of models on people that they have not learnt from.

Every take is denoised whole, from its first frame on. Velocities are compared frame by
frame; :mod:`sd2core.denoise.metrics` defines how. Two sets of frames are judged:

- those in which something moves: the strongest bin of the radar's map lies 10 dB above the
  noise of its take (:func:`sd2core.denoise.metrics.stands_out`). This is the measure that
  models are ranked by;
- all frames. Where nothing moves, the strongest bin of a radar's map is that of its noise,
  which no model can foretell, so this measure has a floor well above zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.card import ModelCard
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.metrics import MapError, VelocityError, map_error, stands_out, velocity_error
from sd2core.denoise.registry import FILTERS, fit_filter, options
from sd2core.denoise.resample_to_model import is_same_rate
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.errors import Sd2Error
from sd2core.maps import mean_velocity_mps, peak_velocity_mps
from sd2core.pairs.store import PairSet
from sd2core.pairs.summary import is_among, kept_out
from sd2core.progress import Progress, silent

Energies = NDArray[np.float32]


@dataclass(frozen=True)
class Score:
    """Errors on some frames."""

    frames: int  # all of them
    peak: VelocityError  # of the peak velocity, where something moves
    peak_all: VelocityError  # the same of all frames
    mean: VelocityError  # of the energy-weighted mean velocity, where something moves
    map: MapError  # of all cells of all frames


@dataclass(frozen=True)
class Report:
    """Errors of one model."""

    name: str  # distinguishes it within its group: the file, or the filter
    card: ModelCard
    seed: int | None
    all: Score
    by_label: Mapping[str, Score]
    by_subject: Mapping[str, Score]


@dataclass(frozen=True)
class Group:
    """Models of one architecture that differ in their seeds."""

    name: str
    reports: tuple[Report, ...]  # at least one
    trained: bool  # False for what needs no training

    def values(
        self, part: str, number: str, label: str | None = None, subject: str | None = None
    ) -> NDArray[np.float64]:
        """One number of every model, e.g. ``values("peak", "mae_mps")``, shape (models,).

        Parameters
        ----------
        part : {"peak", "peak_all", "mean", "map"}
            Field of :class:`Score`.
        number : str
            Field of that.
        label, subject : str, optional
            Frames of one label, or of one subject; by default all. With both, those of the label.
        """
        scores = [_score_of(report, label, subject) for report in self.reports]
        return np.array([getattr(getattr(score, part), number) for score in scores], np.float64)


@dataclass(frozen=True)
class Evaluation:
    """Errors of all groups on the same takes."""

    kind: str  # "simulated" or "real" radar
    subjects: tuple[str, ...]
    labels: tuple[str, ...]  # those that occur
    frames: int
    moving: int  # frames in which something moves
    groups: tuple[Group, ...]  # the filters first
    notes: tuple[str, ...] = field(default=())  # reservations about the result

    def to_json(self) -> dict[str, Any]:
        """All numbers of all models, and mean and sd over the models of a group."""
        return {
            "format": "sd2-evaluation",
            "version": 1,
            "kind": self.kind,
            "subjects": list(self.subjects),
            "labels": list(self.labels),
            "frames": self.frames,
            "moving_frames": self.moving,
            "notes": list(self.notes),
            "groups": [
                {
                    "name": group.name,
                    "model": group.reports[0].card.model,
                    "trained": group.trained,
                    "parameters": group.reports[0].card.parameters,
                    "peak_mae_mps": _spread(group.values("peak", "mae_mps")),
                    "peak_sd_mps": _spread(group.values("peak", "sd_mps")),
                    "peak_all_mae_mps": _spread(group.values("peak_all", "mae_mps")),
                    "mean_mae_mps": _spread(group.values("mean", "mae_mps")),
                    "mean_correlation": _spread(group.values("mean", "correlation")),
                    "map_rmse": _spread(group.values("map", "rmse_compressed")),
                    "models": [_report_json(report) for report in group.reports],
                }
                for group in self.groups
            ],
        }


def _score_of(report: Report, label: str | None, subject: str | None) -> Score:
    if label is not None:
        return report.by_label[label]
    return report.by_subject[subject] if subject is not None else report.all


def _spread(values: NDArray[np.float64]) -> dict[str, Any]:
    """Mean over models, and their standard deviation (of the sample) where there are two."""
    return {
        "mean": float(values.mean()),
        "sd": float(values.std(ddof=1)) if len(values) > 1 else None,
        "models": len(values),
    }


def _report_json(report: Report) -> dict[str, Any]:
    return {
        "name": report.name,
        "seed": report.seed,
        "all": asdict(report.all),
        "by_label": {name: asdict(score) for name, score in report.by_label.items()},
        "by_subject": {name: asdict(score) for name, score in report.by_subject.items()},
    }


def evaluate(
    models: Sequence[TrainedDenoiser],
    pairs: PairSet,
    subjects: Iterable[str] | None = None,
    *,
    first_only: bool = True,
    progress: Progress = silent,
) -> Evaluation:
    """Measure models, and for comparison filters that need no training.

    The filters are fitted on the subjects that the first model learnt from, as far as they
    are there; else on all that are not judged.

    Parameters
    ----------
    models : sequence of TrainedDenoiser
    pairs : PairSet
    subjects : iterable of str, optional
        To be judged; by default the test subjects of the first model, or all.
    first_only : bool
        On what every take's own sensor saw.
    progress : Progress
        Counts takes, once for every model and filter.

    Raises
    ------
    Sd2Error
        If a model does not fit the pairs, a subject has no take, or no take is left.
    """
    for model in models:
        check_fits(model.card, pairs, "Judge it by pairs like those that it learnt from")
    judged_subjects = _judged_subjects(models, pairs, subjects)
    judged = pairs.of(judged_subjects).placements(first_only=first_only)
    if not judged.takes:
        raise Sd2Error("No take is left to judge", "takes of a sensor of their own")
    truth = _Truth.of(judged)
    filters = _filters(models, pairs, judged_subjects)
    total = len(judged.takes) * (len(filters) + len(models))

    reports = []
    for number, (name, model) in enumerate(
        [*filters, *((_title(model.card), model) for model in models)]
    ):
        estimate = _estimated(model, judged, progress, number * len(judged.takes), total)
        reports.append(_report(name, model.card, estimate, truth))
    progress(total, total)
    groups = [Group(report.name, (report,), False) for report in reports[: len(filters)]]
    return Evaluation(
        kind=pairs.kind,
        subjects=judged.subjects,
        labels=tuple(truth.labels),
        frames=len(truth.energies),
        moving=int(truth.moving.sum()),
        groups=(*groups, *_grouped(reports[len(filters) :])),
        notes=_notes(models, judged_subjects, pairs),
    )


@dataclass(frozen=True, eq=False)
class _Truth:
    """All judged takes one after another."""

    pairs: PairSet
    energies: Energies  # (frames, bins)
    moving: NDArray[np.bool_]  # (frames,)
    labels: dict[str, NDArray[np.bool_]]
    subjects: dict[str, NDArray[np.bool_]]
    compression: Compression

    @classmethod
    def of(cls, pairs: PairSet) -> _Truth:
        takes, nulled = pairs.takes, list(pairs.null_bins)
        energies = np.concatenate([take.radar for take in takes])
        energies[:, nulled] = 0.0
        label = np.concatenate([take.label for take in takes])
        subject = np.concatenate(
            [np.full(len(take.label), pairs.subjects.index(take.subject)) for take in takes]
        )
        return cls(
            pairs,
            energies,
            np.concatenate([stands_out(take.radar, pairs.null_bins) for take in takes]),
            {name: label == n for n, name in enumerate(pairs.labels) if (label == n).any()},
            {name: subject == n for n, name in enumerate(pairs.subjects)},
            Compression.fitted([energies], pairs.null_bins),
        )


def _estimated(
    model: TrainedDenoiser, pairs: PairSet, progress: Progress, done: int, total: int
) -> Energies:
    estimates = []
    for number, take in enumerate(pairs.takes):
        progress(done + number, total)
        estimates.append(model.denoise_values(take.inputs(model.card.parts)))
    return np.concatenate(estimates)


def _report(name: str, card: ModelCard, estimate: Energies, truth: _Truth) -> Report:
    everywhere = np.ones(len(estimate), bool)
    axis, seed = truth.pairs.axis, card.about.get("seed")
    peaks_mps = peak_velocity_mps(estimate, axis), peak_velocity_mps(truth.energies, axis)
    means_mps = mean_velocity_mps(estimate, axis), mean_velocity_mps(truth.energies, axis)

    def score(frames: NDArray[np.bool_]) -> Score:
        return Score(
            frames=int(frames.sum()),
            peak=velocity_error(*peaks_mps, frames & truth.moving),
            peak_all=velocity_error(*peaks_mps, frames),
            mean=velocity_error(*means_mps, frames & truth.moving),
            map=map_error(
                estimate[frames], truth.energies[frames], truth.compression, truth.pairs.null_bins
            ),
        )

    return Report(
        name=name,
        card=card,
        seed=seed if isinstance(seed, int) else None,
        all=score(everywhere),
        by_label={label: score(frames) for label, frames in truth.labels.items()},
        by_subject={subject: score(frames) for subject, frames in truth.subjects.items()},
    )


def _filters(
    models: Sequence[TrainedDenoiser], pairs: PairSet, judged: Sequence[str]
) -> list[tuple[str, TrainedDenoiser]]:
    learnt = learnt_from(models[0].card, "training") if models else []
    fitted_on = [name for name in pairs.subjects if is_among(name, learnt) and name not in judged]
    fitted_on = fitted_on or [name for name in pairs.subjects if name not in judged]
    takes = pairs.of(fitted_on or judged).placements(first_only=True).takes
    takes = takes or pairs.of(fitted_on or judged).takes
    scaling = Scaling.fitted(
        [take.synthetic for take in takes], [take.radar for take in takes], pairs.null_bins
    )
    # What a filter answers weakly, because it is unsure, is its answer all the same.
    scaling = replace(scaling, floor=0.0)
    inputs = [scaling.input.compress(take.synthetic) for take in takes]
    targets = [scaling.target.compress(take.radar) for take in takes]
    made = []
    for name in FILTERS:
        network, chosen = fit_filter(name, inputs, targets, pairs.null_bins)
        card = ModelCard(
            model=name,
            options=chosen,
            scaling=scaling,
            axis=pairs.axis,
            null_bins=pairs.null_bins,
            frame_rate_hz=pairs.frame_rate_hz,
            trained_on=pairs.kind,
        )
        made.append((name, TrainedDenoiser(network, card)))
    return made


def _grouped(reports: Sequence[Report]) -> list[Group]:
    """Models by architecture, in the order of the first of each."""
    groups: dict[str, list[Report]] = {}
    for report in reports:
        groups.setdefault(_architecture(report.card), []).append(report)
    return [Group(name, tuple(members), True) for name, members in groups.items()]


def _architecture(card: ModelCard) -> str:
    """The model's name, with the options that are not its defaults."""
    usual = options(card.model)
    other = [f"{name}={value}" for name, value in card.options.items() if usual.get(name) != value]
    other += [] if card.inputs == "map" else [card.inputs]
    return card.model + (f" ({', '.join(other)})" if other else "")


def _title(card: ModelCard) -> str:
    if card.path is None:
        return card.title or card.model
    # All best models have one name; their runs tell them apart.
    return card.path.parent.name if card.path.stem == "best" else card.path.stem


def _judged_subjects(
    models: Sequence[TrainedDenoiser], pairs: PairSet, subjects: Iterable[str] | None
) -> tuple[str, ...]:
    if subjects is not None:
        return pairs.of(subjects).subjects
    if not models:
        return pairs.subjects
    card = models[0].card
    return kept_out(pairs.subjects, learnt_from(card, "test"), _seen(card))


def _seen(card: ModelCard) -> list[str]:
    return learnt_from(card, "training", "validation")


def learnt_from(card: ModelCard, *parts: str) -> list[str]:
    """People of some parts of a model's data: ``training``, ``validation``, ``test``."""
    subjects, provenance = card.about.get("subjects"), card.about.get("provenance")
    known = subjects if isinstance(subjects, Mapping) else {}
    names = [name for part in parts for name in known.get(part, ())]
    if isinstance(provenance, Mapping) and provenance.get("made_by") == "sd2 pairs mars":
        # Older models name persons with their parts, "1-test".
        names = list(dict.fromkeys(name.partition("-")[0] for name in names))
    return names


def _notes(
    models: Sequence[TrainedDenoiser], judged: Sequence[str], pairs: PairSet
) -> tuple[str, ...]:
    notes = []
    for model in models:
        seen = _seen(model.card)
        known = [name for name in judged if is_among(name, seen)]
        if known:
            notes.append(
                f"{_title(model.card)} has learnt from, or was chosen by, subjects called"
                f" {', '.join(known)}: its errors there say nothing about other people"
            )
        if model.card.trained_on != pairs.kind:
            notes.append(
                f"{_title(model.card)} has learnt from {model.card.trained_on} radar, and is"
                f" judged by {pairs.kind} radar"
            )
    if not set(pairs.subjects) - set(judged):
        notes.append("the filters were fitted on the very takes that they are judged by")
    return tuple(dict.fromkeys(notes))


def check_fits(card: ModelCard, pairs: PairSet, remedy: str) -> None:
    """Raise Sd2Error, with a remedy, for a model that is not made for maps like those of pairs."""
    same_rate = is_same_rate(card.frame_rate_hz, pairs.frame_rate_hz)
    for what, mine, theirs, alike in (
        ("velocity axis", card.axis, pairs.axis, card.axis == pairs.axis),
        ("null bins", card.null_bins, pairs.null_bins, card.null_bins == tuple(pairs.null_bins)),
        ("frame rate", card.frame_rate_hz, pairs.frame_rate_hz, same_rate),
    ):
        if not alike:
            raise Sd2Error(
                f"The {what} of the model {_title(card)} is {mine}, that of the pairs {theirs}",
                "the same",
                remedy,
            )
