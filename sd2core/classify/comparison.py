"""Comparison of many trainings: run the missing ones and collect the results."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import Clip, ClipSet, seen_first
from sd2core.classify.experiment import (
    PAPER,
    RADAR,
    Added,
    Condition,
    Denoise,
    Network,
    choose,
    counts_of,
    digest,
    has_synthetic,
)
from sd2core.classify.live import judge
from sd2core.classify.metrics import Score
from sd2core.classify.training import TrainOptions, train
from sd2core.denoise import resample_to_model as matching
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import parameter_count
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_json
from sd2core.progress import Progress, silent

FORMAT = "sd2-classifier-run"
VERSION = 3

SHARES = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0)
"""Of the real data, for the learning curve."""
QUICK_SHARES = (0.1, 1.0)


@dataclass(frozen=True)
class TableOptions:
    """Options of a comparison: its trainings."""

    seeds: int = 5  # each is another split of people, another draw and another network
    shares: tuple[float, ...] = SHARES  # of the learning curve, ascending, up to 1
    network: Network = field(default_factory=Network)
    """Network of all trainings but those that compare networks."""
    others: tuple[Network, ...] = (
        PAPER,
        replace(PAPER, features="columns"),
        Network(delay_s=0.0),
        Network("s4"),
        Network("kernel", delay_s=0.9),
    )
    training: TrainOptions = field(default_factory=TrainOptions)
    """Equal for all; its network and its seed are ignored."""
    same_people: bool = False
    """Whether other movements of the people trained on are judged, instead of other people's."""

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise Sd2Error(f"{self.seeds} seeds", "at least one")
        if not self.shares or not all(0 < share <= 1 for share in self.shares):
            raise Sd2Error(f"The shares are {self.shares}", "one or more, above 0 and up to 1")


@dataclass(frozen=True, eq=False)
class Run:
    """One training and its score."""

    condition: Condition
    seed: int
    subjects: tuple[str, ...]  # of the test
    real: dict[str, int]  # training frames per class
    added: dict[str, int]  # training frames per class
    score: Score  # on maps of each movement's own sensor
    moved: Score | None  # on maps of other placements, where there are any
    parameters: int
    cpu_s: float  # of the training alone

    def to_json(self) -> dict[str, Any]:
        """Return the content of a run's file."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "condition": asdict(self.condition),
            "seed": self.seed,
            "subjects": list(self.subjects),
            "real": self.real,
            "added": self.added,
            "score": self.score.to_json(),
            "moved": None if self.moved is None else self.moved.to_json(),
            "parameters": self.parameters,
            "cpu_s": self.cpu_s,
        }

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Run:
        """Parse :meth:`to_json`; raises KeyError, TypeError or ValueError."""
        if content["format"] != FORMAT or content["version"] != VERSION:
            raise ValueError(f"format {content['format']!r} version {content['version']!r}")
        return cls(
            Condition.from_json(content["condition"]),
            int(content["seed"]),
            tuple(content["subjects"]),
            dict(content["real"]),
            dict(content["added"]),
            Score.from_json(content["score"]),
            None if content["moved"] is None else Score.from_json(content["moved"]),
            int(content["parameters"]),
            float(content["cpu_s"]),
        )


@dataclass(frozen=True, eq=False)
class Table:
    """All runs of a comparison."""

    classes: tuple[str, ...]
    kind: str  # "simulated" or "real": the radar
    options: TableOptions
    runs: tuple[Run, ...]
    by_movement: bool  # True with one subject or the same people: nothing is said about others

    def of(self, condition: Condition) -> tuple[Run, ...]:
        """Return the runs of one condition, by seed."""
        return tuple(run for run in self.runs if run.condition == condition)

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Conditions in the order of their first runs."""
        return tuple(dict.fromkeys(run.condition for run in self.runs))


def conditions_of(known: ClipSet, options: TableOptions, denoised: bool) -> list[Condition]:
    """Return the conditions to train, each once; ``denoised`` if there is a denoiser."""
    base = Condition(network=options.network)
    found = [replace(base, network=other) for other in options.others]
    found.append(base)
    added: list[Added] = []
    if has_synthetic(known):
        added = ["synthetic", "denoised"] if denoised else ["synthetic"]
        places = (False,) if all(map(seen_first(known.clips), known.clips)) else (False, True)
        found += [replace(base, added=one, moved=moved) for one in added for moved in places]
        # What added maps are at best.
        found.append(replace(base, added="radar"))
    for share in options.shares:
        found.append(replace(base, share=share))
        found += [replace(base, share=share, added=one) for one in added]
    return list(dict.fromkeys(found))


