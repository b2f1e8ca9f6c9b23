"""Monitor of one batch, the maps that it made as rows, and batches in words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.background.run_monitor import History, RunMonitor, reason_in
from sd2app.batch.setup import Entry
from sd2app.widgets.record_table import Heading, RecordTableModel
from sd2app.widgets.run_text import PHASES, time_text
from sd2app.widgets.text import about, bytes_text, counted
from sd2core.batch.folder import BatchFolder
from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import whole_lines
from sd2core.placements.placements import Place
from sd2core.runs.command_folder import last_output
from sd2core.runs.progress import Event
from sd2core.sensor import Vector, VirtualSensor, spherical_from_position

if TYPE_CHECKING:
    from sd2core.batch.estimate import BatchEstimate, StepEstimate


_KEPT_FAILURES = 500
"""Limit of kept failures; the report has all."""


def plan_of(folder: Path) -> Path:
    """Plan that a batch is started with; it keeps a copy in its folder."""
    return folder.with_name(f".{folder.name}.plan.toml")


class BatchHistory(History):
    """Counts and failures of a batch's last start."""

    steps: tuple[str, ...] = ()  # of the plan, in order
    workers = failed = 0  # processes that share the work; tasks that cannot be done

    def __init__(self) -> None:
        self.tasks: dict[str, dict[str, int]] = {}  # per step: "total", "done", "there" already
        self.failures: list[str] = []  # tasks that cannot be done, each with its reason

    @property
    def share(self) -> float | None:
        """Share of the time that has passed; None while what is left is not known."""
        elapsed_s, left_s = self.elapsed_s, self.left_s
        if elapsed_s is None or left_s is None:
            return None
        return elapsed_s / max(elapsed_s + left_s, 1e-9)

    def _take_start(self, event: Event) -> None:
        self.steps, self.failures = tuple(map(str, event.get("steps", ()))), []
        self._take_progress({})

    def _take_progress(self, event: Event) -> None:
        elapsed_s, left_s = event.get("elapsed_s"), event.get("left_s")
        self.elapsed_s = None if elapsed_s is None else float(elapsed_s)
        self.told_left_s = None if left_s is None else float(left_s)
        self.tasks = {name: dict(event.get(name, {})) for name in ("total", "done", "there")}
        self.workers, self.failed = int(event.get("workers", 0)), int(event.get("failed", 0))
        self.error = reason_in(event)

    _take_end = _take_progress

    def _take_failed(self, event: Event) -> None:
        if len(self.failures) < _KEPT_FAILURES:
            place = f" from place {event['placement']}" if event.get("placement") else ""
            step = str(event["step"])
            what = f"{event['recording']}, {STEP_WORDS.get(step, step).lower()}{place}"
            self.failures.append(f"{what}: {reason_in(event)}")


class BatchMonitor(RunMonitor[BatchFolder]):
    """A batch with its counts, its failures and its log; only its last start counts."""

    folders, histories = BatchFolder, BatchHistory
    history: BatchHistory
    facts = ""  # end of its log

    def inspect(self) -> str:
        """Read the end of the log."""
        return last_output(self.folder.log)

    @property
    def resumable(self) -> bool:
        """True if the same command would go on with it."""
        return not self.under_way and self.phase != "gone" and self.folder.plan.exists()

    def _settle(self) -> None:
        super()._settle()
        if not self.under_way:
            plan_of(self.path).unlink(missing_ok=True)


STEP_WORDS = {
    "inspect": "Look at recordings",
    "fit": "Fit bodies",
    "synthesise": "Synthesise",
    "denoise": "Denoise",
    "simulate": "Simulate radar",
    "export": "Export",
}
_PHASES = PHASES | {"stopping": "Stopping, what is done stays…"}


def entry_text(entry: Entry) -> str:
    """Content of an entry in words."""
    if entry.problem:
        return entry.problem
    if entry.count is None:
        return "…"
    return "" if entry.count == 1 and len(entry.patterns) == 1 else counted(entry.count, "file")


def headline(batch: BatchMonitor) -> str:
    """Current phase of the run in words."""
    history, words = batch.history, _PHASES[batch.phase]
    if batch.phase == "finished" and history.failed:
        return f"{words}, but {counted(history.failed, 'task')} could not be done"
    if batch.phase == "running" and not history.workers:
        return f"{words}: waiting for workers"
    return words


def batch_time_text(batch: BatchMonitor) -> str:
    """Time left, elapsed time, and the processes that share the work."""
    workers = batch.history.workers if batch.under_way else 0
    return " · ".join(filter(None, (time_text(batch), counted(workers, "worker") * bool(workers))))


