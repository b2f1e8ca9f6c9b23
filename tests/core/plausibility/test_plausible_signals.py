"""What maps, inertial samples and labels are judged to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.plausibility.radar import judge_map
from sd2core.plausibility.samples import judge_inertial
from sd2core.plausibility.spans import judge_spans

RNG = np.random.default_rng(0)
TIMES_S = np.arange(100) / 30


def test_noise_is_a_signal():
    assert judge_map(RNG.random((32, 100)), TIMES_S) == []


def test_empty_frames_are_lost_in_a_radar_and_rest_in_a_computed_map():
    values = RNG.random((32, 100))
    values[:, 20:30] = 0
    (finding,) = judge_map(values, TIMES_S)
    assert "10 of 100 frames (10%)" in finding.found
    assert judge_map(values, TIMES_S, measured=False) == []
    assert judge_map(values, TIMES_S, ~np.isin(np.arange(100), range(20, 30))) == []
    (finding,) = judge_map(0 * values, TIMES_S, measured=False)
    assert "nothing but zeros" in finding.found
    assert "Nobody moves" in finding.remedy
    (finding,) = judge_map(np.zeros((32, 1)), TIMES_S[:1], measured=False)
    assert "One frame alone" in finding.remedy


@pytest.mark.parametrize(
    ("factor", "unit"), [(1.0, ""), (1 / 9.81, "in g"), (1000 / 9.81, "thousandths of g")]
)
def test_the_unit_of_accelerations_is_known_by_gravity(factor, unit):
    acceleration = np.array([0.3, -9.7, 1.0]) * factor + RNG.normal(0, 0.1 * factor, (200, 3))
    findings = judge_inertial(np.arange(200) / 100, acceleration, np.zeros((200, 3)))
    assert len(findings) == (1 if unit else 0)
    assert all(unit in finding.remedy for finding in findings)


def test_what_is_not_known_is_not_judged_and_degrees_are():
    unknown = np.full((50, 3), np.nan)
    assert judge_inertial(np.arange(50) / 100, unknown, unknown) == []
    (finding,) = judge_inertial(np.arange(50) / 100, unknown, np.full((50, 3), 90.0))
    assert "degrees per second" in finding.remedy


@given(st.lists(st.tuples(st.floats(0, 9), st.floats(0.1, 1)), max_size=9), st.floats(1, 100))
def test_only_labels_beyond_the_recording_are_counted(inside, beyond_s):
    spans = [(start, start + length) for start, length in inside]
    assert judge_spans(spans, 0.0, 10.0) == []
    (finding,) = judge_spans([*spans, (9.0, 10.0 + beyond_s)], 0.0, 10.0)
    assert finding.found.startswith(f"1 of {len(spans) + 1} labels reaches beyond")


def test_labels_in_milliseconds_are_recognised():
    (finding,) = judge_spans([(2000.0, 3000.0), (4000.0, 5000.0)], 0.0, 10.0)
    assert "milliseconds" in finding.remedy
