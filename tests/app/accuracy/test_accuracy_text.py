from __future__ import annotations

from dataclasses import replace

import pytest
from fake_accuracy import FACING, result_of

from sd2app.accuracy.measurements import InUse, chosen_sentence, point_text, short
from sd2app.widgets.text import milliseconds, seconds
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.numerics.map_accuracy import percent


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (1e-6, "<0.001 %"),
        (0.0004, "0.04 %"),
        (0.0078, "0.78 %"),
        (0.05, "5 %"),
        (0.0996, "10 %"),
        (0.134, "13 %"),
        (2.5, "250 %"),
    ],
)
def test_shares_have_two_digits_and_no_exponent(share, text):
    assert percent(share) == text


def test_the_accuracy_holds_the_body_where_it_is_known():
    assert InUse(FACING, 0.031, 0.6).accuracy == "±3.1 %"
    known = InUse(FACING, 0.031, 0.6, body=0.37)
    assert known.accuracy == "±37 % (body 37, arithmetic 3.1)"
    assert str(known) == f"{FACING} · ±37 % (body 37, arithmetic 3.1) · 0.6 ms/frame"
    assert replace(known, pending=True).accuracy == "±37 % (body 37, arithmetic 3.1)…"
    words = chosen_sentence(known, 100)
    assert "3.1 % off the reference – ±37 % (body 37, arithmetic 3.1) with the body – and" in words


@pytest.mark.parametrize(
    ("value_ms", "text"),
    [(0.0, "0 ms"), (2e-4, "<0.001 ms"), (0.0123, "0.012 ms"), (1.26, "1.3 ms"), (458.2, "458 ms")],
)
def test_costs_have_two_digits_and_no_exponent(value_ms, text):
    assert milliseconds(value_ms) == text


def test_a_clip_takes_seconds_or_less():
    assert seconds(0.27) == "270 ms"
    assert seconds(1.26) == "1.3 s"


def test_a_plan_is_said_shortly_and_with_its_figures():
    plan = AccuracyPlan(mask_stride=5, vertices_kept=0.25, frame_rate_factor=2)
    assert short(plan) == (
        "visibility exact · mask every 5 frames · 25 % of the vertices · frame rate × 2"
    )
    assert short(AccuracyPlan(visibility="depth", depth_resolution=128)) == "depth 128"
    text = str(InUse(plan, 0.008, 0.6))
    assert text == f"{plan} · ±0.8 % · 0.6 ms/frame"


@pytest.mark.parametrize(
    ("peak_bytes", "line"), [(3 << 20, "3 MiB at most, 250 ms once"), (None, "250 ms once")]
)
def test_memory_is_said_where_it_was_measured(peak_bytes, line):
    result = result_of(FACING, 1.0, 0.01)
    result = replace(result, cost=replace(result.cost, peak_bytes=peak_bytes))
    assert point_text(result).splitlines()[-1].startswith(line)
