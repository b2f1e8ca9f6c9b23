"""Least and greatest values, stated once: of settings, and of numbers that files declare."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from sd2core.numerics.limits import FARTHEST_M, MAX_BINS


class Bounds(NamedTuple):
    """Bounds of a number, both included.

    Parameters
    ----------
    low, high : float
        Least and greatest value.
    whole : bool
        True if only whole numbers are allowed.
    above : bool
        True if the least value itself is not allowed.
    """

    low: float = -math.inf
    high: float = math.inf
    whole: bool = False
    above: bool = False

    def __contains__(self, value: Any) -> bool:
        fits = self.low < value if self.above else self.low <= value
        return fits and value <= self.high and (not self.whole or int(value) == value)

    def nearest(self, value: float) -> float:
        """Nearest number within the bounds."""
        return min(max(value, self.low), self.high)

    @property
    def words(self) -> str:
        """Bounds in words, as ``a whole number from 1 to 100``."""
        low, high = (f"{end:{',' if self.whole else 'g'}}" for end in (self.low, self.high))
        open_end = math.isinf(self.high)
        if math.isinf(self.low):
            span = "" if open_end else f" up to {high}"
        elif self.above:
            span = f" above {low}" + ("" if open_end else f" and up to {high}")
        else:
            span = f" from {low} on" if open_end else f" from {low} to {high}"
        return f"a {'whole ' if self.whole else ''}number{span}"

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """Check a field of a plan; pydantic asks for it."""
        from pydantic_core import PydanticCustomError, core_schema

        def check(value: float) -> float:
            if not math.isfinite(value) or value not in self:
                raise PydanticCustomError("bounds", "{words}", {"words": self.words})
            return value

        return core_schema.no_info_after_validator_function(check, handler(kind))


ANY = Bounds()
POSITIVE = Bounds(0.0, above=True)
NOT_NEGATIVE = Bounds(0.0)
NATURAL = Bounds(0, whole=True)
COUNT = Bounds(0, whole=True, above=True)
SHARE = Bounds(0.0, 1.0, above=True)
UP_TO_ONE = Bounds(0.0, 1.0)

STATURE_M = Bounds(0.5, 2.6)
"""Standing height of a person, from a small child on."""

FIELD_OF_VIEW_DEG = Bounds(1.0, 170.0)
"""Of a camera, across the longer side of the picture."""

RANGE_M = Bounds(0.05, 1000.0)
AZIMUTH_DEG = Bounds(-360.0, 360.0)
ELEVATION_DEG = Bounds(-90.0, 90.0)
"""Of a sensor, about the body."""

RADAR_SEARCH_S = Bounds(2.0)
"""How far to either side the offset of a radar's clock is searched."""

STRIP_FRAMES = Bounds(1, 100, whole=True)

RANGE_EXPONENT = Bounds(0.0, 8.0)
REFERENCE_RANGE_M = Bounds(0.0, 1000.0, above=True)
"""Within these, the range law stays within single precision at any range."""

BINS = Bounds(2, MAX_BINS, whole=True)
FRAME_RATE_HZ = Bounds(0.0, 1e6, above=True)
SEGMENT_FRAMES = Bounds(1, 1_000_000, whole=True)
NUMBER_OF_ROWS = Bounds(0, 1 << 40, whole=True)
"""Of arrays, and of frames."""
PLACEMENT = Bounds(0, 2**31 - 1, whole=True)
TIME_S = Bounds(-1e15, 1e15)
"""Whole seconds are still told apart."""
COORDINATE_M = Bounds(-FARTHEST_M, FARTHEST_M)

EPOCHS = Bounds(1, 1_000_000, whole=True)
BATCH_SIZE = Bounds(1, 100_000, whole=True)
PATIENCE_EPOCHS = Bounds(0, 1_000_000, whole=True)
LEARNING_RATE = Bounds(1e-8, 1.0)
RANGE_FACTOR = Bounds(1.0, 4.0)
SEED = Bounds(0, 2**31 - 1, whole=True)
STEPS = Bounds(1, 1_000_000, whole=True)
"""Of the training of a classifier."""
