"""Classifying a clip at once, and frame by frame."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from timing import spent_s

from sd2core.classify.card import ClassifierCard
from sd2core.classify.defaults import MODELS
from sd2core.classify.live import LiveClasses, TrainedClassifier
from sd2core.classify.models import build
from sd2core.sensor import VelocityAxis

FRAMES, RATE_HZ = 450, 30.0


pytestmark = pytest.mark.usefixtures("one_thread")


def classifier(name: str) -> TrainedClassifier:
    maps, classes = (VelocityAxis(), (14, 15, 16), RATE_HZ), ("background", "one", "other")
    card = ClassifierCard(name, {}, *maps, "columns", classes, ("real",), 15)
    return TrainedClassifier(build(name, card.features.size, 3), card)


def test_a_clip_at_once_and_frame_by_frame(
    benchmark: BenchmarkFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    values = np.random.default_rng(0).exponential(0.01, (FRAMES, 32)).astype(np.float32)
    rows = []
    for name in MODELS:
        model = classifier(name)
        model.probabilities_of(values)
        map_s = spent_s(partial(model.probabilities_of, values), 5)
        session = model.live()
        session.advance(values)

        def live(session: LiveClasses = session) -> None:
            session.advance(values[:1])
            # The window also asks what is owed, if nothing moves from now on.
            session.finish()

        rows.append((name, map_s, spent_s(live, 100)))
    benchmark.pedantic(classifier("lstm").probabilities_of, (values,), rounds=3)
    with capsys.disabled():
        for name, map_s, frame_s in rows:
            print(
                f"\n{name}, 1 thread: {FRAMES} frames {1e3 * map_s:.1f} ms, a frame live"
                f" {1e3 * frame_s:.2f} ms, {frame_s * RATE_HZ:.1%} of a frame's time",
                end="",
            )
    for _, map_s, frame_s in rows:
        assert FRAMES * frame_s > 3 * map_s
        assert frame_s * RATE_HZ < 0.5
