"""Times of the slots of an ELAN document, also of those that have none."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

from sd2core.labels.formats.numbers import finite_number


class ElanTimes:
    """Times of slots: those that are stated, and those between them.

    Where an annotation is divided, ELAN writes slots without a time, and draws them evenly spaced:
    along the annotations of their tier that follow each other, otherwise in the order of the
    document's slots. One whose time is no number has none.
    """

    def __init__(self, document: Element) -> None:
        self._order: list[str] = []
        self._stated_ms: dict[str, float] = {}
        self._open: set[str] = set()
        self.placed: set[str] = set()
        for slot in document.iter("TIME_SLOT"):
            name, text = slot.get("TIME_SLOT_ID", ""), slot.get("TIME_VALUE")
            self._order.append(name)
            value = finite_number(text or "")  # whole in ELAN, not so in files of others
            if value is not None and value >= 0:
                self._stated_ms[name] = value
            elif text is None:
                self._open.add(name)
        self._in_order_ms = self._between(self._order)

    def of_tier(self, tier: Element) -> dict[str, float]:
        """Times in milliseconds of the slots that a tier refers to, as far as they are known."""
        following: dict[str, str] = {}
        used: set[str] = set()
        for annotation in tier.iter("ALIGNABLE_ANNOTATION"):
            first, second = (annotation.get(f"TIME_SLOT_REF{side}", "") for side in (1, 2))
            following[first] = second
            used |= {first, second}
        along_ms: dict[str, float] = {}
        for first in following:
            chain = {first: None}  # In order; one that comes back to itself ends.
            after = following[first] if first in self._stated_ms else ""
            while after in self._open and after not in chain:
                chain[after] = None
                after = following.get(after, "")
            along_ms |= self._between([*chain, after])
        known_ms = (self._stated_ms, along_ms, self._in_order_ms)
        times_ms = {
            name: next(times[name] for times in known_ms if name in times)
            for name in used
            if any(name in times for times in known_ms)
        }
        self.placed |= self._open.intersection(times_ms)
        return times_ms

    def _between(self, names: Sequence[str]) -> dict[str, float]:
        """Times of slots without one that stand between two with one."""
        found: dict[str, float] = {}
        run: list[str] = []
        before_ms: float | None = None
        for name in names:
            if name in self._open:
                run.append(name)
                continue
            after_ms = self._stated_ms.get(name)
            if before_ms is not None and after_ms is not None:
                step_ms = (after_ms - before_ms) / (len(run) + 1)
                found |= {one: before_ms + step_ms * k for k, one in enumerate(run, start=1)}
            before_ms, run = after_ms, []
        return found
