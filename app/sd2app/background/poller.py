"""Looking at something again and again, in the background."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import LatestRunner


class RepeatedLook(QObject):
    """Calls a function in a thread at intervals, and at once; never twice at a time.

    Parameters
    ----------
    name : str
        Of the thread.
    look : callable
        May wait for the disk.
    every_ms : int

    Signals
    -------
    found : object
        What it returned.
    failed : Exception
        What it raised; it is called again all the same.
    """

    found = Signal(object)
    failed = Signal(object)

    def __init__(
        self, name: str, look: Callable[[], Any], every_ms: int, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._look = look
        self._runner = LatestRunner(name, self)
        self._runner.finished.connect(self.found)
        self._runner.failed.connect(self.failed)
        self._timer = QTimer(self)
        self._timer.setInterval(every_ms)
        self._timer.timeout.connect(self.look)
        self._timer.start()
        self.look()

    def set_interval(self, every_ms: int) -> None:
        """Look more or less often."""
        self._timer.setInterval(every_ms)

    def look(self) -> None:
        """Look now, unless it is being looked at."""
        if not self._runner.busy:
            self._runner.submit(lambda emit: self._look())

    def close(self) -> None:
        """Look no more."""
        self._timer.stop()
        self._runner.close()
