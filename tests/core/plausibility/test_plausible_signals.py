"""What maps, captures, inertial samples and labels are judged to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.plausibility.radar import judge_map, judge_samples
from sd2core.plausibility.samples import judge_inertial
from sd2core.plausibility.spans import judge_spans

RNG = np.random.default_rng(0)
TIMES_S = np.arange(100) / 30


def counts(rms=200.0):
    return np.clip(2048 + RNG.normal(0, rms, (10, 3, 8, 32)), 0, 4095).astype(np.uint16)


def test_noise_is_a_signal():
    assert judge_samples(counts(), 10, converter_bits=12) == []
    complex_ = RNG.normal(0, 0.1, (10, 2, 8, 16, 2)).astype(np.float32).view(np.complex64)[..., 0]
    assert judge_samples(complex_, 10, converter_bits=16) == []
    assert judge_map(RNG.random((32, 100)), TIMES_S) == []


@pytest.mark.parametrize("value", [0, 2048, 4095])
def test_a_capture_of_one_value_is_none(value):
    (finding,) = judge_samples(np.full((4, 3, 8, 32), value, np.uint16), 4, converter_bits=12)
    assert str(value) in finding.found
    assert "no capture" in finding.remedy


def test_a_silent_receiver_is_named_by_its_number():
    samples = counts()
    samples[:, 1] = 2048
    (finding,) = judge_samples(samples, 10, converter_bits=12)
    assert "channel 2 of 3" in finding.found
    assert "--receiver" in finding.remedy


def test_the_share_of_lost_chirps_is_counted():
    samples = counts()
    samples[4, :, :4] = 0  # half of the chirps of one frame in ten
    (finding,) = judge_samples(samples, 10, converter_bits=12)
    assert finding.found.startswith("5.0% of the chirps hold")
    assert "Packets" in finding.remedy


def test_an_overdriven_receiver_and_bytes_in_another_order_are_told_apart():
    (loud,) = judge_samples(counts(rms=1500.0), 10, converter_bits=12)
    assert "overdriven" in loud.remedy
    quiet = RNG.normal(0, 200, (10, 3, 8, 32)).astype("<i2")
    swapped = (quiet.view(">i2").astype(np.float32) / 2**15).reshape(10, 3, 8, 32)
    (order,) = judge_samples(swapped, 10, converter_bits=16)
    assert "another order" in order.remedy
    assert judge_samples(swapped, 10, converter_bits=None) == []


def test_empty_frames_are_lost_in_a_radar_and_rest_in_a_computed_map():
    values = RNG.random((32, 100))
    values[:, 20:30] = 0
    (finding,) = judge_map(values, TIMES_S)
    assert "10 of 100 frames (10%)" in finding.found
    assert judge_map(values, TIMES_S, measured=False) == []
    assert judge_map(values, TIMES_S, ~np.isin(np.arange(100), range(20, 30))) == []
    assert "Every value" in judge_map(0 * values, TIMES_S, measured=False)[0].found


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
