"""Class probabilities of every frame of a map, kept in step with the map."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, Emit, LatestRunner, delayed
from sd2app.background.model_worker.client import RemoteClassifier, RemoteSession
from sd2app.denoise.map import cut_out
from sd2app.session.maps import MapModel
from sd2core.classify.card import ClassifierCard
from sd2core.denoise.resample_to_model import check_bins, is_regular, stretches
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.numerics.byte_budget import ByteBudget
from sd2core.timebase import Timebase

_LATE_S = 0.2
"""Largest accepted lag behind the clock while a map grows frame by frame."""
_LATER_S = 0.5
"""Largest accepted lag in addition to the classifier's own delay; its age is shown."""

_AT_ONCE = 2048
"""Frames that are classified together."""

_BETWEEN_MS = 120
"""Shortest interval between updates while a long map is painted piece by piece."""


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


class _Going(NamedTuple):
    """Session of a stretch that is classified up to a frame."""

    session: RemoteSession
    start: int
    next: int
    answered: int
    """The answers of frames from here on may change with the next frames."""


class _Piece(NamedTuple):
    start: int
    shares: NDArray[np.float32]
    going: _Going | None


class ClassTrack(BackgroundModel):
    """Classifies what changed of a map, from the first frame that differs.

    Classifiers are causal: what stands before that frame stays right, and where the map
    only grows, the classifier goes on with what it remembers, as beside a live radar.
    ``counts`` tells if a map is of the sensor's present place; otherwise all of it is outdated.
    """

    changed = Signal()  # probabilities of frames

    def __init__(
        self, counts: Callable[[MapModel], bool], results: ByteBudget, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._counts, self._results = counts, results
        self.source: MapModel | None = None  # the map that is looked at
        self._classifier: RemoteClassifier | None = None
        self.card: ClassifierCard | None = None  # of the classifier at work
        self.problem = ""  # why this map cannot be classified
        self._runner = LatestRunner("classify", self, self._finish, self._fail)
        self._runner.partial.connect(self._receive)
        self._calm = delayed(self._go_on, _BETWEEN_MS, self)
        self._forget()

    def _forget(self) -> None:
        self._given: DopplerMap | None = None
        self._known = np.zeros(0, bool)
        # Probabilities, (frames, classes), and the frames, (frames,), whose answer is of the map as
        # it is now; those of the others are older.
        self.shares = np.zeros((0, 0), np.float32)
        self.done = np.zeros(0, bool)
        self._revision = -1
        self._going: _Going | None = None
        self._until = 0
        self._again = False

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
        self._calm.stop()
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
        if self._restore() or self._again:
            return
        if np.count_nonzero(self._known & ~self.done) <= _AT_ONCE:
            self._calm.stop()
            self._go_on()
        elif not self._calm.isActive():
            self._calm.start()

    def _take(self, doppler: DopplerMap, known: NDArray[np.bool_]) -> None:
        """Copy values, which may change while they are classified."""
        assert self.card is not None
        before = self._given
        count = 0 if before is None else len(before.timebase)
        if before is None or not np.array_equal(before.times_s, doppler.times_s[:count]):
            self.shares = np.full((len(known), len(self.card.classes)), np.nan, np.float32)
            self.done = np.zeros(len(known), bool)
            before, first, values = None, 0, doppler.values.copy()
        else:
            if count < len(known):
                before = self._lengthen(before, doppler.timebase)
            # Of a long map little is known while it grows frame by frame: no more is looked at.
            numbers = np.flatnonzero(known | self._known)
            start, stop = (int(numbers[0]), int(numbers[-1]) + 1) if numbers.size else (0, 0)
            part = slice(start, stop)
            differs = (before.values[:, part] != doppler.values[:, part]).any(axis=0)
            differs |= self._known[part] != known[part]
            differs |= before.present_mask[part] != doppler.present_mask[part]
            first = start + int(differs.argmax()) if differs.any() else len(known)
            values = before.values
        self.problem = ""
        # What was known of this frame and is another now has been seen by earlier answers.
        seen = first < len(known) and before is not None and bool(self._known[first])
        self.done[first - (min(self.card.delay_frames, first) if seen else 0) :] = False
        # What is under way is still right where the map only grew behind it.
        self._again = self._runner.busy and first >= self._until
        if self._runner.busy and not self._again:
            # The other side may have gone on without anybody to take its answer.
            self._runner.cancel()
            self._going = None
        if self._going is not None and self._going.next > first:
            self._going = None
        if before is not None:
            # What is read meanwhile is before it, or of no interest any more.
            values[:, first:stop] = doppler.values[:, first:stop]
        self._given, self._known = replace(doppler, values=values), known.copy()
        nobody = known & ~doppler.present_mask
        self.shares[nobody] = self.card.no_person()
        self.done[nobody] = True
        self.changed.emit()

    @property
    def _key(self) -> Hashable:
        """Key of all that the answers depend on; None until the map is final."""
        return None if self.source is None else self.source.key_with(self._classifier)

    def _restore(self) -> bool:
        """Show what the classifier answered before of the same map."""
        kept = self._results.get(self._key)
        if kept is None or self._again or self.done.all():
            return False
        self._calm.stop()
        self._runner.cancel()
        self.shares[:], self.done[:], self._going = kept, True, None
        self.changed.emit()
        return True

    def _lengthen(self, before: DopplerMap, timebase: Timebase) -> DopplerMap:
        """Make room for frames that were added to the map."""
        more = len(timebase) - len(self._known)
        self._known = np.append(self._known, np.zeros(more, bool))
        self.done = np.append(self.done, np.zeros(more, bool))
        self.shares = np.pad(self.shares, ((0, more), (0, 0)), constant_values=np.nan)
        values = np.pad(before.values, ((0, 0), (0, more)))
        present = np.append(before.present_mask, np.ones(more, bool))
        return replace(before, values=values, timebase=timebase, present=present)

    # --- classifying ----------------------------------------------------------------------

    def _go_on(self) -> None:
        doppler, classifier, card = self._given, self._classifier, self.card
        if doppler is None or classifier is None or card is None:
            return
        waiting = self._known & ~self.done
        numbers = np.flatnonzero(waiting)
        if not numbers.size:
            return
        self._until = int(numbers[-1]) + 1
        known, going, rate_hz = self._known, self._going, card.frame_rate_hz
        is_growing = self.source is not None and self.source.growing

        def work(emit: Emit) -> None:
            known_map = replace(doppler, present=doppler.present_mask & known)
            for start, stop in stretches(known_map, rate_hz):
                if not waiting[start:stop].any():
                    continue
                # What follows is still to come: the last frames have no answer until then.
                grows = not known[stop] if stop < len(known) else is_growing
                if is_regular(doppler.times_s[start:stop], rate_hz):
                    _in_order(classifier, doppler, (start, stop), grows, going, emit)
                else:
                    cut = cut_out(doppler, start, doppler.values[:, start:stop])
                    cut = replace(cut, present=None)
                    owed = round(card.delay_s * cut.timebase.frames_per_s) if grows else 0
                    shares = classifier.probabilities(cut)
                    emit(_Piece(start, shares[: max(len(shares) - owed, 0)], None))

        self._runner.submit(work)

    def _receive(self, piece: _Piece) -> None:
        stop = piece.start + len(piece.shares)
        self.shares[piece.start : stop] = piece.shares
        self.done[piece.start : stop] = True
        self._going = piece.going
        self.changed.emit()

    def _finish(self, _: object) -> None:
        again, self._again = self._again, False
        if again:
            self._go_on()
        elif self._key is not None and self.done.all():
            self._results.put(self._key, self.shares.copy(), self.shares.nbytes)
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        revision = self._revision
        self._stop()
        self._revision = revision
        self.problem = str(error)
        self.changed.emit()


def _in_order(
    classifier: RemoteClassifier,
    doppler: DopplerMap,
    stretch: tuple[int, int],
    grows: bool,
    going: _Going | None,
    emit: Emit,
) -> None:
    """Classify one stretch piece by piece from where it was left; ``grows``: no end yet."""
    start, stop = stretch
    if going is None or going.start != start or going.next > stop:
        going = _Going(classifier.live(), start, start, start)
    while going.next < stop:
        end = min(going.next + _AT_ONCE, stop)
        shares = going.session.advance(np.ascontiguousarray(doppler.values[:, going.next : end].T))
        answered = going.answered
        going = _Going(going.session, start, end, answered + len(shares))
        emit(_Piece(answered, shares, going))
    if going.answered < stop and not grows:
        emit(_Piece(going.answered, going.session.finish(), going))
