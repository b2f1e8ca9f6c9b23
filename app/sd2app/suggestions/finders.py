"""What can suggest spans: motion in a map, or the classifier."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from PySide6.QtCore import SignalInstance

from sd2app.session.tracks import TrackModel
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
