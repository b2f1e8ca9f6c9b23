"""The synthetic Doppler map that follows the sensor."""

from __future__ import annotations

import functools
import itertools
import math
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QObject, Signal, SignalInstance

from sd2app.accuracy.model import AccuracyModel
from sd2app.background.latest import Emit, LatestRunner, ReportingModel, delayed
from sd2app.maps.partial_map import FINAL, PREVIEW, Part, PartialMap, View, empty_map, pieces
from sd2app.maps.quality import (
    ALL_WORDS,
    AT_ONCE,
    ROUGH_WORDS,
    Compiler,
    Postprocess,
    Request,
    SynthesizerCache,
    final_words,
)
from sd2app.maps.readout import Readout, torso_of
from sd2app.session.content import UNTITLED, folder_for_command
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2app.widgets.text import quoted
from sd2core.cli.synth import Synth
from sd2core.doppler.body_error import body_error
from sd2core.doppler.options import PRESETS
from sd2core.doppler.synthesizer import FrameScattering, MapFrames, Synthesizer, Visibility
from sd2core.errors import Sd2Error
from sd2core.files.digests import deep_signature
from sd2core.io.mesh_models import is_estimate
from sd2core.maps import DopplerMap
from sd2core.mesh.made_vertices import same_bodies
from sd2core.numerics.compiled import kernels_ready
from sd2core.options.records import words_of
from sd2core.options.synthesis import CHOSEN
from sd2core.radar_profiles import BEAMS
from sd2core.recording.recording import Recording
from sd2core.scattering.amplitude import range_weight
from sd2core.scattering.beam import share_in_beam
from sd2core.sensor import Vector, VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_MAP_BUDGET_MS = 15.0
"""For one map while the sensor is dragged and the video plays: 20 of them a second, with most
of the time left to drawing."""

_REST_MS = 300
"""Pause of a drag that counts as rest."""


def _source(recording: Recording) -> dict[str, Any]:
    """Where a command finds the mesh, and how it reads it, as :class:`Synth` calls it.

    Raises Sd2Error where only a recording could say what is around it.
    """
    if recording.folder != UNTITLED or recording.things or recording.bodies or recording.walls:
        return {"mesh": folder_for_command(recording)}
    assert recording.mesh is not None
    read = recording.mesh_options()
    read.pop("simulated", None)
    if not is_estimate(recording.mesh):  # the command refuses what would change nothing
        read.pop("focal_px", None)
    return {"mesh": recording.mesh, "fps": read.pop("frames_per_s", None), **read}


def _looking(sensor: VirtualSensor) -> dict[str, Any]:
    """Direction and beam for a command; without a beam no direction counts.

    A table without a name has no words: the command takes the recording's.
    """
    if (beam := sensor.beam) is None:
        return {}
    named = next((name for name, one in BEAMS.items() if one == beam), None)
    widths = None if beam.cuts else f"{beam.azimuth_width_deg},{beam.elevation_width_deg}"
    return {"aim": f"{sensor.azimuth_deg},{sensor.elevation_deg}", "beam": named or widths}


