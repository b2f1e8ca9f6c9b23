"""What one state of labels has that another has not."""

from __future__ import annotations

from dataclasses import dataclass

from sd2core.labels.spans import Labels


@dataclass(frozen=True)
class Comparison:
    """How many spans differ, by their ids.

    Parameters
    ----------
    added, changed, removed : int
    tracks, label_set : bool
        Whether these differ.
    """

    added: int
    changed: int
    removed: int
    tracks: bool
    label_set: bool

    def __str__(self) -> str:
        """Such as ``2 spans added, 1 removed, other tracks``; empty where nothing differs."""
        counts = {"added": self.added, "changed": self.changed, "removed": self.removed}
        said = [f"{count:,} {what}" for what, count in counts.items() if count]
        if said:
            first, what = said[0].split()
            said[0] = f"{first} {'span' if first == '1' else 'spans'} {what}"
        others = {"other tracks": self.tracks, "another label set": self.label_set}
        return ", ".join([*said, *(words for words, so in others.items() if so)])


def compare(before: Labels, after: Labels) -> Comparison:
    """What has to be done to ``before`` for it to become ``after``."""
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
    """From the first to the last second of spans in which two states differ; None: in none."""
    old = {span.id: span for span in before.spans}
    new = {span.id: span for span in after.spans}
    differ = [span for one, span in new.items() if old.get(one) != span]
    differ += [span for one, span in old.items() if new.get(one) != span]
    if not differ:
        return None
    return min(span.start_s for span in differ), max(span.end_s for span in differ)
