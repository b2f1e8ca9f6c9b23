"""Models in a separate process with torch, which the window never loads; tests replace them."""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.card import ClassifierCard
from sd2core.classify.files import available_classifiers, describe_classifier
from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import available_models, describe_model
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.processes import ONE_THREAD

COMMAND = (sys.executable, "-m", "sd2app.background.model_worker.server")


class ModelProcess:
    """Started with the first model and again when it dies; one request at a time.

    Its methods wait for the answer: they belong into background threads.
    """

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self._command = list(command)
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._closed = False

    def ask(self, do: str, *arguments: Any) -> Any:
        """Call a method of its ``Worker``; raises what that raises, or Sd2Error if it is gone."""
        with self._lock:
            process = self._started()
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                pickle.dump((do, arguments), process.stdin, pickle.HIGHEST_PROTOCOL)
                process.stdin.flush()
                answer = pickle.load(process.stdout)
            except (OSError, EOFError, ValueError, pickle.UnpicklingError):
                # It died, or was closed from another thread.
                self._process = None
                _let_go(process)
                answer = Sd2Error(
                    "The process in which the models work has ended",
                    remedy="Choose the model again; if it ends again,"
                    " there may be too little memory",
                )
        if isinstance(answer, Sd2Error):
            raise answer
        return answer

    def close(self) -> None:
        """End it, whatever it is doing."""
        self._closed = True
        busy = self._process
        if busy is not None:
            busy.kill()  # a thread that waits for its answer goes on
        with self._lock:
            process, self._process = self._process, None
            if process is not None:
                _let_go(process)

    def _started(self) -> subprocess.Popen[bytes]:
        if self._closed:
            raise Sd2Error("The window is being closed")
        if self._process is not None and self._process.poll() is not None:
            _let_go(self._process)
            self._process = None
        if self._process is None:
            # One thread: the cores belong to synthesis, video and drawing as well.
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | ONE_THREAD,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        return self._process


def _let_go(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            # No process is left to read the rest.
            with contextlib.suppress(OSError):
                stream.close()


class _Remote:
    """Stand-in for a model in the model process, or Sd2Error; the first one loads torch there."""

    kind: ClassVar[str]
    equals_batch: bool  # frame by frame a denoiser gives the whole map

    def __init__(self, process: ModelProcess, path: Path) -> None:
        self._process = process
        # A file that is written anew is another model.
        self._file = self.kind, path, path.stat().st_mtime_ns
        self.equals_batch = process.ask("load", self._file)

    def live(self) -> RemoteSession:
        """Session for the frames of a clip; those of a classifier all have a person in."""
        return RemoteSession(self._process, self._file)


class RemoteDenoiser(_Remote):
    """Stand-in for a ``TrainedDenoiser`` that works in the model process."""

    kind = "denoiser"

    def __init__(self, process: ModelProcess, path: Path) -> None:
        self.card = describe_model(path)
        super().__init__(process, path)

    def denoise(self, doppler: DopplerMap) -> DopplerMap:
        """Denoised map: an estimate of a radar's map from a synthetic one."""
        # What the model does not take need not travel.
        given = replace(doppler, uncertainty=None, limbs=doppler.limbs if self.card.parts else None)
        denoised: DopplerMap = self._process.ask("call", self._file, "denoise", given)
        return replace(denoised, timebase=doppler.timebase)


class RemoteClassifier(_Remote):
    """Stand-in for a ``TrainedClassifier`` that works in the model process."""

    kind = "classifier"

    def __init__(self, process: ModelProcess, path: Path) -> None:
        self.card = describe_classifier(path)
        super().__init__(process, path)

    def probabilities(self, doppler: DopplerMap) -> NDArray[np.float32]:
        """Class probabilities of every frame of a map, (frames, classes)."""
        given = replace(doppler, uncertainty=None)
        return self._process.ask("call", self._file, "probabilities", given)


class RemoteSession:
    """A clip whose frames come one after another."""

    def __init__(self, process: ModelProcess, file: tuple[str, Path, int]) -> None:
        self._process = process
        self._clip = process.ask("begin", file)

    def advance(
        self, energies: NDArray[np.float32], *present: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Answers of a model to the next frames (frames, features), a row each.

        A denoiser is told in which of them a person is. A classifier answers with probabilities of
        its classes, as late as its card says.
        """
        return self._process.ask("go_on", self._clip, "advance", energies, *present)

    def finish(self) -> NDArray[np.float32]:
        """Outstanding answers of a classifier, as if nothing moved from now on.

        The session stays usable.
        """
        return self._process.ask("go_on", self._clip, "finish")


Card = TypeVar("Card", bound=Any)
Model = TypeVar("Model")


@dataclass(frozen=True)
class ModelLibrary(Generic[Card, Model]):
    """Functions on models of one kind."""

    available: Callable[[], Sequence[Card]]  # bundled models and the user's own
    describe: Callable[[Path], Card]
    load: Callable[[Path], Model]  # takes seconds the first time
    close: Callable[[], None] = lambda: None  # release everything

    def named(self, name: str) -> Card | None:
        """Card of a model that comes with the program; a user's own of that name goes first."""
        return next((card for card in self.available() if card.name == name), None)


DenoiserLibrary = ModelLibrary[ModelCard, RemoteDenoiser]
ClassifierLibrary = ModelLibrary[ClassifierCard, RemoteClassifier]


def core_denoisers(process: ModelProcess) -> DenoiserLibrary:
    """Denoisers of the library, in the model process; cards are read here."""
    return ModelLibrary(
        available_models, describe_model, partial(RemoteDenoiser, process), process.close
    )


def core_classifiers(process: ModelProcess) -> ClassifierLibrary:
    """Classifiers of the library, in the model process; cards are read here."""
    return ModelLibrary(
        available_classifiers, describe_classifier, partial(RemoteClassifier, process)
    )
