"""A logarithmic axis: where values stand, and which of them are written."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class LogAxis:
    """Values from ``low`` to ``high`` on pixels from ``start_px`` to ``end_px``.

    What lies below ``low``, nought included, stands on the edge.
    """

    low: float
    high: float
    start_px: float
    end_px: float

    @classmethod
    def around(
        cls, values: list[float], start_px: float, end_px: float, *, floor: float = 0.0
    ) -> LogAxis:
        """An axis with some room around positive values; nothing below ``floor`` is shown."""
        shown = [max(value, floor) for value in values if max(value, floor) > 0] or [1.0]
        low, high = min(shown) / 1.5, max(shown) * 1.5
        return cls(max(low, floor), max(high, 10 * max(low, floor)), start_px, end_px)

    def px(self, value: float) -> float:
        """Pixel of a value."""
        clamped = min(max(value, self.low), self.high)
        share = math.log(clamped / self.low) / math.log(self.high / self.low)
        return self.start_px + share * (self.end_px - self.start_px)

    def is_below(self, value: float) -> bool:
        """Whether a value has no place but the edge."""
        return value < self.low

    def ticks(self, most: int) -> list[float]:
        """Values to write: decades, and 2 and 5 times them where there is room."""
        first, last = (math.floor(math.log10(end)) for end in (self.low, self.high))
        for steps in ((1, 2, 5), (1, 3), (1,)):
            values = [
                step * 10.0**power
                for power in range(first, last + 1)
                for step in steps
                if self.low * 0.999 <= step * 10.0**power <= self.high * 1.001
            ]
            if len(values) <= most:
                return values
        return values[:: -(-len(values) // most)]


def tick_text(value: float) -> str:
    """Short, without exponents."""
    return f"{value:.10f}".rstrip("0").rstrip(".")
