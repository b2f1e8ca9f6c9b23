"""Plans: one choice of every setting, in one line, and back from a file."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sd2core.accuracy.plans import (
    AccuracyPlan,
    compared_plans,
    counting_plans,
    reference_plan,
    visibility_plans,
    wave_plans,
)
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.fmcw.options import WaveOptions
from sd2core.numerics.map_accuracy import percent

ALL = [*counting_plans(), *compared_plans(), *wave_plans(), reference_plan("fmcw")]


def test_different_plans_have_different_lines() -> None:
    plans = set(ALL)
    assert len({str(plan) for plan in plans}) == len(plans)
    assert all("\n" not in str(plan) for plan in plans)


@pytest.mark.parametrize(
    "plan", [AccuracyPlan(), reference_plan("fmcw"), AccuracyPlan(mask_reuse_m=0.1)]
)
def test_a_plan_survives_a_file(plan: AccuracyPlan) -> None:
    assert AccuracyPlan.from_json(json.loads(json.dumps(plan.to_json()))) == plan


def test_a_plan_of_another_version_is_refused() -> None:
    with pytest.raises(Sd2Error, match="magic"):
        AccuracyPlan.from_json({"magic": 1})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"signal": "sonar"}, "sonar"),
        ({"signal": "fmcw", "visibility": "depth"}, "depth"),
        ({"vertices_kept": 0.0}, "vertices_kept is 0.0"),
        ({"vertices_kept": 1.5}, "1.5"),
        ({"mask_reuse_m": -1.0}, "-1.0"),
        ({"visibility": "facing", "mask_stride": 5}, "facing"),
        ({"visibility": "none", "mask_reuse_m": 0.1}, "none"),
    ],
)
def test_what_cannot_be_is_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(Sd2Error, match=message):
        AccuracyPlan(**settings)  # type: ignore[arg-type]


def test_a_plan_changes_only_its_settings() -> None:
    base = replace(PRESETS["paper"], velocity_sigma_bins=3.0, null_bins=(), count="expected")
    plan = AccuracyPlan(visibility="depth", depth_resolution=128, mask_stride=5, range_law="frame")
    options = plan.options(base)
    assert options.visibility == "depth"
    assert options.depth_resolution == 128
    assert options.mask_stride == 5
    assert options.range_law == "frame"
    assert options.velocity_sigma_bins == 3.0
    assert options.null_bins == ()
    assert options.count == "expected"
    wave = replace(AccuracyPlan(signal="direct"), blocks=4).wave(WaveOptions(coherent=False))
    assert (wave.model, wave.blocks, wave.coherent) == ("direct", 4, False)


def test_every_sight_is_a_choice_of_its_own() -> None:
    found = list(visibility_plans())
    assert len(set(found)) == len(found)
    assert [plan.visibility for plan in visibility_plans(surface=False)] == ["none"]


def test_a_point_cloud_has_no_visibility_and_no_geometry() -> None:
    for plan in (*counting_plans(surface=False), *compared_plans(surface=False)):
        assert plan.visibility == "none"
        assert plan.vertices_kept == 1
        assert plan.mask_reuse_m == 0


def test_without_a_range_law_there_is_none_to_choose() -> None:
    assert {plan.range_law for plan in counting_plans(range_law=False)} == {"vertex"}
    assert {plan.range_law for plan in counting_plans()} == {"vertex", "frame"}


def test_the_reference_of_a_point_cloud_has_no_visibility() -> None:
    assert reference_plan("histogram", surface=False).visibility == "none"


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.0, "0 %"), (1e-9, "<0.001 %"), (0.02, "2 %"), (0.123, "12 %"), (np.inf, "∞ %")],
)
def test_percentages_for_people(share: float, text: str) -> None:
    assert percent(share) == text
