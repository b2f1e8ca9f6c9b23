"""The process that denoises for the window; it answers one request after another.

Run as ``python -m sd2app.jobs.denoise_worker``; it ends when nobody writes to it any more.
"""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from sd2app.jobs.denoise_messages import (
    Message,
    packed_map,
    read_message,
    unpacked_map,
    unpacked_values,
    write_message,
)
from sd2core.errors import Sd2Error

_KEPT = 3
"""Models: the one in use, the one before, and the one that is about to be. Of clips that
are denoised frame after frame as many."""


class Worker:
    """Holds models, and what they remember of frames that come one by one."""

    def __init__(self) -> None:
        self._models: dict[int, Any] = {}
        self._live: dict[int, Any] = {}
        self._next = 0

    def answer(self, content: dict[str, Any], numbers: bytes) -> Message:
        """One answer; what a user can cause is raised as :class:`Sd2Error`."""
        reply: Message = getattr(self, f"_do_{content['do']}")(content, numbers)
        return reply

    def _do_load(self, content: dict[str, Any], numbers: bytes) -> Message:
        from sd2core.denoise.files import load_model

        model = load_model(Path(content["path"]))
        self._models[number := self._number()] = model
        while len(self._models) > _KEPT:
            self._models.pop(next(iter(self._models)))
        about = {"equals_batch": model.live().equals_batch}
        return about | {"model": number, "frame_rate_hz": model.card.frame_rate_hz}, b""

    def _do_denoise(self, content: dict[str, Any], numbers: bytes) -> Message:
        return packed_map(self._model(content).denoise(unpacked_map(content["map"], numbers)))

    def _do_live(self, content: dict[str, Any], numbers: bytes) -> Message:
        self._live[number := self._number()] = self._model(content).live()
        while len(self._live) > _KEPT:
            self._live.pop(next(iter(self._live)))
        return {"live": number}, b""

    def _do_advance(self, content: dict[str, Any], numbers: bytes) -> Message:
        live = self._live.get(content["live"])
        if live is None:
            raise Sd2Error("The model is no longer loaded", remedy="Choose it again")
        frames, bins = content["frames"], content["bins"]
        present = np.frombuffer(numbers, np.bool_, frames)
        values = unpacked_values(numbers, (frames, bins), frames)
        if frames == 1:
            return {}, live.step(values[0], bool(present[0])).tobytes()
        return {}, np.ascontiguousarray(live.advance(values, present)).tobytes()

    def _model(self, content: dict[str, Any]) -> Any:
        model = self._models.get(content["model"])
        if model is None:
            raise Sd2Error("The model is no longer loaded", remedy="Choose it again")
        self._models[content["model"]] = self._models.pop(content["model"])  # the newest in use
        return model

    def _number(self) -> int:
        self._next += 1
        return self._next


def serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Answer until nobody asks any more."""
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
    """Keep answers apart from whatever a library may print."""
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        serve(sys.stdin.buffer, sink)
    return 0


if __name__ == "__main__":
    sys.exit(main())
