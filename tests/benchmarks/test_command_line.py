"""``sd2 --help`` beside the bare interpreter, in CPU time of the same run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

resource = pytest.importorskip("resource", reason="needs the CPU time of child processes")

REPOSITORY = Path(__file__).resolve().parents[2]
LIMIT_S = 0.5


def cpu_s(*arguments: str) -> float:
    """CPU time, user and system, of one Python process."""
    before = _children_s()
    subprocess.run(
        [sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True, cwd=REPOSITORY
    )
    return _children_s() - before


def _children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@pytest.mark.benchmark(group="command line")
def test_help(benchmark) -> None:
    bare_s = min(cpu_s("-c", "pass") for _ in range(5))
    benchmark.pedantic(cpu_s, args=("-m", "sd2app.command_line", "--help"), rounds=5)
    help_s = min(cpu_s("-m", "sd2app.command_line", "--help") for _ in range(5))
    benchmark.extra_info |= {
        "bare_interpreter_cpu_s": round(bare_s, 3),
        "help_cpu_s": round(help_s, 3),
        "ratio": round(help_s / bare_s, 2),
        "limit_s": LIMIT_S,
    }
    # The bare interpreter takes 10 to 30 ms on today's machines, so 10 times is within 0.5 s.
    assert help_s < 10 * bare_s
