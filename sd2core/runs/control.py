"""Steering a run from outside: one word in a file, which its process reads at every step.

A file works on every system, needs no open connection, and a window that was closed and
opened again can go on steering.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, get_args

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_text

Command = Literal["run", "pause", "stop", "cancel"]
WORDS: tuple[Command, ...] = get_args(Command)

_PAUSED_POLL_S = 0.1


def write_control(path: Path, word: Command) -> None:
    """Write the word that a run is to obey."""
    atomic_write_text(path, word + "\n")


def read_control(path: Path) -> Command:
    """Command that a run is to obey; ``run`` where there is none, or an unknown one."""
    try:
        text = read_text(path, "a word").strip()
    except Sd2Error:
        return "run"
    for word in WORDS:
        if text == word:
            return word
    return "run"


class Control:
    """Orders to a run, by its file or by a signal."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._signal: signal.Signals | None = None

    @property
    def interrupted(self) -> bool:
        """True if Ctrl-C asked for the end."""
        return self._signal is signal.SIGINT

    def word(self) -> Command:
        """Current order. A signal means ``stop``, unless the file says ``cancel``."""
        word = read_control(self._path)
        if self._signal is not None and word != "cancel":
            return "stop"
        return word

    def wait_while_paused(self) -> tuple[Command, float]:
        """Wait until the word is another than ``pause``; return it and the seconds that passed."""
        begun_s = time.monotonic()
        while (word := self.word()) == "pause":
            time.sleep(_PAUSED_POLL_S)
        return word, time.monotonic() - begun_s

    def take_signals(self) -> None:
        """Let SIGTERM and SIGINT mean ``stop``; only in the main thread."""
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGTERM, signal.SIGINT):
                signal.signal(number, self._note)

    def _note(self, number: int, frame: Any) -> None:
        self._signal = signal.Signals(number)


@contextmanager
def signals_kept() -> Iterator[None]:
    """Restore the handlers of SIGTERM and SIGINT at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stop_signals() -> Iterator[threading.Event]:
    """Event that SIGTERM and SIGINT set in place of what they do otherwise.

    An exception in the midst of anything, as Ctrl-C raises, may be lost in a library, or end the
    process with the signal although it was caught.
    """
    stopped = threading.Event()
    with signals_kept():
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGTERM, signal.SIGINT):
                signal.signal(number, lambda *_: stopped.set())
        yield stopped
