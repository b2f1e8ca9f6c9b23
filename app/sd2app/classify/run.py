"""Trainings of classifiers: what is set up, their monitor, and what they told."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import CommandRun
from sd2app.background.runs import Runs, RunSetup, Source, free_folder
from sd2app.settings import Settings, StoredChoices
from sd2app.training.run import StepHistory
from sd2app.widgets.text import counted, duration_text, quoted
from sd2core.classify.defaults import CLASSIFIERS, DELAYS_S, FeatureKind, pace_kind
from sd2core.classify.files import user_classifiers_folder
from sd2core.cli.classify.comparison import Table
from sd2core.cli.classify.train import Train
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.options.records import words_of
from sd2core.runs.command_folder import COMMAND_IN_FOLDER
from sd2core.runs.pace import known_pace_s

if TYPE_CHECKING:
    # Imported where it is used: it takes long to load, and the window starts without.
    from sd2core.datasets.labelled import LabelledFacts
    from sd2core.train.data import Split


MAPS = ("radar", "synthetic", "denoised")
_NETWORK = ("model", "features", "width", "delay_s")
_DEFAULTS = {name: getattr(Train, name) for name in (*_NETWORK, "maps", "seed")} | {"steps": 300}
"""Defaults of ``sd2 classify train``."""
_DATA, _PEOPLE = "classify/train/data", "classify/train/people"


@dataclass(frozen=True)
class DataSource(Source):
    """A labelled recording, radar file, data set or folder that was chosen."""

    person: str = ""  # empty where the user has named no one
    facts: tuple[LabelledFacts, ...] = ()  # of all that a folder holds; empty until read

    @property
    def nameable(self) -> bool:
        """True if the user can name its person: pairs and data sets name theirs."""
        return any(one.kind in ("recording", "radar file") for one in self.facts)

    @property
    def people(self) -> tuple[str, ...]:
        """People in it."""
        from sd2core.datasets.labelled import people_of

        return people_of(self.facts)

    @property
    def text(self) -> str:
        """Content in words; an ellipsis while that is not known."""
        if not self.facts:
            return "…"
        parts = [_what(self.facts)]
        if not self.nameable or len(self.people) > 1:
            parts.append(counted(len(self.people), "person", "people"))
        spans = sum(one.spans for one in self.facts)
        if spans:
            parts.append(counted(spans, "label"))
        known_s = [one.duration_s for one in self.facts if one.duration_s is not None]
        if len(known_s) == len(self.facts):
            parts.append(duration_text(sum(known_s)))
        placements = max(one.placements for one in self.facts)
        if placements > 1:
            parts.append(f"{placements} placements")
        maps = [name for name in ("synthetic", "denoised", "radar") if self.has(name)]
        if len(maps) < 3:
            parts.append(f"{' and '.join(maps) or 'no'} maps")
        return " · ".join(parts)

    def has(self, name: str) -> bool:
        """True if all of it has maps of a kind, or they can be computed."""
        return all(name in one.maps for one in self.facts)


class ClassSetup(RunSetup[DataSource]):
    """Labelled data and settings for a classifier."""

    kind = DataSource

    def __init__(self, settings: Settings, parent: QObject) -> None:
        known: dict[str, Container[Any]] = {
            "features": get_args(FeatureKind), "model": CLASSIFIERS, "delay_s": DELAYS_S
        }  # fmt: skip
        values = StoredChoices(settings, "classify/train", _DEFAULTS, known)
        people = settings.table(_PEOPLE)
        data = [DataSource(path, str(people.get(str(path), ""))) for path in settings.paths(_DATA)]
        self._told: tuple[object, list[LabelledFacts]] = None, []
        super().__init__(settings, values, _DATA, data, parent)

    def look_into(self, source: DataSource) -> DataSource:
        """Read the content of a source of data."""
        from sd2core.datasets.labelled import labelled_facts, unfolded

        path, person = source.path, source.person
        try:
            facts = tuple(map(labelled_facts, unfolded([LabelledSource(path, person)])))
        except (Sd2Error, OSError) as error:
            return DataSource(path, person, problem=str(error))
        # A name that was given before is no reason to refuse those that state it themselves.
        named = all(one.kind in ("pairs", "data set") for one in facts)
        return DataSource(path, "" if named else person, facts)

    def keep(self, data: tuple[DataSource, ...]) -> None:
        """Learn from this data, and remember it with its people."""
        people = {str(one.path): one.person for one in data if one.person}
        self._settings.keep_table(_PEOPLE, people)
        super().keep(data)

    @property
    def maps(self) -> tuple[str, ...]:
        """Kinds of maps to learn from."""
        chosen = str(self._values["maps"]).split(",")
        return tuple(name for name in MAPS if name in chosen)

    def set_map(self, name: str, wanted: bool) -> None:
        """Add or remove a kind of maps to learn from."""
        chosen = {*self.maps, name} if wanted else set(self.maps) - {name}
        self.set_value("maps", ",".join(one for one in MAPS if one in chosen))

    def name_person(self, path: Path, name: str) -> None:
        """Name the person of a source's recordings or radar files; empty: the stored name."""
        # The command takes a person as PERSON=PATH.
        name = name.translate(str.maketrans("=/", "--")).strip()
        known = {one.path: one.person for one in self.data}
        if known.get(path, name) != name:
            named = DataSource(path, name)
            self.keep(tuple(named if one.path == path else one for one in self.data))

    @property
    def problem(self) -> str:
        """Reason why nothing can be started; empty when something can."""
        if problem := self.data_problem("Add labelled data to learn from."):
            return problem
        if any(not one.facts for one in self.data):
            return "Reading the data…"
        return self._why_not_together()

    @property
    def train_problem(self) -> str:
        """Reason why no classifier can be trained; empty when one can."""
        if self.problem:
            return self.problem
        if not self.maps:
            return "Choose maps to learn from."
        return self._why_not_together(self.maps)

    @property
    def division(self) -> Split | None:
        """Division of people in a training; None until the data is known and fits together."""
        return None if self.problem else division_of(self._together())

    def _why_not_together(self, maps: Sequence[str] = ()) -> str:
        """Reason why these sources cannot be mixed with these maps; empty when they can."""
        for source in self.data:
            for name in maps:
                if not source.has(name):
                    return f"{source.path.name} has no {name} maps: choose others, or leave it out."
        grids = {one.grid for source in self.data for one in source.facts if one.grid is not None}
        if len(grids) > 1:
            return (
                "These differ in their velocity axis or frame rate: "
                + "; ".join(
                    f"{grid.bins} bins up to ±{grid.v_max_mps:g} m/s at {grid.frame_rate_hz:.4g}"
                    " frames/s"
                    for grid in sorted(grids)
                )
                + ". Choose data of one kind."
            )
        try:
            division_of(self._together())
        except Sd2Error as error:
            return str(error)
        return ""

    def _together(self) -> list[LabelledFacts]:
        """Facts of all data, found once for the same data: folders and files are looked into."""
        if self._told[0] is not self.data:
            self._told = self.data, _told_apart(self.data)
        return self._told[1]

    @property
    def step_s(self) -> float | None:
        """Seconds per step, as this machine has measured such steps; None where it has not."""
        values = self._values
        return known_pace_s(pace_kind(values["model"], values["features"], values["width"]))

    def train_arguments(self, out: Path) -> list[str]:
        """Words of ``sd2 classify train`` for all that differs from the defaults."""
        values = self._values
        command = Train(
            data=self._sources, out=out, maps=values["maps"], seed=values["seed"], **self._network
        )
        # Named even where they are the default: one looks for them.
        return words_of("classify train", command, ("model", "steps"))

    def table(self, out: Path, **switches: Any) -> list[str]:
        """Words of ``sd2 classify table`` for the data, the network and what is switched on."""
        command = Table(data=self._sources, out=out, **self._network, **switches)
        return words_of("classify table", command, ("steps",))

    @property
    def _network(self) -> dict[str, Any]:
        return {name: self._values[name] for name in (*_NETWORK, "steps")}

    @property
    def _sources(self) -> tuple[LabelledSource, ...]:
        return tuple(LabelledSource(one.path, one.person) for one in self.data)


