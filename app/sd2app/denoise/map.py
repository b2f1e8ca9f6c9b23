"""A track that keeps in step with the synthetic map, denoised by one model."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable
from copy import deepcopy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, LatestRunner, delayed
from sd2app.background.model_worker.client import RemoteDenoiser, RemoteSession
from sd2app.maps.partial_map import FINAL, Part, PartialMap, View
from sd2app.maps.quality import Postprocess
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.session.tasks import Job
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.resample_to_model import input_of, is_regular
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.pairs.segments import LENGTH, OVERLAP

_TOO_SLOW_S = 0.15
"""Time limit per sweep; a slower model waits until the drag pauses."""

_TRIED = 3
"""Number of sweeps that decide if a model is too slow."""

_BETWEEN_MS = 80
"""Shortest interval between denoisings of a short clip while its map is refined."""

_JUMP_S = 1.0
"""Longest step of the clock whose skipped frames are denoised live; a jump starts again."""

_WAITS = "too slow to be dragged, follows when the sensor rests"

AT_ONCE = 2048
"""Frames that are denoised together; a clip up to this length always is whole."""
TEXTURE_SEED = 0
CONTEXT = 288
"""Frames around a part that its preview is made with: four windows of training."""


class Swept(NamedTuple):
    """Denoised preview of a part of the map."""

    denoiser: RemoteDenoiser
    doppler: DopplerMap


class _Order(NamedTuple):
    """How far a clip whose map stands is gone through, with what the model remembers there."""

    next: int = 0
    session: RemoteSession | None = None


class _Answer(NamedTuple):
    """Denoised piece of the map."""

    piece: View
    values: NDArray[np.float32]  # (bins, n)
    like: DopplerMap  # map with their unit and axis
    order: _Order | None = None  # that it goes on with
    session: RemoteSession | None = None  # at its end, where pieces follow in order
    cost_s: float = 0.0  # of each frame there


class DenoisedMap(BackgroundModel):
    """Denoises what changed of the synthetic map, what is in view first.

    While the sensor is dragged the model is asked by the background task that sweeps the
    map (:meth:`postprocess`), so that both are of the same place and are shown together. At
    rest one piece after another is denoised behind the synthetic map. Pieces of a long clip
    are a preview, where a model remembers more than is around them: when the synthetic map
    stands, the clip is gone through in order, or denoised at once where a model looks ahead or
    knows another frame rate (:meth:`finish`). Live it grows frame by frame.
    """

    failed = Signal(str)
    idle = Signal()  # everything is denoised

    _stumbled = Signal(str)

    def __init__(
        self, track: MapModel, session: Session, view: Callable[[], View], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.track, self._synthetic = track, session.maps.synthetic
        self._view, self._partial = view, PartialMap(track)
        self._jobs, self._results = session.jobs, session.results
        self._playback = session.playback
        self._job: Job | None = None
        self.denoiser: RemoteDenoiser | None = None  # the model in use
        self.words = ""
        self._texture: Texture | None = None
        self._movements: KnownMovements | None = None
        self._held = False  # it follows the clock
        self._reached: _Order | None = None  # by it; None: begin where it is
        self._stepper = LatestRunner("live", self, self._take_live)
        self._stepper.failed.connect(lambda _: self.set_live(False))
        session.playback.frame_changed.connect(self._step)
        self._runner = LatestRunner("denoise", self, self._receive)
        self._runner.failed.connect(lambda error: self._fail(str(error)))
        self._stumbled.connect(self._fail)
        self._again = delayed(self._go_on, _BETWEEN_MS, self)
        self._took_s: deque[float] = deque(maxlen=5)
        self._forget()

    def _forget(self) -> None:
        self._sensor: object = None  # placement that the synthetic map is of
        self._order: _Order | None = None  # once the synthetic map stands
        self._partial.forget()
        self._restart()

    def _restart(self) -> None:
        """Mark all frames as not denoised."""
        frames = self._synthetic.known.size
        self._wanted = np.ones(frames, bool)  # not asked for since the synthetic map changed there
        if self._partial.frames == frames:
            self._partial.quality[:] = 0  # what is on screen stays until there is better
        else:
            self._partial.forget()
        if self._order is not None:
            self._order = _Order()

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
        self,
        denoiser: RemoteDenoiser | None,
        words: str = "",
        *,
        texture: Texture | None = None,
        known: KnownMovements | None = None,
    ) -> None:
        """Denoise with another model, called ``words`` on the track, or not at all.

        With a texture the map is drawn as the radar would show it; of the known movements is said
        how many frames are others.
        """
        self._stop()
        self._texture, self._movements = texture, known
        self._took_s.clear()
        self.denoiser = denoiser
        self.words = words
        self.track.set_status(words)
        self._partial.forget()
        self._restart()
        if denoiser is None:
            self.track.set_map(None)
        elif not self._restore():
            self._go_on()

    def clear(self) -> None:
        """Remove the map."""
        self._stop()
        self._forget()
        self.track.set_map(None)

    def take(self, sensor: object, piece: View) -> None:
        """Follow a changed piece of the synthetic map, all of which is for a placement now."""
        self._took_s.clear()
        if not self._held:
            self.track.set_status(self.words)
        self._follow(sensor)
        self._wanted[touched(piece, self._wanted.size)] = True
        if not self._restore() and not self._again.isActive():
            self._go_on()

    def finish(self) -> None:
        """Replace previews, now that the synthetic map is complete."""
        if self._order is None:
            self._order = _Order()
            self._go_on()

    def postprocess(self) -> Postprocess | None:
        """Function that denoises a preview in the background; None without a model."""
        denoiser, source = self.denoiser, self._synthetic.map
        if denoiser is None or source is None or self._held or not self.keeps_up:
            return None
        if self._lacks_limbs:
            return None

        def denoised(part: Part) -> Swept | None:
            began = time.perf_counter()
            try:
                made = denoiser.denoise(cut_out(source, part.start, part.values, part.limbs))
            except Sd2Error as error:
                self._stumbled.emit(str(error))
                return None
            self._took_s.append(time.perf_counter() - began)
            return Swept(denoiser, made)

        return denoised

    def take_sweep(self, sensor: object, start: int, swept: Swept | None) -> None:
        """Show the preview that was denoised during a drag."""
        self._runner.cancel()
        self._again.stop()
        self._follow(sensor)
        self._wanted[:] = True
        self._partial.quality[:] = 0
        if self.denoiser is None or self._held:
            return
        if swept is not None and swept.denoiser is self.denoiser:
            stop = start + swept.doppler.values.shape[1]
            self._paint(swept.doppler.values, (start, stop), swept.doppler)
            self._wanted[start:stop] = False
        else:
            self.track.set_status(f"{self.words} · {_WAITS}")
        self._publish()

    def set_live(self, live: bool) -> None:
        """Denoise frame by frame as the clock reaches them, as beside a radar, or the whole map."""
        if live == self._held:
            return
        self._held = live
        self._stop()
        self._restart()
        if live:
            self._publish()
            self._step()
        else:
            self.track.set_status(self.words)
            self._go_on()

    def close(self) -> None:
        """Stop computing."""
        self._stop()
        super().close()

    # --- live -----------------------------------------------------------------------------

    def _step(self) -> None:
        """Ask for the frames up to the one on screen, one after another."""
        source, denoiser, clock = self._synthetic.map, self.denoiser, self._playback
        frame = self._synthetic.frame_at(clock.time_s)
        if not self._held or source is None or denoiser is None or frame is None:
            return
        if self._stepper.busy or self._lacks_limbs:
            return
        longest = _JUMP_S * source.timebase.frames_per_s * clock.speed
        if self._reached is None or not -1 <= frame - self._reached.next <= longest:
            self._reached = _Order(frame)
        ahead = self._synthetic.known[self._reached.next : frame + 1]
        if ahead.size and ahead.all():
            self._stepper.submit(self._in_order(self._reached, frame + 1))

    def _take_live(self, answer: _Answer) -> None:
        assert self.denoiser is not None
        if self._reached is not None and self._reached.session is None:
            self._partial.quality[:] = 0  # it began here
        self._reached = _Order(answer.piece[1], answer.session)
        self._paint(answer.values, answer.piece, answer.like)
        self._publish()
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

    @property
    def _final(self) -> bool:
        """True once no frame is a preview."""
        frames = self._wanted.size
        in_order = self._order is not None and self._order.next >= frames
        return self._partial.full and (in_order or (frames <= AT_ONCE and not self._wanted.any()))

    def _restore(self) -> bool:
        """Show the map if it was made before of the same synthetic map, by the same model."""
        kept = None if self._held or not self._wanted.any() else self._results.get(self._key)
        if kept is None:
            return False
        self._stop()
        self._begin_like(kept)
        self._partial.paint(0, kept.values, FINAL)
        self._wanted[:] = False
        self._order = _Order(self._wanted.size)
        self._publish()
        self._end()
        return True

    # --- denoising ------------------------------------------------------------------------

    def _follow(self, sensor: object) -> None:
        if self._wanted.size != self._synthetic.known.size:
            self._restart()
        if sensor != self._sensor:
            self._sensor = sensor
            self._partial.quality[:] = 0
            self._wanted[:] = True
        self._order = None

    def _go_on(self) -> None:
        source, known, denoiser = self._synthetic.map, self._synthetic.known, self.denoiser
        if source is None or denoiser is None or self._held or self._runner.busy:
            return
        if self._lacks_limbs:
            return  # they are on their way
        wanted = known & self._wanted
        piece = next_piece(wanted, self._view())
        if piece is None:
            if not self._go_on_in_order():
                self._end()
            return
        self._report(int(wanted.sum()))
        first, last = piece
        begin, end = with_context(known, piece)
        # Copied: the values go on changing while the model works.
        limbs = None if source.limbs is None else deepcopy(source.limbs.between(begin, end))
        doppler = cut_out(source, begin, source.values[:, begin:end].copy(), limbs)

        def work(emit: object) -> _Answer:
            denoised = denoiser.denoise(doppler)
            values = denoised.values[:, first - begin : last - begin]
            return _Answer(piece, values, denoised)

        self._wanted[first:last] = False
        self._runner.submit(work)

    def _go_on_in_order(self) -> bool:
        """Denoise the next piece with what the model remembers of those before, if need be.

        At another frame rate, and with a look ahead, pieces are not those of the whole: all at
        once, as the command does.
        """
        source, denoiser, order = self._synthetic.map, self.denoiser, self._order
        frames = self._wanted.size
        if order is None or frames <= AT_ONCE or order.next >= frames:
            return False
        assert source is not None
        assert denoiser is not None
        self._report(frames - order.next)
        if not (denoiser.equals_batch and is_regular(source.times_s, denoiser.card.frame_rate_hz)):
            whole = cut_out(source, 0, source.values.copy(), deepcopy(source.limbs))

            def at_once(emit: object) -> _Answer:
                denoised = denoiser.denoise(whole)
                return _Answer((0, frames), denoised.values, denoised, order)

            self._runner.submit(at_once)
            return True
        self._runner.submit(self._in_order(order, min(order.next + AT_ONCE, frames)))
        return True

    def _in_order(self, order: _Order, stop: int) -> Callable[[object], _Answer]:
        """Go on to a frame, with what the model remembers of those before."""
        source, denoiser, start = self._synthetic.map, self.denoiser, order.next
        assert source is not None
        assert denoiser is not None
        energies = input_of(source.between(start, stop), denoiser.card.parts).copy()
        present = source.present_mask[start:stop]
        like = replace(source, kind="denoised", meta={}, uncertainty=None, limbs=None)

        def work(emit: object) -> _Answer:
            session = order.session or denoiser.live()
            began = time.perf_counter()
            answers = session.advance(energies, present)
            cost_s = (time.perf_counter() - began) / len(answers)
            return _Answer((start, stop), answers.T, like, order, session, cost_s)

        return work

    def _end(self) -> None:
        """Everything is denoised: say which frames the model passes through."""
        self._report(0)
        shown, key = self.track.map, self.track.key
        if shown is not None and key is not None and self._results.get(key) is None:
            kept = replace(shown, values=shown.values.copy())
            self._results.put(key, kept, kept.values.nbytes)
        source, movements = self._synthetic.map, self._movements
        if source is not None and movements is not None:
            passed = int(movements.strange(source.values.T, source.axis).sum())
            if passed:
                self.track.set_status(
                    f"{self.words} · {passed:,} frames unlike what it learnt stay synthetic"
                )
        self.idle.emit()

    def _receive(self, answer: _Answer) -> None:
        if answer.order is None:
            self._paint(answer.values, answer.piece, answer.like)
            self._publish()
            # Pieces of a long clip follow each other at once; a short one begins again.
            if self._wanted.size > AT_ONCE:
                self.track.set_status(f"{self.words} · preview")
                self._go_on()
            elif (self._wanted & self._synthetic.known).any():
                self._again.start()
            else:
                self._end()
            return
        if answer.order is self._order:  # else it has begun again
            last = answer.piece[1]
            self._order = _Order(last, answer.session)
            self._paint(answer.values, answer.piece, answer.like)
            share = 100 * last // self._wanted.size
            done = "" if share == 100 else f" · preview, {share} % final"
            self.track.set_status(f"{self.words}{done}")
            self._publish()
        self._go_on()

    def _begin_like(self, like: DopplerMap) -> None:
        """Begin a map with the unit and the axis of another where there is none."""
        source = self._synthetic.map
        assert source is not None
        if not self._partial.frames:
            empty, base = np.zeros_like(source.values), source.timebase
            self._partial.begin(
                replace(like, values=empty, timebase=base, present=source.present, limbs=None)
            )

    def _paint(self, values: NDArray[np.float32], piece: View, like: DopplerMap) -> None:
        """Take over a piece (bins, n)."""
        self._begin_like(like)
        if self._texture is not None:
            values = self._texture.drawn(values.T, (TEXTURE_SEED,), piece[0]).T
        known = self._synthetic.known[slice(*piece)]
        self._partial.paint(piece[0], values, known.astype(np.uint8))

    def _publish(self) -> None:
        self._partial.show(self._key if self._final else None)

    def _report(self, left: int) -> None:
        """Report a long clip as a task that can be cancelled."""
        total = self._wanted.size
        if left > AT_ONCE and self._job is None:
            self._job = Job("Denoising the map", self._give_up)
            self._jobs.start(self._job)
        if self._job is not None:
            self._jobs.report(self._job, total - left, total)
            if left == 0:
                self._end_job()

    def _give_up(self) -> None:
        """Cancel on the user's request; denoised frames stay."""
        self._stop()
        self._order = None
        self._wanted[:] = False
        self.idle.emit()

    def _fail(self, words: str) -> None:
        self._stop()
        self.denoiser = None
        self._partial.forget()
        self.track.set_map(None)
        self.failed.emit(words)

    def _stop(self) -> None:
        self._runner.cancel()
        self._stepper.cancel()
        self._reached = None
        self._again.stop()
        self._end_job()

    def _end_job(self) -> None:
        self._jobs.finish(self._job)
        self._job = None


