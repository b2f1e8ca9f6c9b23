"""What a source costs when it is written, and a segment when torch reads it; of a processor.

``pytest tests/benchmarks/test_dataset_speed.py --benchmark-only --capture=no`` prints
processor time, which others on the machine do not lengthen; decision 38 quotes it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lazy_sources import write_dataset

from sd2core.datasets import store
from sd2core.datasets.source import Source
from sd2core.datasets.torch_dataset import SegmentDataset
from sd2core.maps import DopplerMap, MapKind
from sd2core.options.exporting import Exporting
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

SOURCES = 60
FRAMES = 450
KINDS: tuple[MapKind, ...] = ("synthetic", "denoised", "simulated")


def sources() -> Iterator[Source]:
    """Of 15 s at 30 frames/s, three kinds each."""
    rng = np.random.default_rng(1)
    axis, clock = VelocityAxis(), Timebase.regular(FRAMES, 30.0)
    maps = {
        kind: DopplerMap(rng.random((axis.bins, FRAMES), np.float32), axis, clock, kind)
        for kind in KINDS
    }
    label = np.zeros(FRAMES, np.int16)
    for number in range(SOURCES):
        yield Source(f"s{number % 6}", f"r{number}", 0, VirtualSensor(), maps, label)


@pytest.mark.benchmark(group="data sets: 60 sources")
@pytest.mark.parametrize("flush_s", [2.0, 0.0], ids=["together", "one by one"])
def test_writing(
    benchmark: Any,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    flush_s: float,
) -> None:
    monkeypatch.setattr(store, "FLUSH_EVERY_S", flush_s)
    names = count()
    worked_s: list[float] = []

    def write() -> None:
        before_s = time.process_time()
        write_dataset(tmp_path / f"{next(names)}.zarr", sources(), Exporting())
        worked_s.append(time.process_time() - before_s)

    benchmark.pedantic(write, rounds=3, warmup_rounds=1)
    told(capsys, f"a source of {FRAMES} frames", 1e3 * np.array(worked_s) / SOURCES)


@pytest.mark.benchmark(group="data sets: 480 segments for torch")
@pytest.mark.parametrize("order", ["in order", "shuffled"])
def test_reading(
    benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path, order: str
) -> None:
    path = tmp_path / "set.zarr"
    segments = write_dataset(path, sources(), Exporting()).segments
    data = SegmentDataset(path, "synthetic", "simulated")
    rows = np.arange(segments)
    if order == "shuffled":
        rows = np.random.default_rng(1).permutation(segments)
    worked_s: list[float] = []

    def read() -> None:
        before_s = time.process_time()
        for start in range(0, segments, 64):
            data.__getitems__(rows[start : start + 64].tolist())
        worked_s.append(time.process_time() - before_s)

    benchmark.pedantic(read, rounds=5, warmup_rounds=1)
    told(capsys, "a segment with its target", 1e3 * np.array(worked_s) / segments)


def told(capsys: pytest.CaptureFixture[str], what: str, times_ms: np.ndarray) -> None:
    """Print what a benchmark has measured."""
    with capsys.disabled():
        print(f"\n{what}: median {np.median(times_ms):.2f} ms of a processor")
