"""Differences between two states of labels."""

from __future__ import annotations

from dataclasses import dataclass

from sd2core.labels.spans import Labels


@dataclass(frozen=True)
class Comparison:
    """Numbers of spans that differ, by their ids; and if tracks or label set differ."""

    added: int
    changed: int
    removed: int
    tracks: bool
    label_set: bool

    def __str__(self) -> str:
        """Such as ``2 spans added, 1 removed, other tracks``; empty where nothing differs."""
        counts = {"added": self.added, "changed": self.changed, "removed": self.removed}
        parts = [f"{count:,} {what}" for what, count in counts.items() if count]
        if parts:
            first, what = parts[0].split()
            parts[0] = f"{first} {'span' if first == '1' else 'spans'} {what}"
        others = {"other tracks": self.tracks, "another label set": self.label_set}
        return ", ".join([*parts, *(words for words, so in others.items() if so)])


def compare(before: Labels, after: Labels) -> Comparison:
    """Count the changes that turn ``before`` into ``after``."""
    old = {span.id: span for span in before.spans}
    new = {span.id: span for span in after.spans}
    both = old.keys() & new.keys()
    return Comparison(
        added=len(new) - len(both),
        changed=sum(old[one] != new[one] for one in both),
        removed=len(old) - len(both),
        tracks=before.tracks != after.tracks,
        label_set=before.label_set != after.label_set,
    )


def changed_stretch(before: Labels, after: Labels) -> tuple[float, float] | None:
    """Return the earliest start and latest end of spans that differ; None where none does."""
    differ = set(before.spans) ^ set(after.spans)
    if not differ:
        return None
    return min(span.start_s for span in differ), max(span.end_s for span in differ)
