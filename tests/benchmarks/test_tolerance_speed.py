"""Maps within a tolerance: for few frames as dear as the most accurate ones, for many cheaper.

Processor time, so that other programs do not disturb it.
"""

from __future__ import annotations

import time
from typing import Any

import pytest
from scaling import body

from sd2core.accuracy import places
from sd2core.accuracy.choosing import choose
from sd2core.accuracy.places import PlacedPlan, choose_for_places, spread
from sd2core.accuracy.plans import reference_plan
from sd2core.accuracy.trial import synthesizer_for
from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor

PAPER = PRESETS["paper"]
TOLERANCE = 0.05
MAX_OF_FEW, MAX_OF_MANY = 1.5, 1.0
CLIPS = {
    "sample": lambda: open_recording(resource_path("swipes.sd2")).load_mesh(),
    "ellipsoid of 1,000 vertices": lambda: body(1000, 450),
    "ellipsoid of 300 vertices": lambda: body(300, 450),
}


def around(count: int) -> list[VirtualSensor]:
    return [VirtualSensor((0.02 * number - 0.5, 0.0, 0.0)) for number in range(count)]


def maps_s(mesh: MeshSequence, options: SynthesisOptions, sensors: list[VirtualSensor]) -> float:
    begun_s = time.process_time()
    synthesizer = Synthesizer(mesh, options, threads=1)
    for sensor in sensors:
        synthesizer.map(sensor)
    return time.process_time() - begun_s


@pytest.mark.benchmark(group="tolerance")
@pytest.mark.parametrize("name", CLIPS)
@pytest.mark.parametrize(("count", "most"), [(1, MAX_OF_FEW), (8, MAX_OF_FEW), (60, MAX_OF_MANY)])
def test_maps_of_many_places(
    benchmark: Any, name: str, count: int, most: float, capsys: pytest.CaptureFixture[str]
) -> None:
    warm_up()
    mesh, sensors = CLIPS[name](), around(count)
    choose(mesh, sensors[0], tolerance=TOLERANCE)
    plain_s = maps_s(mesh, PAPER, sensors)
    best_s = maps_s(mesh, reference_plan("histogram").options(PAPER), sensors)

    def work() -> tuple[float, PlacedPlan]:
        begun_s = time.process_time()
        frames = mesh.frame_count * count
        found = choose_for_places(mesh, spread(sensors), frames, TOLERANCE, PAPER)
        chosen = synthesizer_for(found.plan, mesh, PAPER)
        for sensor in sensors:
            chosen.map(sensor)
        return time.process_time() - begun_s, found

    spent_s, found = benchmark.pedantic(work, rounds=1)
    with capsys.disabled():
        print(
            f"\n{name}, {count} maps of {mesh.frame_count} frames: {spent_s:.2f} s within"
            f" {TOLERANCE:.0%}, {spent_s / best_s:.2f} times the most accurate ones and"
            f" {spent_s / plain_s:.2f} times the preset's; {found.plan}"
        )
    assert spent_s / best_s <= most


@pytest.mark.benchmark(group="tolerance")
@pytest.mark.parametrize("name", CLIPS)
def test_frames_from_which_choosing_pays(
    benchmark: Any, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of three places whose maps take so much longer by the most accurate plan."""
    warm_up()
    mesh, sensors = CLIPS[name](), around(3)
    choose(mesh, sensors[0], tolerance=TOLERANCE)

    def work() -> float:
        begun_s = time.process_time()
        found = choose_for_places(mesh, sensors, 10**6, TOLERANCE, PAPER)
        chosen_s, frames = time.process_time() - begun_s, mesh.frame_count * len(sensors)
        best, plan = reference_plan("histogram"), found.plan
        saved_s = maps_s(mesh, best.options(PAPER), sensors) - maps_s(
            synthesizer_for(plan, mesh, PAPER).mesh, plan.options(PAPER), sensors
        )
        return frames * chosen_s / saved_s

    frames = benchmark.pedantic(work, rounds=1)
    with capsys.disabled():
        print(f"\n{name}: choosing pays from {frames:,.0f} frames on")
    assert 0 < frames <= 3 * places._MIN_FRAMES
