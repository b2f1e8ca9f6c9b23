"""Class probabilities of every frame of a map, kept in step with the map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, LatestRunner
from sd2app.background.model_worker.client import RemoteClassifier, RemoteSession
from sd2app.denoise.map import cut_out
from sd2app.session.maps import MapModel
from sd2core.classify.card import ClassifierCard
from sd2core.denoise.resample_to_model import check_bins, is_regular, stretches
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap

_LATE_S = 0.2
"""Largest accepted lag behind the clock while a map grows frame by frame."""
_LATER_S = 0.5
"""Largest accepted lag in addition to the classifier's own delay; its age is shown."""

_AT_ONCE = 2048
"""Frames that a classifier is asked about together; in between a denoiser is heard."""


@dataclass(frozen=True)
class ClassReading:
    """Class probabilities of one frame."""

    classes: tuple[str, ...]
    shares: tuple[float, ...]
    current: bool  # False while the map differs from the one that this was read from
    nobody: bool  # no person in the frame
    ago_s: float = 0.0  # lag behind the requested time, if the classifier is late on a growing map

    @property
    def best(self) -> int:
        """The most probable class."""
        return max(range(len(self.shares)), key=self.shares.__getitem__)


class _Reached(NamedTuple):
    """Session of a stretch that grows, and how far it has come."""

    session: RemoteSession
    start: int
    next: int
    answered: int  # answers of frames from here on are owed until there are more frames


_Answers = tuple[list[tuple[int, NDArray[np.float32]]], _Reached | None]
"""First frames with the shares from there on, and how far a stretch has come that grows."""


