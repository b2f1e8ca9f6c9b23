"""Trainings that pages of the documentation are about, and their errors."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from sd2core.files.atomic import atomic_write_text
from sd2core.runs.progress import effective, read_events
from sd2core.train.folder import TrainingFolder
from tools.documentation.measured import spread

PILOT_EPOCHS = 4
MEMORY = "memory.txt"


@dataclass(frozen=True)
class Job:
    """One run of ``sd2 train``."""

    name: str
    data: Path
    options: tuple[str, ...]

    def seeds(self, count: int, epochs: int) -> list[Job]:
        """The run of so many epochs with so many seeds."""
        options = (*self.options, "--epochs", str(epochs), "--seed")
        return [
            Job(f"{self.name}-{seed}", self.data, (*options, str(seed))) for seed in range(count)
        ]


def settings(given: Mapping[str, object]) -> list[str]:
    """Options of a model for the command line."""
    return [word for name, value in given.items() for word in ("--set", f"{name}={value}")]


def run(module: str, *arguments: object) -> None:
    """Run ``python -m MODULE``; what fails ends the program."""
    command = [sys.executable, "-m", module, *map(str, arguments)]
    if code := subprocess.run(command).returncode:
        sys.exit(code)


def sd2(*arguments: object) -> None:
    """Run a command of ``sd2``; what fails ends the program."""
    run("sd2core.cli", *arguments)


def campaign_of(folder: Path, minutes: float, *options: object) -> Path:
    """A simulated campaign of six people; what is there of it is not made again."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "campaign.zarr"
    sd2("simulate", "campaign", "--out", path, "--people", 6, "--minutes", minutes, *options)
    return path


def epochs_in(folder: Path, job: Job, minutes: float) -> int:
    """Number of epochs that take these minutes of processor time, by a short run."""
    pilots = folder / "pilots"
    train(pilots, [replace(job, options=(*job.options, "--epochs", str(PILOT_EPOCHS)))])
    events = effective(read_events(TrainingFolder(pilots / job.name).progress))
    # Processor time that the run had used by the end of each epoch.
    ends_s = [event["processor_s"] for event in events if event["event"] == "epoch"]
    # The first epoch has the start in it; the shortest has least of what else went on.
    # Where it was broken off and went on, the processor time began again.
    epoch_s = min(after - before for before, after in pairwise(ends_s) if after > before)
    return max(1, round(60.0 * minutes / epoch_s))


def train(folder: Path, jobs: Sequence[Job]) -> list[Path]:
    """Train what is not trained yet, as many at once as there are cores; the runs' folders."""
    folder.mkdir(parents=True, exist_ok=True)
    pending = [job for job in jobs if not _finished(folder / job.name)]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        codes = pool.map(lambda job: _run(folder, job), pending)
        failed = [job.name for job, code in zip(pending, codes, strict=True) if code]
    if failed:
        sys.exit(f"{', '.join(failed)} failed; what is done is kept")
    return [folder / job.name for job in jobs]


def evaluated(models: Sequence[Path], data: Path, *options: object) -> dict[str, Any]:
    """What ``sd2 eval`` says of some models, and of the filters that need no training."""
    words = ("eval", *models, "--data", data, "--json", *options)
    command = [sys.executable, "-m", "sd2core.cli", *map(str, words)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


ERRORS = {
    "peak_mae_mps": "peak MAE m/s",
    "mean_mae_mps": "mean MAE m/s",
    "map_rmse": "map RMSE",
}
"""Errors of ``sd2 eval --json`` that pages show, and their headings."""


def errors_of(group: Mapping[str, Any]) -> list[str]:
    """Cells of a group of models of ``sd2 eval --json``, as :data:`ERRORS` has them."""
    return [spread(group[name]) for name in ERRORS]


def run_of(group: Mapping[str, Any]) -> str:
    """Name of the run without its seed, or of the filter."""
    return group["models"][0]["name"].rpartition("-")[0] if group["trained"] else group["name"]


def _finished(run: Path) -> bool:
    return TrainingFolder(run).exists and TrainingFolder(run).status().state == "finished"


def _run(folder: Path, job: Job) -> int:
    """Train one, and note the most memory that its process had."""
    path = folder / job.name
    how = (
        ["--resume", str(path)]
        if TrainingFolder(path).exists
        else [str(job.data), *job.options, "--out", str(path), "--threads", "1"]
    )
    process = subprocess.Popen([sys.executable, "-m", "sd2core.cli", "train", *how])
    _, code, usage = os.wait4(process.pid, 0)
    if not code:
        atomic_write_text(path / MEMORY, f"{usage.ru_maxrss * 1024}\n")
    return code