def step_facts(batch: BatchMonitor) -> list[tuple[str, int, int, str]]:
    """Per step: its name, how many tasks are settled, how many there are, and both in words."""
    facts = []
    for step in batch.history.steps:
        total, done, there = (
            batch.history.tasks[name].get(step, 0) for name in ("total", "done", "there")
        )
        if not total:
            continue
        words = f"{done + there:,} of {total:,}"
        if there:
            words += f", {there:,} there already"
        facts.append((STEP_WORDS.get(step, step), done + there, total, words))
    return facts


def estimate_headline(made: BatchEstimate) -> str:
    """Summary of an estimate in one line."""
    recordings = counted(made.recordings, "recording")
    if not any(step.to_do for step in made.steps.values()):
        return f"{recordings}: all of it is there already"
    time = "the first tasks tell how long it takes"
    if made.seconds is not None:
        time = f"{about(made.seconds)} on {counted(made.workers, 'worker')}"
    return f"{recordings}: {time}, at most {bytes_text(made.bytes)}"


def estimate_facts(made: BatchEstimate) -> list[tuple[str, str]]:
    """Estimate step by step."""
    rows = [
        (STEP_WORDS.get(name, name), _step_text(step))
        for name, step in made.steps.items()
        if step.to_do or step.there
    ]
    if made.looked_at < made.recordings:
        rows.append(("Looked at", f"{made.looked_at:,}; the others are taken to be like them"))
    return rows


def unusable_text(made: BatchEstimate) -> str:
    """Recordings that cannot be used, with the first reason; empty where all can."""
    unusable = made.unusable
    if not unusable:
        return ""
    more = f" ({len(unusable) - 1:,} more cannot, either.)" if len(unusable) > 1 else ""
    return f"Cannot be used: {unusable[0]}{more}"


def _step_text(step: StepEstimate) -> str:
    parts = [f"{step.to_do:,} to do"]
    if step.there:
        parts.append(f"{step.there:,} there already")
    if step.to_do and step.seconds is not None:
        parts.append(about(step.seconds))
    if step.bytes:
        parts.append(f"at most {bytes_text(step.bytes)}")
    return " · ".join(parts)


_MAX_ROWS = 50_000
"""Limit of shown rows; the file has all."""
_COLUMNS = ("Recording", "Subject", "Place", "Seen from the body", "Maps")


@checked(frozen=True)
class Result:
    """One map of a recording from one place, as a line of ``results.jsonl`` describes it."""

    recording: str
    subject: str
    source: str  # the processed file
    mesh: str  # the mesh that the map is of
    placement: int | None  # 0 or None is the recording's own sensor
    sensor: VirtualSensor
    target_m: Vector  # position of the body
    # Files of the maps, relative to the folder of the batch.
    synthetic: str | None = None
    denoised: str | None = None
    simulated: str | None = None

    @property
    def kinds(self) -> str:
        """Kinds of maps that there are, in words."""
        kinds = ("synthetic", "denoised", "simulated")
        return ", ".join(kind for kind in kinds if getattr(self, kind))


_LINE = TypeAdapter(Result)


class BatchResults(RecordTableModel[Result]):
    """Reads ``results.jsonl`` in the background; one row per map."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__([Heading(text) for text in _COLUMNS], parent)
        self.card = ""  # of the exported data set, as Markdown; empty where there is none
        self._runner = LatestRunner("results", parent, self._take)
        # There may be none, or the disk is away.
        self._runner.failed.connect(lambda error: self.forget())

    def read(self, folder: BatchFolder) -> None:
        """Read the results of a batch."""
        self._runner.submit(lambda emit: (_rows(folder.results), _card(folder)))

    def forget(self) -> None:
        """Show none."""
        self._runner.cancel()
        self._take(([], ""))

    def _take(self, results: tuple[list[Result], str]) -> None:
        self.beginResetModel()
        self.rows, self.card = results
        self.endResetModel()
        self.changed.emit()

    def _text(self, record: Result, column: int) -> str:
        around = spherical_from_position(record.target_m, record.sensor.position_m)
        return (
            record.recording,
            record.subject,
            f"{record.placement:,}" if record.placement else "own sensor",
            Place(*around).words.replace("-", "−"),
            record.kinds,
        )[column]


def _rows(file: Path) -> list[Result]:
    rows: dict[tuple[str, str, int], Result] = {}
    with open_regular(file) as stream:
        for line in whole_lines(stream):
            row = _row(line)
            if row is not None:
                rows.setdefault((row.recording, row.subject, row.placement or 0), row)
            if len(rows) >= _MAX_ROWS:
                break
    return list(rows.values())


def _row(line: bytes) -> Result | None:
    try:
        return _LINE.validate_json(line)
    except (ValidationError, Sd2Error):
        return None


def _card(folder: BatchFolder) -> str:
    """Card of the exported data set; empty where none was exported."""
    from sd2core.datasets.card import card_paths

    try:
        return card_paths(folder.path / "dataset")[0].read_text(encoding="utf-8")
    except OSError:
        return ""
