"""What double precision costs where it is needed, and what single would have got wrong.

The real walk, to and fro: 450 frames of 13,718 vertices. It is counted in single
precision as it is, and once more with double forced on it. What a run measures is
printed; ratios are asserted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.compiled import warm_up
from sd2core.doppler import PRESETS, Synthesizer, prepared
from sd2core.doppler.histogram import relative_range
from sd2core.mesh import MeshSequence
from sd2core.precision import SHARE_OF_A_BIN, velocity_error_mps
from sd2core.scattering.velocity import radial_velocity
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

FRAMES = 450
CAMERA = VirtualSensor()


@pytest.fixture(scope="module")
def walk(shared_data: Path) -> MeshSequence:
    warm_up()
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        vertices, faces = data["vertices"], data["faces"]
    there_and_back = np.abs((np.arange(FRAMES) + 88) % 176 - 88)
    return MeshSequence(vertices[there_and_back], faces, Timebase.regular(FRAMES, 30.0), "walk")


def ready(mesh: MeshSequence) -> Synthesizer:
    maker = Synthesizer(mesh, PRESETS["paper"])
    maker.prepare()
    maker.map(CAMERA)  # with its masks, which are kept
    return maker


def spent_s(work: Callable[[], Any]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


@pytest.mark.benchmark(group="precision")
def test_what_double_precision_costs(
    benchmark: Any,
    walk: MeshSequence,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    single = ready(walk)
    with monkeypatch.context() as forced:
        forced.setattr(prepared, "single_is_enough", lambda **_: False)
        double = ready(walk)
    makers = {"f4": single, "f8": double}
    for name, maker in makers.items():
        assert maker.prepared.block(0).frames.positions.dtype == np.dtype(name)

    def all_of(maker: Synthesizer) -> list[float]:
        maker.map(CAMERA, visibility="facing")  # normals are kept from here on
        moved = VirtualSensor((0.2 * np.random.default_rng().random(), 0.0, 0.0))
        return [
            spent_s(lambda: maker.map(CAMERA)),
            spent_s(lambda: maker.map(CAMERA, visibility="facing")),
            spent_s(lambda: maker.map(moved)),
        ]

    benchmark.pedantic(single.map, args=(CAMERA,), rounds=3)
    # In turns, so that a busy machine slows both.
    rounds = np.array([[all_of(maker) for maker in makers.values()] for _ in range(8)])
    best_ms = 1e3 * rounds.min(axis=0) / FRAMES  # (precision, what)
    ratio = best_ms[1] / best_ms[0]
    first, second = (maker.map(CAMERA).values for maker in makers.values())
    apart = float(np.abs(first - second).sum() / second.sum())
    with capsys.disabled():
        print("\nms a frame, whole clip, all cores: single, double, ratio")
        for what, *figures in zip(
            ("mask kept", "facing test", "exact, sensor moved"), *best_ms, ratio, strict=True
        ):
            print(f"{what}: " + ", ".join(f"{figure:.3f}" for figure in figures))
        print(f"The two maps differ by L1 {apart:.1e}")
    # Twice the bytes, half as many numbers in a vector register.
    assert 1.0 < ratio[1] < 3.0
    assert ratio[2] < 2.0
    # A hundredth of a bin is allowed; an ordinary scene needs far less.
    assert apart < 0.01


@pytest.mark.benchmark(group="precision, errors")
def test_what_single_precision_gets_wrong(
    benchmark: Any, walk: MeshSequence, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = benchmark.pedantic(errors, args=(walk,), rounds=1)
    with capsys.disabled():
        print("\nhow far from the clip's origin: predicted, single, double, in bins; is used")
        print("\n".join(lines))


def errors(walk: MeshSequence) -> list[str]:
    """One line per place; the prediction holds, and what is used is right at each."""
    axis, duration_s = VelocityAxis(), 2.0 / 30.0
    before, after = (walk.frame(k).T.astype(np.float64) for k in (20, 22))
    middle = before.mean(axis=1, keepdims=True)
    lines = []
    for away_m in (0.0, 10.0, 100.0, 1e3, 1e4):
        offset = away_m * np.array([[0.6], [0.0], [0.8]]) - middle
        ends = before + offset, after + offset
        sensor = (offset + middle).ravel() - np.array([0.0, 0.0, 2.2])
        truth = _long_velocity(*ends, sensor, duration_s)
        predicted, single, double = (
            error / axis.bin_width_mps
            for error in (
                velocity_error_mps(max(float(np.abs(end).max()) for end in ends), duration_s),
                _error_in(np.float32, ends, sensor, duration_s, truth),
                _error_in(np.float64, ends, sensor, duration_s, truth),
            )
        )
        used = "single" if predicted <= SHARE_OF_A_BIN else "double"
        lines.append(f"{away_m:g} m: {predicted:.1e}, {single:.1e}, {double:.1e}; {used}")
        assert single <= predicted
        assert (single if used == "single" else double) <= SHARE_OF_A_BIN
    assert used == "double"
    return lines


def _error_in(
    precision: Any,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    sensor: NDArray[np.float64],
    duration_s: float,
    truth: NDArray[np.longdouble],
) -> float:
    first, last = (relative_range(end.astype(precision), sensor) for end in ends)
    return float(np.abs((first - last).astype(np.float64) / duration_s - truth).max())


def _long_velocity(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    sensor: NDArray[np.float64],
    duration_s: float,
) -> NDArray[Any]:
    wide = np.longdouble
    return radial_velocity(before.astype(wide), after.astype(wide), sensor, duration_s)
