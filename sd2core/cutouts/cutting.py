"""Writing of cut-outs into folders, each complete or absent."""

from __future__ import annotations

import csv
import glob
import io
import json
import shutil
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sd2core.cutouts.source import FORMAT, CutSource, folder_name
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder, atomic_write_json, atomic_write_text
from sd2core.files.lock import FileLock
from sd2core.files.tables import as_cell
from sd2core.files.texts import read_json
from sd2core.io.mesh import save_mesh
from sd2core.io.video import VideoReader, open_video
from sd2core.io.video_writing import write_video
from sd2core.labels.spans import ShownFrames, Span
from sd2core.progress import Progress, silent

State = Literal["new", "same", "other", "empty"]  # The last has no frame.
_DETAILS = "span.json"
_UNFINISHED = ".sd2-cut-*"
"""What earlier versions left unfinished."""
_LOCK = ".sd2-lock"
_CRF, _PRESET = 16, "fast"
_COLUMNS = (
    "folder", "label", "track", "start_s", "end_s", "first_frame", "last_frame", "frames",
    "note", "author", "confidence", "recording", "simulated", "person",
)  # fmt: skip


@dataclass(frozen=True)
class Cut:
    """Span, the folder to write it to, and if that is new, the same or something else."""

    span: Span
    path: Path
    state: State


def plan_cuts(source: CutSource, spans: Iterable[Span], folder: Path) -> list[Cut]:
    """List the cut-outs of spans in the order of time, compared with a folder's content.

    Raises Sd2Error when there are no spans, or none has a frame of the recording.
    """
    cuts: list[Cut] = []
    for span in sorted(spans, key=lambda one: (one.start_s, one.end_s, one.id)):
        first, stop = source.frames_of(span)
        path = folder / folder_name(span)
        state: State = _state(path, source.described(span)) if stop > first else "empty"
        cuts.append(Cut(span, path, state))
    if not cuts:
        raise Sd2Error("There are no spans to cut out", "one at least")
    if all(one.state == "empty" for one in cuts):
        raise Sd2Error(f"{cuts[0].span.words()} has no frame of {source.title}", "one at least")
    return cuts


def without_frame(cuts: Iterable[Cut]) -> str:
    """Sentences on spans that are not cut out, each after a blank; "" for none."""
    return "".join(f" {one.span.words()} has no frame." for one in cuts if one.state == "empty")


