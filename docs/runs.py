"""Trainings that pages of the documentation are about, and the tables they come to."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from sd2core.train.folder import RunFolder


@dataclass(frozen=True)
class Job:
    """One run of ``sd2 train``."""

    name: str
    data: Path
    options: tuple[str, ...]


def settings(given: Mapping[str, object]) -> list[str]:
    """Options of a model for the command line."""
    return [word for name, value in given.items() for word in ("--set", f"{name}={value}")]


def sd2(*arguments: object) -> None:
    """Run a command; what fails ends the program."""
    command = [sys.executable, "-m", "sd2core.cli", *map(str, arguments)]
    if code := subprocess.run(command).returncode:
        sys.exit(code)


def train(folder: Path, jobs: Iterable[Job]) -> None:
    """Train what is not trained yet, as many at once as there are cores, one thread each."""
    pending = [job for job in jobs if not _finished(folder / job.name)]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        codes = pool.map(lambda job: _run(folder, job), pending)
        failed = [job.name for job, code in zip(pending, codes, strict=True) if code]
    if failed:
        sys.exit(f"{', '.join(failed)} failed; what is done is kept")


def tables(folder: Path, models: Sequence[Path], data: Path, *options: object) -> str:
    """What ``sd2 eval`` says of models, in Markdown."""
    written = folder / "tables.md"
    sd2("eval", *models, "--data", data, "--markdown", written, *options)
    return written.read_text("utf-8")


def _finished(run: Path) -> bool:
    return RunFolder(run).exists and RunFolder(run).status().state == "finished"


def _run(folder: Path, job: Job) -> int:
    path = folder / job.name
    how = (
        ["--resume", str(path)]
        if RunFolder(path).exists
        else [str(job.data), *job.options, "--out", str(path), "--threads", "1"]
    )
    return subprocess.run([sys.executable, "-m", "sd2core.cli", "train", *how]).returncode
