"""The process that denoises and classifies for the window; one request after another.

Run as ``python -m sd2app.background.model_worker.server``; it ends when its input does.
"""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from sd2app.background.model_worker.protocol import (
    Message,
    packed_map,
    read_message,
    unpacked_map,
    unpacked_values,
    write_message,
)
from sd2core.errors import Sd2Error

_KEPT = 5
"""Models: the denoiser in use, the one before, the one that is about to be; the classifier
in use, and the next. Of clips that are gone through frame after frame as many."""


class Worker:
    """Holds models, and what they remember of frames that come one by one."""

    def __init__(self) -> None:
        self._models: dict[int, Any] = {}
        self._live: dict[int, Any] = {}
        self._next = 0

    def answer(self, content: dict[str, Any], numbers: bytes) -> Message:
        """Answer a request; errors that a user can cause are raised as :class:`Sd2Error`."""
        reply: Message = getattr(self, f"_do_{content['do']}")(content, numbers)
        return reply

    def _do_load(self, content: dict[str, Any], numbers: bytes) -> Message:
        from sd2core.denoise.files import load_model

        model = load_model(Path(content["path"]))
        self._models[number := self._number()] = model
        self._forget_old(self._models)
        about = {"equals_batch": model.live().equals_batch}
        return about | {"model": number, "frame_rate_hz": model.card.frame_rate_hz}, b""

    def _do_load_classifier(self, content: dict[str, Any], numbers: bytes) -> Message:
        from sd2core.classify.files import load_classifier

        model = load_classifier(Path(content["path"]))
        self._models[number := self._number()] = _Classifying(model)
        self._forget_old(self._models)
        return {"model": number}, b""

    def _do_classify(self, content: dict[str, Any], numbers: bytes) -> Message:
        doppler = unpacked_map(content["map"], numbers)
        return {}, self._model(content).trained.probabilities(doppler).tobytes()

    def _do_denoise(self, content: dict[str, Any], numbers: bytes) -> Message:
        return packed_map(self._model(content).denoise(unpacked_map(content["map"], numbers)))

    def _do_live(self, content: dict[str, Any], numbers: bytes) -> Message:
        self._live[number := self._number()] = self._model(content).live()
        self._forget_old(self._live)
        return {"live": number}, b""

    def _do_advance(self, content: dict[str, Any], numbers: bytes) -> Message:
        live = self._session(content)
        frames, bins = content["frames"], content["bins"]
        present = np.frombuffer(numbers, np.bool_, frames)
        values = unpacked_values(numbers, (frames, bins), frames)
        if frames == 1:
            return _packed(live.step(values[0], bool(present[0])))
        return _packed(live.advance(values, present))

    def _do_finish(self, content: dict[str, Any], numbers: bytes) -> Message:
        return _packed(self._session(content).finish())

    def _session(self, content: dict[str, Any]) -> Any:
        live = self._live.get(content["live"])
        if live is None:
            raise Sd2Error("The model is no longer loaded", remedy="Choose it again")
        # What is used goes last, as what is forgotten goes first.
        self._live[content["live"]] = self._live.pop(content["live"])
        return live

    def _model(self, content: dict[str, Any]) -> Any:
        model = self._models.get(content["model"])
        if model is None:
            raise Sd2Error("The model is no longer loaded", remedy="Choose it again")
        self._models[content["model"]] = self._models.pop(content["model"])  # the newest in use
        return model

    def _forget_old(self, kept: dict[int, Any]) -> None:
        while len(kept) > _KEPT:
            kept.pop(next(iter(kept)))

    def _number(self) -> int:
        self._next += 1
        return self._next


class _Classifying:
    """Classifier with the interface of a denoiser."""

    def __init__(self, trained: Any) -> None:
        self.trained = trained

    def live(self) -> _LiveClasses:
        return _LiveClasses(self.trained)


class _LiveClasses:
    """Frames of one stretch, all with a person, as they come."""

    def __init__(self, trained: Any) -> None:
        self._trained = trained
        self._memory = trained.initial_memory()

    def step(self, energies: NDArray[np.float32], present: bool) -> NDArray[np.float32]:
        return self.advance(energies[None], np.array([present]))

    def advance(
        self, energies: NDArray[np.float32], present: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        found: NDArray[np.float32]
        found, self._memory = self._trained.advance(energies, self._memory)
        return found

    def finish(self) -> NDArray[np.float32]:
        found: NDArray[np.float32] = self._trained.finish(self._memory)
        return found


def _packed(rows: NDArray[np.float32]) -> Message:
    """Answer of a session; one frame of a denoiser is one row."""
    shown = np.ascontiguousarray(np.atleast_2d(rows), np.float32)
    return {"shape": list(shown.shape)}, shown.tobytes()


def serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Answer requests until the input is closed."""
    worker = Worker()
    while (request := read_message(source)) is not None:
        try:
            content, numbers = worker.answer(*request)
        except Sd2Error as error:
            content = {"error": [error.found, error.expected, error.remedy]}
            numbers = b""
        except Exception as error:  # whatever a model does, the window goes on
            content = {"error": [f"The model failed ({error!r})", "", ""]}
            numbers = b""
        write_message(sink, content, numbers)


def main() -> int:
    """Serve, with the output of libraries redirected away from the answers."""
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        serve(sys.stdin.buffer, sink)
    return 0


if __name__ == "__main__":
    sys.exit(main())