def cut_out(
    source: CutSource,
    cuts: Sequence[Cut],
    folder: Path,
    *,
    replace_others: bool = False,
    progress: Progress = silent,
) -> list[Path]:
    """Write the folders that do not exist yet, and an index of all; return the written folders.

    A folder has its name only once it is complete. Folders with the same content are kept, so a
    stopped export continues where it was.

    Parameters
    ----------
    source : CutSource
        What spans are cut from.
    cuts : sequence of Cut
        Plan of :func:`plan_cuts` for this source and folder.
    folder : Path
        Holds the folders and the index; made where it is missing.
    replace_others : bool
        True to replace folders of the same name that hold something else; otherwise they stay.
    progress : Progress
        Counts frames; may raise ``Cancelled``.

    Raises
    ------
    Sd2Error
        When another process is writing there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / _LOCK)
    if not lock.take():
        raise Sd2Error(
            f"Another process is writing to {folder}", "a folder of its own", "Wait for that"
        )
    try:
        unfinished = [f".{glob.escape(one.path.name)}.*.tmp" for one in cuts]
        for left in (one for name in (_UNFINISHED, *unfinished) for one in folder.glob(name)):
            shutil.rmtree(left, ignore_errors=True)
        wanted = [
            one for one in cuts if one.state == "new" or (one.state == "other" and replace_others)
        ]
        try:
            return _write_all(source, wanted, progress)
        finally:
            write_index(folder)
    finally:
        lock.release()


def write_index(folder: Path) -> None:
    """Write ``index.csv`` and ``index.json`` of all cut-outs in a folder."""
    entries = []
    for path in sorted(folder.glob(f"*/{_DETAILS}")):
        details = _read(path)
        if details is not None:
            entries.append({"folder": path.parent.name, **details})
    if not entries:
        return
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for one in entries:
        first, last, count = (one["frames"][name] for name in ("first", "last", "count"))
        flat = one | {"person": ""} | one["span"]
        flat |= {"first_frame": first, "last_frame": last, "frames": count}
        cells = ("" if flat[name] is None else flat[name] for name in _COLUMNS)
        writer.writerow([as_cell(cell) if isinstance(cell, str) else cell for cell in cells])
    atomic_write_text(folder / "index.csv", table.getvalue())
    kept = [{key: value for key, value in one.items() if key != "frame_times_s"} for one in entries]
    content = {"format": f"{FORMAT}-index", "version": 1, "spans": kept}
    atomic_write_json(folder / "index.json", content)


def _write_all(source: CutSource, wanted: Sequence[Cut], progress: Progress) -> list[Path]:
    sizes = [stop - first for first, stop in (source.frames_of(one.span) for one in wanted)]
    done, total = 0, sum(sizes)
    progress(0, total)
    shown = source.video if wanted else None
    with nullcontext() if shown is None else open_video(shown) as video:
        for one, size in zip(wanted, sizes, strict=True):
            start = done

            def within(frames: int, _: int, start: int = start) -> None:
                progress(start + frames, total)

            with atomic_folder(one.path) as made:
                _write_one(source, one.span, video, made, within)
            done += size
            progress(done, total)
    return [one.path for one in wanted]


def _write_one(
    source: CutSource, span: Span, video: VideoReader | None, made: Path, progress: Progress
) -> None:
    zero_s = source.zero_s(span)
    if video is not None:
        _write_clip(video, span, zero_s, made / "video.mp4", progress)
    if (whole := source.mesh_of(span)) is not None:
        start, end = whole.timebase.frames_between(span.start_s, span.end_s)
        if end > start:
            mesh = whole.between(start, end)
            shifted = replace(mesh, timebase=mesh.timebase.shifted(-zero_s), others=())
            save_mesh(shifted, made / "mesh.zarr")
    label = {"label": span.label, "track": span.track, "start_s": span.start_s, "end_s": span.end_s}
    for name, doppler in source.maps.items():
        start, end = doppler.timebase.frames_between(span.start_s, span.end_s)
        if end > start:
            part = doppler.between(start, end).shifted(-zero_s)
            replace(part, meta=part.meta | {"cut_out": label}).save(made / f"{name}.npz")
    described = source.described(span)
    described["files"] = [name for name in described["files"] if (made / name).exists()]
    atomic_write_json(made / _DETAILS, described)


def _write_clip(
    video: VideoReader, span: Span, zero_s: float, path: Path, progress: Progress
) -> None:
    first, stop = video.timebase.frames_between(span.start_s, span.end_s)
    times_s = video.timebase.times_s[first:stop] - zero_s
    # H.264 halves the colour's resolution: an odd edge is repeated.
    odd_y, odd_x = video.height % 2, video.width % 2

    def pictures() -> Iterable[np.ndarray]:
        for number, picture in enumerate(video.frames(first, stop)):
            progress(number, stop - first)
            yield np.pad(picture, ((0, odd_y), (0, odd_x), (0, 0)), mode="edge")

    size = video.width + odd_x, video.height + odd_y
    rate = max(round(video.timebase.frames_per_s), 1)
    write_video(path, pictures(), rate, size, times_s=times_s, crf=_CRF, preset=_PRESET)


def _state(path: Path, described: dict[str, Any]) -> State:
    if not path.exists():
        return "new"
    details = _read(path / _DETAILS)
    if details is None or not all((path / name).exists() for name in details["files"]):
        return "other"
    known = json.loads(json.dumps(described)) | {"files": details["files"]}
    return "same" if details == known else "other"


def _read(path: Path) -> dict[str, Any] | None:
    try:
        details = read_json(path)
    except Sd2Error:
        return None
    ours = isinstance(details, dict) and details.get("format") == FORMAT
    if not ours or not {"span", "frames", "files"} <= details.keys():
        return None
    if isinstance(details["frames"], list):  # half-open, in cut-outs of before
        first, stop = details["frames"]
        details["frames"] = asdict(ShownFrames(first, stop - 1, stop - first))
    return details
