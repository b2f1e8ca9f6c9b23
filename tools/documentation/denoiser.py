"""Makes ``denoiser.md`` and its pictures: ``make denoiser``, hours of training.

Campaigns, pairs and runs stay in ``build/denoiser``; what is there is not made again, a run that
was broken off goes on. Runs are as many at once as the machine has cores, one thread each. Motion
capture comes from ``build/fitting``, which ``make fitting`` fills.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.parts import synthetic_map
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, load_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.texture import Texture
from sd2core.doppler import Synthesizer
from sd2core.fmcw import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.segments import LENGTH
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.radar_config import CLUTTER, PAPER_RADAR
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.simulate.campaign.radar import TargetOptions, radar_target
from sd2core.simulate.campaign.takes import OPTIONS
from sd2core.train.evaluation import Evaluation, Group, Score, evaluate
from tools.documentation.long_sequences import long_sequences
from tools.documentation.measured import BUILD, SAMPLE, SHARED, spread, table, write_filled
from tools.documentation.runs import (
    ERRORS,
    Job,
    campaign_of,
    epochs_in,
    errors_of,
    evaluated,
    run_of,
    sd2,
    settings,
    train,
)
from tools.fitting.clips import REAL_MOTION

FOLDER = BUILD / "denoiser"
FITTING = BUILD / "fitting"
SEEDS, MINUTES = 3, 1.0
"""Trainings of each network, and minutes of each."""

WALKS = ("walk-towards", "towards-2", "towards-3", "walk-away", "away-2", "away-3")
NETWORKS = {
    "s4": ("s4",),
    "s4-kinematics": ("s4", "--inputs", "kinematics"),
    "gru": ("gru", *settings({"dropout": 0.3})),
    "unet": ("unet", *settings({"dropout": 0.3})),
}
MARS_PAIRS = FOLDER / "mars.zarr"
MARS = tuple(SHARED / "paired" / f"mars_subject{person}" for person in (1, 2, 4))
# At 10 frames/s the S4's steps are longer.
_MARS_S4 = ("s4", *settings({"dt_min": 0.2, "dt_max": 2.0, "dropout": 0.5, "live": "false"}))
ON_MARS = {
    "s4": _MARS_S4,
    "s4-kinematics": (*_MARS_S4, "--inputs", "kinematics"),
    "gru-kinematics": ("gru", *settings({"dropout": 0.5}), "--inputs", "kinematics"),
}
_WEIGHT = ("--velocity-weight", "1")
_WORSE = 1.05


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    motions = ("--movements", "both", "--motions", FITTING / "motions", "--radars", "drawn")
    known = campaign_of(FOLDER / "known", 20, *motions, "--limbs", "--fit-error-sizes", "0,2")
    bundled = [load_model(name) for name in (MAP_MODEL, LIMBS_MODEL)]
    pairs = read_pairs(known)
    exact, fitted = (_judged(bundled, pairs, _clips(fit)) for fit in (False, True))
    paper = campaign_of(FOLDER / "paper", 72, "--protocol", "paper", "--limbs", "--seed", 3)
    networks = _networks(paper)
    mars = _mars()
    whole, live = _live_errors()
    write_filled(
        "denoiser.md",
        seeds=SEEDS,
        minutes=MINUTES,
        sample=_sample(_judged(bundled, pairs, _sample_takes())),
        clips=len(REAL_MOTION),
        motion=_motion(exact, fitted),
        walks=_walks(exact, fitted),
        networks=_table(networks),
        **_leader(networks),
        whole=whole,
        live=live,
        mars=_mars_table(mars),
        gain=_gain(mars),
        long=long_sequences(FOLDER / "long", 0.4 * MINUTES),
        texture=texture_table(
            {
                "simulated radar, the paper's protocol": (FOLDER / "s4-0", paper, None),
                "real radar, MARS person 2": (FOLDER / "mars-2-s4-kinematics-0", MARS_PAIRS, "2"),
            }
        ),
    )


# --- the bundled models -----------------------------------------------------------------------


def _judged(models: Sequence[TrainedDenoiser], pairs: PairSet, takes: Sequence[Take]) -> Evaluation:
    """Errors in takes of other people than those of the pairs, on which the filters are fitted."""
    together = replace(pairs, takes=(*pairs.takes, *takes))
    return evaluate(models, together, dict.fromkeys(take.subject for take in takes))


def _take(name: str, mesh: MeshSequence, sensor: VirtualSensor, radar: np.ndarray) -> Take:
    synthetic = synthetic_map(Synthesizer(mesh, OPTIONS), sensor, limbs=True)
    present = np.flatnonzero(mesh.presence.present)
    frames = slice(int(present[0]), min(int(present[-1]) + 1, len(radar)))
    whole = Take(
        name,
        "clip",
        np.ascontiguousarray(synthetic.values.T[: len(radar)]),
        np.ascontiguousarray(radar[: len(mesh.times_s)]),
        mesh.times_s[: len(radar)],
        np.zeros(min(len(radar), len(mesh.times_s)), np.int8),
        np.array(sensor.position_m),
        limbs=None if synthetic.limbs is None else synthetic.limbs.of_frames(slice(len(radar))),
    )
    return whole.part(frames)


def _sample_takes() -> list[Take]:
    recording = open_recording(SAMPLE)
    radar = doppler_map(
        recording.load_capture(), axis=OPTIONS.axis, clutter=CLUTTER
    ).values.T.copy()
    radar[:, list(OPTIONS.null_bins)] = 0.0
    meshes = {"fit": recording.load_mesh(), "true": load_mesh(recording.folder / "mesh.zarr")}
    return [_take(name, mesh, recording.sensor, radar) for name, mesh in meshes.items()]


def _clips(fitted: bool) -> list[Take]:
    """A drawn radar's map of every clip of recorded motion, and that of its true or fitted body."""
    takes = []
    for number, clip in enumerate(REAL_MOTION):
        true = load_mesh(FITTING / "clips" / clip.name / "mesh.zarr")
        seed = (9, number)
        radar = radar_target(
            true,
            PAPER_RADAR,
            VirtualSensor(),
            OPTIONS.axis,
            OPTIONS.null_bins,
            seed=seed,
            options=TargetOptions().drawn(np.random.default_rng(seed)),
        )
        mesh = load_mesh(FITTING / "fits" / f"{clip.name}.zarr") if fitted else true
        takes.append(_take(clip.name, mesh, VirtualSensor(), radar))
    return takes


