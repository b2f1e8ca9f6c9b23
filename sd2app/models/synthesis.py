"""The synthetic Doppler map that follows the sensor."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal
from sd2core.doppler.synthesizer import FrameScattering, Stretch, Synthesizer

from sd2app.jobs.latest import Emit, LatestRunner
from sd2app.models.content import reference_of
from sd2app.models.document import DocumentModel
from sd2app.models.jobs import Job, JobsModel
from sd2app.models.playback import PlaybackModel
from sd2app.models.sensor import SensorModel
from sd2app.models.tracks import TrackModel
from sd2app.models.visible_span import VisibleSpanModel
from sd2core.compiled import compile_in_background, kernels_ready
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled
from sd2core.sensor import Vector, VirtualSensor
from sd2core.spectrum import DopplerMap

_AT_ONCE = 12_000_000
"""Vertices times frames that are swept in one go (about 30 ms) while dragging."""
_EXACT_PARTS = 16
_KERNELS_POLL_MS = 500

_RANK = {"none": 3, "facing": 1, "frozen": 2, "exact": 3}
_WORDS = {
    "none": "all vertices (point cloud)",
    "facing": "preview: vertices facing the sensor",
    "frozen": "preview: visibility of the last exact placement",
    "exact": "exact visibility",
}


@dataclass(frozen=True)
class Readout:
    """What the sensor makes of the frame on screen."""

    torso_range_m: float
    visible_share: float
    beyond_share: float


@dataclass(frozen=True, eq=False)
class _Part:
    """A computed stretch on its way to the window."""

    sensor: VirtualSensor
    start: int
    stretch: Stretch
    synthesizer: Synthesizer


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
        self._forget()
        self._runner = LatestRunner("synthesis", self)
        self._runner.partial.connect(self._receive)
        self._runner.finished.connect(self._finish)
        self._runner.failed.connect(self._fail)
        self._kernels = QTimer(self)
        self._kernels.setInterval(_KERNELS_POLL_MS)
        self._kernels.timeout.connect(self._poll_kernels)
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
        return self._runner.busy or self._kernels.isActive()

    @property
    def complete(self) -> bool:
        """Whether every frame is exact for the sensor where it stands."""
        return self._values_for == self._sensor.sensor and bool(
            self._rank.size and self._rank.min() >= _RANK["exact"]
        )

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
        index, torso = self._mesh_frame(), self.torso_m
        if index is None or torso is None or not self._rank[index]:
            return None
        offset = np.subtract(self._sensor.sensor.position_m, torso)
        return Readout(
            torso_range_m=float(np.linalg.norm(offset)),
            visible_share=float(self._visible[index]),
            beyond_share=float(self._beyond[index]),
        )

    # --- requests -------------------------------------------------------------------------

    def take_over(self) -> None:
        """Start on the mesh of the document that is open now."""
        self._runner.cancel()
        self._end_job()
        self._synthesizer = None
        self._forget()
        self._track.set_map(None)
        mesh = self._document.mesh
        if mesh is None:
            self._announce()
            return
        visibility = "none" if mesh.faces is None else "exact"
        try:
            self._synthesizer = Synthesizer(mesh, _options(visibility))
        except Sd2Error as error:
            self.failed.emit(str(error))
            return
        frames, bins = mesh.frame_count, self._synthesizer.options.axis.bins
        self._values = np.zeros((bins, frames), np.float32)
        self._visible = np.zeros(frames, np.float32)
        self._beyond = np.zeros(frames, np.float32)
        self._rank = np.zeros(frames, np.uint8)
        if compile_in_background() is not None:
            self._kernels.start()
        self._announce()
        self._follow()

    def reset_reference(self) -> None:
        """Make the strongest bin of the map 0 dB."""
        if self._track.map is not None:
            self._track.set_reference(reference_of(self._values))

    def export(self, path: Path) -> None:
        """Write the exact map with its provenance."""
        if self._synthesizer is None or not self.complete:
            raise Sd2Error("The synthetic map is not complete yet", "an exact map", "Wait for it")
        values, sensor = self._values.copy(), self._sensor.sensor
        self._synthesizer.describe(values, sensor).save(path)

    def close(self) -> None:
        """Stop computing."""
        self._kernels.stop()
        self._runner.close()
        self._end_job()

    # --- following ------------------------------------------------------------------------

    def _forget(self) -> None:
        self._values = np.zeros((2, 0), np.float32)
        self._visible: NDArray[np.float32] = np.zeros(0, np.float32)
        self._beyond: NDArray[np.float32] = np.zeros(0, np.float32)
        self._rank: NDArray[np.uint8] = np.zeros(0, np.uint8)
        self._values_for: VirtualSensor | None = None
        self._frame: tuple[Any, FrameScattering] | None = None
        self._torso: tuple[int, Vector] | None = None
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
        start, stop = self._frames_in_view()
        if synthesizer.mesh.vertex_count * len(self._rank) <= _AT_ONCE:
            start, stop = 0, len(self._rank)
        rough = self._rough()

        def work(emit: Emit) -> _Part:
            stretch = synthesizer.stretch(sensor, start, stop, rough)
            return _Part(sensor, start, stretch, synthesizer)

        self._runner.submit(work)

    def _settle(self) -> None:
        """Rough where nothing is known yet, then exact; the stretch in view first."""
        assert self._synthesizer is not None
        self._end_job()
        self._again = self._sweeping = False
        synthesizer, sensor = self._synthesizer, self._sensor.sensor
        rank = self._rank.copy() if self._values_for == sensor else np.zeros_like(self._rank)
        if rank.min() >= _RANK["exact"]:
            return
        view, rough = self._frames_in_view(), self._rough()
        final = synthesizer.options.visibility
        rough_size = max(_AT_ONCE // synthesizer.mesh.vertex_count, 64)
        exact_size = min(max(len(rank) // _EXACT_PARTS, 8), max(rough_size // 16, 8))
        total = int((rank < _RANK["exact"]).sum())
        if kernels_ready() or final == "none":
            self._job = self._jobs.start("Exact visibility", self._cancel)

        def work(emit: Emit) -> None:
            def check(*_: int) -> None:
                emit(None)

            def run(below: int, size: int, visibility: str) -> None:
                done = 0
                for start, stop in _pieces(rank, below, view, size):
                    stretch = synthesizer.stretch(sensor, start, stop, visibility, check)
                    rank[start:stop] = _RANK[stretch.visibility]
                    emit(_Part(sensor, start, stretch, synthesizer))
                    done += stop - start
                    if visibility == final:
                        emit((done, total))

            if rough != final:
                run(_RANK["facing"], rough_size, rough)
            if kernels_ready() or final != "exact":
                run(_RANK["exact"], exact_size, final)

        self._runner.submit(work)

    def _reorder(self) -> None:
        start, stop = self._frames_in_view()
        if self._synthesizer is None or self._sensor.dragging or stop <= start:
            return
        if self._rank[start:stop].min() < _RANK["exact"] and len(self._rank) > stop - start:
            self._settle()

    def _cancel(self) -> None:
        self._runner.cancel()
        self._end_job()
        self._say_quality()

    def _poll_kernels(self) -> None:
        if kernels_ready():
            self._kernels.stop()
            self._follow()

    # --- results --------------------------------------------------------------------------

    def _receive(self, result: Any) -> None:
        if isinstance(result, _Part):
            self._take(result)
        elif self._job is not None:
            self._jobs.report(self._job, *result)

    def _finish(self, result: Any) -> None:
        if isinstance(result, _Part):
            self._take(result)
        self._sweeping = False
        self._end_job()
        if self._again and self._sensor.dragging:
            self._sweep()
        elif self.complete:
            self.completed.emit()

    def _take(self, part: _Part) -> None:
        if part.synthesizer is not self._synthesizer:
            return
        if part.sensor != self._values_for:
            self._values_for = part.sensor
            self._rank[:] = 0
        stretch = part.stretch
        stop = part.start + stretch.values.shape[1]
        self._values[:, part.start : stop] = stretch.values
        self._visible[part.start : stop] = stretch.visible_share
        self._beyond[part.start : stop] = stretch.beyond_share
        self._rank[part.start : stop] = _RANK[stretch.visibility]
        if self._needs_reference and self._rank.min() > 0:
            self._needs_reference = False
            self._track.set_reference(reference_of(self._values))
        covered = None if self._rank.min() > 0 else self._rank > 0
        self._track.set_map(self._map(), covered)
        self._say_quality()
        self.readout_changed.emit()

    def _map(self) -> DopplerMap:
        assert self._synthesizer is not None
        return self._synthesizer.describe(self._values, self._sensor.sensor)

    def _say_quality(self) -> None:
        if not self._rank.size:
            return
        final = self._synthesizer.options.visibility if self._synthesizer else "exact"
        exact = float((self._rank >= _RANK["exact"]).mean())
        if exact == 1.0:
            words = _WORDS[final]
        else:
            lowest = int(self._rank[self._rank > 0].min(initial=_RANK["exact"]))
            words = _WORDS["frozen" if lowest == _RANK["frozen"] else "facing"]
            if exact > 0:
                words = f"{words}, {100 * exact:.0f} % exact"
        if not kernels_ready():
            words += " · preparing fast kernels"
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

    def _rough(self) -> str:
        assert self._synthesizer is not None
        if self._synthesizer.options.visibility == "none":
            return "none"
        return "frozen" if self._synthesizer.has_frozen_mask else "facing"

    def _frame_visibility(self) -> str:
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

    def _frames_in_view(self) -> tuple[int, int]:
        mesh = self._document.mesh
        if mesh is None:
            return (0, 0)
        return mesh.timebase.frames_between(self._span.start_s, self._span.end_s)


def _options(visibility: str) -> Any:
    from dataclasses import replace

    from sd2core.doppler.options import PRESETS

    return replace(PRESETS["paper"], visibility=visibility)


def _pieces(
    rank: NDArray[np.uint8], below: int, view: tuple[int, int], size: int
) -> Iterator[tuple[int, int]]:
    """Stretches of frames whose rank is below, from the view onwards, then before it."""
    frames = len(rank)
    first, last = view if view[1] > view[0] else (0, 0)
    for begin, end in ((first, last), (last, frames), (0, first)):
        start = begin
        while start < end:
            if rank[start] >= below:
                start += 1
                continue
            stop = start
            while stop < min(end, start + size) and rank[stop] < below:
                stop += 1
            yield start, stop
            start = stop