class ClassTrack(BackgroundModel):
    """Classifies what changed of a map, from the first frame that differs.

    Classifiers are causal: what stands before that frame stays right, and where the map
    only grows, the classifier goes on with what it remembers, as beside a live radar.
    ``counts`` tells if a map is of the sensor's present place; otherwise all of it is outdated.
    """

    changed = Signal()  # probabilities of frames

    def __init__(self, counts: Callable[[MapModel], bool], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._counts = counts
        self.source: MapModel | None = None  # the map that is looked at
        self._classifier: RemoteClassifier | None = None
        self.card: ClassifierCard | None = None  # of the classifier at work
        self.problem = ""  # why this map cannot be classified
        self._runner = LatestRunner("classify", self, self._receive, self._fail)
        self._forget()

    def _forget(self) -> None:
        self._given: DopplerMap | None = None
        self._known = np.zeros(0, bool)
        # Probabilities, (frames, classes), and the frames, (frames,), whose answer is of the map as
        # it is now; those of the others are older.
        self.shares = np.zeros((0, 0), np.float32)
        self.done = np.zeros(0, bool)
        self._revision = self._asked = -1  # of the map as it is, and as it was asked about
        self._until = 0  # last frame that was known then, and one
        self._reached: _Reached | None = None

    # --- what is known --------------------------------------------------------------------

    @property
    def complete(self) -> bool:
        """True once every frame of the current map is classified."""
        source = self.source
        whole = source is not None and source.map is not None and source.covered is None
        return whole and self.current and self.done.size > 0 and bool(self.done.all())

    @property
    def current(self) -> bool:
        """True while the map is current for the sensor."""
        return self.source is not None and self._counts(self.source)

    def at(self, time_s: float) -> ClassReading | None:
        """Classes of the frame at a time of the recording; None where they are not known.

        Of a map that is still growing up to there, what its newest frames show.
        """
        frame = self.source.frame_at(time_s) if self.source is not None else None
        if frame is None or self.card is None or frame >= len(self.shares):
            return None
        asked, frame = frame, self._newest(frame)
        shares = self.shares[frame]
        if np.isnan(shares).any():
            return None
        assert self._given is not None
        times_s = self._given.times_s
        return ClassReading(
            self.card.classes,
            tuple(map(float, shares)),
            bool(self.done[frame]) and self.current,
            not self._given.present_mask[frame],
            float(times_s[asked] - times_s[frame]) if self.card.delay_frames else 0.0,
        )

    def _newest(self, frame: int) -> int:
        """The newest frame up to this one that is done, if it is hardly earlier."""
        assert self._given is not None
        assert self.card is not None
        late_s = self.card.delay_s + _LATER_S if self.card.delay_frames else _LATE_S
        late = round(late_s * self._given.timebase.frames_per_s)
        done = np.flatnonzero(self.done[max(frame - late, 0) : frame + 1])
        return max(frame - late, 0) + int(done[-1]) if done.size else frame

    # --- requests -------------------------------------------------------------------------

    def use(self, classifier: RemoteClassifier | None) -> None:
        """Use another classifier, or none."""
        self._classifier, self.card = classifier, classifier.card if classifier else None
        self._restart()

    def look_at(self, source: MapModel | None) -> None:
        """Look at another map, or at none."""
        if source is self.source:
            return
        if self.source is not None:
            self.source.changed.disconnect(self._follow)
        self.source = source
        if source is not None:
            source.changed.connect(self._follow)
        self._restart()

    # --- following the map ----------------------------------------------------------------

    def _stop(self) -> None:
        self._runner.cancel()
        self._forget()

    def _restart(self) -> None:
        self._stop()
        self.problem = ""
        self._follow()
        self.changed.emit()

    def _follow(self) -> None:
        source, card = self.source, self.card
        if source is None or source.map is None or card is None:
            if self._given is not None:
                self._stop()
                self.changed.emit()
            return
        if source.revision == self._revision:
            return  # its levels, its place in time
        self._revision = source.revision
        try:
            check_bins(source.map, card)
        except Sd2Error as error:
            self._fail(error)
            return
        self._take(source.map, source.known)
        self._go_on()

    def _take(self, doppler: DopplerMap, known: NDArray[np.bool_]) -> None:
        """Copy a map, which may change in place, and forget answers to what was another."""
        assert self.card is not None
        self.problem = ""
        before, frames, count = self._given, len(known), len(self._known)
        shares = np.full((frames, len(self.card.classes)), np.nan, np.float32)
        done, first = np.zeros(frames, bool), 0
        if before is not None and np.array_equal(before.times_s, doppler.times_s[:count]):
            differs = (before.values != doppler.values[:, :count]).any(axis=0)
            differs |= self._known != known[:count]
            differs |= before.present_mask != doppler.present_mask[:count]
            first = int(differs.argmax()) if differs.any() else count
            # What was known of this frame and is another now has been seen by earlier answers.
            seen = self.card.delay_frames if first < count and self._known[first] else 0
            right = max(first - seen, 0)
            shares[:count], done[:right] = self.shares, self.done[:right]
        if first < self._until:
            # Its session may have gone on without anybody to take the answer.
            self._runner.cancel()
            self._reached = None
        nobody = known & ~doppler.present_mask
        shares[nobody], done[nobody] = self.card.no_person(), True
        self._given, self._known = replace(doppler, values=doppler.values.copy()), known.copy()
        self.shares, self.done = shares, done
        self.changed.emit()

    # --- classifying ----------------------------------------------------------------------

    def _go_on(self) -> None:
        """Ask about the map as it is, unless that was done or another answer is awaited."""
        doppler, classifier, known = self._given, self._classifier, self._known
        waiting = np.flatnonzero(known & ~self.done)
        if doppler is None or classifier is None or not waiting.size or self._runner.busy:
            return
        self._asked, self._until, reached = self._revision, int(waiting[-1]) + 1, self._reached
        grows = self.source is not None and self.source.growing
        self._runner.submit(
            lambda emit: _answers(classifier, doppler, known, waiting, grows, reached)
        )

    def _receive(self, answers: _Answers) -> None:
        pieces, self._reached = answers
        for start, shares in pieces:
            self.shares[start : start + len(shares)] = shares
            self.done[start : start + len(shares)] = True
        if self._asked != self._revision:
            self._go_on()
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        revision = self._revision
        self._stop()
        self._revision = revision
        self.problem = str(error)
        self.changed.emit()


def _answers(
    classifier: RemoteClassifier,
    doppler: DopplerMap,
    known: NDArray[np.bool_],
    waiting: NDArray[np.intp],
    grows: bool,
    reached: _Reached | None,
) -> _Answers:
    """Classify the stretches in which frames wait, those that grow from where they were left."""
    card, pieces = classifier.card, []
    is_open = np.append(~known, grows)  # what follows is still to come, and the last answers owed
    inside = replace(doppler, present=doppler.present_mask & known)
    for start, stop in stretches(inside, card.frame_rate_hz):
        if not ((start <= waiting) & (waiting < stop)).any():
            continue
        if is_regular(doppler.times_s[start:stop], card.frame_rate_hz):
            if reached is None or reached.start != start:
                reached = _Reached(classifier.live(), start, start, start)
            for at in range(reached.next, stop, _AT_ONCE):
                end, (session, _, _, answered) = min(at + _AT_ONCE, stop), reached
                shares = session.advance(np.ascontiguousarray(doppler.values[:, at:end].T))
                pieces.append((answered, shares))
                reached = _Reached(session, start, end, answered + len(shares))
            if not is_open[stop]:
                pieces.append((reached.answered, reached.session.finish()))
        else:
            cut = replace(cut_out(doppler, start, doppler.values[:, start:stop]), present=None)
            owed = round(card.delay_s * cut.timebase.frames_per_s) if is_open[stop] else 0
            shares = classifier.probabilities(cut)
            pieces.append((start, shares[: max(len(shares) - owed, 0)]))
    return pieces, reached