def _name(group: Group) -> str:
    return group.reports[0].name


def _relative(value: float, none: float) -> str:
    return f"{value:.3f}" + (f" ({100.0 * (value / none - 1.0):+.0f} %)" if value != none else "")


def _sample(evaluation: Evaluation) -> str:
    rows = [["model", "fit: peak MAE m/s", "mean", "true: peak", "mean"]]
    none = evaluation.groups[0].reports[0].by_subject
    for group in evaluation.groups:
        cells = [
            _relative(getattr(score, of).mae_mps, getattr(none[mesh], of).mae_mps)
            for mesh, score in group.reports[0].by_subject.items()
            for of in ("peak", "mean")
        ]
        rows.append([_name(group), *cells])
    return table(rows)


def _motion(*evaluations: Evaluation) -> str:
    rows = {"": ["model"]}
    for body in ("exact", "fitted"):
        rows[""] += [f"{body}: peak MAE m/s", "mean", "worse"]
    for evaluation in evaluations:
        none = evaluation.groups[0].reports[0]
        for group in evaluation.groups:
            report = group.reports[0]
            ratios = np.array(
                [_ratios(score, none.by_subject[clip]) for clip, score in report.by_subject.items()]
            )
            of_each = " / ".join(f"{100.0 * one:.0f}" for one in (ratios > _WORSE).mean(axis=0))
            any_of_them = 100.0 * (ratios > _WORSE).any(axis=1).mean()
            worse = f"{of_each}; any {any_of_them:.0f} % ({ratios.max():.2f})"
            cells = [
                _relative(getattr(report.all, of).mae_mps, getattr(none.all, of).mae_mps)
                for of in ("peak", "mean")
            ]
            rows.setdefault(_name(group), [_name(group)]).extend([*cells, worse])
    return table(rows.values())


