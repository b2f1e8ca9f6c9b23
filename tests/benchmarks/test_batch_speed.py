"""Batches: two processes against one, and ten times the tasks.

Process starts are left out, as they are there once for however many tasks. Memory does not
grow with length or number of recordings.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from batches import memory, ten_times_the_tasks, two_against_one

MIN_GAIN = 1.8
MAX_GROWTH = 10.5
MAX_MB = 1000.0


@pytest.mark.benchmark(group="batch")
def test_two_processes(benchmark: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = benchmark.pedantic(lambda: two_against_one(tmp_path, 4, 50, 3), rounds=1)
    with capsys.disabled():
        print(f"\n{found.tasks} maps: two processes are {found.ratio:.2f} times as fast as one")
    assert found.tasks >= 200
    assert found.ratio >= MIN_GAIN


@pytest.mark.benchmark(group="batch")
def test_ten_times_the_tasks(
    benchmark: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = benchmark.pedantic(lambda: ten_times_the_tasks(tmp_path, 10, 8, 3), rounds=1)
    with capsys.disabled():
        print(f"\n{found.tasks} maps take {found.ratio:.2f} times what a tenth of them does")
    assert found.ratio <= MAX_GROWTH


@pytest.mark.benchmark(group="batch")
def test_memory(benchmark: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cases = [(1.0, 1), (1.0, 10), (25.0, 1)]
    found = benchmark.pedantic(
        lambda: [memory(tmp_path, *case, 1200, "facing") for case in cases],
        rounds=1,
    )
    with capsys.disabled():
        for one in found:
            peak_mb = max(one.peak_mb.values())
            print(f"\n{one.recordings} of {one.minutes:g} min: {peak_mb:.0f} MB at most")
    assert all(max(one.peak_mb.values()) <= MAX_MB for one in found)
