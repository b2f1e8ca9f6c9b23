"""The program's own ``labels.json``, among the others."""

from __future__ import annotations

from pathlib import Path

from sd2core.labels import files
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="sd2",
    title="SD² Studio",
    suffixes=(".json",),
    made_for="SD² Studio",
    keeps=frozenset(ASPECTS),
)


def write(path: Path, labels: Labels, timebase: Timebase, media: Path | None = None) -> list[Loss]:
    """Write a ``labels.json``, which holds everything."""
    files.write_labels(path, labels, timebase=timebase, video=media)
    return []


def read(path: Path, timebase: Timebase | None = None, observation: str | None = None) -> Labels:
    """Read a ``labels.json``."""
    return files.read_labels(path).labels
