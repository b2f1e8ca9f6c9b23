"""The table: every plan with errors that its settings explain, and costs that are measured."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from accuracy_scenes import ball, plate, steady, swinging, together

from sd2core.accuracy.cache import scene_fingerprint
from sd2core.accuracy.measuring import measure
from sd2core.accuracy.plans import AccuracyPlan, compared_plans, wave_plans
from sd2core.accuracy.results import Measurement
from sd2core.accuracy.sample import take_sample
from sd2core.accuracy.survey import scene_facts
from sd2core.accuracy.trial import Trial
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.progress import Cancelled
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

CAMERA = VirtualSensor()


@pytest.fixture(scope="module")
def scene() -> MeshSequence:
    return together(ball(swinging((0, 0, 3), 1.5, 0.8), fineness=2), plate((0.25, 0, 1), 0.5, 0.5))


@pytest.fixture(scope="module")
def table(scene: MeshSequence) -> Measurement:
    return measure(scene, CAMERA, repeats=1)


def error(table: Measurement, plan: AccuracyPlan) -> float:
    result = table.of(plan)
    assert result is not None, plan
    return result.errors.l1


@pytest.mark.slow
def test_every_plan_is_there_once(table: Measurement) -> None:
    plans = [result.plan for result in table.results]
    assert len(set(plans)) == len(plans)
    assert set(plans) == set(compared_plans())


def test_the_reference_plan_itself_is_right(table: Measurement) -> None:
    """In single precision only vertices at the very edge of a bin can differ."""
    assert error(table, AccuracyPlan(frame_rate_factor=8)) < 1e-3


def test_expected_counts_are_held_against_expected_counts(scene: MeshSequence) -> None:
    shape = scene.frame_count, 1
    known = VelocityUncertainty(
        ("all",), np.zeros(scene.vertex_count, int), np.full(shape, 0.2), np.full(shape, 0.1)
    )
    scene, finest = replace(scene, uncertainty=known), AccuracyPlan(frame_rate_factor=8)
    plain, found = replace(PRESETS["paper"], count="plain"), []
    for options in (PRESETS["paper"], plain):
        trial = Trial(scene, CAMERA, options, take_sample(scene, CAMERA, options, runs=2))
        found.append(trial.reference(trial.sample.runs).smooth)
        assert trial.errors(finest).l1 < 2e-3
    assert np.abs(found[0] - found[1]).sum() > 0.1 * found[1].sum()
    more = replace(scene, uncertainty=known.times(2.0))
    told = [
        [scene_fingerprint(one, CAMERA, options, "histogram") for one in (scene, more)]
        for options in (PRESETS["paper"], plain)
    ]
    assert told[0][0] != told[0][1]
    assert told[1][0] == told[1][1]


@pytest.mark.parametrize(("depth_m", "spread"), [(0.0, 0.0), (1.0, 0.5)])
def test_facts_of_a_scene_name_how_far_its_ranges_lie_apart(depth_m: float, spread: float) -> None:
    """Two small plates, one behind the other: from half a metre before 2 m to half behind."""
    near, far = (plate((0.0, 0.0, 2.0 + side * depth_m), 0.02, 0.02) for side in (-0.5, 0.5))
    scene, paper = together(near, far), PRESETS["paper"]
    trial = Trial(scene, CAMERA, paper, take_sample(scene, CAMERA, paper, runs=2))
    assert scene_facts(trial).range_spread == pytest.approx(spread, abs=0.02)


def test_each_setting_brings_the_map_nearer(table: Measurement) -> None:
    raised = replace(AccuracyPlan(), frame_rate_factor=4)
    kinds = [replace(raised, visibility=kind) for kind in ("none", "facing", "exact")]
    found = [error(table, plan) for plan in kinds]
    assert found == sorted(found, reverse=True)
    rates = [error(table, AccuracyPlan(frame_rate_factor=factor)) for factor in (1, 2, 4, 8)]
    assert rates == sorted(rates, reverse=True)


def test_costs_are_there_and_finer_work_costs_more(table: Measurement) -> None:
    for result in table.results:
        assert result.cost.one_thread_ms.median > 0
        assert result.cost.all_cores_ms.median > 0
        assert result.cost.peak_bytes is not None
        assert result.cost.peak_bytes > 0
    cheap, dear = (
        table.of(AccuracyPlan(visibility="facing")),
        table.of(AccuracyPlan(frame_rate_factor=8)),
    )
    assert cheap is not None
    assert dear is not None
    assert dear.cost.one_thread_ms.median > cheap.cost.one_thread_ms.median
    assert (dear.cost.peak_bytes or 0) > (cheap.cost.peak_bytes or 0)


def test_the_front_is_a_staircase(table: Measurement) -> None:
    costs = [result.cost.all_cores_ms.median for result in table.front]
    errors = [result.errors.l1 for result in table.front]
    assert costs == sorted(costs)
    assert errors == sorted(errors, reverse=True)
    assert len(set(errors)) == len(errors)


def test_the_table_says_what_it_is_of(table: Measurement) -> None:
    assert table.source == "scene"
    assert table.machine.cores >= 1
    best = table.of(AccuracyPlan(frame_rate_factor=8))
    assert best is not None
    assert len(table.frames) == len(set(table.frames)) == best.errors.frames


def test_a_point_cloud_has_a_table(scene: MeshSequence) -> None:
    cloud = MeshSequence(scene.vertices, None, scene.timebase, "cloud")
    table = measure(cloud, CAMERA, repeats=1)
    assert {result.plan.visibility for result in table.results} == {"none"}
    with pytest.raises(Sd2Error, match="cloud has no faces"):
        measure(cloud, CAMERA, repeats=1, family="fmcw")


def test_without_memory_no_allocation_is_traced(
    scene: MeshSequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tracing that ends while another thread's kernel allocates ends the process."""
    monkeypatch.setattr(tracemalloc, "start", None)
    cloud = MeshSequence(scene.read(0, 5), None, Timebase(scene.times_s[:5]))
    table = measure(cloud, CAMERA, repeats=1, memory=False)
    assert {result.cost.peak_bytes for result in table.results} == {None}