def division_of(facts: Sequence[LabelledFacts]) -> Split | None:
    """Division of people into training, validation and test; None where there are no people.

    Like ``sd2 classify train``: where there is nothing but data sets, they state it themselves.
    Raises Sd2Error if data sets contradict each other.
    """
    from sd2core.datasets.labelled import people_of
    from sd2core.train.data import split_subjects

    people = people_of(facts)
    if not people:
        return None
    validation: list[str] = []
    test: list[str] = []
    if all(one.kind == "data set" for one in facts):
        for one in facts:
            validation += one.splits.get("validation", ())
            test += one.splits.get("test", ())
    return split_subjects(people, validation or None, test or None)


def _told_apart(data: Sequence[DataSource]) -> list[LabelledFacts]:
    """Facts of sources, whose people are called as the command calls them that takes all."""
    from sd2core.datasets.labelled import labelled_facts, unfolded

    known = {one.path: one for source in data for one in source.facts}
    sources = unfolded([LabelledSource(one.path, one.person) for one in data if one.facts])
    return [
        facts
        if (facts := known.get(one.path)) and one.subject in ("", facts.subjects[0])
        else labelled_facts(one)
        for one in sources
    ]


def _what(facts: Sequence[LabelledFacts]) -> str:
    """Short text such as ``simulated pairs`` or ``3 recordings``."""
    kinds = {one.kind for one in facts}
    if len(facts) > 1:
        words = {"recording": "recordings", "radar file": "radar files", "data set": "data sets"}
        kind = next(iter(kinds)) if len(kinds) == 1 else ""
        what = f"{len(facts)} {words.get(kind, 'recordings and radar files')}"
    else:
        what = facts[0].kind
    return f"{what} (simulated)" if any(one.simulated for one in facts) else what


