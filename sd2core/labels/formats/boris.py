"""Projects of BORIS (.boris), format 7.0: an ethogram and observations of state events.

Source: BORIS user guide, and projects saved by BORIS 7 to 9. A span is a START and a STOP of the
same subject and behaviour, in that order; the subject is the track, the behaviour the label. Its
note is the comment of the START; author, confidence, origin, person and number stand in that of
the STOP. The file is ASCII, because BORIS reads it in the encoding of the system.

Times of events have the observation's time offset in them, and count from the start of the first
player: another player's media begin so many seconds later as its offset says.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import plain_path, stored_path
from sd2core.files.tables import counted
from sd2core.files.texts import read_json
from sd2core.labels.formats.lanes import Lane, edges_s, lanes_of, track_of
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss, details_of
from sd2core.labels.formats.rows import LabelRows, Row, chosen_observation, clean_name
from sd2core.labels.label_set import GESTURES, Label, LabelSet, with_own_keys
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
_LAST_S = 1e15

_DETAILS = "sd2 "
"""Prefix of the comment of a STOP that holds id, author, confidence, origin and person."""

_LABEL_SET = "sd2_label_set"

_EXPECTED = "a BORIS project (.boris) with observations"
_NO_SUBJECT = "No focal subject"


def write(path: Path, labels: Labels, timebase: Timebase, media: Path | None) -> list[Loss]:
    """Write a project with one observation, called like the file; what it cannot hold is returned.

    The video is linked relative to the file; without one it is a live observation.
    """
    now = datetime.now().isoformat(timespec="seconds")
    lanes = lanes_of(labels, edges_s)
    known = {one.name for one in labels.label_set.labels}
    others = dict.fromkeys(span.label for span in labels.spans if span.label not in known)
    behaviours = [*labels.label_set.labels, *(Label(name, _GREY) for name in others)]
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
        _LABEL_SET: {
            "name": labels.label_set.name,
            "labels": [one.name for one in labels.label_set.labels],
        },
    }
    atomic_write_text(path, json.dumps(project, indent=1, allow_nan=False) + "\n")
    return _unwelcome(labels)


def read(path: Path, _: Timebase | None, observation: str | None) -> LabelRows:
    """Read the state events of one observation; point events are marks without a duration.

    The observation's id is needed when the project has several. Raises Sd2Error when the file is no
    project, or the observation is not certain.
    """
    project = _project(path)
    name = chosen_observation(project["observations"], observation)
    content = project["observations"][name]
    events = content.get("events") if isinstance(content, dict) else None
    if not isinstance(events, list):
        raise Sd2Error(f"The observation {name!r} in {path} has no events", _EXPECTED)
    behaviours = _entries(project, "behaviors_conf")
    points = {
        str(one.get("code")) for one in behaviours if "point" in str(one.get("type")).casefold()
    }
    result = LabelRows(label_set=_label_set(project.get(_LABEL_SET), behaviours))
    _add_rows(result, events, points, _start_s(content))
    subjects = [str(one.get("name", "")) for one in _entries(project, "subjects_conf")]
    used = {row.track for row in result.rows}
    ours = _LABEL_SET in project
    for subject in subjects:
        track, overlap = track_of(subject)
        if ours or track in used:
            result.tracks.append((track, overlap))
    return result


def _start_s(observation: dict[str, Any]) -> float:
    """Time of events at which the video begins: its first player's that has pictures."""
    media, players = _mapping(observation.get("media_info")), _mapping(observation.get("file"))
    offsets, pictures = _mapping(media.get("offset")), _mapping(media.get("hasVideo"))
    seen = {name for name, has in pictures.items() if has is True}
    with_pictures = (
        number
        for number, files in players.items()
        if isinstance(files, list) and any(isinstance(one, str) and one in seen for one in files)
    )
    offset = offsets.get(next(with_pictures, "1"))
    return _seconds(observation.get("time offset")) + _seconds(offset)


