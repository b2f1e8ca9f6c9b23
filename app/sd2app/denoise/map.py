"""A track that keeps in step with the synthetic map, denoised by one model."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, Emit
from sd2app.background.model_worker.client import RemoteDenoiser, RemoteSession
from sd2app.maps.partial_map import Part, PartialMap
from sd2app.maps.quality import Postprocess
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2core.denoise.resample_to_model import input_of, is_regular
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps

_TOO_SLOW_S = 0.15
"""Time limit per sweep; a slower model waits until the drag pauses."""

_TRIED = 3
"""Number of sweeps that decide if a model is too slow."""

_LISTED = 2048
"""Frames from which a denoising is listed as a task that can be cancelled."""

_JUMP_S = 1.0
"""Longest step of the clock whose skipped frames are denoised live; a jump starts again."""

_WAITS = "too slow to be dragged, follows when the sensor rests"

TEXTURE_SEED = 0


class Swept(NamedTuple):
    """Denoised preview of a part of the map."""

    denoiser: RemoteDenoiser
    doppler: DopplerMap


class _Reached(NamedTuple):
    """How far the clock has led a model through a clip, with what the model remembers there."""

    next: int
    session: RemoteSession | None = None


class _Answer(NamedTuple):
    """Denoised stretch of the map."""

    start: int
    doppler: DopplerMap
    known: NDArray[np.bool_]  # (n,): frames that there was an input of
    revision: int  # of the synthetic map


class _LiveAnswer(NamedTuple):
    """Frames that the clock has reached, denoised, and what the model remembers at their end."""

    start: int
    doppler: DopplerMap
    cost_s: float  # of each frame
    session: RemoteSession


class DenoisedMap(BackgroundModel):
    """Denoises what is known of the synthetic map, again until nothing has changed meanwhile.

    All of it at once: the slowest of our models but one takes a second for ten minutes. While
    the sensor is dragged the model is asked by the background task that sweeps the map
    (:meth:`postprocess`), so that both are of the same place and are shown together. Live it
    grows frame by frame.
    """

    failed = Signal(str)
    idle = Signal()  # everything is denoised

    _stumbled = Signal(Exception)

    def __init__(self, track: MapModel, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self.track, self._synthetic = track, session.maps.synthetic
        self._partial, self._results = PartialMap(track), session.results
        self._playback = session.playback
        self.denoiser: RemoteDenoiser | None = None  # the model in use
        self.words = ""
        self._texture: Texture | None = None
        self._sensor: object = None  # placement that the synthetic map is of
        self._held = False  # it follows the clock
        self._reached: _Reached | None = None  # by it; None: begin where it is
        self._runner = ListedRunner("denoise", session.jobs, self, self._receive, self._fail)
        self._runner.cancelled.connect(self._give_up)
        self._stumbled.connect(self._fail)
        session.playback.frame_changed.connect(self._step)
        self._took_s: deque[float] = deque(maxlen=5)

    # --- what is known --------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """True while something is being denoised or about to be."""
        return super().busy or self._lacks_limbs

    @property
    def _lacks_limbs(self) -> bool:
        """True while the model takes limb maps, and the synthetic map has none of everybody."""
        source, denoiser = self._synthetic.map, self.denoiser
        if source is None or denoiser is None:
            return False
        return bool(denoiser.card.parts) and not (source.limbs and source.limbs.of_everybody)

    @property
    def shows_source(self) -> bool:
        """True if the denoised frames are all of the current synthetic map and sensor."""
        return bool(self._partial.quality.any())

    @property
    def keeps_up(self) -> bool:
        """True if the model is fast enough to follow a mouse drag."""
        # The best of some: a busy machine is not a slow model.
        return len(self._took_s) < _TRIED or min(self._took_s) <= _TOO_SLOW_S

    # --- requests -------------------------------------------------------------------------

    def use(
        self, denoiser: RemoteDenoiser | None, words: str = "", texture: Texture | None = None
    ) -> None:
        """Denoise with another model, called ``words`` on the track, or not at all.

        With a texture the map is drawn as the radar would show it.
        """
        self._stop()
        self._texture = texture
        self._took_s.clear()
        self.denoiser = denoiser
        self.words = words
        self.track.set_status(words)
        self._partial.forget()
        if denoiser is None:
            self.track.set_map(None)
        elif not self._restore():
            self._go_on()

    def clear(self) -> None:
        """Remove the map."""
        self._stop()
        self._sensor = None
        self._partial.forget()
        self.track.set_map(None)

    def take(self, sensor: object) -> None:
        """Follow the synthetic map, which has changed and is for a placement now."""
        self._took_s.clear()
        if not self._held:
            self.track.set_status(self.words)
        self._follow(sensor)
        if not self._restore():
            self._go_on()

    def postprocess(self) -> Postprocess | None:
        """Function that denoises a preview in the background; None without a model."""
        denoiser, source, texture = self.denoiser, self._synthetic.map, self._texture
        if denoiser is None or source is None or self._held or not self.keeps_up:
            return None
        if self._lacks_limbs:
            return None

        def denoised(part: Part) -> Swept | None:
            began = time.perf_counter()
            try:
                made = denoiser.denoise(cut_out(source, part.start, part.values, part.limbs))
                made = _drawn(texture, made, part.start)
            except Sd2Error as error:
                self._stumbled.emit(error)
                return None
            self._took_s.append(time.perf_counter() - began)
            return Swept(denoiser, made)

        return denoised

    def take_sweep(self, sensor: object, start: int, swept: Swept | None) -> None:
        """Show the preview that was denoised during a drag."""
        self._runner.cancel()
        self._follow(sensor)
        self._partial.quality[:] = 0
        if self.denoiser is None or self._held:
            return
        if swept is not None and swept.denoiser is self.denoiser:
            self._paint(start, swept.doppler)
        else:
            self.track.set_status(f"{self.words} · {_WAITS}")
        self._partial.show()

    def set_live(self, live: bool) -> None:
        """Denoise frame by frame as the clock reaches them, as beside a radar, or the whole map."""
        if live == self._held:
            return
        self._held = live
        self._stop()
        self._restart()
        if live:
            self._partial.show()
            self._step()
        else:
            self.track.set_status(self.words)
            self._go_on()

    # --- live -----------------------------------------------------------------------------

    def _step(self) -> None:
        """Ask for the frames up to the one on screen, one after another."""
        source, denoiser, clock = self._synthetic.map, self.denoiser, self._playback
        frame = self._synthetic.frame_at(clock.time_s)
        if not self._held or source is None or denoiser is None or frame is None:
            return
        if self._runner.busy or self._lacks_limbs:
            return
        longest = _JUMP_S * source.timebase.frames_per_s * clock.speed
        if self._reached is None or not -1 <= frame - self._reached.next <= longest:
            self._reached = _Reached(frame)
        ahead = self._synthetic.known[self._reached.next : frame + 1]
        if ahead.size and ahead.all():
            self._runner.submit(self._advance(self._reached, frame + 1))

    def _advance(self, reached: _Reached, stop: int) -> Callable[[Emit], _LiveAnswer]:
        """Go on to a frame, with what the model remembers of those before."""
        source, denoiser, start = self._synthetic.map, self.denoiser, reached.next
        texture = self._texture
        assert source is not None
        assert denoiser is not None
        stretch = source.between(start, stop)
        energies = input_of(stretch, denoiser.card.parts).copy()
        like = replace(stretch, kind="denoised", meta={}, uncertainty=None, limbs=None)

        def work(emit: Emit) -> _LiveAnswer:
            session = reached.session or denoiser.live()
            began = time.perf_counter()
            answers = session.advance(energies, stretch.present_mask)
            cost_s = (time.perf_counter() - began) / len(answers)
            made = _drawn(texture, replace(like, values=answers.T), start)
            return _LiveAnswer(start, made, cost_s, session)

        return work

    def _take_live(self, answer: _LiveAnswer) -> None:
        assert self.denoiser is not None
        if self._reached is not None and self._reached.session is None:
            self._partial.quality[:] = 0  # it began here
        self._reached = _Reached(answer.start + len(answer.doppler.timebase), answer.session)
        self._paint(answer.start, answer.doppler)
        self._partial.show()
        # A model that looks at a window of frames knows no later ones here.
        past = "" if self.denoiser.equals_batch else ", from past frames only"
        source, rate_hz = self._synthetic.map, self.denoiser.card.frame_rate_hz
        if source is not None and not is_regular(source.times_s, rate_hz):
            past += f", as if at {rate_hz:g} frames/s"
        self.track.set_status(
            f"{self.words} · live, frame by frame{past}: {1e3 * answer.cost_s:.1f} ms a frame"
        )
        self._step()

    # --- what was made before -------------------------------------------------------------

    @property
    def _key(self) -> Hashable:
        """Key of all that the denoised map depends on; None until the synthetic map is final."""
        return self._synthetic.key_with(self.denoiser, self._texture is not None)

    def _restore(self) -> bool:
        """Show the map if it was made before of the same synthetic map, by the same model."""
        kept = None if self._held else self._results.get(self._key)
        if kept is None:
            return False
        self._stop()
        self._paint(0, kept)
        self._end()
        return True

    # --- denoising ------------------------------------------------------------------------

    def _restart(self) -> None:
        """Mark all frames as not denoised; those on screen stay until there are better ones."""
        if self._partial.frames == self._synthetic.known.size:
            self._partial.quality[:] = 0
        else:
            self._partial.forget()

    def _follow(self, sensor: object) -> None:
        if sensor != self._sensor or self._partial.frames != self._synthetic.known.size:
            self._sensor = sensor
            self._restart()

    def _go_on(self) -> None:
        source, known, denoiser = self._synthetic.map, self._synthetic.known, self.denoiser
        texture = self._texture
        if source is None or denoiser is None or self._held or not known.any():
            return
        if self._runner.busy or self._lacks_limbs:
            return
        numbers = np.flatnonzero(known)
        start, stop = int(numbers[0]), int(numbers[-1]) + 1
        known, revision = known[start:stop].copy(), self._synthetic.revision

        def work(emit: Emit) -> _Answer:
            # Not copied: if values change while they are read, they are read once more.
            stretch = source.between(start, stop)
            if not known.all():
                stretch = replace(stretch, present=stretch.present_mask & known)
            made = _drawn(texture, denoiser.denoise(stretch), start)
            return _Answer(start, made, known, revision)

        self._runner.submit(work, "Denoising the map" if len(known) > _LISTED else "")

    def _end(self) -> None:
        """Show that everything is denoised, and say which frames the model passes through."""
        self._partial.show(self._key if self._partial.full else None)
        shown, key = self.track.map, self.track.key
        if shown is not None and key is not None and self._results.get(key) is None:
            kept = replace(shown, values=shown.values.copy())
            self._results.put(key, kept, kept.values.nbytes)
        source, denoiser = self._synthetic.map, self.denoiser
        movements = None if denoiser is None else denoiser.card.known
        if source is not None and movements is not None:
            passed = int(movements.strange(source.values.T, source.axis).sum())
            if passed:
                self.track.set_status(
                    f"{self.words} · {passed:,} frames unlike what it learnt stay synthetic"
                )
        self.idle.emit()

    def _receive(self, answer: _Answer | _LiveAnswer) -> None:
        if isinstance(answer, _LiveAnswer):
            self._take_live(answer)
            return
        self._paint(answer.start, answer.doppler, answer.known)
        if answer.revision == self._synthetic.revision:
            self._end()
        else:
            self._partial.show()
            self._go_on()

    def _paint(self, start: int, made: DopplerMap, known: NDArray[np.bool_] | None = None) -> None:
        """Take over frames from ``start`` on, those that there was an input of."""
        source = self._synthetic.map
        assert source is not None
        if not self._partial.frames:
            empty, base = np.zeros_like(source.values), source.timebase
            self._partial.begin(
                replace(made, values=empty, timebase=base, present=source.present, limbs=None)
            )
        self._partial.paint(start, made.values, 1 if known is None else known.astype(np.uint8))

    def _give_up(self) -> None:
        """Stay as it is, on the user's request."""
        self._stop()
        self.idle.emit()

    def _fail(self, error: Exception) -> None:
        if self._held:
            self.set_live(False)
            return
        self._stop()
        self.denoiser = None
        self._partial.forget()
        self.track.set_map(None)
        self.failed.emit(str(error))

    def _stop(self) -> None:
        self._runner.cancel()
        self._reached = None


def cut_out(
    doppler: DopplerMap, start: int, values: NDArray[np.float32], limbs: LimbMaps | None = None
) -> DopplerMap:
    """Part of a map, with other values (bins, frames), and its split."""
    inside = replace(doppler, uncertainty=None, limbs=None).between(start, start + values.shape[1])
    return replace(inside, values=values, limbs=limbs)


def _drawn(texture: Texture | None, made: DopplerMap, start: int) -> DopplerMap:
    """Frames of a map from ``start`` on, with the radar's texture where one is wanted."""
    if texture is None:
        return made
    return replace(made, values=texture.drawn(made.values.T, (TEXTURE_SEED,), start).T)
