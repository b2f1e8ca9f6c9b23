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
import uuid
from functools import lru_cache
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


@lru_cache(maxsize=_KEPT)
def _model(kind: str, path: Path, changed_ns: int) -> Any:
    """Load a model, once as long as its file stays as it is."""
    if kind == "denoiser":
        from sd2core.denoise.files import load_model

        return load_model(path)
    from sd2core.classify.files import load_classifier

    return load_classifier(path)


class Worker:
    """Answers about models, and what they remember of frames that come one by one.

    A model is named by its kind, its file and when that was changed. Errors that a user can cause
    are raised as Sd2Error.
    """

    def __init__(self) -> None:
        self._live: dict[str, Any] = {}

    def load(self, file: tuple[str, Path, int]) -> bool:
        """Load a model; True if frame by frame it gives what it gives of a whole map."""
        return bool(getattr(_model(*file).network, "causal", True))

    def call(self, file: tuple[str, Path, int], method: str, *arguments: Any) -> Any:
        """Result of a method of a model."""
        return getattr(_model(*file), method)(*arguments)

    def begin(self, file: tuple[str, Path, int]) -> str:
        """Name of a new clip whose frames come one after another."""
        name = uuid.uuid4().hex
        self._live[name] = _model(*file).live()
        while len(self._live) > _KEPT:
            self._live.pop(next(iter(self._live)))
        return name

    def go_on(self, clip: str, method: str, *arguments: Any) -> Any:
        """Result of a method of a clip; the one that was not asked for longest is forgotten."""
        if clip not in self._live:
            raise Sd2Error(
                "The process in which the models work was started again",
                remedy="Choose the model again",
            )
        self._live[clip] = self._live.pop(clip)
        return getattr(self._live[clip], method)(*arguments)


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
