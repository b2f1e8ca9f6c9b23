"""Zarr store that a data set grows in, source by source, each whole or not at all.

``sources.jsonl`` beside the arrays has a line per source. A source counts once its line is
there, so that a writer that was killed leaves whole sources, and the next one writes over
what the killed one left.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.cutting import Arrays
from sd2core.datasets.layout import (
    CHUNK_SEGMENTS,
    FORMAT,
    Header,
    check_arrays,
    chunk_of,
    row_shapes,
    whole_names,
)
from sd2core.datasets.source import KINDS
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder
from sd2core.files.stores import (
    StoredArray,
    array_in,
    create_array,
    create_group,
    growing,
    open_group,
    put_rows,
    read_attributes,
)
from sd2core.files.texts import append_lines, drop_torn_line, whole_lines
from sd2core.io.kinds import is_dataset

SOURCES_NAME = "sources.jsonl"
FLUSH_EVERY_S = 2.0
"""Time of work that a killed writer may lose; a source that takes longer is written at once."""
_TOGETHER = 16 * CHUNK_SEGMENTS
"""Segments that are written together."""
_TORN = "*.partial"
"""Files that a killed Zarr leaves of a chunk that it was writing."""
_DESCRIPTION = "zarr.json"


class SegmentStore:
    """Rows of a data set on disk, appended source by source.

    The folder holds a store already, see :meth:`begin`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        for left in path.rglob(_TORN):
            left.unlink(missing_ok=True)
        self._group = open_group(path, "r+")
        self.header = Header.from_dict(dict(self._group.attrs), path)
        # Asked for by name: Zarr complains when it lists a folder with other files in it.
        names = [*KINDS, *row_shapes(self.header)]
        self._arrays: dict[str, Any] = {
            name: growing(self._group, path, name)
            for name in dict.fromkeys(names)
            if (path / name / _DESCRIPTION).exists()
        }
        drop_torn_line(path / SOURCES_NAME)
        self._pending: list[tuple[int, Arrays]] = []
        self._lines: list[str] = []
        self._flushed_s = time.monotonic()
        self.rows = 0
        self.sources = 0
        for entry in read_sources(path / SOURCES_NAME):
            self.rows = entry["stop"]
            self.sources += 1

    @classmethod
    def begin(
        cls,
        path: Path,
        header: Header,
        arrays: Mapping[str, Any] | None = None,
        sources: Iterable[dict[str, Any]] = (),
    ) -> SegmentStore:
        """Make an empty store, or the one that a file was packed from.

        Parameters
        ----------
        path : Path
            Folder of the store; an earlier store there is deleted.
        header : Header
        arrays : mapping, optional
            Arrays of the file by name, (segments, …), read in parts.
        sources : iterable of dict
            Lines of the sources in the file.
        """
        with atomic_folder(path) as folder:
            group = create_group(folder, header.as_dict() | {"complete": False})
            for name, (kind, row) in row_shapes(header).items():
                packed: Any = np.empty((0, *row), kind) if arrays is None else arrays[name]
                target: Any = _create(group, name, kind, row, packed.shape[0])
                step = 16 * chunk_of(row)[0]
                for start in range(0, packed.shape[0], step):
                    target[start : start + step] = packed[start : start + step]
            if arrays is not None:
                append_lines(folder / SOURCES_NAME, map(_line, sources))
        return cls(path)

    @property
    def complete(self) -> bool:
        """True if nothing was appended since the header was last written."""
        return bool(self._group.attrs["complete"])

    def append(self, blocks: Iterable[Arrays], entry: dict[str, Any]) -> None:
        """Add the segments of one source.

        Some are kept in memory and written together, which takes a fraction of the time.
        They count once their source's line is written, see :meth:`flush`.

        ``blocks`` come from :func:`~sd2core.datasets.cutting.cut_source`; errors that they raise
        leave the store unchanged. ``entry`` is the line of the source, with a value for each of its
        columns in ``columns``; its rows are added to it as ``start`` and ``stop``.
        """
        if self.complete:
            self._group.attrs["complete"] = False
        columns = entry.pop("columns")
        stop = self.rows
        try:
            for block in blocks:
                self._pending.append((stop, columns | block))
                stop += len(block["start_s"])
                if stop - self._pending[0][0] >= _TOGETHER:
                    self._write()
        except BaseException:
            self._pending = [one for one in self._pending if one[0] < self.rows]
            raise
        entry |= {"start": self.rows, "stop": stop}
        self._lines.append(_line(entry))
        self.rows = stop
        self.sources += 1
        if time.monotonic() - self._flushed_s >= FLUSH_EVERY_S:
            self.flush()

    def flush(self) -> None:
        """Write appended sources to disk."""
        self._write()
        self._flushed_s = time.monotonic()
        if not self._lines:
            return
        append_lines(self.path / SOURCES_NAME, self._lines)
        self._lines = []

    def entries(self) -> Iterator[dict[str, Any]]:
        """Yield the lines of the sources."""
        yield from read_sources(self.path / SOURCES_NAME)

    def finish(self, header: Header, split_of_subject: np.ndarray) -> None:
        """Write the split of every segment and the header, which completes the data set."""
        self.flush()
        for name in [one for one in KINDS if one in self._arrays and one not in header.kinds]:
            del self._group[name], self._arrays[name]
        for array in self._arrays.values():
            if array.shape[0] != self.rows:
                array.resize((self.rows, *array.shape[1:]))
        subject = self._arrays["subject"]
        step = subject.chunks[0]
        for start in range(0, self.rows, step):
            stop = min(start + step, self.rows)
            put_rows(self._arrays["split"], start, split_of_subject[subject[start:stop]])
        self._group.attrs.put(header.as_dict() | {"complete": True})
        self.header = header

    def _write(self) -> None:
        """Put pending rows into the arrays."""
        pending, self._pending = self._pending, []
        if not pending:
            return
        start = pending[0][0]
        stop = pending[-1][0] + len(pending[-1][1]["start_s"])
        for kind in KINDS:
            if kind not in self._arrays and any(kind in block for _, block in pending):
                row = (self.header.length, self.header.axis.bins)
                array = self._arrays[kind] = _create(self._group, kind, "float32", row, start)
                for first in range(0, start, _TOGETHER):
                    array[first : first + _TOGETHER] = 0.0
        for name, array in self._arrays.items():
            values = np.zeros((stop - start, *array.shape[1:]), array.dtype)
            for at, block in pending:
                if name in block:
                    values[at - start : at - start + len(block["start_s"])] = block[name]
            put_rows(array, start, values)