class SynthesisModel(ReportingModel):
    """Recomputes when the sensor moves: a preview at once, the final quality at rest.

    While the sensor is dragged, one sweep runs at a time and the newest
    position follows it at once. At rest the plan in use is applied in the
    background, the time window first; then a plan is chosen for the new
    place, applied if it is another, and at last one for the next drag. Any
    new move interrupts all of it. A map stays until it is replaced.
    """

    frame_changed = Signal()  # what the sensor sees of the frame on screen
    readout_changed = Signal()  # the numbers of it
    moving_changed = Signal()
    completed = Signal()
    refining = Signal()  # the map at rest is not complete yet
    painted = Signal(object)  # Part that came onto the map

    def __init__(self, session: Session, accuracy: AccuracyModel, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._accuracy = session, accuracy
        self.moving = False  # then the time budget decides, otherwise the tolerance
        self._track = session.maps.synthetic
        self._partial = PartialMap(self._track)
        # Asked before each sweep what is to be made of it, and shown with it.
        self.postprocess: Callable[[], Postprocess | None] = lambda: None
        self._wanting_limbs: set[str] = set()
        self._synthesizers: SynthesizerCache | None = None
        # The mesh of the plan for dragging, and its masks from where the sensor rests.
        self._masks_of: Request | None = None
        self._prefetcher = LatestRunner("ready", self, self._take_masks, self._fail)
        # Asked for by the window and taken by the thread.
        self._next_sweep: deque[tuple[Callable[[Emit], Part], Postprocess | None]] = deque(maxlen=1)
        self._woken = threading.Event()  # by another sweep, or the end of what is made of one
        self._forget()
        self._runner = ListedRunner("synthesis", session.jobs, self, self._finish, self._fail)
        self._runner.partial.connect(self._receive)
        self._runner.cancelled.connect(self._say_quality)
        self._compiler = Compiler("compile", session.jobs, self)
        compiler = self._compiler
        for signal in (compiler.finished, compiler.failed, compiler.cancelled):
            signal.connect(self._follow)
        self._rest = delayed(self._settle, _REST_MS, self)
        session.sensor.changed.connect(self._follow)
        session.sensor.dragging_changed.connect(self._follow)
        session.span.changed.connect(self._reorder)
        session.document.changed.connect(self._recount)
        session.playback.frame_changed.connect(self._follow_clock)
        accuracy.plan_changed.connect(self._take_plan)
        accuracy.decided.connect(self._go_on)
        accuracy.requested.connect(self._go_on)

    # --- what is known --------------------------------------------------------------------

    @property
    def v_max_mps(self) -> float:
        """Edge of the velocity axis."""
        return self._synthesizers.options.axis.v_max_mps if self._synthesizers else 2.0

    @property
    def busy(self) -> bool:
        """True while a better map is being computed."""
        return self._runner.busy or self._compiler.busy

    @property
    def _sensor(self) -> VirtualSensor:
        return self._session.sensor.sensor

    @property
    def complete(self) -> bool:
        """True once every frame has its final quality for the current sensor."""
        return self._partial.final and self.shows_sensor

    @property
    def completeness(self) -> tuple[SignalInstance, ...]:
        """Signals after which the map may be complete, or no longer."""
        return self.completed, self.moving_changed, self.refining

    @property
    def split(self) -> bool:
        """True if the map is split by the parts of the body."""
        return self._partial.split

    @property
    def shows_sensor(self) -> bool:
        """True while the map is of the current sensor, at any quality."""
        return self._partial.sensor == self._sensor

    def frames_in_view(self) -> View:
        """Frames of the map in the time window, half-open."""
        mesh = self._session.document.mesh
        if mesh is None:
            return (0, 0)
        return mesh.timebase.frames_between(self._session.span.start_s, self._session.span.end_s)

    @property
    def _index(self) -> int | None:
        """Frame of the mesh on screen, None where there is no person."""
        mesh = self._session.document.mesh
        return None if mesh is None else mesh.person_at(self._session.playback.time_s)

    @property
    def torso_m(self) -> Vector | None:
        """Median vertex of the frame on screen: inside the torso whatever the limbs do."""
        mesh, index = self._session.document.mesh, self._index
        return None if mesh is None or index is None else self._torso_of(mesh, index)

    @property
    def frame(self) -> FrameScattering | None:
        """Velocity, range and visibility of every vertex in the frame on screen.

        None while a recording opens or kernels compile, until there is a map: that comes first.
        """
        index, synthesizers = self._index, self._synthesizers
        if index is None or synthesizers is None or self._track.map is None or self._compiler.busy:
            return None
        synthesizer = synthesizers.full
        visibility: Visibility = synthesizer.options.visibility
        if self.moving and visibility != "none":
            # The mask of the map, where the map has one and all vertices.
            visibility, made = "frozen", synthesizers.ready(self._plan)
            if made is not None and made.mesh is synthesizer.mesh:
                synthesizer = made
        return self._scattering_of(synthesizer, self._sensor, index, visibility)

    def readout(self) -> Readout | None:
        """Numbers beside the sensor, None without a mesh on screen."""
        mesh, index, frame, torso_m = (
            self._session.document.mesh, self._index, self.frame, self.torso_m,
        )  # fmt: skip
        if mesh is None or index is None or frame is None or torso_m is None:
            return None
        sensor, within = self._sensor, None
        seen_mps = np.abs(frame.velocity_mps[frame.visible])
        if sensor.beam is not None:
            echo = frame.visible * range_weight(frame.range_m, 4.0, 1.0)
            within = share_in_beam(sensor, mesh.frame(index).T, echo)
        return Readout(
            torso_range_m=math.dist(sensor.position_m, torso_m),
            visible_share=float(frame.visible.mean()),
            beyond_share=float((seen_mps > self.v_max_mps).mean()) if seen_mps.size else 0.0,
            share_in_beam=within,
        )

    # --- requests -------------------------------------------------------------------------

    def attach(self) -> None:
        """Start on the mesh of the document that is open now."""
        self._stop()
        self._synthesizers = None
        self._forget()
        self._set_moving(False)
        self._track.set_map(None)
        self._track.set_awaited(False)
        mesh = self._session.document.mesh
        options = replace(PRESETS["paper"], count=self._session.document.count)
        if mesh is not None and mesh.faces is None:
            options = replace(options, visibility="none")
        self._accuracy.attach(mesh, options)
        if mesh is None:
            self._announce()
            return
        try:
            self._synthesizers = SynthesizerCache(mesh, options, self._files)
            self._synthesizers.limbs = bool(self._wanting_limbs)
        except Sd2Error as error:
            self.failed.emit(str(error))
            return
        self._partial.begin(empty_map(options, mesh))
        self._compiler.start()
        self._track.set_awaited(self._compiler.busy)
        self._announce()
        self._follow()

    def _recount(self) -> None:
        """Count another way or among others, at the same 0 dB; the map stays until then."""
        document, synthesizers = self._session.document, self._synthesizers
        if synthesizers is None or document.mesh is None:
            return
        before, mesh = synthesizers.mesh, document.mesh
        around = [(one.surroundings, one.others) for one in (mesh, before)]
        moved = mesh.vertices is before.vertices and around[0] != around[1]
        if synthesizers.options.count == document.count and not moved:
            return
        dragging = self._session.sensor.dragging
        if not dragging:  # else the pass under way shows a place a moment ago
            self._stop()
        self._keep()
        options = replace(synthesizers.options, count=document.count)
        # What is dragged is of the same files at every step.
        files = synthesizers.files if same_bodies(mesh, before) else self._files
        self._synthesizers = synthesizers.among(mesh, options, files)
        self._partial.mark_stale()
        if options != synthesizers.options:
            self._masks_of = None
            self._accuracy.attach(mesh, options)
        self._set_moving(self.moving or dragging)
        self._follow()

    def made_by(self) -> tuple[Callable[[], Synthesizer], VirtualSensor] | None:
        """Synthesizer and sensor of the map on screen; None until it is complete.

        Asking for the synthesizer may take long.
        """
        synthesizers, plan = self._synthesizers, self._plan
        if synthesizers is None or self.moving or not self.complete:
            return None
        return lambda: synthesizers.of(plan), self._sensor

    def want_limbs(self, who: str, wanted: bool) -> None:
        """Split the map by the parts of the body while somebody wants it."""
        before = bool(self._wanting_limbs)
        (self._wanting_limbs.add if wanted else self._wanting_limbs.discard)(who)
        if bool(self._wanting_limbs) != before and self._synthesizers is not None:
            self._synthesizers.limbs = not before
            if not before:
                self._keep()
                self._partial.quality[:] = 0
                self._settle()

    def export(self, path: Path) -> None:
        """Write the map that is shown with its provenance."""
        self.whole_map().save(path)

    def command(self, out: Path) -> Synth:
        """Options of ``sd2 synth`` that make the map on screen of the saved recording."""
        content, synthesizers, plan = self._session.document.content, self._synthesizers, self._plan
        assert content is not None
        assert synthesizers is not None
        recording, used, usual = content.recording, synthesizers.options, PRESETS["paper"]
        assert recording.mesh is not None
        chosen: dict[str, Any] = {}
        if plan is not None:
            used, chosen["vertices_kept"] = plan.options(used), plan.vertices_kept
            chosen["left_out"] = plan.left_out
        for name in (*CHOSEN, "count"):
            if getattr(used, name, None) != getattr(usual, name, None):
                chosen[name] = getattr(used, name)
        return Synth(
            **_source(recording),
            out=out,
            sensor=self._sensor.position_m,
            **_looking(self._sensor),
            limbs=synthesizers.limbs and self.split,
            uncertainty=self._track.uncertainty is not None,
            **chosen,
        )

    def line(self, name: str) -> str:
        """Command for a terminal that writes the map to a file of this name."""
        return quoted(words_of("synth", self.command(Path(name))))

    def whole_map(self) -> DopplerMap:
        """Copy of the map on screen with its provenance, the plan included.

        Raises Sd2Error if it is not complete.
        """
        part, synthesizers = self._partial.kept(), self._synthesizers
        if synthesizers is None or not self.complete or part is None:
            raise Sd2Error("The synthetic map is not complete yet", "a final map", "Wait for it")
        maker = synthesizers.of(self._plan)
        assert part.shares is not None
        limbs = part.limbs if synthesizers.limbs else None
        # What is smoothed no more needs no values before.
        raw, (visible, beyond) = np.empty((0, 0)), part.shares
        stretch = MapFrames(part.values, raw, visible, beyond, maker.options.visibility, limbs)
        made = maker.as_map(stretch, self._sensor)
        error = body_error(maker, self._sensor)
        meta = made.meta | ({} if error is None else {"body_error_l1": error})
        if (in_use := self._accuracy.in_use) is not None:
            meta |= in_use.plan.provenance(in_use.error)
            if in_use.elsewhere:  # no error is known from here
                del meta["plan_error_l1"]
        return replace(made, meta=meta, uncertainty=self._track.uncertainty)

    def _stop(self) -> None:
        self._rest.stop()
        self._runner.cancel()
        self._prefetcher.cancel()

    # --- following ------------------------------------------------------------------------

    def _forget(self) -> None:
        self._partial.forget()
        # What was read last is kept, as several views ask for the same.
        newest = functools.lru_cache(maxsize=1)
        self._scattering_of, self._torso_of = newest(Synthesizer.frame), newest(torso_of)
        self._plan: AccuracyPlan | None = None
        self._masks_of = None
        self._next_sweep.clear()

    def _take_masks(self, masks: Request) -> None:
        self._masks_of = masks

    def _announce(self) -> None:
        self.frame_changed.emit()
        self.readout_changed.emit()

    def _follow_clock(self) -> None:
        if self._synthesizers is not None:
            self._announce()

    def _follow(self) -> None:
        if self._synthesizers is None:
            return
        self._accuracy.hold()
        self._prefetcher.cancel()
        if self._session.sensor.dragging:
            self._rest.start()
            self._set_moving(self.moving or self._sensor != self._partial.sensor)
            self._follow_clock()
            if self.moving:
                self._sweep()
        else:
            self._settle()
            self._follow_clock()

    def _set_moving(self, moving: bool) -> None:
        if moving != self.moving:
            self.moving = moving
            self._runner.cancel()  # it was at rest, or moved
            self.moving_changed.emit()

    def _sweep(self) -> None:
        """Ask for a rough pass for the sensor where it is now, after the one under way."""
        assert self._synthesizers is not None
        sweep = functools.partial(self._synthesizers.part, self._preview(), self._swept())
        self._next_sweep.append((sweep, self.postprocess()))
        self._woken.set()
        if not self._runner.busy:
            self._runner.submit(self._sweep_on)

    def _sweep_on(self, emit: Emit) -> None:
        """Make pass after pass; what is to be made of one is made beside the next."""

        def more_of(part: Part, postprocess: Postprocess | None) -> None:
            emit(part if postprocess is None else replace(part, more=postprocess(part)))

        with ThreadPoolExecutor(1, "postprocess") as beside:
            before = beside.submit(lambda: None)
            while True:
                self._woken.clear()
                ended = before.done()
                try:
                    sweep, postprocess = self._next_sweep.pop()
                except IndexError:
                    if ended:
                        return before.result()
                    self._woken.wait()
                    continue
                part = sweep(emit)
                before.result()
                before = beside.submit(more_of, part, postprocess)
                before.add_done_callback(lambda _: self._woken.set())

    def _settle(self) -> None:
        """Compute previews where nothing is known, then the final quality; time window first."""
        if self._synthesizers is None:
            return
        self._rest.stop()
        self._next_sweep.clear()
        self._accuracy.surround(self._synthesizers.mesh)
        sensor = self._sensor
        self._accuracy.measured.rest_at(sensor)
        was_complete = self.complete
        self._set_moving(False)
        final = self._final()
        if final is not None:
            self._restore(final)
        quality = self._partial.quality_for(sensor)
        if quality.min() >= FINAL:
            self._runner.cancel()
            if not was_complete:
                self.completed.emit()
            self._go_on()
            return
        self.refining.emit()
        start, stop = self.frames_in_view()
        stretches, requests, size = [(start, stop)], [self._preview()], self._at_once
        # Much of a long clip can wait until it is known how it is to be done.
        if final is not None or self._compiler.busy or self._is_short:
            stretches += [(stop, self._partial.frames), (0, start)]
        if final is not None:
            requests.append(final)
        synthesizers = self._synthesizers

        def work(emit: Emit) -> None:
            done, total = 0, int((quality < FINAL).sum())
            for stretch, request in itertools.product(stretches, requests):
                for frames in pieces(quality < request.quality, *stretch, size):
                    emit(synthesizers.part(request, frames, emit))
                    if request is final:
                        done += frames[1] - frames[0]
                        emit((done, total))

        self._runner.submit(work, "Synthesising the map" if final is not None else "")

    def _go_on(self) -> None:
        """Start the next task while the sensor rests."""
        if self._synthesizers is None or self.moving or self.busy:
            return
        if self._may_choose():
            self._accuracy.choose(self._sensor, self._budget_ms())
        elif not self.complete:
            self._settle()
        elif (dragging := self._accuracy.while_dragging) is not None:
            masks = Request(self._sensor, dragging.plan, PREVIEW, "")
            synthesizers, swept = self._synthesizers, self._swept()

            def prepare(emit: Emit) -> Request:
                synthesizers.part(masks, swept, emit)
                return masks

            if masks != self._masks_of:
                self._prefetcher.submit(prepare)

    def _may_choose(self) -> bool:
        """True if the plans are for another sensor and the kernels are compiled."""
        decided = self._accuracy.is_decided(self._sensor, self._budget_ms())
        return kernels_ready() and not decided

    def _take_plan(self) -> None:
        """Follow the plans; what was made by another stays until it is replaced."""
        in_use = self._accuracy.in_use
        plan = None if in_use is None else in_use.plan
        if self._synthesizers is None or plan == self._plan:
            self._say_quality()
            return
        self._plan = plan
        self._keep()
        self._partial.mark_stale()
        if not self.moving:
            self._settle()

    def _reorder(self) -> None:
        start, stop = self.frames_in_view()
        if self._synthesizers is None or self.moving or stop <= start:
            return
        self._say_quality()
        quality = self._partial.quality
        if quality[start:stop].min() < FINAL and len(quality) > stop - start:
            self._settle()

    # --- results --------------------------------------------------------------------------

    def _receive(self, result: Any) -> None:
        if isinstance(result, Part):
            self._take(result)

    def _finish(self, result: Any) -> None:
        self._receive(result)
        if self._next_sweep and self._session.sensor.dragging:
            # It was asked for when the last one had just ended.
            self._sweep()
            return
        if self.complete:
            self.completed.emit()
        self._go_on()

    def _keep(self) -> None:
        """Keep the final map that is being left, for when one comes back to it."""
        if (part := self._partial.kept()) is not None:
            self._session.results.put(part.key, part, part.size_bytes)

    def _restore(self, final: Request) -> None:
        """Show the final map if it was made before, with the same sensor, plan and options."""
        assert self._synthesizers is not None
        part = self._session.results.get(self._synthesizers.key(final.plan, final.sensor))
        if part is not None and not self.complete:
            self._take(part)

    def _take(self, part: Part) -> None:
        first = self._track.map is None
        if part.sensor != self._partial.sensor:
            self._keep()
        self._partial.take(part)
        self._say_quality()
        self.painted.emit(part)
        if first:
            self.frame_changed.emit()
        self.readout_changed.emit()

    def _say_quality(self) -> None:
        if self._synthesizers is not None:
            final = functools.partial(final_words, self._synthesizers, self._accuracy.in_use)
            self._partial.say_quality(self.frames_in_view(), final, self._compiler.busy)

    # --- helpers --------------------------------------------------------------------------

    def _preview(self) -> Request:
        """Quality for what moves, and where no frame is computed yet."""
        assert self._synthesizers is not None
        synthesizers, dragging = self._synthesizers, self._accuracy.while_dragging
        here = self._sensor
        if dragging is not None and synthesizers.ready(dragging.plan):
            plan, words = dragging.plan, f"while dragging: {dragging.accuracy}"
            if plan.mask_reuse_m == 0:
                return Request(here, plan, PREVIEW, words)
            known = self._masks_of
            if known is not None and known.plan == plan:
                away_m = math.dist(known.sensor.position_m, here.position_m)
                if away_m <= plan.mask_reuse_m:
                    return Request(here, plan, PREVIEW, words, "frozen")
        # The masks of rest serve until one for dragging is known.
        newest = self._plan if synthesizers.ready(self._plan) else None
        if synthesizers.options.visibility == "none":
            return Request(here, newest, PREVIEW, ALL_WORDS, "none")
        # Where the sensor stays, and things move, they are as good.
        if dragging is not None and not self.shows_sensor:
            return Request(here, newest, PREVIEW, ROUGH_WORDS, "facing")
        return Request(here, newest, PREVIEW, "preview: visibility of the nearest place", "frozen")

    def _final(self) -> Request | None:
        """Quality that the tolerance asks for; None until it is chosen."""
        if self._synthesizers is None or self._compiler.busy:
            return None
        if self._plan is None and self._may_choose():
            return None
        words = final_words(self._synthesizers, self._accuracy.in_use)
        return Request(self._sensor, self._plan, FINAL, words)

    @property
    def _files(self) -> str:
        """What tells files of the scene apart: two meshes may be alike in some frames."""
        recording = self._session.document.recording
        return "" if recording is None else str(deep_signature(recording.scene_files))

    @property
    def _at_once(self) -> int:
        """Frames that are computed in one go."""
        assert self._synthesizers is not None
        return max(AT_ONCE // self._synthesizers.mesh.vertex_count, 64)

    @property
    def _is_short(self) -> bool:
        """True if the clip is swept whole while the sensor is dragged."""
        return self._partial.frames <= self._at_once

    def _swept(self) -> View:
        """Frames that follow a drag: the whole clip when it is short, else those in view."""
        return (0, self._partial.frames) if self._is_short else self.frames_in_view()

    def _budget_ms(self) -> float:
        """Time budget per frame, in steps, so that a little zooming needs no other plan."""
        start, stop = self._swept()
        steps = math.ceil(2 * math.log2(max(stop - start, 1)))
        return float(_MAP_BUDGET_MS / 2 ** (steps / 2))