MODEL_NAME = "classifier.safetensors"


class CheckPoint(NamedTuple):
    """Mean recall over classes, on the people held out to select the best model."""

    step: int
    recall: float
    best: bool


class ClassHistory(StepHistory):
    """Steps and checks of a training."""

    def __init__(self) -> None:
        super().__init__()
        self.losses: list[tuple[int, float]] = []  # steps, and cross entropy of their batches
        self.checks: list[CheckPoint] = []

    @property
    def best(self) -> CheckPoint | None:
        """The best check so far."""
        return next((check for check in reversed(self.checks) if check.best), None)

    def _take_start(self, event: dict[str, Any]) -> None:
        self.total, self.begun = int(event["steps"]), True

    def _take_step(self, event: dict[str, Any]) -> None:
        step, loss = int(event["step"]), float(event["loss"])
        self._advance(step, float(event["elapsed_s"]))
        if math.isfinite(loss):
            self.losses.append((step, loss))

    def _take_check(self, event: dict[str, Any]) -> None:
        step, recall = int(event["step"]), float(event["validation_mean_recall"])
        best = self.best
        self.checks.append(CheckPoint(step, recall, best is None or recall > best.recall))

    def _take_end(self, event: dict[str, Any]) -> None:
        self.saving = True


class ClassRun(CommandRun):
    """A training."""

    histories = ClassHistory
    history: ClassHistory
    result_name = MODEL_NAME


class ClassTraining(Runs[ClassRun]):
    """Trainings of classifiers, one under way at a time.

    ``use`` classifies with a file. ``folder`` is that of the classifiers, with the runs in
    ``runs`` below it. ``command`` is the program that runs ``sd2`` commands in a folder.
    """

    monitor, remembered = ClassRun, "classify/train/run"

    def __init__(
        self,
        settings: Settings,
        use: Callable[[Path], None],
        parent: QObject,
        folder: Path | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        self._classifiers = folder or user_classifiers_folder()
        super().__init__(settings, self._classifiers / "runs", parent, command)
        self._use = use
        self.setup = ClassSetup(settings, self)
        self.setup.changed.connect(self.changed)
        self._used: Path | None = None

    @property
    def in_use(self) -> bool:
        """True if the model of the run in view is in use."""
        return self.run is not None and self._used == self.run.path

    @property
    def why_not_train(self) -> str:
        """Reason why no classifier can be trained; empty when one can."""
        return self.busy or self.setup.train_problem

    @property
    def command(self) -> str:
        """Command for a terminal that does what is set up."""
        return quoted(self.setup.train_arguments(Path(MODEL_NAME)))

    def name_of(self, path: Path, about: Mapping[str, Any]) -> str:
        """Name of such a run, the same for all."""
        return "Training"

    def train(self) -> None:
        """Begin as set up; Sd2Error if it cannot start, OSError if its folder cannot be made."""
        if self.why_not_train:
            raise Sd2Error(self.why_not_train)
        data = [one.path for one in self.setup.data]
        path = free_folder(self._folder, str(self.setup.value("model")), data)
        words = [*self.setup.train_arguments(path / MODEL_NAME), "--progress-json"]
        self.start_command(path, words, what="train")

    def use_model(self) -> None:
        """Keep the model of the run in view among the classifiers, and classify with it.

        Raises Sd2Error or OSError if it cannot be read or kept.
        """
        run = self.run
        if run is None or run.result is None:
            return
        kept = self._classifiers / f"{run.path.name}.safetensors"
        with atomic_write(kept) as stream:
            stream.write(run.result.read_bytes())
        self._use(kept)
        self._used = run.path
        self.changed.emit()
