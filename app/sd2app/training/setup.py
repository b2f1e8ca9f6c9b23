"""Set-up of a training run: pairs, kind of model, settings, and the estimated time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.settings import Settings, StoredChoices
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.pairs.summary import PairFacts, pair_facts
from sd2core.runs.pace import known_pace_s
from sd2core.train.config import (
    DataConfig,
    MachineConfig,
    ModelConfig,
    TrainConfig,
    TrainingConfig,
)
from sd2core.train.data import Split, split_subjects

MODELS = ("s4", "s4d", "gru", "unet", "swin", "s4-serial")
_DATA = DataConfig(pairs=(Path(),))
_DEFAULTS: dict[str, str | int | float] = {
    "model": "s4",
    "epochs": TrainingConfig().epochs,
    "batch_size": TrainingConfig().batch_size,
    "learning_rate": TrainingConfig().learning_rate,
    "early_stopping_epochs": 0,
    "range_factor": 1.0,
    "seed": TrainingConfig().seed,
}
"""Defaults, from the paper where it has them; 0 epochs of patience: no early stopping."""


@dataclass(frozen=True)
class Store:
    """A chosen store of pairs."""

    path: Path
    facts: PairFacts | None = None  # None until it has been read, and if it cannot be
    problem: str = ""  # why it cannot be used


@dataclass(frozen=True)
class Estimate:
    """Size of a run, and its time as far as this machine has measured such steps."""

    segments: int  # training segments per epoch
    steps: int
    step_s: float | None  # None until a run of the kind has measured it


class TrainingSetupModel(QObject):
    """Choices for a training, kept from one start to the next."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self._values = StoredChoices(settings, "training", _DEFAULTS, {"model": MODELS})
        self._stores: tuple[Store, ...] = tuple(
            Store(path) for path in settings.paths("training/pairs")
        )
        self._runner = LatestRunner("pairs", self)
        self._runner.finished.connect(self._take)
        self._read()

    # --- what is chosen -------------------------------------------------------------------

    @property
    def stores(self) -> tuple[Store, ...]:
        """Stores of pairs to learn from."""
        return self._stores

    @property
    def reading(self) -> bool:
        """True while a store has not been read."""
        return self._runner.busy

    @property
    def known_stores(self) -> list[Path]:
        """Stores that were chosen before."""
        chosen = {store.path for store in self._stores}
        return [path for path in self._settings.paths("training/known_pairs") if path not in chosen]

    def value(self, name: str) -> Any:
        """One of the settings."""
        return self._values[name]

    @property
    def differs(self) -> bool:
        """True if a setting, the kind of model apart, differs from the paper's."""
        return bool(self._values.others.keys() - {"model"})

    def set_value(self, name: str, value: Any) -> None:
        """Choose a setting; KeyError if there is no such setting."""
        if self._values.set(name, value):
            self.changed.emit()

    def reset(self) -> None:
        """Restore the defaults of all settings but the kind of model."""
        for name, default in _DEFAULTS.items():
            if name != "model":
                self.set_value(name, default)

    def add_store(self, path: Path) -> None:
        """Add a store of pairs."""
        path = plain_path(path)
        if path.name == "zarr.json":
            path = path.parent
        if path not in [store.path for store in self._stores]:
            self._stores = (*self._stores, Store(path))
            known = [path, *(one for one in self._settings.paths("training/known_pairs"))]
            self._settings.set_paths("training/known_pairs", list(dict.fromkeys(known))[:10])
            self._keep_stores()

    def remove_store(self, path: Path) -> None:
        """Remove a store of pairs."""
        self._stores = tuple(store for store in self._stores if store.path != path)
        self._keep_stores()

    def _keep_stores(self) -> None:
        self._settings.set_paths("training/pairs", [store.path for store in self._stores])
        self._read()
        self.changed.emit()

    def refresh(self) -> None:
        """Read the stores again: a campaign grows while it is being made."""
        self._read()

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    # --- what follows ---------------------------------------------------------------------

    @property
    def problem(self) -> str:
        """Reason why it cannot be started; empty when it can."""
        if not self._stores:
            return "Add pairs to learn from."
        problems = [store.problem for store in self._stores if store.problem]
        if problems:
            return problems[0]
        facts = [store.facts for store in self._stores if store.facts is not None]
        if len(facts) < len(self._stores):
            return "Reading the pairs…"
        if len({(one.bins, one.v_max_mps, one.frame_rate_hz) for one in facts}) > 1:
            return (
                "These pairs differ in their velocity axis or frame rate. Choose pairs of one kind."
            )
        division = self.division
        if division is not None and division.by_take and not any(one.divisible for one in facts):
            return "All of it is one take. Add another to choose the best model by."
        if not self._segments():
            return "Every take is shorter than one segment of 72 frames."
        return ""

    @property
    def config(self) -> TrainConfig:
        """Configuration in the form that the library takes; Sd2Error if it cannot be started."""
        if self.problem:
            raise Sd2Error(self.problem)
        return self._config(tuple(store.path for store in self._stores))

    def _config(self, pairs: tuple[Path, ...]) -> TrainConfig:
        values = self._values
        return TrainConfig(
            DataConfig(pairs=pairs, range_factor=values["range_factor"]),
            ModelConfig(name=values["model"]),
            TrainingConfig(
                batch_size=values["batch_size"],
                epochs=values["epochs"],
                learning_rate=values["learning_rate"],
                early_stopping_epochs=values["early_stopping_epochs"] or None,
                seed=values["seed"],
            ),
            MachineConfig(threads=1, nice=10),
        )

    @property
    def estimate(self) -> Estimate:
        """Size and time of the run."""
        segments = self._segments()
        steps = -(-segments // self._values["batch_size"]) * self._values["epochs"]
        return Estimate(segments, steps, known_pace_s(self._config(_DATA.pairs).pace_kind))

    @property
    def division(self) -> Split | None:
        """Division of people into training and held-out parts; None until the pairs are known."""
        people = self._people()
        return split_subjects([name for name, _, _ in people]) if people else None

    def _people(self) -> list[tuple[str, PairFacts, str]]:
        """All people as the library names them, with store and name in it."""
        found = [store.facts for store in self._stores if store.facts is not None]
        names = [subject for facts in found for subject in facts.subjects]
        return [
            (
                f"{facts.path.stem}:{subject}" if names.count(subject) > 1 else subject,
                facts,
                subject,
            )
            for facts in found
            for subject in facts.subjects
        ]

    def _segments(self) -> int:
        """Number of training segments."""
        division = self.division
        if division is None:
            return 0
        count = sum(
            facts.segments([subject], _DATA.segment_frames, _DATA.overlap_frames)
            for name, facts, subject in self._people()
            if name in division.training
        )
        return round(0.8 * count) if division.by_take else count

    # --- reading --------------------------------------------------------------------------

    def _read(self) -> None:
        paths = [store.path for store in self._stores]
        if paths:
            self._runner.submit(lambda emit: [_looked_into(path) for path in paths])

    def _take(self, stores: list[Store]) -> None:
        self._stores = tuple(stores)
        self.changed.emit()


def _looked_into(path: Path) -> Store:
    try:
        return Store(path, pair_facts(path))
    except (Sd2Error, OSError) as error:
        return Store(path, problem=str(error))
