"""Forecast of a data set in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sd2app.widgets.text import counted

if TYPE_CHECKING:
    from sd2core.datasets.forecast import Forecast

_MAX_NAMED = 4


def size_words(forecast: Forecast, length: int) -> str:
    """Size in words: ``24 segments of 2.4 s from 3 views · 0.7 MB before compression``."""
    seconds = length / forecast.frame_rate_hz
    segments, views = counted(forecast.segments, "segment"), counted(forecast.sources, "view")
    size = bytes_words(forecast.total_bytes)
    return f"{segments} of {seconds:.1f} s from {views} · {size} before compression"


def label_words(forecast: Forecast) -> str:
    """Number of segments of each label."""
    named = " · ".join(f"{name} {count:,}" for name, count in forecast.of_label.items())
    return f"Labels: {named}" if named else ""


def split_words(forecast: Forecast) -> str:
    """Number of segments and people of each split."""
    if not (forecast.split.validation or forecast.split.test):
        who = _named(forecast.split.training)
        return f"Split: all {forecast.segments:,} to train ({who}); none to validate or test on"
    people = {
        "train": forecast.split.training,
        "validation": forecast.split.validation,
        "test": forecast.split.test,
    }
    return "Split: " + " · ".join(
        f"{name} {count:,} ({_named(people[name])})" for name, count in forecast.of_split().items()
    )


def inertial_words(places: Sequence[str]) -> str:
    """Places of inertial sensors that can be exported: ``at head, left wrist``."""
    names = [place.replace("-", " ") for place in places]
    more = len(names) - _MAX_NAMED
    listed = ", ".join(names[:_MAX_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"at {listed}" if names else "none placed"


def bytes_words(count: int) -> str:
    """Size of a file, such as ``1.2 MB``."""
    return f"{count / 1e9:,.1f} GB" if count >= 1e9 else f"{count / 1e6:,.1f} MB"


def _named(people: tuple[str, ...]) -> str:
    if not people:
        return "no person"
    return ", ".join(people) if len(people) <= 3 else f"{len(people)} people"