def next_piece(wanted: NDArray[np.bool_], view: View) -> View | None:
    """Part to be denoised next, half-open; None when there is none.

    ``wanted``, shape (T,), is true for known frames without an answer. Frames in ``view``
    come first, then those that follow, then those before.
    """
    if len(wanted) <= AT_ONCE:
        return (0, len(wanted)) if wanted.any() else None
    for start, stop in (view, (view[1], len(wanted)), (0, view[0])):
        numbers = np.flatnonzero(wanted[start:stop])
        if numbers.size:
            first = start + int(numbers[0])
            last = start + int(numbers[numbers < numbers[0] + AT_ONCE][-1])
            return first, last + 1
    return None


def with_context(known: NDArray[np.bool_], piece: View) -> View:
    """Part with the known frames before and after it.

    It begins where a window does that is cut from the whole clip.
    """
    first, last = piece[0], piece[1]
    wanted = max(first - CONTEXT, 0)
    before = known[wanted - wanted % (LENGTH - OVERLAP) : first][::-1]
    after = known[last : last + CONTEXT]
    return (
        first - (len(before) if before.all() else int(before.argmin())),
        last + (len(after) if after.all() else int(after.argmin())),
    )


def touched(piece: View, frames: int) -> slice:
    """Range of frames whose preview depends on a stretch."""
    return slice(max(piece[0] - CONTEXT, 0), min(piece[1] + CONTEXT, frames))


def cut_out(
    doppler: DopplerMap, start: int, values: NDArray[np.float32], limbs: LimbMaps | None = None
) -> DopplerMap:
    """Part of a map, with other values (bins, frames), and its split."""
    inside = replace(doppler, uncertainty=None, limbs=None).between(start, start + values.shape[1])
    return replace(inside, values=values, limbs=limbs)
