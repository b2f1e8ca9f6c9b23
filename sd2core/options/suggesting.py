"""Options of suggesting spans: in which something moves, or a gesture is predicted."""

from __future__ import annotations

from sd2core.options.kinds import NotNegative, Share
from sd2core.options.records import OptionError, OptionRecord


class PredictedSpans(OptionRecord):
    """Conditions for frames of a predicted class to be a span.

    Parameters
    ----------
    min_duration_s : S
        shorter spans are left out
    merge_gap_s : S
        merge spans of a class with a shorter gap between them
    min_confidence : SHARE
        spans whose class is less probable on average are left out, as 50% or 0.5 (default: none)
    """

    min_duration_s: NotNegative = 0.2
    merge_gap_s: NotNegative = 0.1
    min_confidence: Share | None = None


class SuggestOptions(OptionRecord):
    """Thresholds and margins for suggesting spans.

    A gesture begins and ends more slowly than energy shows, and a hand is held still before it is
    let go; so there are margins, but of no more than a third of the quiet up to a neighbour.

    Parameters
    ----------
    high_db : DB
        energy over the quiet level that the peak of a span reaches
    low_db : DB
        energy that a span never falls below
    min_duration_s : S
        least duration, without margins
    merge_gap_s : S
        quiet stretches up to this do not end a span
    margin_s : S
        added on both sides
    hold_s : S
        added to the margin at the end
    """

    high_db: NotNegative = 7.0
    low_db: NotNegative = 5.0
    min_duration_s: NotNegative = 0.2
    merge_gap_s: NotNegative = 0.1
    margin_s: NotNegative = 0.2
    hold_s: NotNegative = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.low_db <= self.high_db:
            raise OptionError(
                f"low_db is {self.low_db:g} and high_db {self.high_db:g}",
                "a low threshold above 0 dB and not above the high one",
            )
