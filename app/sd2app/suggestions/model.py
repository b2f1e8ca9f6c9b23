"""Suggested spans: found in the background, then accepted or rejected one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoStack

from sd2app.background.latest import LatestRunner
from sd2app.labels.model import LabelsModel
from sd2app.session.maps import MapModel
from sd2app.session.playback import PlaybackModel
from sd2app.suggestions.finders import Found, SpanFinder, Threshold
from sd2core.labels.edits import Change
from sd2core.labels.field_edits import offer, pending, reject, take
from sd2core.labels.spans import Labels, Span
from sd2core.labels.suggest import LABEL, TRACK


class SuggestionsModel(QObject):
    """Suggested spans to be accepted or rejected; the spans themselves are among the labels.

    Another threshold takes the place of the step before as long as nothing else was done, so
    that trying thresholds is one step. What was rejected does not come again while the
    recording is open. The first of ``finders`` is the default.
    """

    changed = Signal()  # use of suggestions, their number, or their source

    def __init__(
        self,
        labels: LabelsModel,
        playback: PlaybackModel,
        finders: Sequence[SpanFinder],
        undo_stack: QUndoStack,
        apply: Callable[[Change], bool],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._labels, self._playback = labels, playback
        self._finders = tuple(finders)
        self._finder = self._finders[0]
        self._stack, self._apply = undo_stack, apply
        self._active = False
        self._wanted = False
        self._thresholds = [finder.threshold.usual for finder in self._finders]
        self._if_none = ""
        self._problem = ""
        self._declined: tuple[Span, ...] = ()
        self._home = labels.track
        self._made: tuple[Labels, int] | None = None
        self._pending: tuple[Span, ...] = ()
        self._runner = LatestRunner("suggest", self)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._fail)
        self._runner.idle_changed.connect(lambda _: self.changed.emit())
        labels.changed.connect(self._follow)
        labels.selection_changed.connect(self._remember_home)
        for finder in self._finders:
            for signal in finder.signals:
                signal.connect(self._begin_if_complete)

    # --- what is there --------------------------------------------------------------------

    @property
    def active(self) -> bool:
        """True while the bar of suggestions is shown."""
        return self._active

    @property
    def busy(self) -> bool:
        """True during a search, or while its map is being computed."""
        return self._runner.busy or self._wanted

    @property
    def pending(self) -> tuple[Span, ...]:
        """Suggestions neither accepted nor rejected."""
        return self._pending

    @property
    def finders(self) -> tuple[SpanFinder, ...]:
        """All finders."""
        return self._finders

    @property
    def finder(self) -> SpanFinder:
        """Finder in use."""
        return self._finder

    @property
    def sources(self) -> tuple[MapModel, ...]:
        """Maps to choose from."""
        return self._finder.sources

    @property
    def source(self) -> MapModel | None:
        """Map that is searched."""
        return self._finder.source

    @property
    def threshold(self) -> float:
        """Threshold of a suggestion, in the unit of :attr:`limits`."""
        return self._thresholds[self._finders.index(self._finder)]

    @property
    def limits(self) -> Threshold:
        """Range of the threshold."""
        return self._finder.threshold

    @property
    def accepted_as(self) -> str:
        """Label for accepted spans without a known one; empty where all are known."""
        unknown = any(span.label == LABEL for span in self._pending)
        return self._labels.label if unknown else ""

    @property
    def text(self) -> str:
        """State of the search, as a sentence."""
        source, why_not = self.source, self._problem or self._finder.why_not
        if why_not or source is None:
            return why_not
        if self._wanted:
            title = source.title.lower()
            waits = source.covered is not None
            return f"Waiting for the map: {title}" if waits else f"Classifying the map: {title}"
        if self._runner.busy:
            return "Looking…"
        count = len(self._pending)
        if count:
            return f"{count} suggestion{'s' * (count != 1)} to decide on"
        return self._if_none or "No suggestions left to decide on"

    # --- asking ---------------------------------------------------------------------------

    def start(self, finder: SpanFinder | None = None) -> None:
        """Search with a finder, or with the first one."""
        self._finder = finder or self._finders[0]
        if not self._finder.why_not:
            self._active = True
            self._made = None
            self._look()

    def set_finder(self, finder: SpanFinder) -> None:
        """Search with another finder; its results replace earlier ones."""
        if finder is not self._finder:
            self._finder = finder
            self._look()

    def stop(self) -> None:
        """Stop the search and hide the bar; suggestions that are there stay."""
        self._runner.cancel()
        self._active = self._wanted = False
        self.changed.emit()

    def set_threshold(self, threshold: float) -> None:
        """Search with another threshold."""
        if threshold != self.threshold:
            self._thresholds[self._finders.index(self._finder)] = threshold
            self._look()

    def set_source(self, source: MapModel) -> None:
        """Search another map."""
        if source is not self.source:
            self._finder.set_source(source)
            self._look()

    def open(self) -> None:
        """Forget everything about the recording before."""
        self._declined, self._made, self._if_none, self._problem = (), None, "", ""
        for finder in self._finders:
            finder.set_source(None)
        self._runner.cancel()
        self._wanted, self._active = False, bool(self._pending)
        self.changed.emit()

    def close(self) -> None:
        """Stop the search."""
        self._runner.close()

    # --- deciding -------------------------------------------------------------------------

    def current(self) -> tuple[Span, ...]:
        """Return the suggestions to decide on: those selected, else the next in time."""
        chosen = tuple(span for span in self._labels.selected if span.origin == "suggestion")
        if chosen:
            return chosen
        now_s = self._playback.time_s
        return tuple(span for span in self._pending if span.end_s > now_s)[:1] or self._pending[:1]

    def accept(self, label: str | None = None) -> None:
        """Accept the current suggestion with a label, and go to the next."""
        self._take(self.current(), label)

    def accept_all(self) -> None:
        """Accept all."""
        self._take(self._pending, None)

    def reject(self) -> None:
        """Reject the current suggestion, and go to the next."""
        self._reject(self.current())

    def reject_all(self) -> None:
        """Reject all."""
        self._reject(self._pending)

    def _take(self, spans: Sequence[Span], label: str | None) -> None:
        if not spans:
            return
        ids = [span.id for span in spans]
        track, given = self._target(), label or self._labels.label
        done = self._apply(
            lambda labels, base: take(labels, base, ids, track, given, keep_known=label is None)
        )
        if done:
            self._go_on(spans[-1].start_s)

    def _reject(self, spans: Sequence[Span]) -> None:
        if not spans:
            return
        ids = [span.id for span in spans]
        if self._apply(lambda labels, base: reject(labels, ids)):
            self._declined = (*self._declined, *spans)
            self._go_on(spans[-1].start_s)

    def _go_on(self, from_s: float) -> None:
        after = [span for span in self._pending if span.start_s >= from_s] or self._pending
        self._labels.select([after[0].id] if after else [])
        if after and not self._playback.playing:
            self._playback.seek(after[0].start_s)

    def _target(self) -> str:
        """The track in use; that of suggestions is not for what was accepted."""
        names = [track.name for track in self._labels.labels.tracks]
        others = [name for name in names if name != TRACK]
        return self._home if self._home in others else (others[0] if others else TRACK)

    # --- looking --------------------------------------------------------------------------

    def _look(self) -> None:
        self._problem = self._if_none = ""
        if not self._active or self._finder.why_not:
            self._runner.cancel()
            self._wanted = False
            self.changed.emit()
            return
        self._wanted = not self._finder.ready
        if not self._wanted:
            look = self._finder.look(self.threshold)
            self._runner.submit(lambda emit: look())
        self.changed.emit()

    def _begin_if_complete(self) -> None:
        if self._wanted:
            self._look()

    def _receive(self, found: Found) -> None:
        self._if_none = found.if_none
        if self._made is not None and self._nothing_since(*self._made):
            self._stack.undo()
        # What was rejected and brought back by an undo is not rejected any more.
        here = {(span.start_s, span.end_s) for span in self._pending}
        declined = tuple(one for one in self._declined if (one.start_s, one.end_s) not in here)
        self._declined = declined
        before = self._labels.labels
        self._apply(lambda labels, base: offer(labels, base, found.spans, declined))
        after = self._labels.labels
        self._made = (after, self._stack.index()) if after is not before else None
        self._go_on(self._playback.time_s)
        self.changed.emit()

    def _nothing_since(self, labels: Labels, step: int) -> bool:
        return labels is self._labels.labels and step == self._stack.index()

    def _fail(self, error: Exception) -> None:
        self._problem = str(error)
        self.changed.emit()

    def _follow(self) -> None:
        now = pending(self._labels.labels)
        if now != self._pending:
            self._pending = now
            self.changed.emit()

    def _remember_home(self) -> None:
        if self._labels.track != TRACK:
            self._home = self._labels.track
        self.changed.emit()