def make_table(
    folder: Path,
    known: ClipSet,
    options: TableOptions,
    denoiser: TrainedDenoiser | None = None,
    progress: Progress = silent,
    conditions: Sequence[Condition] = (),
) -> Table:
    """Train the missing runs and read the others from ``folder``, one small file per run.

    Files of other data or settings are ignored. ``known`` holds the radar's and the
    synthetic maps; progress counts runs. The conditions are those of :func:`conditions_of` by
    default.
    """
    folder.mkdir(parents=True, exist_ok=True)
    conditions = conditions or conditions_of(known, options, denoiser is not None)
    wanted = [(one, seed) for seed in range(options.seeds) for one in conditions]
    data = digest(known)
    denoise = _denoising(known, denoiser)
    runs: list[Run] = []
    by_movement = options.same_people or len(known.subjects) < 2
    for done, (condition, seed) in enumerate(wanted):
        progress(done, len(wanted))
        path = folder / f"{_key(data, denoiser, condition, seed, options)}.json"
        run = _read(path)
        if run is None:
            run = run_one(known, condition, seed, options, denoise)
            atomic_write_text(path, json.dumps(run.to_json()) + "\n")
        runs.append(run)
    progress(len(wanted), len(wanted))
    kinds = [kind for kind in known.kinds if kind in RADAR]
    return Table(
        known.classes,
        "simulated" if "simulated" in kinds else "real",
        options,
        tuple(runs),
        by_movement,
    )


def run_one(
    known: ClipSet, condition: Condition, seed: int, table: TableOptions, denoise: Denoise
) -> Run:
    """Train once and score the result."""
    chosen = choose(known, condition, seed, denoise, same_people=table.same_people)
    options = condition.network.of(table.training, seed)
    begun_s = time.process_time()
    made = train([*chosen.real, *chosen.added], chosen.validation, known, options)
    if made.interrupted:
        raise KeyboardInterrupt
    cpu_s = time.process_time() - begun_s
    return Run(
        condition,
        seed,
        tuple(dict.fromkeys(clip.subject for clip in chosen.test)),
        counts_of(chosen.real, known),
        counts_of(chosen.added, known),
        judge(made.classifier, chosen.test, known),
        judge(made.classifier, chosen.moved, known) if chosen.moved else None,
        parameter_count(made.classifier.network),
        cpu_s,
    )


def gains(table: Table, condition: Condition, of: Callable[[Run], float]) -> NDArray[np.float64]:
    """Return the gain of every run over the one of the same seed and share with nothing added."""
    plain = {run.seed: run for run in table.of(replace(condition, added="nothing", moved=False))}
    return np.array([of(run) - of(plain[run.seed]) for run in table.of(condition)])


def fits(known: ClipSet, denoiser: TrainedDenoiser) -> bool:
    """Tell if a denoiser is made for such maps, which are not split by the parts of the body."""
    card = denoiser.card
    return (
        not card.parts
        and card.axis == known.axis
        and set(known.null_bins) <= set(card.null_bins)
        and abs(known.frame_rate_hz / card.frame_rate_hz - 1.0) <= matching.SAME_RATE
    )


def _denoising(known: ClipSet, denoiser: TrainedDenoiser | None) -> Denoise:
    """Return a function that denoises every clip once."""
    kept: dict[tuple[str, str, int], Clip] = {}

    def denoise(clip: Clip) -> Clip:
        if denoiser is None:
            raise Sd2Error("There is no denoiser", "one, to add denoised maps")
        key = (*clip.key, clip.placement)
        if key not in kept:
            kept[key] = replace(
                clip, kind="denoised", energies=denoiser.denoise_values(clip.energies)
            )
        return kept[key]

    return denoise


def _key(
    data: str,
    denoiser: TrainedDenoiser | None,
    condition: Condition,
    seed: int,
    options: TableOptions,
) -> str:
    """Hash of all that a run depends on."""
    model = ""
    if denoiser is not None and condition.added == "denoised":
        sums = hashlib.blake2b(digest_size=16)
        for tensor in denoiser.network.state_dict().values():
            sums.update(np.ascontiguousarray(tensor.cpu().numpy()).data)
        model = sums.hexdigest()
    training = condition.network.of(options.training, seed)
    told = [VERSION, data, model, asdict(condition), seed, training.to_json()]
    told += ["same people"] if options.same_people else []
    return hashlib.blake2b(json.dumps(told).encode(), digest_size=12).hexdigest()


def _read(path: Path) -> Run | None:
    """Read a run; None where it is missing or damaged."""
    try:
        return Run.from_json(read_json(path))
    except (ValueError, KeyError, TypeError, Sd2Error):
        return None
