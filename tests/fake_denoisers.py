"""Denoisers with known answers, for tests of what the window does with them."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np

from sd2app.background.model_worker.client import DenoiserLibrary
from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL
from sd2core.denoise.resample_to_model import input_of
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis

NULLED = (14, 15, 16)


def card_of(path, **more):
    about = {
        "model": "gru",
        "options": {},
        "scaling": Scaling(Compression(0.01), Compression(1e-4)),
        "axis": VelocityAxis(32, 2.0),
        "null_bins": NULLED,
        "frame_rate_hz": 30.0,
        "trained_on": "simulated",
        "parameters": 4321,
        "path": Path(path),
    }
    return ModelCard(**(about | more))


def fading(values, gain):
    """The answer to energies (bins, T): each frame, and half of the answer before."""
    made = np.zeros_like(values)
    before = np.zeros(len(values), np.float32)
    for frame in range(values.shape[1]):
        before = gain * values[:, frame] + 0.5 * before
        made[:, frame] = before
    return made


class FakeDenoiser:
    """Causal; it remembers half of its answer."""

    equals_batch = True

    def __init__(self, library, card, gain):
        self.library, self.card, self.gain = library, card, gain

    def denoise(self, doppler):
        self.library.asked.append((len(doppler.timebase), threading.current_thread().name))
        while not self.library.gate.wait(0.002):
            pass
        if self.library.failure is not None:
            raise self.library.failure
        # With parts, the answer is to the last of them.
        values = fading(input_of(doppler, self.card.parts)[:, -32:].T, self.gain)
        if doppler.present is not None:
            values[:, ~doppler.present] = 0.0
        meta = {"denoiser": {"name": self.card.name}, "input": doppler.meta}
        return replace(doppler, values=values, kind="denoised", unit="power", meta=meta, limbs=None)

    def live(self):
        return FakeLive(self)


class FakeLive:
    def __init__(self, denoiser):
        self.denoiser = denoiser
        self.before = 0.0
        denoiser.library.sessions += 1

    def step(self, energies, present=True):
        self.denoiser.library.steps += 1
        self.before = self.denoiser.gain * energies[-32:] + 0.5 * self.before
        return self.before

    def advance(self, energies, present):
        self.denoiser.library.in_order += len(energies)
        return np.stack([self.step(frame) for frame in energies])


class FakeDenoisers:
    """A library of models by path; ``gate`` keeps answers back while a test clears it."""

    def __init__(self, **gains):
        self.cards, self.gains = {}, {}
        for name, gain in gains.items():
            self.add(Path(f"/models/{name}.safetensors"), gain)
        self.asked, self.loaded, self.steps, self.sessions = [], [], 0, 0
        self.in_order = 0
        self.failure = None
        self.gate = threading.Event()
        self.gate.set()
        self.closed = False
        self.library = DenoiserLibrary(
            lambda: list(self.cards.values()), self._describe, self._load, self._close
        )

    @classmethod
    def bundled(cls, gain, limbs_gain=7.0):
        """The two that are chosen of where nobody has chosen."""
        made = cls(**{MAP_MODEL: gain})
        path = Path(f"/models/{LIMBS_MODEL}.safetensors")
        made.add(path, limbs_gain, parts=("trunk", "forearm.R"))
        return made

    def add(self, path, gain, **more):
        self.cards[path] = card_of(path, **more)
        self.gains[path] = gain
        return path

    def _describe(self, path):
        if Path(path) not in self.cards:
            raise Sd2Error(f"{path} is no model file", "a model file written by `sd2 train`")
        return self.cards[Path(path)]

    def _load(self, path):
        self.loaded.append(path)
        return FakeDenoiser(self, self._describe(path), np.float32(self.gains[Path(path)]))

    def _close(self):
        self.closed = True
        self.gate.set()
