"""The classifier as a finder of suggestions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import SignalInstance

from sd2app.classify.model import ClassifyModel
from sd2app.session.maps import MapModel
from sd2app.suggestions.finders import Found, Threshold
from sd2core.classify.spans import SpanOptions, predicted_spans


class GestureFinder:
    """Finder of the spans that the classifier recognises as gestures."""

    title = "classifier"
    threshold = Threshold(
        0.0, 100.0, 50.0, 5.0, 0, " %", "How sure the classifier must be of a span on average"
    )

    def __init__(self, classify: ClassifyModel) -> None:
        self._classify = classify

    @property
    def why_not(self) -> str:
        """Reason why it cannot be used; empty where it can."""
        if self._classify.path is None:
            return "Choose a classifier first, under Model"
        if not self.sources:
            return "There is no map to look in"
        return self._classify.problem

    @property
    def sources(self) -> tuple[MapModel, ...]:
        """Maps to look in."""
        return self._classify.sources

    @property
    def source(self) -> MapModel | None:
        """The map that the classifier looks at."""
        return self._classify.source

    def set_source(self, source: MapModel | None) -> None:
        """Let the classifier look at another map; None: at the one it chooses."""
        self._classify.set_source(source)

    @property
    def signals(self) -> tuple[SignalInstance, ...]:
        """Signals after which a search may become possible."""
        return (self._classify.track.changed, self._classify.changed)

    @property
    def ready(self) -> bool:
        """True once every frame of the map is classified."""
        return self._classify.track.complete

    def look(self, threshold: float) -> Callable[[], Found]:
        """Make the search, to be run in the background."""
        source, card = self.source, self._classify.track.card
        assert source is not None
        assert source.map is not None
        assert card is not None
        doppler, shares = source.map, self._classify.track.shares.copy()
        timebase = doppler.timebase.shifted(source.offset_s)
        options = SpanOptions(min_confidence=threshold / 100.0)
        names = {name: self._classify.label_of(name) for name in card.classes}

        def look() -> Found:
            spans = predicted_spans(
                shares, timebase, card.classes, options, present=doppler.present
            )
            named = tuple(replace(span, label=names[span.label]) for span in spans)
            return Found(named, "" if named else "Nothing: no gesture is that sure")

        return look
