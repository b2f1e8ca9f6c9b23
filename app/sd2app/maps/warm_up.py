"""Preparation of the next drag while the sensor rests."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2app.maps.partial_map import View
from sd2app.maps.quality import SynthesizerCache
from sd2app.session.tasks import Job, TaskList
from sd2core.numerics.compiled import compile_in_background, kernels_compiled, kernels_ready
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_POLL_MS = 500


class MaskPrefetcher(LatestRunner):
    """Prepares the mesh of the plan for dragging, and its masks from where the sensor rests."""

    def __init__(self, parent: QObject) -> None:
        super().__init__("ready", parent)
        self.prefetched_for: VirtualSensor | None = None  # whose masks are there
        self.finished.connect(self._note)

    def prefetch(
        self,
        synthesizers: SynthesizerCache,
        plan: AccuracyPlan,
        sensor: VirtualSensor,
        frames: View,
    ) -> None:
        """Apply a plan once to the frames that will follow a drag."""

        def work(emit: Emit) -> VirtualSensor:
            synthesizer = synthesizers.of(plan)
            parts = synthesizers.parts_of(synthesizer)
            synthesizer.stretch(
                sensor, *frames, progress=lambda *_: emit(None), parts=parts, shares=False
            )
            return sensor

        self.submit(work)

    def forget(self) -> None:
        """Drop the masks: plan or mesh have changed."""
        self.cancel()
        self.prefetched_for = None

    def _note(self, sensor: VirtualSensor) -> None:
        self.prefetched_for = sensor


class CompilerModel(QObject):
    """Starts the compiler where there is no machine code yet, and says how far it is."""

    finished = Signal()

    def __init__(self, jobs: TaskList, parent: QObject) -> None:
        super().__init__(parent)
        self._process: subprocess.Popen[bytes] | None = None
        self._jobs = jobs
        self._job: Job | None = None
        self._poll = QTimer(self, interval=_POLL_MS)
        self._poll.timeout.connect(self._watch)

    @property
    def ready(self) -> bool:
        """True once the machine code is there."""
        return kernels_ready()

    @property
    def busy(self) -> bool:
        """True while machine code is being compiled."""
        return not self.ready and self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Compile what is not compiled: a map waits for it."""
        self._process = process = compile_in_background(awaited=True)
        if process is not None and self.busy and self._job is None:
            self._job = self._jobs.start(
                "Compiling the numerical kernels, once after installing", process.terminate
            )
            self._poll.start()

    def stop(self) -> None:
        """Stop waiting."""
        self._poll.stop()
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None

    def _watch(self) -> None:
        if not self.busy:
            self.stop()
            self.finished.emit()
        elif self._job is not None:
            self._jobs.report(self._job, *kernels_compiled())
