"""What the truth costs, and how far single precision is from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.reference import reference_stretch
from sd2core.io.mesh import load_mesh
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor

FRAMES = (30, 54)


@pytest.mark.benchmark(group="reference histogram, 24 frames of 13,718 vertices")
@pytest.mark.parametrize("every", [1, 8])
def test_reference(
    benchmark: Any, shared_data: Path, capsys: pytest.CaptureFixture[str], every: int
) -> None:
    warm_up()
    mesh = load_mesh(shared_data / "mesh" / "walk.npz")
    chosen = replace(PRESETS["paper"], oversampling=every)
    sensor = VirtualSensor()
    truth = benchmark.pedantic(
        lambda: reference_stretch(mesh, sensor, chosen, *FRAMES), rounds=5, warmup_rounds=1
    )
    fast = Synthesizer(mesh, chosen).stretch(sensor, *FRAMES).raw
    error = np.abs(fast - truth).sum() / truth.sum()
    spent_s = benchmark.stats.stats.min
    with capsys.disabled():
        print(f"\nframe rate × {every}: {spent_s:.2f} s; the fast way is {error:.1e} (L1) from it")
    assert spent_s <= 1.0
