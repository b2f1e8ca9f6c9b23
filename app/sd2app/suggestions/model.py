"""Suggested spans: who finds them, found, then decided one by one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PySide6.QtCore import QObject, Signal, SignalInstance

from sd2app.labels.edits import LabelEdits
from sd2app.session.content import folder_for_command
from sd2app.session.maps import MapModel
from sd2app.widgets.text import counted, quoted
from sd2core.cli.labels.suggest import Suggest
from sd2core.errors import Sd2Error
from sd2core.labels.field_edits import offer, pending, reject, take
from sd2core.labels.spans import Labels, Span
from sd2core.labels.suggest import LABEL, motion_energy_db, suggest_spans
from sd2core.options.records import words_of
from sd2core.options.suggesting import SuggestOptions


class Threshold(NamedTuple):
    """Range of the threshold that the user sets."""

    low: float
    high: float
    usual: float
    step: float
    decimals: int
    unit: str
    tip: str


class SearchResult(NamedTuple):
    """Spans found, and a sentence for when there are none."""

    spans: tuple[Span, ...]
    if_none: str = ""


class SpanFinder:
    """Method of finding spans in one of several maps; ``searched`` are those that it can search."""

    title: str
    threshold: Threshold
    searched: tuple[MapModel, ...]
    why_not: str
    """Reason why it cannot be used; empty where it can."""
    signals: tuple[SignalInstance, ...]
    """Signals after which a search may become possible."""
    ready: bool
    """True if everything needed for a search is there."""
    _chosen: MapModel | None = None

    @property
    def sources(self) -> tuple[MapModel, ...]:
        """Maps to choose from: those that are there."""
        return tuple(track for track in self.searched if track.map is not None)

    @property
    def source(self) -> MapModel | None:
        """Map that is searched: the one chosen, else the first."""
        sources = self.sources
        return self._chosen if self._chosen in sources else next(iter(sources), None)

    def set_source(self, source: MapModel | None) -> None:
        """Search another map; None: the default."""
        self._chosen = source

    def wake(self) -> None:
        """Begin to get ready; a map is made anyway."""

    def look(self, threshold: float) -> SearchResult:
        """Search; Sd2Error where the map is damaged."""
        raise NotImplementedError

    def words(self, recording: Path, threshold: float) -> list[str]:
        """Words of the command that searches a saved recording likewise."""
        raise NotImplementedError


class MotionFinder(SpanFinder):
    """Finder of motion, of any kind."""

    title = "motion"
    threshold = Threshold(
        3.0, 40.0, SuggestOptions().high_db, 0.5, 1, " dB",
        "How far over the quiet level a suggestion must reach",
    )  # fmt: skip

    def __init__(self, maps: Sequence[MapModel]) -> None:
        self.searched = tuple(maps)
        self.signals = tuple(track.changed for track in maps)

    @property
    def why_not(self) -> str:
        """Reason why it cannot be used; empty where it can."""
        return "" if self.sources else "There is no map to look in"

    @property
    def ready(self) -> bool:
        """True if the map is complete."""
        return self.source is not None and self.source.covered is None

    def look(self, threshold: float) -> SearchResult:
        """Search; Sd2Error where the map is damaged."""
        source = self.source
        assert source is not None
        assert source.map is not None
        doppler = source.map.shifted(source.offset_s)
        if spans := suggest_spans(doppler, SuggestOptions(**_levels(threshold))):
            return SearchResult(spans)
        loudest_db = float(np.nanmax(motion_energy_db(doppler), initial=0.0))
        short = loudest_db >= threshold
        return SearchResult(
            (), "" if short else f"Nothing: the loudest frame has {loudest_db:.1f} dB"
        )

    def words(self, recording: Path, threshold: float) -> list[str]:
        """Words of ``sd2 labels suggest``."""
        name = None if self.source is None else self.source.name
        out = Path("suggested.json")
        command = Suggest(map=recording, of=name, out=out, **_levels(threshold))
        return words_of("labels suggest", command)


def _levels(threshold_db: float) -> dict[str, Any]:
    low_db = min(SuggestOptions().low_db, threshold_db)
    return {"high_db": threshold_db, "low_db": low_db}


class SuggestionsModel(QObject):
    """Suggested spans to be accepted or rejected; the spans themselves are among the labels.

    Another threshold takes the place of the step before as long as nothing else was done, so
    that trying thresholds is one step. What was rejected does not come again while the
    recording is open. The first of ``finders`` is the default.
    """

    changed = Signal()

    def __init__(self, edits: LabelEdits, finders: Sequence[SpanFinder], parent: QObject) -> None:
        super().__init__(parent)
        self.finders, self.finder = tuple(finders), finders[0]
        self.active = False  # while the bar of suggestions is shown
        self.waiting = False  # for the map to be complete, and classified where that is searched
        self.problem = ""  # why the search failed; empty where it did not
        self.pending: tuple[Span, ...] = ()  # neither accepted nor rejected
        self._edits, self._labels, self._playback = edits, edits.labels, edits.playback
        self._stack = edits.undo_stack
        self._thresholds = {finder.title: finder.threshold.usual for finder in finders}
        self._if_none = ""
        self._why_not = ""  # of the finder, when it was last looked at
        self._declined: tuple[Span, ...] = ()
        self._made: tuple[Labels, int] | None = None
        self._labels.changed.connect(self._follow)
        self._labels.selection_changed.connect(self.changed)
        for finder in finders:
            for signal in finder.signals:
                signal.connect(self._begin_if_complete)

    # --- what is there --------------------------------------------------------------------

    @property
    def threshold(self) -> float:
        """Threshold of a suggestion, in the unit of the finder's."""
        return self._thresholds[self.finder.title]

    @property
    def unnamed(self) -> tuple[Span, ...]:
        """Suggestions that say that something moves, but not what."""
        return tuple(span for span in self.pending if span.label == LABEL)

    @property
    def accepted_as(self) -> str:
        """Label for accepted spans without a known one; empty where all are known."""
        return self._labels.label if self.unnamed else ""

    @property
    def text(self) -> str:
        """State of the search, as a sentence."""
        source, why_not = self.finder.source, self.problem or self.finder.why_not
        to_decide = f"{counted(len(self.pending), 'suggestion')} to decide on"
        if why_not or source is None:
            # Those of a file can be decided on before their map is there.
            return to_decide if self.pending and not self.problem else why_not
        if self.waiting:
            title = source.title.lower()
            waits = source.covered is not None
            return f"Waiting for the map: {title}" if waits else f"Classifying the map: {title}"
        if self.pending:
            return to_decide
        return self._if_none or "No suggestions left to decide on"

    @property
    def line(self) -> str:
        """Command for a terminal that searches the saved recording likewise."""
        recording = self._edits.recording
        assert recording is not None
        return quoted(self.finder.words(folder_for_command(recording), self.threshold))

    # --- asking ---------------------------------------------------------------------------

    def start(self, finder: SpanFinder | None = None) -> None:
        """Search with a finder, or with the first one."""
        self.finder = finder or self.finders[0]
        if not self.finder.why_not:
            self.active = True
            self._made = None
            self._look()

    def set_finder(self, finder: SpanFinder) -> None:
        """Search with another finder; its results replace earlier ones."""
        if finder is not self.finder:
            self.finder = finder
            self._look()

    def stop(self) -> None:
        """Wait for no map any more, and hide the bar; suggestions that are there stay."""
        self.active = self.waiting = False
        self.changed.emit()

    def set_threshold(self, threshold: float) -> None:
        """Search with another threshold."""
        if threshold != self.threshold:
            self._thresholds[self.finder.title] = threshold
            self._look()

    def set_source(self, source: MapModel) -> None:
        """Search another map."""
        if source is not self.finder.source:
            self.finder.set_source(source)
            self._look()

    def open(self, *, same: bool = False) -> None:
        """Forget everything about the recording before, or about the same one's other files."""
        self._declined = self._declined if same else ()
        self._made, self._if_none, self.problem = None, "", ""
        for finder in self.finders:
            finder.set_source(None)
        self.waiting, self.active = False, bool(self.pending)
        self.changed.emit()

    # --- deciding -------------------------------------------------------------------------

    def current(self) -> tuple[Span, ...]:
        """Return the suggestions to decide on: those selected, else the next in time."""
        chosen = tuple(span for span in self._labels.selected if span.origin == "suggestion")
        if chosen:
            return chosen
        now_s = self._playback.time_s
        return tuple(span for span in self.pending if span.end_s > now_s)[:1] or self.pending[:1]

    def accept(self, label: str | None = None, *, whole: bool = False) -> None:
        """Accept the current suggestion with a label, and go to the next; or all.

        Of all, those that have a label keep it. By default it is the one used last.
        """
        spans, known = self.pending if whole else self.current(), whole or label is None
        ids = [span.id for span in spans]
        track = self._labels.track or Labels().tracks[0].name
        given = label or self._labels.label
        if ids and self._edits.apply(lambda now: take(now, ids, track, given, keep_known=known)):
            self._go_on(spans[-1].start_s)

    def reject(self, *, whole: bool = False) -> None:
        """Reject the current suggestion, and go to the next; or all."""
        spans = self.pending if whole else self.current()
        ids = [span.id for span in spans]
        if ids and self._edits.apply(lambda now: reject(now.labels, ids)):
            self._declined = (*self._declined, *spans)
            self._go_on(spans[-1].start_s)

    def _go_on(self, from_s: float) -> None:
        after = [span for span in self.pending if span.start_s >= from_s] or self.pending
        self._labels.select([after[0].id] if after else [])
        if after and not self._playback.playing:
            self._playback.seek(after[0].start_s)

    # --- looking --------------------------------------------------------------------------

    def _look(self) -> None:
        self.problem = self._if_none = ""
        self.waiting = False
        if self.active and not self.finder.why_not:
            self.finder.wake()
            self.waiting = not self.finder.ready
            if not self.waiting:
                self._search()
        self.changed.emit()

    def _begin_if_complete(self) -> None:
        before, self._why_not = self._why_not, self.finder.why_not
        if self.waiting:
            self._look()
        elif self.active and self._why_not != before:
            self.changed.emit()

    def _search(self) -> None:
        try:
            result = self.finder.look(self.threshold)
        except Sd2Error as error:
            self.problem = str(error)
            return
        self._if_none = result.if_none
        labels, step = self._made or (None, 0)
        if labels is self._labels.labels and step == self._stack.index():
            self._stack.undo()  # nothing was edited since
        # What was rejected and brought back by an undo is not rejected any more.
        here = {(span.start_s, span.end_s) for span in self.pending}
        declined = tuple(one for one in self._declined if (one.start_s, one.end_s) not in here)
        self._declined = declined
        before = self._labels.labels
        self._edits.apply(lambda now: offer(now, result.spans, declined))
        after = self._labels.labels
        self._made = (after, self._stack.index()) if after is not before else None
        self._go_on(self._playback.time_s)

    def _follow(self) -> None:
        now = pending(self._labels.labels)
        if now != self.pending:
            self.pending = now
            self.changed.emit()
