"""What a classifier is to learn: from which data and maps, with which network, for how long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.jobs.latest import LatestRunner
from sd2app.models.training_words import store_text
from sd2app.settings import Settings
from sd2core.errors import Sd2Error
from sd2core.io.kinds import RADAR_MAP_SUFFIXES, kind_of
from sd2core.pair_facts import pair_facts
from sd2core.relative_paths import plain_path

MAPS = ("radar", "synthetic", "denoised")
MODELS = ("lstm", "s4")
FEATURES = ("columns", "peak")
_DEFAULTS: dict[str, Any] = {
    "model": "lstm",
    "features": "columns",
    "maps": "radar",
    "steps": 160,
    "seed": 0,
    "quick": "yes",
}
"""Those of ``sd2 classify train``; ``quick`` is of a comparison."""
_CHOICES = {"model": MODELS, "features": FEATURES, "quick": ("yes", "no")}


@dataclass(frozen=True)
class DataSource:
    """Something labelled that was chosen.

    Parameters
    ----------
    path : Path
    text : str
        What it holds; an ellipsis while it is being looked into.
    problem : str
        Why it cannot be used.
    """

    path: Path
    text: str = "…"
    problem: str = ""


class ClassSetup(QObject):
    """The choices, kept from one start to the next."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self._values = {
            name: settings.stored(f"classify/train/{name}", default)
            for name, default in _DEFAULTS.items()
        }
        for name, known in _CHOICES.items():
            if self._values[name] not in known:
                self._values[name] = _DEFAULTS[name]
        self._data = tuple(DataSource(path) for path in settings.paths("classify/train/data"))
        self._runner = LatestRunner("labelled data", self)
        self._runner.finished.connect(self._take)
        self.refresh()

    # --- what is chosen -------------------------------------------------------------------

    @property
    def data(self) -> tuple[DataSource, ...]:
        """What is learnt from."""
        return self._data

    @property
    def maps(self) -> tuple[str, ...]:
        """Which maps of it."""
        chosen = str(self._values["maps"]).split(",")
        return tuple(name for name in MAPS if name in chosen)

    def value(self, name: str) -> Any:
        """One of the settings."""
        return self._values[name]

    def set_value(self, name: str, value: Any) -> None:
        """Choose a setting.

        Raises
        ------
        KeyError
            When there is no such setting.
        """
        kind: Callable[[Any], Any] = type(_DEFAULTS[name])
        if kind(value) != self._values[name]:
            self._values[name] = kind(value)
            self._settings.set_value(f"classify/train/{name}", kind(value))
            self.changed.emit()

    def set_map(self, name: str, wanted: bool) -> None:
        """Learn from one kind of maps, or do not."""
        chosen = {*self.maps, name} if wanted else set(self.maps) - {name}
        self.set_value("maps", ",".join(one for one in MAPS if one in chosen))

    def add(self, path: Path) -> None:
        """Learn from this as well."""
        path = plain_path(path)
        if path.name in ("zarr.json", "recording.json"):
            path = path.parent
        if path not in [one.path for one in self._data]:
            self._keep((*self._data, DataSource(path)))

    def remove(self, path: Path) -> None:
        """Do not learn from this."""
        self._keep(tuple(one for one in self._data if one.path != path))

    def refresh(self) -> None:
        """Look into the data again."""
        paths = [one.path for one in self._data]
        if paths:
            self._runner.submit(lambda emit: tuple(_looked_into(path) for path in paths))

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    def _keep(self, data: tuple[DataSource, ...]) -> None:
        self._runner.cancel()
        self._data = data
        self._settings.set_paths("classify/train/data", [one.path for one in data])
        self.refresh()
        self.changed.emit()

    def _take(self, data: tuple[DataSource, ...]) -> None:
        self._data = data
        self.changed.emit()

    # --- what follows ---------------------------------------------------------------------

    @property
    def problem(self) -> str:
        """Why nothing can be started; empty when it can."""
        if not self._data:
            return "Add labelled data to learn from."
        problems = [one.problem for one in self._data if one.problem]
        if problems:
            return problems[0]
        return "Reading the data…" if self._runner.busy else ""

    @property
    def train_problem(self) -> str:
        """Why no classifier can be trained; empty when one can."""
        return self.problem or ("" if self.maps else "Choose maps to learn from.")

    def train_arguments(self, out: Path) -> list[str]:
        """``sd2 classify train`` with what is not as it is by default."""
        values = self._values
        # Network and steps are named even where they are the default: one looks for them.
        words = ["classify", "train", *map(str, self._paths)]
        words += ["--model", values["model"], "--steps", f"{values['steps']}"]
        for name in ("features", "maps", "seed"):
            if values[name] != _DEFAULTS[name]:
                words += [f"--{name}", f"{values[name]}"]
        return [*words, "--out", str(out)]

    def table_arguments(self, out: Path) -> list[str]:
        """``sd2 classify table`` with the network that is chosen."""
        values = self._values
        words = ["classify", "table", *map(str, self._paths), "--steps", f"{values['steps']}"]
        for name in ("model", "features"):
            if values[name] != _DEFAULTS[name]:
                words += [f"--{name}", f"{values[name]}"]
        if values["quick"] == "yes":
            words.append("--quick")
        return [*words, "--out", str(out)]

    @property
    def _paths(self) -> tuple[Path, ...]:
        return tuple(one.path for one in self._data)


def _looked_into(path: Path) -> DataSource:
    """What something holds, as far as that is told without reading it all."""
    try:
        if path.is_dir() and path.suffix not in (".sd2", ".zarr"):
            inside = sorted(
                one
                for one in path.iterdir()
                if one.suffix == ".sd2" or one.suffix.lower() in RADAR_MAP_SUFFIXES
            )
            if inside:
                return DataSource(path, f"folder with {len(inside)} recordings or radar files")
        kind = kind_of(path)
        if kind == "pairs":
            return DataSource(path, store_text(pair_facts(path)))
        if kind == "recording" or path.suffix.lower() in RADAR_MAP_SUFFIXES:
            return DataSource(path, "recording" if kind == "recording" else "radar file")
        raise Sd2Error(f"{path.name} is a {kind}", "pairs, labelled recordings or radar files")
    except (Sd2Error, OSError) as error:
        return DataSource(path, problem=str(error))
