"""Journals as earlier versions wrote them: all labels, then a record of each edit's changes."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sd2core.files.atomic import to_json
from sd2core.labels.entries import label_set_entry, span_entry, track_entries
from sd2core.labels.journal import Kept, packed
from sd2core.labels.spans import Labels


def record(content: dict[str, Any]) -> bytes:
    """A record of a journal."""
    payload = to_json(content, separators=(",", ":")).encode()
    return b"%08x %08x %b\n" % (len(payload), zlib.crc32(payload), payload)


def change(before: Labels, after: Labels) -> dict[str, Any]:
    """What of the labels an edit has changed, for its record."""
    old = {span.id: span for span in before.spans}
    put = [span_entry(span) for span in after.spans if old.pop(span.id, None) != span]
    content: dict[str, Any] = {"gone": list(old), "put": put}
    if before.tracks != after.tracks:
        content["tracks"] = track_entries(after.tracks)
    if before.label_set != after.label_set:
        content["label_set"] = label_set_entry(after.label_set)
    return content


def part(recording: Path, states: Sequence[Labels], saved_after: int = 0) -> list[bytes]:
    """Records of a part: the first labels, then an edit to each of the next ones.

    After the edit of a number, counted from 1, the user's file was written.
    """
    records = [packed(Kept(recording, states[0]))]
    for count in range(1, len(states)):
        about = {"name": f"Edit {count}", "time_unix_s": float(count)}
        records.append(record(about | change(states[count - 1], states[count])))
        if count == saved_after:
            records.append(record(about | {"saved": True}))
    return records
