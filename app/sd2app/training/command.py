"""Training runs as ``sd2`` commands."""

from __future__ import annotations

import shlex
import sys
import time
from dataclasses import fields
from pathlib import Path

from sd2core.train.config import DataConfig, TrainConfig, TrainingConfig
from sd2core.train.folder import TrainingFolder

_OPTIONS = {"early_stopping_epochs": "--early-stopping"}
"""Options whose names differ from their settings."""


def new_run_folder(folder: Path, config: TrainConfig) -> Path:
    """Free folder name made of the kind of model, the pairs and the time."""
    pairs = "+".join(path.stem for path in config.data.pairs)
    when = time.strftime("%Y-%m-%d %H.%M")
    name = f"{config.model.name} {pairs[:40]} {when}"
    path, number = folder / name, 2
    while path.exists() or TrainingFolder(path).output.exists():
        path, number = folder / f"{name} {number}", number + 1
    return path


def train_arguments(config: TrainConfig, run: Path) -> list[str]:
    """Arguments of ``sd2 train`` for all that differs from the defaults."""
    # The model is named even where it is the default: it is what one looks for.
    words = ["train", *map(str, config.data.pairs), "--model", config.model.name, "--background"]
    for section, plain in (("data", DataConfig(config.data.pairs)), ("training", TrainingConfig())):
        mine = getattr(config, section)
        for one in fields(mine):
            value = getattr(mine, one.name)
            if value != getattr(plain, one.name):
                words += [_OPTIONS.get(one.name, f"--{one.name.replace('_', '-')}"), f"{value}"]
    return [*words, "--out", str(run)]


def resume_arguments(run: Path) -> list[str]:
    """Arguments of ``sd2 train`` that resume a run."""
    return ["train", "--resume", str(run)]


def quoted(arguments: list[str]) -> str:
    """Command line for a terminal."""
    words = ["sd2", *arguments]
    if sys.platform == "win32":
        import subprocess

        return subprocess.list2cmdline(words)
    return shlex.join(words)
