"""Denoising frame by frame as the clock reaches the frames, as beside a live radar."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner
from sd2app.background.model_worker.client import RemoteDenoiser, RemoteLive
from sd2app.denoise.model import DenoiseModel
from sd2app.session.session import Session
from sd2core.denoise.resample_to_model import input_of, is_regular

_WANTED = "denoise_live"
_JUMP_S = 1.0
"""Longest step of the clock whose skipped frames are denoised; a jump starts again."""


class _Stepped(NamedTuple):
    session: RemoteLive
    start: int
    values: NDArray[np.float32]
    cost_s: float


class LiveDenoiseModel(QObject):
    """While the clock runs the denoised map grows frame by frame; else it is whole.

    The choice to play live is the user's, and remembered.
    """

    changed = Signal()

    def __init__(self, session: Session, denoise: DenoiseModel, parent: QObject) -> None:
        super().__init__(parent)
        self._playback, self._synthetic = session.playback, session.maps.synthetic
        self._settings, self._denoise = session.settings, denoise
        self.wanted = session.settings.flag(_WANTED, False)  # by the user
        self._denoiser: RemoteDenoiser | None = None
        self._session: RemoteLive | None = None
        self._next = 0
        self._fresh = True
        self._runner = LatestRunner("live", self, self._receive)
        self._runner.failed.connect(self._end)
        self._playback.playing_changed.connect(self._follow)
        self._playback.frame_changed.connect(self._advance)
        denoise.changed.connect(self._follow)
        self._synthetic.changed.connect(self._watch)

    @property
    def running(self) -> bool:
        """True while frames are denoised one by one."""
        return self._denoiser is not None

    def set_wanted(self, wanted: bool) -> None:
        """Denoise frame by frame while playing, or the whole map."""
        if wanted != self.wanted:
            self.wanted = wanted
            self._settings.set_value(_WANTED, wanted)
            self._follow()
            self.changed.emit()

    def close(self) -> None:
        """Stop."""
        self._end()
        self._runner.close()

    def _follow(self) -> None:
        denoiser = self._denoise.map.denoiser
        live = self.wanted and self._playback.playing and self._synthetic.map is not None
        if not live or denoiser is None:
            self._end()
        elif denoiser is not self._denoiser:
            self._runner.cancel()
            self._denoiser = denoiser
            self._begin_at(self._frame())
            self._denoise.map.hold(True)
            self.changed.emit()
            self._advance()

    def _watch(self) -> None:
        if self._synthetic.map is None:
            self._end()

    def _end(self) -> None:
        if self._denoiser is None:
            return
        self._runner.cancel()
        self._denoiser = self._session = None
        self._denoise.map.hold(False)
        self.changed.emit()

    def _frame(self) -> int | None:
        return self._synthetic.frame_at(self._playback.time_s)

    def _begin_at(self, frame: int | None) -> None:
        """Start at a frame and forget the frames before."""
        self._session = None
        self._next = frame or 0
        self._fresh = True

    def _advance(self) -> None:
        """Ask for the frames up to the one on screen, one after another."""
        source, denoiser, frame = self._synthetic.map, self._denoiser, self._frame()
        if source is None or denoiser is None or frame is None or self._runner.busy:
            return
        late = frame - self._next
        if late < -1 or late > _JUMP_S * source.timebase.frames_per_s * self._playback.speed:
            self._begin_at(frame)
        covered, start, stop = self._synthetic.covered, self._next, frame + 1
        if denoiser.card.parts and not (source.limbs and source.limbs.of_everybody):
            return
        if stop <= start or (covered is not None and not covered[start:stop].all()):
            return
        energies, session = (
            input_of(source.between(start, stop), denoiser.card.parts),
            self._session,
        )
        present = source.present_mask[start:stop]

        def work(emit: object) -> _Stepped:
            live = session or denoiser.live()
            began = time.perf_counter()
            answers = live.advance(energies, present)
            cost_s = (time.perf_counter() - began) / len(answers)
            return _Stepped(live, start, answers.T, cost_s)

        self._runner.submit(work)

    def _receive(self, stepped: _Stepped) -> None:
        if self._denoiser is None:
            return
        self._session = stepped.session
        self._next = stepped.start + stepped.values.shape[1]
        shown = self._denoise.map
        shown.put(stepped.start, stepped.values, self._fresh)
        self._fresh = False
        # A model that looks at a window of frames knows no later ones here.
        past = "" if self._denoiser.equals_batch else ", from past frames only"
        source, rate_hz = self._synthetic.map, self._denoiser.card.frame_rate_hz
        if source is not None and not is_regular(source.times_s, rate_hz):
            past += f", as if at {rate_hz:g} frames/s"
        shown.track.set_status(
            f"{shown.words} · live, frame by frame{past}: {1e3 * stepped.cost_s:.1f} ms a frame"
        )
        self._advance()
