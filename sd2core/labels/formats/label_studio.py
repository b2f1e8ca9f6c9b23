"""Exports of Label Studio (JSON and JSON-MIN), read only: spans of videos, sounds and time series.

Source: Label Studio's documentation of TimelineLabels, TimeSeriesLabels and Labels, and exports of
Label Studio 1. Timelines of videos count frames from 1, the last one within; sounds and time series
have seconds. The control tag (``from_name``) is the track, who annotated it the author; a task is
an observation, called like its file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote, urlsplit

from sd2core.errors import Sd2Error
from sd2core.files.texts import read_json
from sd2core.labels.formats.losses import DEFAULT_TRACK, LabelFormat
from sd2core.labels.formats.rows import UNNAMED, LabelRows, Row, chosen_observation
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="label-studio",
    title="Label Studio",
    suffixes=(".json",),
    made_for="Label Studio 1, JSON and JSON-MIN",
    keeps=frozenset({"tracks", "overlap", "authors"}),
)

_EXPECTED = "an export of Label Studio (JSON) with annotated tasks"
_KINDS = ("timelinelabels", "timeserieslabels", "labels")
_TASKS = re.compile(r"\[\s*(\{|\])")


def begins_so(text: str) -> bool:
    """True if a JSON text may be an export by its beginning: a list of tasks, or a task."""
    task = '"annotations"' in text or '"completions"' in text
    return bool(_TASKS.match(text)) or (task and '"sd2-' not in text)


def observations(path: Path) -> tuple[str, ...]:
    """Names of the tasks of an export, each of one video or signal.

    Raises Sd2Error when the file is no export.
    """
    return tuple(_tasks(path))


def read(path: Path, _: Timebase | None, observation: str | None) -> LabelRows:
    """Read the spans of one task; its name is needed when there are several.

    Regions of other kinds, such as boxes, are left out. Raises Sd2Error when the file is no export,
    or the task is not certain.
    """
    tasks = _tasks(path)
    task = tasks[chosen_observation(tasks, observation, "annotated task")]
    result = LabelRows()
    for place, region, author in _regions(result, task):
        with result.entry(place):
            result.rows.extend(_rows(place, region, author))
    return result


def _tasks(path: Path) -> dict[str, dict[str, Any]]:
    content = read_json(path, _EXPECTED, "Export it again")
    listed = content if isinstance(content, list) else [content]
    if not all(isinstance(one, dict) for one in listed) or not any(map(_is_annotated, listed)):
        raise Sd2Error(f"{path} is JSON without annotated tasks", _EXPECTED)
    tasks: dict[str, dict[str, Any]] = {}
    for number, task in enumerate(listed, start=1):
        name = _name(task)
        tasks[name if name and name not in tasks else f"task {task.get('id', number)}"[:100]] = task
    return tasks


def _is_annotated(task: dict[str, Any]) -> bool:
    """True for a task with annotations, perhaps none, or of JSON-MIN with regions."""
    if isinstance(task.get("annotations", task.get("completions")), list):
        return True
    lists = (one for one in task.values() if isinstance(one, list))
    return any(isinstance(one, dict) and {*_KINDS} & one.keys() for items in lists for one in items)


def _name(task: dict[str, Any]) -> str:
    """Name of a task's file."""
    data = task.get("data", task)
    texts = data.values() if isinstance(data, dict) else ()
    for text in texts:
        if isinstance(text, str) and "." in text:
            try:
                name = PurePosixPath(unquote(urlsplit(text).path)).name
            except ValueError:
                continue
            if name:
                return name
    return ""


def _regions(taken: LabelRows, task: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Regions of a task, each with its place and author; cancelled annotations are left out."""
    annotations = task.get("annotations", task.get("completions"))
    if not isinstance(annotations, list):  # JSON-MIN has the regions of each control tag.
        author = str(task.get("annotator", ""))
        for name, regions in task.items():
            for number, value in enumerate(regions if isinstance(regions, list) else (), start=1):
                if isinstance(value, dict):
                    kind = next((one for one in _KINDS if one in value), "")
                    region = {"type": kind, "value": value, "from_name": name}
                    yield f"{name} {number}", region, author
        return
    for number, annotation in enumerate(annotations, start=1):
        with taken.entry():
            regions = annotation.get("result") if isinstance(annotation, dict) else None
            if not isinstance(regions, list) or annotation.get("was_cancelled"):
                why = "is cancelled" if isinstance(regions, list) else "has no result"
                raise Sd2Error(f"annotation {number} {why}", _EXPECTED)
            by = annotation.get("completed_by", "")
            author = str(by.get("email", by.get("id", "")) if isinstance(by, dict) else by)
            for index, region in enumerate(regions, start=1):
                if isinstance(region, dict):
                    yield f"annotation {number}, region {index}", region, author


def _rows(place: str, region: dict[str, Any], author: str) -> list[Row]:
    kind, value = str(region.get("type")), region.get("value")
    value = value if isinstance(value, dict) else {}
    if kind not in _KINDS or not ("ranges" in value or {"start", "end"} <= value.keys()):
        raise Sd2Error(f"{place} is {kind[:50]!r}", "a span of a timeline")
    names = value.get(kind)
    names = [str(one) for one in names] if isinstance(names, list) else []
    track = str(region.get("from_name") or DEFAULT_TRACK)
    rows = []
    ranges = value.get("ranges", [value])
    for one in ranges if isinstance(ranges, list) else [None]:
        edges: list[Any] = [
            one.get(side) if isinstance(one, dict) else None for side in ("start", "end")
        ]
        if not all(isinstance(at, int | float) and abs(at) < 1e15 for at in edges):
            raise Sd2Error(
                f"{place} is from {str(edges[0])[:50]!r} to {str(edges[1])[:50]!r}",
                "seconds, or frames of a video",
            )
        frames = (max(int(edges[0]) - 1, 0), int(edges[1])) if "ranges" in value else None
        start_s, end_s = (0.0, 0.0) if frames else map(float, edges)
        rows += [
            Row(place, start_s, end_s, name, track, author=author, frames=frames)
            for name in names or [UNNAMED]
        ]
    return rows
