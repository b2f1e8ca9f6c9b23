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
from pathlib import Path
from typing import Any, Generic, TypeVar

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

    Its methods wait for the answer: they belong into background threads. ``generation``
    counts the starts: a new process has none of the models that earlier ones had loaded.
    """

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self._command = list(command)
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._closed = False
        self.generation = 0

    @property
    def running(self) -> bool:
        """True while there is a process."""
        return self._process is not None and self._process.poll() is None

    def load(self, path: Path) -> RemoteDenoiser:
        """Load a model, or raise Sd2Error; the first one takes as long as loading torch."""
        return RemoteDenoiser(self, path)

    def load_classifier(self, path: Path) -> RemoteClassifier:
        """Load a classifier beside the denoisers, or raise Sd2Error."""
        return RemoteClassifier(self, path)

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
            self.generation += 1
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
    """Stand-in for a model in the model process."""

    def __init__(self, process: ModelProcess, path: Path) -> None:
        self._process = process
        self._path = path
        self._number = self._load()
        self._generation = process.generation

    def _load(self) -> int:
        """Load the model and return its number."""
        raise NotImplementedError

    def _ready(self) -> int:
        """Number of the model, loaded again if its process has died."""
        if not self._process.running or self._process.generation != self._generation:
            self._number = self._load()
            self._generation = self._process.generation
        return self._number


class RemoteDenoiser(_Remote):
    """Stand-in for a ``TrainedDenoiser`` that works in the model process."""

    equals_batch: bool  # frame by frame it gives the whole map

    def __init__(self, process: ModelProcess, path: Path) -> None:
        self.card = describe_model(path)
        super().__init__(process, path)

    def denoise(self, doppler: DopplerMap) -> DopplerMap:
        """Denoised map: an estimate of a radar's map from a synthetic one."""
        # What the model does not take need not travel.
        given = replace(doppler, uncertainty=None, limbs=doppler.limbs if self.card.parts else None)
        denoised: DopplerMap = self._process.ask("call", self._ready(), "denoise", given)
        return replace(denoised, timebase=doppler.timebase)

    def live(self) -> RemoteLive:
        """Session for live frames; it replaces the session before."""
        return RemoteLive(self._process, self._ready())

    def _load(self) -> int:
        number, self.equals_batch = self._process.ask("load", self._path)
        return int(number)


class RemoteClassifier(_Remote):
    """Stand-in for a ``TrainedClassifier`` that works in the model process."""

    def probabilities(self, doppler: DopplerMap) -> NDArray[np.float32]:
        """Class probabilities of every frame of a map, (frames, classes)."""
        given = replace(doppler, uncertainty=None)
        return self._process.ask("call", self._ready(), "probabilities", given)

    def live(self) -> RemoteClasses:
        """Session for live frames of one stretch, all with a person."""
        return RemoteClasses(self._process, self._ready())

    def _load(self) -> int:
        return int(self._process.ask("load_classifier", self._path))


class _RemoteSession:
    """A clip whose frames come one after another."""

    def __init__(self, process: ModelProcess, model: int) -> None:
        self._process = process
        self._clip = process.ask("begin", model)
        self._generation = process.generation

    def _ask(self, do: str, *arguments: Any) -> NDArray[np.float32]:
        if self._process.generation != self._generation:
            raise Sd2Error(
                "The process in which the models work was started again",
                remedy="Choose the model again",
            )
        return self._process.ask("call", self._clip, do, *arguments)


class RemoteClasses(_RemoteSession):
    """Frames with a person in; probabilities of the classes out, as late as the card says."""

    def advance(self, energies: NDArray[np.float32]) -> NDArray[np.float32]:
        """Probabilities that follow from the next frames: (frames, bins) → (answers, classes)."""
        return self._ask("advance", energies)

    def finish(self) -> NDArray[np.float32]:
        """Outstanding answers, as if nothing moved from now on; the session stays usable."""
        return self._ask("finish")


class RemoteLive(_RemoteSession):
    """Session that takes frames and answers each of them."""

    def advance(
        self, energies: NDArray[np.float32], present: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Answers to the next frames (frames, features), one row for each."""
        return self._ask("advance", energies, present)


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
    return ModelLibrary(available_models, describe_model, process.load, process.close)


def core_classifiers(process: ModelProcess) -> ClassifierLibrary:
    """Classifiers of the library, in the model process; cards are read here."""
    return ModelLibrary(available_classifiers, describe_classifier, process.load_classifier)
