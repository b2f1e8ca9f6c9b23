"""``sd2 info`` of a radar's recording: raw samples, or a map with labels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.info import Description, describe_capture, describe_map

if TYPE_CHECKING:
    from sd2core.io.radar import RecordedMap


def describe_radar(path: Path) -> Description:
    """Open a capture or a recorded map and describe it."""
    from sd2core.io.radar import holds_map, load_capture, load_recorded_map

    if holds_map(path):
        return describe_recorded_map(path, load_recorded_map(path))
    return describe_capture(path, load_capture(path))


def describe_recorded_map(path: Path, recorded: RecordedMap) -> Description:
    """Describe the map, and what is labelled in it."""
    inside = describe_map(path, recorded.doppler)
    spans = recorded.labels.spans
    data = inside.data | {
        "kind": "radar",
        "simulated": False,
        "gesture": recorded.gesture,
        "labels": [
            {"start_s": span.start_s, "end_s": span.end_s, "label": span.label} for span in spans
        ],
        "notes": list(recorded.notes),
    }
    labelled = ", ".join(f"{span.start_s:.3f} to {span.end_s:.3f} s" for span in spans)
    facts = inside.facts | {"gesture": recorded.gesture, "labelled": labelled or "nowhere"}
    return Description(f"Radar map {path}", data, facts, recorded.notes)
