"""The synthetic Doppler map that follows the sensor."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.jobs.latest import LatestRunner
from sd2app.models.canvas import FINAL, RANK, Canvas, View
from sd2app.models.content import reference_of
from sd2app.models.document import DocumentModel
from sd2app.models.jobs import Job, JobsModel
from sd2app.models.playback import PlaybackModel
from sd2app.models.refine import Part, refine, sweep
from sd2app.models.sensor import SensorModel
from sd2app.models.tracks import TrackModel
from sd2app.models.visible_span import VisibleSpanModel
from sd2core.compiled import compile_in_background, kernels_ready
from sd2core.doppler.options import PRESETS
from sd2core.doppler.synthesizer import FrameScattering, Synthesizer, Visibility
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled
from sd2core.sensor import Vector
from sd2core.spectrum import DopplerMap

_COMPILER_POLL_MS = 500
_REST_MS = 300
"""A hand that holds the sensor still for so long is at rest."""

_WORDS = {
    RANK["facing"]: "preview: vertices facing the sensor",
    RANK["frozen"]: "preview: visibility of the nearest exact placement",
}
_FINAL_WORDS = {
    "none": "all vertices of the point cloud",
    "facing": "vertices facing the sensor",
    "depth": "visibility by depth buffer",
    "exact": "exact visibility",
}


@dataclass(frozen=True)
class Readout:
    """What the sensor makes of the frame on screen."""

    torso_range_m: float
    visible_share: float
    beyond_share: float


class SynthesisModel(QObject):
    """Recomputes when the sensor moves: at once roughly, exactly when the hand rests.

    While a hand moves the sensor, one sweep runs at a time and the newest
    position follows it. At rest an exact pass runs in the background, the
    stretch in view first; any new move interrupts it.
    """

    frame_changed = Signal()
    target_changed = Signal()
    readout_changed = Signal()
    completed = Signal()
    failed = Signal(str)

    def __init__(
        self,
        document: DocumentModel,
        sensor: SensorModel,
        playback: PlaybackModel,
        span: VisibleSpanModel,
        track: TrackModel,
        jobs: JobsModel,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._document = document
        self._sensor = sensor
        self._playback = playback
        self._span = span
        self._track = track
        self._jobs = jobs
        self._job: Job | None = None
        self._synthesizer: Synthesizer | None = None
        self._canvas = Canvas.blank(2, 0)
        self._frame: tuple[Any, FrameScattering] | None = None
        self._torso: tuple[int, Vector] | None = None
        self._forget()
        self._runner = LatestRunner("synthesis", self)
        self._runner.partial.connect(self._receive)
        self._runner.finished.connect(self._finish)
        self._runner.failed.connect(self._fail)
        self._compiler: subprocess.Popen[bytes] | None = None
        self._compiler_poll = QTimer(self)
        self._compiler_poll.setInterval(_COMPILER_POLL_MS)
        self._compiler_poll.timeout.connect(self._watch_compiler)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_REST_MS)
        self._rest.timeout.connect(self._settle)
        sensor.changed.connect(self._follow)
        sensor.dragging_changed.connect(lambda _: self._follow())
        span.changed.connect(self._reorder)
        playback.frame_changed.connect(self._follow_clock)

    # --- what is known --------------------------------------------------------------------

    @property
    def v_max_mps(self) -> float:
        """Edge of the velocity axis."""
        return self._synthesizer.options.axis.v_max_mps if self._synthesizer else 2.0

    @property
    def busy(self) -> bool:
        """Whether a better map is on its way."""
        return self._runner.busy or self._compiling

    @property
    def complete(self) -> bool:
        """Whether every frame is exact for the sensor where it stands."""
        return self._canvas.final and self._canvas.sensor == self._sensor.sensor

    @property
    def torso_m(self) -> Vector | None:
        """Median vertex of the frame on screen: inside the torso whatever the limbs do."""
        index = self._mesh_frame()
        mesh = self._document.mesh
        if index is None or mesh is None:
            return None
        if self._torso is None or self._torso[0] != index:
            x, y, z = np.median(mesh.frame(index), axis=0)
            self._torso = (index, (float(x), float(y), float(z)))
        return self._torso[1]

    @property
    def frame(self) -> FrameScattering | None:
        """Velocity, range and visibility of every vertex in the frame on screen."""
        index = self._mesh_frame()
        if index is None or self._synthesizer is None:
            return None
        key = (index, self._sensor.sensor, self._frame_visibility())
        if self._frame is None or self._frame[0] != key:
            self._frame = (key, self._synthesizer.frame(key[1], index, key[2]))
        return self._frame[1]

    def readout(self) -> Readout | None:
        """Numbers beside the sensor, None without a mesh on screen."""
        frame, torso = self.frame, self.torso_m
        if frame is None or torso is None:
            return None
        offset = np.subtract(self._sensor.sensor.position_m, torso)
        seen = np.abs(frame.velocity_mps[frame.visible])
        return Readout(
            torso_range_m=float(np.linalg.norm(offset)),
            visible_share=float(frame.visible.mean()),
            beyond_share=float((seen > self.v_max_mps).mean()) if seen.size else 0.0,
        )

    # --- requests -------------------------------------------------------------------------

    def take_over(self) -> None:
        """Start on the mesh of the document that is open now."""
        self._rest.stop()
        self._runner.cancel()
        self._end_job()
        self._synthesizer = None
        self._forget()
        self._track.set_map(None)
        mesh = self._document.mesh
        if mesh is None:
            self._announce()
            return
        options = PRESETS["paper"]
        if mesh.faces is None:
            options = replace(options, visibility="none")
        try:
            self._synthesizer = Synthesizer(mesh, options)
        except Sd2Error as error:
            self.failed.emit(str(error))
            return
        self._canvas = Canvas.blank(options.axis.bins, mesh.frame_count)
        self._compiler = compile_in_background()
        if self._compiling:
            self._compiler_poll.start()
        self._announce()
        self._follow()

    def export(self, path: Path) -> None:
        """Write the exact map with its provenance."""
        if self._synthesizer is None or not self.complete:
            raise Sd2Error("The synthetic map is not complete yet", "an exact map", "Wait for it")
        self._synthesizer.map(self._sensor.sensor).save(path)

    def close(self) -> None:
        """Stop computing."""
        self._rest.stop()
        self._compiler_poll.stop()
        self._runner.close()
        self._end_job()

    # --- following ------------------------------------------------------------------------

    def _forget(self) -> None:
        self._canvas = Canvas.blank(2, 0)
        self._frame = None
        self._torso = None
        self._needs_reference = True
        self._again = False
        self._sweeping = False

    def _announce(self) -> None:
        self.target_changed.emit()
        self.frame_changed.emit()
        self.readout_changed.emit()

    def _follow_clock(self) -> None:
        if self._synthesizer is not None:
            self._announce()

    def _follow(self) -> None:
        if self._synthesizer is None:
            return
        self.frame_changed.emit()
        self.readout_changed.emit()
        if self._sensor.dragging:
            self._rest.start()
            if self._sweeping and self._runner.busy:
                self._again = True
            else:
                self._sweep()
        else:
            self._settle()

    def _sweep(self) -> None:
        """One rough pass for the sensor where it is now, never interrupted."""
        assert self._synthesizer is not None
        self._end_job()
        self._again, self._sweeping = False, True
        synthesizer, sensor = self._synthesizer, self._sensor.sensor
        view, rough = self._frames_in_view(), self._rough()
        self._runner.submit(lambda emit: sweep(synthesizer, sensor, view, rough))

    def _settle(self) -> None:
        """Rough where nothing is known yet, then exact; the stretch in view first."""
        if self._synthesizer is None:
            return
        self._rest.stop()
        self._end_job()
        self._again = self._sweeping = False
        synthesizer, sensor = self._synthesizer, self._sensor.sensor
        rank = self._canvas.ranks_for(sensor)
        if rank.min() >= FINAL:
            return
        view, rough = self._frames_in_view(), self._rough()
        to_the_end = synthesizer.options.visibility != "exact" or not self._compiling
        if to_the_end:
            self._job = self._jobs.start("Exact visibility", self._cancel)
        self._runner.submit(
            lambda emit: refine(
                synthesizer, sensor, rank, view, rough, to_the_end=to_the_end, emit=emit
            )
        )

    def _reorder(self) -> None:
        start, stop = self._frames_in_view()
        if self._synthesizer is None or self._sensor.dragging or stop <= start:
            return
        self._say_quality()
        if self._canvas.rank[start:stop].min() < FINAL and self._canvas.frames > stop - start:
            self._settle()

    def _cancel(self) -> None:
        self._runner.cancel()
        self._end_job()
        self._say_quality()

    @property
    def _compiling(self) -> bool:
        """Whether machine code is on its way; without it exact visibility takes too long."""
        return not kernels_ready() and self._compiler is not None and self._compiler.poll() is None

    def _watch_compiler(self) -> None:
        if not self._compiling:
            self._compiler_poll.stop()
            self._follow()

    # --- results --------------------------------------------------------------------------

    def _receive(self, result: Any) -> None:
        if isinstance(result, Part):
            self._take(result)
        elif self._job is not None:
            self._jobs.report(self._job, *result)

    def _finish(self, result: Any) -> None:
        if isinstance(result, Part):
            self._take(result)
        self._sweeping = False
        self._end_job()
        if self._again and self._sensor.dragging:
            self._sweep()
        elif self.complete:
            self.completed.emit()

    def _take(self, part: Part) -> None:
        if part.synthesizer is not self._synthesizer:
            return
        self._canvas.paint(part.sensor, part.start, part.stretch)
        if self._needs_reference and self._canvas.full:
            self._needs_reference = False
            self._track.set_reference(reference_of(self._canvas.values))
        covered = None if self._canvas.full else self._canvas.rank > 0
        self._track.set_map(self._map(), covered)
        self._say_quality()
        self.readout_changed.emit()

    def _map(self) -> DopplerMap:
        assert self._synthesizer is not None
        options, mesh = self._synthesizer.options, self._synthesizer.mesh
        return DopplerMap(
            values=self._canvas.values,
            axis=options.axis,
            timebase=mesh.timebase,
            kind="synthetic",
            unit=self._synthesizer.unit,
            null_bins=options.null_bins,
        )

    def _say_quality(self) -> None:
        start, stop = self._frames_in_view()
        rank = self._canvas.rank[start:stop]
        if self._synthesizer is None or not rank.any():
            return
        final = float((rank >= FINAL).mean())
        lowest = int(rank[rank > 0].min())
        words = _WORDS.get(lowest) or _FINAL_WORDS[self._synthesizer.options.visibility]
        if 0 < final < 1 and lowest < FINAL:
            words = f"{words}, {100 * final:.0f} % exact"
        if self._compiling:
            words += " · compiling, exact follows"
        self._track.set_status(words)

    def _fail(self, error: Exception) -> None:
        self._sweeping = False
        self._end_job()
        if not isinstance(error, Cancelled):
            self.failed.emit(str(error))

    def _end_job(self) -> None:
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None

    # --- helpers --------------------------------------------------------------------------

    def _rough(self) -> Visibility:
        assert self._synthesizer is not None
        if self._synthesizer.options.visibility == "none":
            return "none"
        # Falls back to the facing test where no exact visibility is kept.
        return "frozen"

    def _frame_visibility(self) -> Visibility:
        assert self._synthesizer is not None
        final = self._synthesizer.options.visibility
        if final == "exact" and (self._sensor.dragging or not kernels_ready()):
            return self._rough()
        return final

    def _mesh_frame(self) -> int | None:
        mesh = self._document.mesh
        time_s = self._playback.time_s
        if mesh is None or not mesh.timebase.covers(time_s):
            return None
        return mesh.timebase.frame_at(time_s)

    def _frames_in_view(self) -> View:
        mesh = self._document.mesh
        if mesh is None:
            return (0, 0)
        return mesh.timebase.frames_between(self._span.start_s, self._span.end_s)
