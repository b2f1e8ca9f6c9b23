"""Projects of BORIS (.boris), format 7.0: an ethogram and one observation of state events.

Source: BORIS user guide, and projects saved by BORIS 7 to 9. A span is a START and a STOP of the
same subject and behaviour, in that order; the subject is the track, the behaviour the label. Its
note is the comment of the START; author, confidence, origin and number stand in the comment of
the STOP. The file is ASCII, because BORIS reads it in the encoding of the system.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import plain_path, stored_path
from sd2core.labels.formats.boris_reading import DETAILS, LABEL_SET
from sd2core.labels.formats.lanes import Lane, lanes_of
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss, losses_by_format
from sd2core.labels.label_set import Label
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="boris",
    title="BORIS",
    suffixes=(".boris",),
    made_for="BORIS 7 to 9, project format 7.0",
    keeps=frozenset(ASPECTS),
    remark="Exact in the file; BORIS rounds times to milliseconds when it opens it.",
)

_GREY = "#999999"
_PLAYERS = 8


def write(path: Path, labels: Labels, timebase: Timebase, media: Path | None = None) -> list[Loss]:
    """Write a project with one observation, called like the file; what it cannot hold is returned.

    Parameters
    ----------
    media : Path, optional
        The video; without one it is a live observation.
    """
    now = datetime.now().isoformat(timespec="seconds")
    lanes = lanes_of(labels, _edges)
    behaviours = _behaviours(labels)
    categories = sorted({one.gesture_class for one in behaviours if one.gesture_class})
    project = {
        "time_format": "s",
        "project_date": now,
        "project_name": path.stem,
        "project_description": "",
        "project_format_version": "7.0",
        "subjects_conf": {
            str(number): {"key": "", "name": lane.name, "description": ""}
            for number, lane in enumerate(lanes)
        },
        "behaviors_conf": {
            str(number): {
                "type": "State event",
                "key": one.key,
                "code": one.name,
                "description": "",
                "color": one.colour,
                "category": one.gesture_class,
                "modifiers": {},
                "excluded": "",
                "coding map": "",
            }
            for number, one in enumerate(behaviours)
        },
        "behavioral_categories": categories,
        "behavioral_categories_config": {
            str(number): {"name": name, "color": ""} for number, name in enumerate(categories)
        },
        "independent_variables": {},
        "coding_map": {},
        "behaviors_coding_map": [],
        "converters": {},
        "observations": {path.stem: _observation(path, lanes, timebase, media, now)},
        LABEL_SET: {
            "name": labels.label_set.name,
            "labels": [one.name for one in labels.label_set.labels],
        },
    }
    atomic_write_text(path, json.dumps(project, indent=1, allow_nan=False) + "\n")
    return losses_by_format(labels, FORMAT) + _unwelcome(labels)


def _edges(span: Span) -> tuple[float, float]:
    return span.start_s, span.end_s


def _behaviours(labels: Labels) -> list[Label]:
    """The label set, and after it what else is used."""
    known = {one.name for one in labels.label_set.labels}
    others = dict.fromkeys(span.label for span in labels.spans if span.label not in known)
    return [*labels.label_set.labels, *(Label(name, _GREY) for name in others)]


def _observation(
    path: Path, lanes: Sequence[Lane], timebase: Timebase, media: Path | None, now: str
) -> dict[str, Any]:
    observation: dict[str, Any] = {
        "file": {},
        "type": "LIVE",
        "date": now,
        "description": "",
        "time offset": 0.0,
        "observation time interval": [0, 0],
        "independent_variables": {},
        "visualize_spectrogram": False,
        "visualize_waveform": False,
        "close_behaviors_between_videos": False,
        "scan_sampling_time": 0,
        "start_from_current_time": False,
        "start_from_current_epoch_time": False,
        "events": _events(lanes, timebase, frames=media is not None),
    }
    if media is not None:
        name = stored_path(plain_path(media), plain_path(path).parent)
        observation |= {
            "type": "MEDIA",
            "file": {str(n + 1): [name] if n == 0 else [] for n in range(_PLAYERS)},
            "media_creation_date_as_offset": False,
            "media_scan_sampling_duration": 0,
            "image_display_duration": 1,
            "media_info": {
                "length": {name: timebase.duration_s},
                "fps": {name: timebase.frames_per_s},
                "hasVideo": {name: True},
                "hasAudio": {name: False},
                "offset": {"1": 0.0},
            },
        }
    return observation


def _events(lanes: Sequence[Lane], timebase: Timebase, *, frames: bool) -> list[list[Any]]:
    """Starts and stops in the order of time; a stop before the start that it touches."""
    found: list[tuple[tuple[float, int, int], list[Any]]] = []
    for lane in lanes:
        for span in lane.spans:
            for side, time_s, comment in (
                (1, float(span.start_s), span.note),
                (0, float(span.end_s), _details(span)),
            ):
                event = [time_s, lane.name, span.label, "", comment]
                if frames:
                    event.append(timebase.frame_at(time_s))
                found.append(((time_s, side, span.id), event))
    return [event for _, event in sorted(found, key=lambda one: one[0])]


def _details(span: Span) -> str:
    kept: dict[str, Any] = {"id": span.id}
    if span.author:
        kept["author"] = span.author
    if span.confidence is not None:
        kept["confidence"] = float(span.confidence)
    if span.origin != "import":
        kept["origin"] = span.origin
    return DETAILS + json.dumps(kept)


def _unwelcome(labels: Labels) -> list[Loss]:
    """What the file holds, but BORIS asks about or changes."""
    losses: list[Loss] = []
    names = {*(span.label for span in labels.spans), *(track.name for track in labels.tracks)}
    barred = sorted(name for name in names if "|" in name or name != name.strip())
    if barred:
        words = f"BORIS wants names without bars and without spaces at their ends: {barred[0]!r}"
        words += f" and {len(barred) - 1} more" if len(barred) > 1 else ""
        losses.append(Loss("characters", len(barred), f"{words} may be refused when edited there"))
    edges_ms = [edge_s * 1000 for span in labels.spans for edge_s in _edges(span)]
    count = sum(not math.isclose(edge, round(edge), abs_tol=1e-6) for edge in edges_ms)
    if count:
        words = f"BORIS counts whole milliseconds: {count} edge{'s' * (count > 1)} will move by up "
        losses.append(Loss("times", count, words + "to 0.5 ms when it opens the file"))
    return losses
