"""Projects of BORIS into labels, those of this program and others."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.labels.formats.lanes import track_of
from sd2core.labels.formats.rows import Row, assemble, clean_name
from sd2core.labels.formats.texts import read_text
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import Labels, Overlap
from sd2core.timebase import Timebase

DETAILS = "sd2 "
"""With this begins the comment of a STOP that holds number, author, confidence and origin."""

LABEL_SET = "sd2_label_set"

_EXPECTED = "a BORIS project (.boris) with observations"
_NO_SUBJECT = "No focal subject"


def read(path: Path, timebase: Timebase | None = None, observation: str | None = None) -> Labels:
    """Read the state events of one observation; point events become one frame each.

    Parameters
    ----------
    observation : str, optional
        Its id; needed when the project has several.

    Raises
    ------
    Sd2Error
        When the file is no project, the observation is not certain, or a state that has begun
        does not end.
    """
    project = _project(path)
    name = _chosen(path, project["observations"], observation)
    content = project["observations"][name]
    events = content.get("events") if isinstance(content, dict) else None
    if not isinstance(events, list):
        raise Sd2Error(f"The observation {name!r} in {path} has no events", _EXPECTED)
    behaviours = [one for one in _entries(project, "behaviors_conf") if isinstance(one, dict)]
    points = {
        str(one.get("code")) for one in behaviours if "point" in str(one.get("type")).casefold()
    }
    rows = _rows(path, events, points)
    subjects = [str(one.get("name", "")) for one in _entries(project, "subjects_conf")]
    used = {row.track for row in rows}
    ours = LABEL_SET in project
    tracks: list[tuple[str, Overlap | None]] = []
    for subject in subjects:
        track, overlap = track_of(subject)
        if ours or track in used:
            tracks.append((track, overlap))
    label_set = _label_set(project.get(LABEL_SET), behaviours)
    return assemble(path, rows, tracks=tracks, label_set=label_set, timebase=timebase)


def _project(path: Path) -> dict[str, Any]:
    text = read_text(path, _EXPECTED)
    try:
        project = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Sd2Error(
            f"{path} is not whole JSON: {error}", _EXPECTED, "Copy it again, or save it in BORIS"
        ) from None
    if not isinstance(project, dict) or not isinstance(project.get("observations"), dict):
        raise Sd2Error(f"{path} is JSON without observations", _EXPECTED)
    return project


def _entries(project: dict[str, Any], key: str) -> list[Any]:
    found = project.get(key)
    entries = list(found.values()) if isinstance(found, dict) else []
    return [one for one in entries if isinstance(one, dict)]


def observations(path: Path) -> tuple[str, ...]:
    """The ids of the observations of a project; there may be several, one per video.

    Raises
    ------
    Sd2Error
        When the file is no project.
    """
    return tuple(_project(path)["observations"])


def _chosen(path: Path, observations: dict[str, Any], wanted: str | None) -> str:
    if wanted is not None and wanted in observations:
        return wanted
    if wanted is None and len(observations) == 1:
        return next(iter(observations))
    names = ", ".join(map(repr, list(observations)[:20])) or "none"
    raise Sd2Error(
        f"{path} has {len(observations)} observations: {names}",
        "one observation" if wanted is None else f"the observation {wanted!r}",
        "Name the one to read",
    )


def _rows(path: Path, events: list[Any], points: set[str]) -> list[Row]:
    """Spans of events: each second one of a subject, behaviour and modifiers is a stop."""
    rows: list[Row] = []
    begun: dict[tuple[str, str, str], tuple[float, str]] = {}
    for number, event in enumerate(events, start=1):
        place = f"event {number}"
        time_s, subject, code, modifiers, comment = _event(path, place, event)
        track = track_of(subject or _NO_SUBJECT)[0]
        key = (subject, code, modifiers)
        if code in points:
            rows.append(Row(place, time_s, time_s, code, track, _note(modifiers, comment, "")))
        elif key not in begun:
            begun[key] = (time_s, comment)
        else:
            start_s, first = begun.pop(key)
            rows.append(_span(place, start_s, time_s, code, track, modifiers, first, comment))
    if begun:
        (subject, code, _), (time_s, _) = next(iter(begun.items()))
        raise Sd2Error(
            f"{path}: {code!r} of {subject or _NO_SUBJECT!r} begins at {time_s:g} s and does not "
            "end",
            "a stop for every start",
            "Mend it in BORIS: Observations, Fix unpaired events",
        )
    return rows


def _event(path: Path, place: str, event: Any) -> tuple[float, str, str, str, str]:
    if not isinstance(event, list) or len(event) < 3 or isinstance(event[0], bool):
        raise Sd2Error(f"{path}, {place} is {str(event)[:100]!r}", "time, subject and behaviour")
    time_s = event[0] if isinstance(event[0], int | float) else math.nan
    if not abs(time_s) < 1e15:
        raise Sd2Error(f"{path}, {place}: the time is {str(event[0])[:50]!r}", "seconds")
    subject, code, modifiers, comment = (
        "" if one is None else str(one) for one in (*event[1:5], *[""] * (5 - len(event)))
    )
    return float(time_s), subject, code, modifiers, comment


def _span(
    place: str,
    start_s: float,
    end_s: float,
    code: str,
    track: str,
    modifiers: str,
    first: str,
    second: str,
) -> Row:
    kept = _details(second)
    if kept is None:
        return Row(place, start_s, end_s, code, track, _note(modifiers, first, second))
    known = kept.get("confidence")
    number = kept.get("id")
    return Row(
        place,
        start_s,
        end_s,
        code,
        track,
        _note(modifiers, first, ""),
        str(kept.get("author", "")),
        float(known) if isinstance(known, int | float) else None,
        str(kept.get("origin", "import")),
        number if isinstance(number, int) and not isinstance(number, bool) else None,
    )


def _details(comment: str) -> dict[str, Any] | None:
    if not comment.startswith(DETAILS):
        return None
    try:
        kept = json.loads(comment[len(DETAILS) :])
    except (ValueError, RecursionError):
        return None
    return kept if isinstance(kept, dict) else None


def _note(modifiers: str, first: str, second: str) -> str:
    return "\n".join(text for text in (modifiers, first, second) if text)


def _label_set(kept: Any, behaviours: list[dict[str, Any]]) -> LabelSet:
    """The ethogram; of a project that this program wrote, without what was only used."""
    ours = isinstance(kept, dict) and isinstance(kept.get("labels"), list)
    if not behaviours and not ours:
        return GESTURES
    labels: dict[str, Label] = {}
    keys: set[str] = set()
    for one in behaviours:
        code = str(one.get("code", ""))
        name = clean_name(code)
        if name in labels or (ours and code not in kept["labels"]):
            continue
        key = str(one.get("key") or "")
        key = key if len(key) == 1 and not key.isspace() and key.casefold() not in keys else ""
        keys.add(key.casefold())
        category = str(one.get("category") or "")
        try:
            labels[name] = Label(name, str(one.get("color") or ""), key, category)
        except Sd2Error:  # BORIS' colours may be names, or absent
            labels[name] = Label(name, "#999999", key, category)
    return LabelSet(str(kept.get("name", "")) if ours else "BORIS", tuple(labels.values()))
