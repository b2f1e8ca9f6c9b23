"""Ten times the vertices, frames or sensor places cost about ten times as much.

Sizes of a swaying ellipsoid that is worked out as it is read; memory beyond the budget
for prepared frames may grow with the size of a few frames, not with the clip.
"""

from __future__ import annotations

from typing import Any

import pytest
from scaling import BUDGET_BYTES, Scaling, scalings

MAX_GROWTH = 11.0


@pytest.mark.parametrize("visibility", ["facing", "exact"])
@pytest.mark.benchmark(group="scaling")
def test_scaling(benchmark: Any, visibility: str, capsys: pytest.CaptureFixture[str]) -> None:
    found: list[Scaling] = benchmark.pedantic(lambda: list(scalings(visibility)), rounds=1)
    with capsys.disabled():
        for scaling in found:
            print(f"\n{scaling.what}")
            for point in scaling.points:
                print(
                    f"  {point.size:>9,}: {point.seconds:8.3f} s,"
                    f" {point.peak_bytes / 1e6:8.1f} MB at most"
                )
            grown = ", ".join(f"{growth:.1f}" for growth in scaling.growth)
            print(f"  per factor of ten: {grown} times the cost")
    vertices, frames, places = found
    for scaling in found:
        assert max(scaling.growth) <= MAX_GROWTH, scaling.what
    for scaling in (frames, places):
        last = scaling.points[-1]
        assert last.peak_bytes <= BUDGET_BYTES * 1.5, scaling.what
    assert len(vertices.points) == 4