def open_arrays(path: Path) -> tuple[Header, dict[str, StoredArray]]:
    """Open the header and arrays of a finished store."""
    if not is_dataset(path):
        raise Sd2Error(f"{path} holds no data set", "one that `sd2 export` made")
    group = open_group(path)
    attributes = dict(group.attrs)
    header = Header.from_dict(attributes, path)
    if not attributes.get("complete"):
        raise Sd2Error(
            f"{path} was not written to its end",
            "a finished data set",
            "Run the command that made it once more: it goes on where it was",
        )
    existing = (one.parent.name for one in path.glob(f"*/{_DESCRIPTION}"))
    names = whole_names(header, existing, path)
    arrays = {name: array_in(group, path, name, "segments") for name in names}
    check_arrays(header, arrays, path)
    return header, arrays


def read_sources(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the lines of sources; an incomplete last line is left out."""
    if not path.exists():
        return
    with path.open("rb") as stream:
        for number, content in enumerate(whole_lines(stream), start=1):
            line = content.decode(errors="replace")
            try:
                entry = json.loads(line)
                entry["subject"], entry["recording"], entry["placement"], entry["stop"]
            except (ValueError, KeyError, TypeError, RecursionError):
                raise Sd2Error(
                    f"{path}: line {number} cannot be read: {line[:80]!r}", "one source, as JSON"
                ) from None
            yield entry


def count_sources(path: Path) -> int:
    """Number of the lines of sources."""
    if not path.exists():
        return 0
    with path.open("rb") as stream:
        return sum(1 for _ in whole_lines(stream))


def is_begun(path: Path) -> bool:
    """True for a folder that is empty, or that an earlier version left before it was a store."""
    if not path.is_dir():
        return False
    of_a_store = read_attributes(path).get("format") == f"{FORMAT}-begun"
    return of_a_store or {one.name for one in path.iterdir()} <= {".sd2-lock"}


def _line(entry: dict[str, Any]) -> str:
    return json.dumps(entry, ensure_ascii=False) + "\n"


def _create(group: Any, name: str, kind: str, row: tuple[int, ...], rows: int) -> Any:
    fill = -1 if name == "split" else 0
    return create_array(
        group, name, shape=(rows, *row), dtype=kind, chunks=chunk_of(row), fill_value=fill
    )