def _ratios(score: Score, none: Score) -> list[float]:
    """Peak, mean and map error over those of no denoiser; 1 where nothing moves."""
    pairs = [
        (score.peak.mae_mps, none.peak.mae_mps),
        (score.mean.mae_mps, none.mean.mae_mps),
        (score.map.shape_l1, none.map.shape_l1),
    ]
    return [one / other if other > 0 else 1.0 for one, other in pairs]


def _walks(*evaluations: Evaluation) -> str:
    rows = {"": ["model", "exact: peak MAE m/s", "mean", "fitted: peak", "mean"]}
    for evaluation in evaluations:
        for group in evaluation.groups:
            cells = []
            for of in ("peak", "mean"):
                mine, none = (
                    np.mean([getattr(one.by_subject[walk], of).mae_mps for walk in WALKS])
                    for one in (group.reports[0], evaluation.groups[0].reports[0])
                )
                cells.append(_relative(float(mine), float(none)))
            rows.setdefault(_name(group), [_name(group)]).extend(cells)
    return table(rows.values())


# --- networks ---------------------------------------------------------------------------------


def _networks(campaign: Path) -> dict[str, Any]:
    jobs = []
    for name, how in NETWORKS.items():
        job = Job(name, campaign, ("--model", *how, *_WEIGHT))
        jobs += job.seeds(SEEDS, epochs_in(FOLDER, job, MINUTES))
    return evaluated(train(FOLDER, jobs), campaign)


def _table(evaluation: Mapping[str, Any]) -> str:
    rows = [[run_of(group), *errors_of(group)] for group in evaluation["groups"]]
    return table([["model", *ERRORS.values()], *rows])


def _leader(evaluation: Mapping[str, Any]) -> dict[str, Any]:
    """What the S4 and the best of its rivals on the map change of the peak's error, in per cent."""
    peaks = {run_of(one): one["peak_mae_mps"]["mean"] for one in evaluation["groups"]}
    best = min(("gru", "unet"), key=lambda name: peaks[name])
    changes = {name: 100.0 * (peaks[name] / peaks["none"] - 1.0) for name in ("s4", best)}
    return {"change": changes["s4"], "rival": best, "rival_change": changes[best]}


def _live_errors() -> tuple[str, str]:
    metrics = [
        load_model(FOLDER / f"s4-{seed}" / "best.safetensors").card.about["metrics"]
        for seed in range(SEEDS)
    ]
    return (
        f"{np.mean([one['validation_mae_mps'] for one in metrics]):.3f}",
        f"{np.mean([one['live_validation_mae_mps'] for one in metrics]):.3f}",
    )


# --- a real radar -----------------------------------------------------------------------------


def _mars() -> dict[str, Mapping[str, Any]]:
    sd2("pairs", "mars", *MARS, "--limbs", "--out", MARS_PAIRS)
    evaluations = {}
    for judged in read_pairs(MARS_PAIRS).subjects:
        kept = ("--validation-subjects", "none", "--test-subjects", judged)
        jobs = []
        for name, how in ON_MARS.items():
            words = ("--model", *how, *kept, *_WEIGHT, "--batch-size", "16")
            job = Job(f"mars-{judged}-{name}", MARS_PAIRS, words)
            jobs += job.seeds(SEEDS, epochs_in(FOLDER, job, MINUTES))
        runs = train(FOLDER, jobs)
        evaluations[judged] = evaluated(runs, MARS_PAIRS, "--subjects", judged)
    return evaluations


def _mars_table(evaluations: Mapping[str, Mapping[str, Any]]) -> str:
    """Errors of the filters and models for each person, side by side."""
    rows: dict[str, list[str]] = {"model": ["model"]}
    for judged, evaluation in evaluations.items():
        rows["model"] += [f"person {judged}: peak MAE m/s", "mean MAE m/s", "corr."]
        for group in evaluation["groups"]:
            name = run_of(group).removeprefix(f"mars-{judged}-")
            rows.setdefault(name, [name]).extend(
                [
                    spread(group["peak_mae_mps"]),
                    spread(group["mean_mae_mps"]),
                    spread(group["mean_correlation"], 2),
                ]
            )
    return table(rows.values())


