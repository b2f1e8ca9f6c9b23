"""A background thread on which the newest request wins."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Any, TypeVar

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from sd2core.errors import of_the_system
from sd2core.progress import Cancelled

Emit = Callable[[Any], None]
"""Hands an intermediate result to the window; raises Cancelled when it is stale."""

Task = Callable[[Emit], Any]
Child = TypeVar("Child", bound=QObject)


def delayed(work: Callable[[], object], delay_ms: int, parent: QObject) -> QTimer:
    """Timer that does some work once, so long after it was last started."""
    timer = QTimer(parent, singleShot=True, interval=delay_ms)
    timer.timeout.connect(work)
    return timer


class LatestRunner(QObject):
    """Runs one task at a time; a newer request cancels the running one.

    Results of a cancelled task are dropped by their revision number, so a
    listener sees only what belongs to the newest request. Signals arrive in
    the thread that owns the runner; ``take`` and ``refuse`` get results and errors.
    """

    partial = Signal(object)
    finished = Signal(object)
    failed = Signal(object)
    idle_changed = Signal(bool)

    _posted = Signal(int, str, object)

    def __init__(
        self,
        name: str,
        parent: QObject | None = None,
        take: Callable[[Any], object] | None = None,
        refuse: Callable[[Exception], object] | None = None,
    ) -> None:
        super().__init__(parent)
        self._name = name
        self._revision = 0
        self._asked = SimpleQueue[tuple[int, Task] | None]()
        self._closed = False
        self.busy = False  # true while the newest request waits for its result
        self._thread: threading.Thread | None = None
        self._posted.connect(self._deliver)
        if take is not None:
            self.finished.connect(take)
        if refuse is not None:
            self.failed.connect(refuse)

    def submit(self, task: Task) -> None:
        """Ask for ``task(emit)`` in the background."""
        if self._closed:
            return
        self._revision += 1
        self._asked.put((self._revision, task))
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()
        self._set_busy(True)

    def cancel(self) -> None:
        """Drop the running and the waiting task; nothing of them is delivered."""
        self._revision += 1
        self._set_busy(False)

    def close(self, timeout_s: float = 5.0) -> None:
        """Cancel, and wait until the thread has left its task."""
        self._closed = True
        self._revision += 1
        self._asked.put(None)
        if self._thread is not None:
            self._thread.join(timeout_s)
        self._set_busy(False)

    def _run(self) -> None:
        for revision, task in iter(self._asked.get, None):
            if revision != self._revision:
                continue  # a newer one waits
            try:
                self._post(revision, "finished", task(partial(self._emit, revision)))
            except Cancelled:
                continue
            except OSError as error:
                self._post(revision, "failed", of_the_system(error))
            except Exception as error:
                self._post(revision, "failed", error)

    def _emit(self, revision: int, value: Any) -> None:
        if revision != self._revision:
            raise Cancelled
        if value is not None:
            self._post(revision, "partial", value)

    def _post(self, revision: int, signal: str, value: object) -> None:
        try:
            self._posted.emit(revision, signal, value)
        except RuntimeError:
            # The window is gone and takes no results.
            self._closed = True
            self._asked.put(None)

    def _deliver(self, revision: int, signal: str, value: object) -> None:
        if revision != self._revision:
            return
        if signal != "partial":
            self._set_busy(False)
        getattr(self, signal).emit(value)

    def _set_busy(self, busy: bool) -> None:
        if busy != self.busy:
            self.busy = busy
            self.idle_changed.emit(not busy)


class ClosingModel(QObject):
    """Model whose children work in the background: runners, timers, other such models."""

    def close(self) -> None:
        """Stop all work for good, and wait until it has ended."""
        for timer in self._own(QTimer):
            timer.stop()
        for runner in self._own(LatestRunner):
            runner.close()
        for model in self._own(ClosingModel):
            model.close()

    def _own(self, kind: type[Child]) -> list[Child]:
        return self.findChildren(kind, options=Qt.FindChildOption.FindDirectChildrenOnly)


class BackgroundModel(ClosingModel):
    """Model of which one can tell whether it works."""

    @property
    def busy(self) -> bool:
        """True while one of its children works, or is about to."""
        waiting = any(timer.isActive() for timer in self._own(QTimer))
        return waiting or any(worker.busy for worker in self._workers())

    def _workers(self) -> list[LatestRunner | BackgroundModel]:
        return [*self._own(LatestRunner), *self._own(BackgroundModel)]


class ReportingModel(BackgroundModel):
    """Model that tells why its work failed."""

    failed = Signal(str)

    def _fail(self, error: Exception) -> None:
        self.failed.emit(str(error))


class ProblemModel(BackgroundModel):
    """Model that keeps why its work failed."""

    changed = Signal()
    problem = ""  # why it failed; empty where it did not

    def _refuse(self, error: Exception) -> None:
        self.problem = str(error)
        self.changed.emit()
