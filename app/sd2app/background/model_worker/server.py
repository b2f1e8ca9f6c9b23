"""The process that denoises and classifies for the window; one request after another.

Run as ``python -m sd2app.background.model_worker.server``; it ends when its input does. A request
is the name of a method of :class:`Worker` with its arguments, pickled; the answer is what it
returns, or the error.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import time
from pathlib import Path
from typing import Any, BinaryIO

from sd2core.errors import Sd2Error
from sd2core.processes import keep_little_free_memory, return_free_memory

_KEPT = 5
"""Models: the denoiser in use, the one before, the one that is about to be; the classifier
in use, and the next. Of clips that are gone through frame after frame as many."""

_LONG_S = 0.03
"""After an answer that took so long freed memory is given back, which takes milliseconds: not
between those about single frames."""


class Worker:
    """Holds models, and what they remember of frames that come one by one.

    Errors that a user can cause are raised as Sd2Error.
    """

    def __init__(self) -> None:
        self._models: dict[int, Any] = {}
        self._live: dict[int, Any] = {}
        self._next = 0

    def load(self, path: Path) -> tuple[int, bool]:
        """Number of a denoiser, and if frame by frame it gives what it gives of a whole map."""
        from sd2core.denoise.files import load_model

        model = load_model(path)
        return self._keep(self._models, model), model.live().equals_batch

    def load_classifier(self, path: Path) -> int:
        """Number of a classifier."""
        from sd2core.classify.files import load_classifier

        return self._keep(self._models, load_classifier(path))

    def begin(self, model: int) -> int:
        """Number of a new clip whose frames come one after another."""
        return self._keep(self._live, self._newest(model).live())

    def call(self, number: int, method: str, *arguments: Any) -> Any:
        """Result of a method of a model, or of a clip."""
        return getattr(self._newest(number), method)(*arguments)

    def _keep(self, kept: dict[int, Any], one: Any) -> int:
        self._next += 1
        kept[self._next] = one
        while len(kept) > _KEPT:
            kept.pop(next(iter(kept)))
        return self._next

    def _newest(self, number: int) -> Any:
        """Return what has a number, and put it last: what is forgotten goes first."""
        kept = self._models if number in self._models else self._live
        if number not in kept:
            raise Sd2Error("The model is no longer loaded", remedy="Choose it again")
        kept[number] = kept.pop(number)
        return kept[number]


def serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Answer requests until the input is closed."""
    worker = Worker()
    while True:
        try:
            do, arguments = pickle.load(source)
        except EOFError:
            return
        begun_s = time.monotonic()
        try:
            answer = getattr(worker, do)(*arguments)
        except Sd2Error as error:
            answer = error
        except Exception as error:  # whatever a model does, the window goes on
            answer = Sd2Error(f"The model failed ({error!r})")
        pickle.dump(answer, sink, pickle.HIGHEST_PROTOCOL)
        sink.flush()
        if time.monotonic() - begun_s > _LONG_S:
            return_free_memory()


def main() -> int:
    """Serve, with the output of libraries redirected away from the answers."""
    keep_little_free_memory()
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        serve(sys.stdin.buffer, sink)
    return 0


if __name__ == "__main__":
    sys.exit(main())