def _mapping(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _seconds(value: Any) -> float:
    """A number of seconds that may be absent."""
    known = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _LAST_S
    return float(value) if known else 0.0


def _project(path: Path) -> dict[str, Any]:
    project = read_json(path, _EXPECTED, "Copy it again, or save it in BORIS")
    if not isinstance(project, dict) or not isinstance(project.get("observations"), dict):
        raise Sd2Error(f"{path} is JSON without observations", _EXPECTED)
    return project


def _entries(project: dict[str, Any], key: str) -> list[dict[str, Any]]:
    return [one for one in _mapping(project.get(key)).values() if isinstance(one, dict)]


def observations(path: Path) -> tuple[str, ...]:
    """The ids of the observations of a project; there may be several, one per video.

    Raises Sd2Error when the file is no project.
    """
    return tuple(_project(path)["observations"])


def _add_rows(taken: LabelRows, events: list[Any], points: set[str], video_s: float) -> None:
    """Add spans of events: each second one of a subject, behaviour and modifiers is a stop."""
    begun: dict[tuple[str, str, str], tuple[float, str]] = {}
    for number, event in enumerate(events, start=1):
        place = f"event {number}"
        with taken.entry(place):
            time_s, subject, code, modifiers, comment = _event(place, event)
            time_s -= video_s  # when the video begins
            track = track_of(subject or _NO_SUBJECT)[0]
            key = (subject, code, modifiers)
            if code in points:  # behaviours without a duration
                note = _note(modifiers, comment, "")
                taken.rows.append(Row(place, time_s, time_s, code, track, note))
            elif key not in begun:
                begun[key] = (time_s, comment)
            else:
                start_s, first = begun.pop(key)
                details = _details(comment)
                note = _note(modifiers, first, comment if details is None else "")
                taken.rows.append(Row(place, start_s, time_s, code, track, note, **(details or {})))
    for (subject, code, _), (time_s, _) in begun.items():
        with taken.entry():
            raise Sd2Error(
                f"{code!r} of {subject or _NO_SUBJECT!r} begins at {time_s:g} s and does not end",
                "a stop for every start",
                "Mend it in BORIS: Observations, Fix unpaired events",
            )


def _event(place: str, event: Any) -> tuple[float, str, str, str, str]:
    if not isinstance(event, list) or len(event) < 3 or isinstance(event[0], bool):
        raise Sd2Error(f"{place} is {str(event)[:100]!r}", "time, subject and behaviour")
    time_s = event[0] if isinstance(event[0], int | float) else math.nan
    if not abs(time_s) < _LAST_S:
        raise Sd2Error(f"the time is {str(event[0])[:50]!r}", "seconds")
    subject, code, modifiers, comment = (
        "" if one is None else str(one) for one in (*event[1:5], *[""] * (5 - len(event)))
    )
    return float(time_s), subject, code, modifiers, comment


def _details(comment: str) -> dict[str, Any] | None:
    """Fields of a row that the comment of a STOP holds; None where somebody wrote it."""
    if not comment.startswith(_DETAILS):
        return None
    try:
        kept = json.loads(comment[len(_DETAILS) :])
    except (ValueError, RecursionError):
        return None
    if not isinstance(kept, dict):
        return None
    known, number = kept.get("confidence"), kept.get("id")
    return {
        "author": str(kept.get("author", "")),
        "confidence": float(known) if isinstance(known, int | float) else None,
        "origin": str(kept.get("origin", "import")),
        "person": str(kept.get("person", "")),
        "id": number if isinstance(number, int) and not isinstance(number, bool) else None,
    }


def _note(modifiers: str, first: str, second: str) -> str:
    return "\n".join(text for text in (modifiers, first, second) if text)


def _label_set(kept: Any, behaviours: list[dict[str, Any]]) -> LabelSet:
    """The ethogram; of a project that this program wrote, without what was only used."""
    ours = isinstance(kept, dict) and isinstance(kept.get("labels"), list)
    if not behaviours and not ours:
        return GESTURES
    labels: dict[str, Label] = {}
    for one in behaviours:
        code = str(one.get("code", ""))
        name = clean_name(code)
        if name in labels or (ours and code not in kept["labels"]):
            continue
        key = str(one.get("key") or "")
        key = key if len(key) == 1 and not key.isspace() else ""
        category = str(one.get("category") or "")
        try:
            labels[name] = Label(name, str(one.get("color") or ""), key, category)
        except Sd2Error:  # BORIS' colours may be names, or absent
            labels[name] = Label(name, _GREY, key, category)
    set_name = str(kept.get("name", "")) if ours else "BORIS"
    return LabelSet(set_name, tuple(with_own_keys(labels.values())))


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
    keyed: list[tuple[tuple[float, int, int], list[Any]]] = []
    for lane in lanes:
        for span in lane.spans:
            for side, time_s, comment in (
                (1, float(span.start_s), span.note),
                (0, float(span.end_s), _stop_comment(span)),
            ):
                event = [time_s, lane.name, span.label, "", comment]
                if frames:
                    event.append(timebase.frame_at(time_s) + timebase.first_number)
                keyed.append(((time_s, side, span.id), event))
    return [event for _, event in sorted(keyed, key=lambda one: one[0])]


def _stop_comment(span: Span) -> str:
    details = {name: value for name, value in details_of(span).items() if name != "note"}
    return _DETAILS + json.dumps({"id": span.id, **details})


def _unwelcome(labels: Labels) -> list[Loss]:
    """Losses that occur only when BORIS opens or edits the file."""
    losses: list[Loss] = []
    names = {*(span.label for span in labels.spans), *(track.name for track in labels.tracks)}
    barred = sorted(name for name in names if "|" in name or name != name.strip())
    if barred:
        words = f"BORIS wants names without bars and without spaces at their ends: {barred[0]!r}"
        words += f" and {len(barred) - 1} more" if len(barred) > 1 else ""
        losses.append(Loss("characters", len(barred), f"{words} may be refused when edited there"))
    edges_ms = [edge_s * 1000 for span in labels.spans for edge_s in edges_s(span)]
    count = sum(not math.isclose(edge, round(edge), abs_tol=1e-6) for edge in edges_ms)
    if count:
        words = (
            f"BORIS counts whole milliseconds: {counted(count, 'edge')} will move by up to 0.5 ms"
        )
        losses.append(Loss("times", count, f"{words} when it opens the file"))
    return losses
