"""Writing of data sets from a stream of sources, one in memory at a time."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.card import write_card
from sd2core.datasets.cutting import cut_source
from sd2core.datasets.formats import refuse_large_npz, write_hdf5, write_npz
from sd2core.datasets.index import Names, check_fits, entry_of, header_of, refuse_other_settings
from sd2core.datasets.layout import SPLITS, FileFormat, Header, format_of
from sd2core.datasets.options import dataset_options
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS, LazySource, SourceKey, each_once
from sd2core.datasets.splitting import named_splits, split_people
from sd2core.datasets.store import SOURCES_NAME, SegmentStore, is_begun, open_arrays
from sd2core.errors import Sd2Error
from sd2core.files.atomic import full_disk_named
from sd2core.files.lock import FileLock
from sd2core.io.kinds import is_dataset
from sd2core.options.exporting import Exporting
from sd2core.progress import Progress, part_of, silent


@dataclass(frozen=True)
class Failed:
    """Source that could not be made, with the reason."""

    key: SourceKey
    reason: str


@dataclass(frozen=True)
class Written:
    """Result of writing a data set."""

    path: Path
    segments: int  # In the data set now.
    sources: int  # In the data set now.
    added: int  # Sources that were not there before.
    failed: tuple[Failed, ...] = ()


def write_dataset(
    out: Path,
    sources: Iterable[LazySource],
    options: Exporting | None = None,
    progress: Progress = silent,
    *,
    provenance: dict[str, Any] | None = None,
) -> Written:
    """Write segments of all sources, or continue a data set that was begun.

    One source is in memory at a time. A source that is there already is not even loaded, so a
    writer that was killed, or that gets more sources later, does only what is missing. Zarr grows
    in place; HDF5 and NPZ grow in the folder ``OUT.partial`` and appear complete. The card is
    written beside it.

    Parameters
    ----------
    out : Path
        Its ending gives the format: ``.zarr``, ``.h5``, ``.hdf5`` or ``.npz``.
    progress : Progress
        Of all sources; it may raise ``Cancelled``.
    provenance : dict, optional
        Origin of a new data set; kept as JSON.

    Returns
    -------
    Written
        Sources that raised ``Sd2Error`` are in ``failed``; they do not stop the others.

    Raises
    ------
    Sd2Error
        When the place holds something else or a data set of other settings, a source of the
        same key was made of something else, no source can be made, or there is no segment.
    """
    out = Path(out)
    options = dataset_options(options or Exporting())
    form = format_of(out)
    work = out if form == "zarr" else out.with_name(f"{out.name}.partial")
    if not out.absolute().parent.is_dir():
        raise Sd2Error(f"The folder {out.absolute().parent} does not exist", "an existing folder")
    _refuse_other(out, form)
    lock = FileLock(out.with_name(f".{out.name}.lock"))
    if not lock.take():
        raise Sd2Error(f"A process is writing to {out}", "one at a time", "Wait until it ends")
    writer: _Writer | None = None
    try:
        with full_disk_named(out):
            writer = _Writer(out, work, form, options, provenance or {})
            written = writer.write(sources, progress)
    finally:
        lock.release(delete=True)
        # A store without a segment would only be in the way of other settings.
        if not is_dataset(work) or (writer is not None and writer.empty):
            shutil.rmtree(work, ignore_errors=True)
    if form != "zarr":
        shutil.rmtree(work, ignore_errors=True)
    write_card(out)
    return written


class _Writer:
    def __init__(
        self,
        out: Path,
        work: Path,
        form: FileFormat,
        options: Exporting,
        provenance: dict[str, Any],
    ) -> None:
        self._out, self._work, self._form, self._options = out, work, form, options
        self._provenance = provenance
        self._names = Names()
        self._fingerprints: dict[SourceKey, str] = {}
        self._before: dict[str, SourceKey] = {}  # what was there, by its fingerprint
        self._store: SegmentStore | None = None
        begun = SegmentStore(work) if is_dataset(work) else None
        if begun is not None and begun.complete and not begun.sources:
            raise Sd2Error(
                f"{out} lacks its list of sources, {SOURCES_NAME}",
                "a data set that is whole",
                "Choose a new name, or copy that file again from where it came",
            )
        if begun is not None and begun.sources:
            self._store = begun
            for entry in begun.entries():
                self._know(entry)
        elif form != "zarr" and out.exists():
            with open_dataset(out) as dataset:
                for entry in dataset.sources():
                    self._know(entry)
                refuse_other_settings(out, dataset.header, options)
        if self._store is not None:
            refuse_other_settings(out, self._store.header, options)
        self._before = {made_of: key for key, made_of in self._fingerprints.items() if made_of}

    @property
    def _kept_out(self) -> tuple[Sequence[str] | None, Sequence[str] | None]:
        return self._options.validation_subjects, self._options.test_subjects

    @property
    def empty(self) -> bool:
        """True if there is a store without a segment."""
        return self._store is not None and self._store.rows == 0

    def write(self, sources: Iterable[LazySource], progress: Progress) -> Written:
        try:
            added, failed, first_error = self._append_all(sources, progress)
        finally:
            if self._store is not None:
                self._store.flush()
        if not self._fingerprints:
            raise first_error or Sd2Error("There are no sources", "one at least")
        segments, count = self._finish(progress)
        return Written(self._out, segments, count, added, tuple(failed))

    def _append_all(
        self, sources: Iterable[LazySource], progress: Progress
    ) -> tuple[int, list[Failed], Sd2Error | None]:
        """Append all sources: number added, failures, and first error."""
        sources = each_once(sources)
        if sources:  # a wrong name is known before the work
            names = [*self._names.subjects, *(one.key.subject for one in sources)]
            split_people(list(dict.fromkeys(names)), *self._kept_out)
        failed: list[Failed] = []
        first_error: Sd2Error | None = None
        added = 0
        for number, one in enumerate(sources):
            report = part_of(progress, number, number + 1, len(sources))
            report(0, 1)
            if self._is_there(one):
                continue
            try:
                self._append(one, report)
                added += 1
            except Sd2Error as error:
                failed.append(Failed(one.key, str(error)))
                first_error = first_error or error
                continue
            if self._form == "npz" and self._store is not None:
                kinds = tuple(kind for kind in KINDS if kind in self._names.kinds)
                header = replace(self._store.header, kinds=kinds)
                refuse_large_npz(self._out, self._store.rows, header)
        return added, failed, first_error

    def _is_there(self, one: LazySource) -> bool:
        known = self._fingerprints.get(one.key)
        if known is None and not self._before:
            return False
        now = one.fingerprint()
        if known is None:
            if now in self._before:
                raise Sd2Error(
                    f"{one.key.title} is in {self._out} already, as {self._before[now].title}",
                    "the same names as before",
                    "Name it so, or write a new data set",
                )
            return False
        if known and known != now:
            raise Sd2Error(
                f"{self._out} holds {one.key.title} already, made of something else",
                "the same maps, labels and options as before",
                "Write a new data set, or delete this one first",
            )
        return True

    def _append(self, one: LazySource, progress: Progress) -> None:
        source = one.load(part_of(progress, 0.0, 0.9))
        if self._store is None:
            if self._out.exists() and self._form != "zarr":
                with open_dataset(self._out) as dataset:
                    self._store = self._unpacked(dataset)
            else:
                header = replace(header_of(source, self._options), provenance=self._provenance)
                self._store = SegmentStore.begin(self._work, header)
        store = self._store
        header = store.header
        check_fits(source, header)
        self._names.check(source)
        entry = entry_of(source, header, one.fingerprint())
        labels = dict(self._names.labels)
        for name in source.labels:
            labels.setdefault(name, len(labels))
        numbers = np.array([labels[name] for name in source.labels], np.int16)
        range_m, azimuth_deg, elevation_deg = source.spherical
        sensor = source.sensor
        entry["columns"] = {
            "subject": self._names.subjects.get(source.subject, len(self._names.subjects)),
            "split": -1,
            "source": store.sources,
            "placement": source.placement,
            "sensor_position_m": sensor.position_m,
            "sensor_direction_deg": (sensor.azimuth_deg, sensor.elevation_deg),
            "range_m": range_m,
            "azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg,
        }
        counts = entry["segments_of_kind"] = dict.fromkeys(source.maps, 0)

        def counted() -> Any:
            for block in cut_source(
                source, header.frame_rate_hz, header.null_bins, numbers, self._options
            ):
                whole = block["available"].sum(axis=0).tolist()
                for kind in counts:
                    counts[kind] += whole[KINDS.index(kind)]
                yield block

        store.append(counted(), entry)
        self._know(entry)
        progress(1, 1)

    def _unpacked(self, dataset: Dataset) -> SegmentStore:
        return SegmentStore.begin(self._work, dataset.header, dataset.arrays, dataset.sources())

    def _finish(self, progress: Progress) -> tuple[int, int]:
        store = self._store
        names = self._names
        if store is None:  # a file that holds everything already
            with open_dataset(self._out) as dataset:
                if self._final(dataset.header) == dataset.header:
                    return len(dataset), len(self._fingerprints)
                store = self._unpacked(dataset)
        if store.rows == 0:
            raise _without_segments(self._options)
        header = self._final(store.header)
        if not store.complete or header != store.header:
            split_of = {name: number for number, name in enumerate(SPLITS)}
            table = np.zeros(len(names.subjects), np.int8)
            for split, subjects in header.splits.items():
                for subject in subjects:
                    table[names.subjects[subject]] = split_of[split]
            store.finish(header, table)
        if self._form != "zarr":
            header, arrays = open_arrays(self._work)
            if self._form == "npz":
                write_npz(self._out, header, arrays, store.entries())
            else:
                write_hdf5(self._out, header, arrays, store.entries(), progress)
        return store.rows, store.sources

    def _final(self, header: Header) -> Header:
        names = self._names
        people = split_people(list(names.subjects), *self._kept_out)
        return replace(
            header,
            kinds=tuple(kind for kind in KINDS if kind in names.kinds),
            labels=tuple(names.labels),
            classes=dict(names.classes),
            subjects=tuple(names.subjects),
            splits=named_splits(people),
            units={kind: tuple(names.units[kind]) for kind in KINDS if kind in names.units},
        )

    def _know(self, entry: dict[str, Any]) -> None:
        key = SourceKey(entry["subject"], entry["recording"], entry["placement"])
        self._fingerprints[key] = entry["fingerprint"]
        self._names.learn(entry)


def _without_segments(options: Exporting) -> Sd2Error:
    if options.spans is not None:
        shortest_s = options.spans.shortest_s
        long_enough = f" of {shortest_s:g} s or more" if shortest_s else ""
        return Sd2Error(
            f"No source has a labelled span{long_enough} that shows a person",
            "one segment at least",
            "Label gestures, or export windows",
        )
    pure = f", of which {options.min_purity:.0%} have one label" if options.min_purity else ""
    return Sd2Error(
        f"No source has {options.segment_frames} frames on end with a person{pure}",
        "one segment at least",
        "Choose shorter segments",
    )


def _refuse_other(out: Path, form: FileFormat) -> None:
    """Refuse to overwrite anything but a data set."""
    if form == "zarr":
        if out.exists() and not (is_dataset(out) or is_begun(out)):
            raise Sd2Error(f"{out} is there and holds no data set", "a new name")
    elif out.exists():
        open_dataset(out).close()
