"""Waiting for the machine code that makes exact visibility fast."""

from __future__ import annotations

import subprocess

from PySide6.QtCore import QObject, QTimer, Signal

from sd2core.numerics.compiled import compile_in_background, kernels_ready

_POLL_MS = 500


class CompilerModel(QObject):
    """Starts the compiler where there is no machine code yet, and says when it is over."""

    finished = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process: subprocess.Popen[bytes] | None = None
        self._poll = QTimer(self)
        self._poll.setInterval(_POLL_MS)
        self._poll.timeout.connect(self._watch)

    @property
    def ready(self) -> bool:
        """Whether there is machine code."""
        return kernels_ready()

    @property
    def busy(self) -> bool:
        """Whether machine code is on its way."""
        return not self.ready and self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Compile what is not compiled."""
        self._process = compile_in_background()
        if self.busy:
            self._poll.start()

    def stop(self) -> None:
        """Wait no longer."""
        self._poll.stop()

    def _watch(self) -> None:
        if not self.busy:
            self._poll.stop()
            self.finished.emit()
