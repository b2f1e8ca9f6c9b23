"""Set-up of a training run: pairs, kind of model, settings, and the estimated time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject

from sd2app.background.runs import RunSetup, Source
from sd2app.settings import Settings, StoredChoices
from sd2app.widgets.text import counted, duration_text
from sd2core.denoise.card import PARTS_OF, ModelCard
from sd2core.denoise.files import available_models
from sd2core.denoise.registry import is_network
from sd2core.denoise.resample_to_model import is_same_rate
from sd2core.errors import Sd2Error
from sd2core.options.training import (
    DataConfig,
    MachineConfig,
    ModelConfig,
    TrainConfig,
    TrainingConfig,
)
from sd2core.pairs.summary import PairFacts, names_together, pair_facts
from sd2core.runs.pace import known_pace_s
from sd2core.train.data import Split, split_subjects

INPUTS = ("map", "limbs", "kinematics")
_DATA = DataConfig(pairs=(Path(),))
_PAIRS, _KNOWN = "training/pairs", "training/known_pairs"
_MAX_KNOWN = 10
_DEFAULTS: dict[str, str | int | float] = {
    "model": "s4",
    "inputs": "map",
    "start": "",
    "epochs": TrainingConfig().epochs,
    "batch_size": TrainingConfig().batch_size,
    "learning_rate": TrainingConfig().learning_rate,
    "early_stopping_epochs": 100,
    "range_factor": 1.0,
    "seed": TrainingConfig().seed,
}
"""Defaults, from the paper where it has them; 0 epochs of patience: no early stopping; no start: a
new model."""


@dataclass(frozen=True)
class Store(Source):
    """A chosen store of pairs."""

    facts: PairFacts | None = None  # None until it has been read, and if it cannot be

    @property
    def text(self) -> str:
        """Content in words; an ellipsis while that is not known."""
        facts = self.facts
        if facts is None:
            return "…"
        parts = [
            facts.kind,
            counted(len(facts.subjects), "person", "people"),
            duration_text(facts.duration_s),
        ]
        if facts.placements > 1:
            parts.append(f"{facts.placements} placements")
        return " · ".join(parts)


class TrainingSetupModel(RunSetup[Store]):
    """Pairs and settings for a denoiser."""

    kind = Store

    def __init__(self, settings: Settings, parent: QObject) -> None:
        self.starts = {card.name: card for card in available_models() if is_network(card.model)}
        known = {"inputs": INPUTS, "start": ("", *self.starts)}
        values = StoredChoices(settings, "training", _DEFAULTS, known)
        if not is_network(values["model"]):
            values.set("model", _DEFAULTS["model"])
        stores = [Store(path) for path in settings.paths(_PAIRS)]
        super().__init__(settings, values, _PAIRS, stores, parent)

    def look_into(self, source: Store) -> Store:
        """Read what a store of pairs holds."""
        try:
            return Store(source.path, pair_facts(source.path))
        except (Sd2Error, OSError) as error:
            return Store(source.path, problem=str(error))

    def keep(self, data: tuple[Store, ...]) -> None:
        """Learn from these pairs, and remember them, also after they are removed."""
        known = [*(store.path for store in reversed(data)), *self._settings.paths(_KNOWN)]
        self._settings.set_paths(_KNOWN, list(dict.fromkeys(known))[:_MAX_KNOWN])
        super().keep(data)

    @property
    def known(self) -> list[Path]:
        """Pairs that were chosen before."""
        chosen = {store.path for store in self.data}
        return [path for path in self._settings.paths(_KNOWN) if path not in chosen]

    @property
    def differs(self) -> bool:
        """True if a setting, the kind of model apart, differs from the paper's."""
        return bool(self._values.others.keys() - {"model"})

    def reset(self) -> None:
        """Restore the defaults of all settings but the kind of model."""
        for name, default in _DEFAULTS.items():
            if name != "model":
                self.set_value(name, default)

    # --- what follows ---------------------------------------------------------------------

    @property
    def problem(self) -> str:
        """Reason why it cannot be started; empty when it can."""
        if problem := self.data_problem("Add pairs to learn from."):
            return problem
        facts = [store.facts for store in self.data if store.facts is not None]
        if len(facts) < len(self.data):
            return "Reading the pairs…"
        if len({(one.bins, one.v_max_mps) for one in facts}) > 1 or not all(
            is_same_rate(facts[0].frame_rate_hz, one.frame_rate_hz) for one in facts
        ):
            return (
                "These pairs differ in their velocity axis or frame rate. Choose pairs of one kind."
            )
        if self.parts and not all(one.has_limbs for one in facts):
            return "Some of these pairs are not split by the parts of the body. Learn from the map."
        if not self.segments:
            return "Every take is shorter than one segment of 72 frames."
        return ""

    @property
    def start(self) -> ModelCard | None:
        """Model to go on from; None: a new one."""
        return self.starts.get(self._values["start"])

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the body whose maps, or motion, are the input."""
        start = self.start
        return PARTS_OF[self._values["inputs"]] if start is None else start.parts

    @property
    def config(self) -> TrainConfig:
        """Configuration in the form that the library takes; Sd2Error if it cannot be started."""
        if self.problem:
            raise Sd2Error(self.problem)
        return self._config(tuple(store.path for store in self.data))

    def _config(self, pairs: tuple[Path, ...]) -> TrainConfig:
        values = self._values
        return TrainConfig(
            DataConfig(pairs=pairs, range_factor=values["range_factor"]),
            ModelConfig(name=values["model"], inputs=values["inputs"])
            if self.start is None
            else ModelConfig(start=self.start.path),
            TrainingConfig(
                batch_size=values["batch_size"],
                epochs=values["epochs"],
                learning_rate=values["learning_rate"],
                early_stopping_epochs=values["early_stopping_epochs"],
                seed=values["seed"],
            ),
            MachineConfig(threads=1, nice=10),
        )

    @property
    def steps(self) -> int:
        """Number of training steps."""
        return -(-self.segments // self._values["batch_size"]) * self._values["epochs"]

    @property
    def step_s(self) -> float | None:
        """Seconds per step, as this machine has measured such steps; None where it has not."""
        return known_pace_s(self._config(_DATA.pairs).pace_kind)

    @property
    def division(self) -> Split | None:
        """Division of people into training and held-out parts; None until the pairs are known."""
        people = dict.fromkeys(name for name, _, _ in self._people())  # several stores may have one
        return split_subjects(list(people)) if people else None

    def _people(self) -> list[tuple[str, PairFacts, str]]:
        """All people as the library names them, with store and name in it."""
        known = [store.facts for store in self.data if store.facts is not None]
        return [
            (name, facts, subject)
            for facts, names in zip(known, names_together(known), strict=True)
            for subject, name in names.items()
        ]

    @property
    def segments(self) -> int:
        """Number of training segments per epoch."""
        division = self.division
        if division is None:
            return 0
        count = sum(
            facts.segments(subject, _DATA.segment_frames, _DATA.overlap_frames)
            for name, facts, subject in self._people()
            if name in division.training
        )
        return round(0.8 * count) if division.by_take else count