def test_measuring_can_be_stopped(scene: MeshSequence) -> None:
    calls = []

    def stop(done: int, total: int) -> None:
        calls.append(done)
        if len(calls) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        measure(scene, CAMERA, repeats=1, progress=stop)
    assert len(calls) == 3


@pytest.mark.slow
def test_the_weight_is_measured_against_its_own_reference(scene: MeshSequence) -> None:
    options = replace(PRESETS["paper"], weight="projected")
    table = measure(scene, CAMERA, options=options, repeats=1)
    assert error(table, AccuracyPlan(weight="projected", frame_rate_factor=8)) < 1e-3


@pytest.mark.slow
def test_waves_converge_and_blocks_and_motion_bring_them_nearer() -> None:
    body = ball(steady((0, 0, 2), (0.1, 0, -0.8)), fineness=3, radius_m=0.1)
    table = measure(body, CAMERA, family="fmcw", repeats=1)
    assert {result.plan for result in table.results} == set(wave_plans())
    changes = [change for _, change in table.convergence]
    assert changes
    assert changes[-1] < 0.02
    fine = error(table, AccuracyPlan(signal="fmcw", motion="interpolated"))
    # A ball of flat facets has speckle of its own: fewer facets are another surface.
    coarse = error(table, AccuracyPlan(signal="fmcw", vertices_kept=0.25))
    assert fine < 0.02
    assert fine < coarse
    direct = error(table, AccuracyPlan(signal="direct"))
    assert direct == pytest.approx(error(table, AccuracyPlan(signal="fmcw", blocks=4)), abs=1e-3)
    assert np.isfinite([result.errors.l1 for result in table.results]).all()