def _gain(evaluations: Mapping[str, Mapping[str, Any]]) -> str:
    """Sentence on what the S4 gains with kinematics, against no denoising and against ridge."""
    means, peaks = [], []
    for judged, evaluation in evaluations.items():
        groups = {run_of(one).removeprefix(f"mars-{judged}-"): one for one in evaluation["groups"]}
        best = groups["s4-kinematics"]
        ratio = best["mean_mae_mps"]["mean"] / groups["none"]["mean_mae_mps"]["mean"]
        means.append(f"{100.0 * (ratio - 1.0):+.0f} % for person {judged}")
        peaks.append(best["peak_mae_mps"]["mean"] < groups["ridge"]["peak_mae_mps"]["mean"])
    return (
        f"`s4-kinematics` changes the error of the mean velocity by {', '.join(means)}; its peaks"
        f" are nearer than `ridge`'s for {sum(peaks)} of {len(peaks)} persons."
    )


Maps = list[NDArray[np.float32]]
_STRONG = 0.5
"""Quantile of the answers above which cells count."""


def texture_table(models: Mapping[str, tuple[Path, Path, str | None]]) -> str:
    """Statistics of a run's own radar and of maps drawn for it, of people it has not learnt from.

    ``models`` are a run, its pairs, and the subject judged; None: the run's test subjects. The law
    is fitted to the people that the run learnt from.
    """
    rows = [["maps", "cells that show", "dB from weak to strong", "change"]]
    for title, (run, data, judged) in models.items():
        model = load_model(run / "best.safetensors")
        known = model.card.about["subjects"]
        pairs = read_pairs(data)
        learnt = pairs.of(known["training"]).placements(first_only=True).takes
        answers = np.concatenate([_cut(_answer(model, take)) for take in learnt])
        texture = Texture.fitted(answers, np.concatenate([_cut(take.radar) for take in learnt]))
        assert texture is not None
        subjects = [judged] if judged else known["test"]
        takes = pairs.of(subjects).placements(first_only=True).takes
        counted = [n for n in range(model.card.axis.bins) if n not in model.card.null_bins]
        means = [_answer(model, take) for take in takes]
        drawn = [texture.drawn(mean, (0, number)) for number, mean in enumerate(means)]
        radar = [take.radar for take in takes]
        for name, maps in (("the radar's", radar), ("drawn", drawn), ("the mean", means)):
            statistics = _statistics(*([one[:, counted] for one in each] for each in (means, maps)))
            rows.append([f"{title}: {name}", *(f"{value:.2f}" for value in statistics)])
    return table(rows)


def _answer(model: TrainedDenoiser, take: Take) -> NDArray[np.float32]:
    return model.denoise_values(take.inputs(model.card.parts))


def _cut(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Whole segments of 72 frames, (segments, 72, bins)."""
    whole = len(values) // LENGTH * LENGTH
    return values[:whole].reshape(-1, LENGTH, values.shape[1])


def _statistics(means: Maps, maps: Maps) -> tuple[float, float, float]:
    least = np.quantile(np.concatenate(means), _STRONG)
    ratios, changes = [], []
    shown = cells = 0
    for mean, values in zip(means, maps, strict=True):
        strong = mean > max(least, 0.0)
        shown, cells = shown + int((values > 0)[strong].sum()), cells + int(strong.sum())
        known = strong & (values > 0)
        ratios.append(values[known] / mean[known])
        both = known[1:] & known[:-1]
        one, other = values[1:][both], values[:-1][both]
        changes.append(np.abs(one - other) / (one + other))
    low, high = np.quantile(np.concatenate(ratios), [0.1, 0.9])
    change = float(np.concatenate(changes).mean())
    return shown / max(cells, 1), float(10.0 * np.log10(high / low)), change


if __name__ == "__main__":
    main()
