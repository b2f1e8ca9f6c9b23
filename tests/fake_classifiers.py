"""Classifiers with known answers, for tests of what the window does with them."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from sd2app.background.model_worker.client import ClassifierLibrary
from sd2core.classify.card import ClassifierCard
from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis

CLASSES = ("background", "horizontal", "vertical")


def class_card(path, kinds=("simulated", "denoised"), bins=32):
    return ClassifierCard(
        model="lstm",
        options={},
        axis=VelocityAxis(bins, 2.0),
        null_bins=(14, 15, 16),
        frame_rate_hz=30.0,
        shown="columns",
        classes=CLASSES,
        trained_on=kinds,
        parameters=1234,
        path=Path(path),
    )


def expected(energies):
    """Answers to energies (frames, bins): what approaches is horizontal, what recedes vertical.

    Each remembers half of the answer before, so what came earlier can be seen.
    """
    half = energies.shape[1] // 2
    made, before = np.zeros((len(energies), 3), np.float32), np.zeros(2)
    for frame, column in enumerate(energies):
        before = 0.5 * before + np.array([column[half:].sum(), column[:half].sum()])
        weights = np.array([0.1, *before])
        made[frame] = weights / weights.sum()
    return made


class FakeLive:
    def __init__(self, library):
        self.library, self.seen = library, []
        library.sessions += 1

    def advance(self, energies):
        self.library.wait()
        self.library.frames += len(energies)
        before = self._answered()
        self.seen.extend(energies)
        return expected(np.array(self.seen))[before : self._answered()]

    def finish(self):
        self.library.wait()
        return expected(np.array(self.seen))[self._answered() :]

    def _answered(self):
        return max(len(self.seen) - self.library.delay_frames, 0)


class FakeClassifier:
    def __init__(self, library, card):
        self.library, self.card = library, card

    def probabilities(self, doppler):
        self.library.wait()
        self.library.whole += 1
        return expected(doppler.values.T)

    def live(self):
        return FakeLive(self.library)


class FakeClassifiers:
    """A library of classifiers by path; ``gate`` keeps answers back while a test clears it."""

    def __init__(self, *names):
        self.cards = {}
        for name in names:
            self.add(Path(f"/classifiers/{name}.safetensors"))
        self.sessions = self.frames = self.whole = self.delay_frames = 0
        self.loaded, self.failure = [], None
        self.gate = threading.Event()
        self.gate.set()
        self.library = ClassifierLibrary(
            lambda: list(self.cards.values()), self._describe, self._load
        )

    def add(self, path, **more):
        self.cards[Path(path)] = class_card(path, **more)
        return Path(path)

    def wait(self):
        while not self.gate.wait(0.002):
            pass
        if self.failure is not None:
            raise self.failure

    def _describe(self, path):
        if Path(path) not in self.cards:
            raise Sd2Error(f"{path} is no classifier", "one written by `sd2 classify train`")
        return self.cards[Path(path)]

    def _load(self, path):
        self.loaded.append(path)
        self.wait()
        return FakeClassifier(self, self._describe(path))
