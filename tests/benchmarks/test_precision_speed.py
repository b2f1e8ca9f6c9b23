"""What double precision costs where it is needed, and what single would have got wrong.

The real walk, to and fro: 450 frames of 13,718 vertices. It is counted in single
precision as it is, and once more with double forced on it. What a run measures is
printed; ratios are asserted.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from longer_walk import longer_walk
from precisions import CAMERA, costs, errors, in_both_precisions

from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.numerics.precision import SHARE_OF_A_BIN


@pytest.fixture(scope="module")
def walk(shared_data: Path) -> MeshSequence:
    warm_up()
    return longer_walk(shared_data)


@pytest.mark.benchmark(group="precision")
def test_what_double_precision_costs(
    benchmark: Any, walk: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    makers = in_both_precisions(walk)
    found = benchmark.pedantic(costs, args=(makers,), rounds=1)
    first, second = (maker.map(CAMERA).values for maker in makers)
    apart = float(np.abs(first - second).sum() / second.sum())
    with capsys.disabled():
        print("\nms a frame, whole clip, all cores: single, double, ratio")
        for cost in found:
            print(f"{cost.what}: {cost.single_ms:.3f}, {cost.double_ms:.3f}, {cost.ratio:.2f}")
        print(f"The two maps differ by L1 {apart:.1e}")
    ratios = {cost.what: cost.ratio for cost in found}
    # Twice the bytes, half as many numbers in a vector register.
    assert 1.0 < ratios["facing test"] < 3.0
    assert ratios["exact, sensor moved"] < 2.0
    # A hundredth of a bin is allowed; an ordinary scene needs far less.
    assert apart < 0.01


@pytest.mark.benchmark(group="precision, errors")
def test_what_single_precision_gets_wrong(
    benchmark: Any, walk: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    found = benchmark.pedantic(errors, args=(walk,), rounds=1)
    with capsys.disabled():
        print("\nhow far from the clip's origin: predicted, single, double, in bins; is used")
        for at in found:
            print(
                f"{at.away_m:g} m: {at.predicted:.1e}, {at.single:.1e}, {at.double:.1e}; {at.used}"
            )
    for at in found:
        assert at.single <= at.predicted
        assert (at.single if at.used == "single" else at.double) <= SHARE_OF_A_BIN
    assert {at.used for at in found} == {"single", "double"}
