"""The accuracy that a map states: of the body and of the arithmetic, and of both together."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from doppler_scenes import CAMERA, wobbling

from sd2core.body.parts import synthetic_map
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.body_error import BODY_FACTOR, body_error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.map_accuracy import MapAccuracy


def ball(frames: int, sigma_mps: float) -> MeshSequence:
    mesh = wobbling(frames, divisions=2)
    limbs = np.zeros(mesh.vertex_count, int)
    sigma = np.full((frames, 1), sigma_mps)
    return replace(mesh, uncertainty=VelocityUncertainty(("all",), limbs, sigma, sigma))


@pytest.mark.parametrize(
    ("body", "arithmetic", "words"),
    [
        (0.37, 0.075, "±38 % (body 37, arithmetic 7.5)"),
        (0.37, None, "±37 % (body 37)"),
        (None, 0.031, "±3.1 %"),
        (None, 0.0, "±0 %"),
        (None, 1e-6, "<0.001 %"),
        (None, None, ""),
    ],
)
def test_one_figure_holds_both_parts(
    body: float | None, arithmetic: float | None, words: str
) -> None:
    accuracy = MapAccuracy(body, arithmetic)
    assert str(accuracy) == words
    if words:
        assert accuracy.total == pytest.approx(math.hypot(body or 0.0, arithmetic or 0.0))
    else:
        assert accuracy.total is None


@pytest.mark.parametrize("count", ["expected", "plain"])
def test_the_body_is_the_expected_deviation_of_the_cells(count: str) -> None:
    maker = Synthesizer(ball(24, 0.2), replace(PRESETS["paper"], count=count))
    known, values = maker.uncertainty(CAMERA), maker.map(CAMERA).values
    drawn = np.random.default_rng(1).normal(known.expected, known.sd, (4000, *values.shape))
    expected = np.abs(drawn - values).mean(axis=0).sum() / known.expected.sum()
    found = body_error(maker, CAMERA)
    assert found == pytest.approx(BODY_FACTOR * expected, rel=0.01)
    made = synthetic_map(maker, CAMERA, limbs=False)
    assert made.accuracy == MapAccuracy(body=found)
    assert replace(made, meta=made.meta | {"plan_error_l1": 0.1}).accuracy.arithmetic == 0.1


def test_of_a_long_clip_some_stretches_tell_about_the_same() -> None:
    maker = Synthesizer(ball(600, 0.2))
    known, values = maker.uncertainty(CAMERA), maker.map(CAMERA).values
    drawn = np.random.default_rng(2).normal(known.expected, known.sd, (200, *values.shape))
    told: list[tuple[int, int]] = []
    found = body_error(maker, CAMERA, progress=lambda *now: told.append(now))
    whole = np.abs(drawn - values).mean(axis=0).sum() / known.expected.sum()
    assert found == pytest.approx(BODY_FACTOR * whole, rel=0.05)
    assert told[-1] == (8, 8)


def test_what_is_exactly_known_or_not_stated_is_no_error_of_the_body() -> None:
    for mesh in (ball(12, 0.0), replace(ball(12, 0.2), uncertainty=None)):
        made = synthetic_map(Synthesizer(mesh), CAMERA, limbs=False)
        assert made.accuracy == MapAccuracy()
        assert "body_error_l1" not in made.meta
