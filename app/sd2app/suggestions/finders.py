"""What can suggest spans: motion in a map, or the classifier."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from PySide6.QtCore import SignalInstance

from sd2app.classify.model import ClassifyModel
from sd2app.session.tracks import TrackModel
from sd2core.classify.spans import SpanOptions, predicted_spans
from sd2core.labels.spans import Span
from sd2core.labels.suggest import SuggestOptions, motion_energy_db, suggest_spans


class Threshold(NamedTuple):
    """A number that the user turns.

    Parameters
    ----------
    low, high, usual, step : float
    decimals : int
    unit : str
    tip : str
    """

    low: float
    high: float
    usual: float
    step: float
    decimals: int
    unit: str
    tip: str


class Found(NamedTuple):
    """What was found, and what to say where that is nothing."""

    spans: tuple[Span, ...]
    if_none: str = ""


class SpanFinder(Protocol):
    """One way of finding spans."""

    title: str
    threshold: Threshold

    @property
    def why_not(self) -> str:
        """Why it cannot be used; empty where it can."""

    @property
    def sources(self) -> tuple[TrackModel, ...]:
        """Maps to look in."""

    @property
    def source(self) -> TrackModel | None:
        """The map that is looked in."""

    def set_source(self, source: TrackModel | None) -> None:
        """Look in another map; None: in the one that is usual."""

    @property
    def signals(self) -> tuple[SignalInstance, ...]:
        """After which it may be possible to look."""

    @property
    def ready(self) -> bool:
        """Whether all is there that is needed to look."""

    def look(self, threshold: float) -> Callable[[], Found]:
        """What looks, in the background."""


class MotionFinder:
    """What moves: it says where, not what."""

    title = "motion"
    threshold = Threshold(
        3.0, 40.0, SuggestOptions().high_db, 0.5, 1, " dB",
        "How far over the quiet level a suggestion must reach",
    )  # fmt: skip

    def __init__(self, maps: Sequence[TrackModel]) -> None:
        self._maps = tuple(maps)
        self._source: TrackModel | None = None

    @property
    def why_not(self) -> str:
        """Why it cannot be used; empty where it can."""
        return "" if self.sources else "There is no map to look in"

    @property
    def sources(self) -> tuple[TrackModel, ...]:
        """Maps to look in."""
        return tuple(track for track in self._maps if track.map is not None)

    @property
    def source(self) -> TrackModel | None:
        """The map that is looked in: the one chosen, else the first."""
        there = self.sources
        if self._source in there:
            return self._source
        return there[0] if there else None

    def set_source(self, source: TrackModel | None) -> None:
        """Look in another map; None: in the first."""
        self._source = source

    @property
    def signals(self) -> tuple[SignalInstance, ...]:
        """After which it may be possible to look."""
        return tuple(track.changed for track in self._maps)

    @property
    def ready(self) -> bool:
        """Whether the map is complete."""
        return self.source is not None and self.source.covered is None

    def look(self, threshold: float) -> Callable[[], Found]:
        """What looks, in the background."""
        source, usual = self.source, SuggestOptions()
        assert source is not None
        assert source.map is not None
        doppler = source.map.shifted(source.offset_s)
        options = SuggestOptions(high_db=threshold, low_db=min(usual.low_db, threshold))

        def look() -> Found:
            spans = suggest_spans(doppler, options)
            loudest_db = float(np.nanmax(motion_energy_db(doppler), initial=0.0))
            if loudest_db < threshold:
                return Found(spans, f"Nothing: the loudest frame has {loudest_db:.1f} dB")
            return Found(spans)

        return look


class GestureFinder:
    """What the classifier takes for a gesture."""

    title = "classifier"
    threshold = Threshold(
        0.0, 100.0, 50.0, 5.0, 0, " %", "How sure the classifier must be of a span on average"
    )

    def __init__(self, classify: ClassifyModel) -> None:
        self._classify = classify

    @property
    def why_not(self) -> str:
        """Why it cannot be used; empty where it can."""
        if self._classify.path is None:
            return "Choose a classifier first, under Model"
        if not self.sources:
            return "There is no map to look in"
        return self._classify.problem

    @property
    def sources(self) -> tuple[TrackModel, ...]:
        """Maps to look in."""
        return self._classify.sources

    @property
    def source(self) -> TrackModel | None:
        """The map that the classifier looks at."""
        return self._classify.source

    def set_source(self, source: TrackModel | None) -> None:
        """Let the classifier look at another map; None: at the one it chooses."""
        self._classify.set_source(source)

    @property
    def signals(self) -> tuple[SignalInstance, ...]:
        """After which it may be possible to look."""
        return (self._classify.track.changed, self._classify.changed)

    @property
    def ready(self) -> bool:
        """Whether every frame of the map is classified."""
        return self._classify.track.complete

    def look(self, threshold: float) -> Callable[[], Found]:
        """What looks, in the background."""
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
