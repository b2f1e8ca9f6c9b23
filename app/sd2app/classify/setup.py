"""Set-up of the training of a classifier: data, maps, network, steps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.classify.data import DataSource, division_of, looked_into, why_not_together
from sd2app.settings import Settings, StoredChoices
from sd2core.classify.defaults import DELAY_S, LONGEST_DELAY_S, MODELS, WIDTH, pace_kind
from sd2core.files.paths import plain_path
from sd2core.runs.pace import known_pace_s
from sd2core.train.data import Split

MAPS = ("radar", "synthetic", "denoised")
FEATURES = ("columns", "peak")
_DEFAULTS: dict[str, Any] = {
    "model": "lstm",
    "features": "columns",
    "width": WIDTH,
    "delay_s": DELAY_S,
    "maps": "radar",
    "steps": 300,
    "seed": 0,
    "quick": "yes",
}
"""Defaults of ``sd2 classify train``; ``quick`` is for a comparison."""
_DATA, _PEOPLE = "classify/train/data", "classify/train/people"
_CHOICES = {"model": MODELS, "features": FEATURES, "quick": ("yes", "no")}


class ClassSetup(QObject):
    """Choices for a classifier's training, kept from one start to the next."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self._values = StoredChoices(settings, "classify/train", _DEFAULTS, _CHOICES)
        if not 0 <= self._values["delay_s"] <= LONGEST_DELAY_S:
            self._values.set("delay_s", DELAY_S)
        people = _people(settings.stored(_PEOPLE, "{}"))
        self._data = tuple(
            DataSource(path, people.get(str(path), "")) for path in settings.paths(_DATA)
        )
        self._runner = LatestRunner("labelled data", self)
        self._runner.finished.connect(self._take)
        self.refresh()

    # --- what is chosen -------------------------------------------------------------------

    @property
    def data(self) -> tuple[DataSource, ...]:
        """Data to learn from."""
        return self._data

    @property
    def maps(self) -> tuple[str, ...]:
        """Kinds of maps to learn from."""
        chosen = str(self._values["maps"]).split(",")
        return tuple(name for name in MAPS if name in chosen)

    def value(self, name: str) -> Any:
        """One of the settings."""
        return self._values[name]

    def set_value(self, name: str, value: Any) -> None:
        """Choose a setting; KeyError if there is no such setting."""
        if self._values.set(name, value):
            self.changed.emit()

    def set_map(self, name: str, wanted: bool) -> None:
        """Add or remove a kind of maps to learn from."""
        chosen = {*self.maps, name} if wanted else set(self.maps) - {name}
        self.set_value("maps", ",".join(one for one in MAPS if one in chosen))

    def add(self, path: Path) -> None:
        """Add a source of data."""
        path = plain_path(path)
        if path.name in ("zarr.json", "recording.json"):
            path = path.parent
        if path not in [one.path for one in self._data]:
            self._keep((*self._data, DataSource(path)))
            self.refresh()

    def remove(self, path: Path) -> None:
        """Remove a source of data."""
        self._keep(tuple(one for one in self._data if one.path != path))
        self.refresh()

    def name_person(self, path: Path, name: str) -> None:
        """Name the person of a source's recordings or radar files; empty: the stored name."""
        # The command takes a person as PERSON=PATH.
        name = name.translate(str.maketrans("=/", "--")).strip()
        known = {one.path: one.person for one in self._data}
        if known.get(path, name) != name:
            named = DataSource(path, name)
            self._keep(tuple(named if one.path == path else one for one in self._data))
            self.refresh()

    def refresh(self) -> None:
        """Read the data again."""
        chosen = [(one.path, one.person) for one in self._data]
        if chosen:
            self._runner.submit(lambda emit: tuple(looked_into(*one) for one in chosen))

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    def _keep(self, data: tuple[DataSource, ...]) -> None:
        self._runner.cancel()
        self._data = data
        self._settings.set_paths(_DATA, [one.path for one in data])
        people = {str(one.path): one.person for one in data if one.person}
        self._settings.set_value(_PEOPLE, json.dumps(people))
        self.changed.emit()

    def _take(self, data: tuple[DataSource, ...]) -> None:
        self._data = data
        self.changed.emit()

    # --- what follows ---------------------------------------------------------------------

    @property
    def problem(self) -> str:
        """Reason why nothing can be started; empty when something can."""
        if not self._data:
            return "Add labelled data to learn from."
        problems = [one.problem for one in self._data if one.problem]
        if problems:
            return problems[0]
        if any(not one.facts for one in self._data):
            return "Reading the data…"
        return why_not_together(self._data)

    @property
    def train_problem(self) -> str:
        """Reason why no classifier can be trained; empty when one can."""
        if self.problem:
            return self.problem
        if not self.maps:
            return "Choose maps to learn from."
        return why_not_together(self._data, self.maps)

    @property
    def division(self) -> Split | None:
        """Division of people in a training; None until the data is known and fits together."""
        return None if self.problem else division_of(self._data)

    @property
    def step_s(self) -> float | None:
        """Seconds per step, as this machine has measured such steps; None where it has not."""
        values = self._values
        return known_pace_s(pace_kind(values["model"], values["features"], values["width"]))

    def train_arguments(self, out: Path) -> list[str]:
        """Arguments of ``sd2 classify train`` for all that differs from the defaults."""
        values = self._values
        # Network and steps are named even where they are the default: one looks for them.
        words = ["classify", "train", *self._sources]
        words += ["--model", values["model"], "--steps", f"{values['steps']}"]
        words += self._others("features", "width", "delay_s", "maps", "seed")
        return [*words, "--out", str(out)]

    def table_arguments(self, out: Path) -> list[str]:
        """Arguments of ``sd2 classify table`` for the chosen network."""
        values = self._values
        words = ["classify", "table", *self._sources, "--steps", f"{values['steps']}"]
        words += self._others("model", "features", "width", "delay_s")
        if values["quick"] == "yes":
            words.append("--quick")
        return [*words, "--out", str(out)]

    def _others(self, *names: str) -> list[str]:
        """Options for all that differs from the defaults."""
        others = self._values.others
        return [
            word
            for name in names
            if name in others
            for word in (f"--{name.replace('_', '-')}", f"{others[name]}")
        ]

    @property
    def _sources(self) -> list[str]:
        return [f"{one.person}={one.path}" if one.person else str(one.path) for one in self._data]


def _people(text: str) -> dict[str, str]:
    """Stored names of people by the paths of their sources."""
    try:
        return {str(path): str(name) for path, name in json.loads(text).items()}
    except (ValueError, AttributeError):
        return {}
