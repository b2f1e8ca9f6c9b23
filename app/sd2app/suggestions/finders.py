"""Finders of suggested spans: the protocol, and motion in a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PySide6.QtCore import SignalInstance

from sd2app.session.maps import MapModel
from sd2core.cli.labels.suggest import Suggest
from sd2core.labels.spans import Span
from sd2core.labels.suggest import motion_energy_db, suggest_spans
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

    def look(self, threshold: float) -> Callable[[], SearchResult]:
        """Make the search, to be run in the background."""
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

    def look(self, threshold: float) -> Callable[[], SearchResult]:
        """Make the search, to be run in the background."""
        source = self.source
        assert source is not None
        assert source.map is not None
        doppler = source.map.shifted(source.offset_s)
        options = SuggestOptions(**_levels(threshold))

        def look() -> SearchResult:
            spans = suggest_spans(doppler, options)
            loudest_db = float(np.nanmax(motion_energy_db(doppler), initial=0.0))
            if loudest_db < threshold:
                return SearchResult(spans, f"Nothing: the loudest frame has {loudest_db:.1f} dB")
            return SearchResult(spans)

        return look

    def words(self, recording: Path, threshold: float) -> list[str]:
        """Words of ``sd2 labels suggest``."""
        name = None if self.source is None else self.source.name
        out = Path("suggested.json")
        command = Suggest(map=recording, of=name, out=out, **_levels(threshold))
        return words_of("labels suggest", command)


def _levels(threshold_db: float) -> dict[str, Any]:
    low_db = min(SuggestOptions().low_db, threshold_db)
    return {"high_db": threshold_db, "low_db": low_db}
