"""Task that makes a data set of all maps of a batch."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import open_mesh
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.digests import file_digest
from sd2core.files.keys import key_of
from sd2core.files.limits import open_regular
from sd2core.files.paths import remove
from sd2core.files.texts import parse_json, read_json, whole_lines
from sd2core.maps import DopplerMap, MapKind, without_shares
from sd2core.options.exporting import Exporting
from sd2core.options.records import changed
from sd2core.progress import Progress
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.datasets.source import LazySource, Source, SourceKey
    from sd2core.imu.signals import InertialSignals
    from sd2core.mesh.sequence import MeshSequence

Row = dict[str, Any]
"""A line of ``results.jsonl``: the map of one person, or everybody's."""

_NOTE = "dataset.json"

_NEW = ("imu", "label_rule", "min_share", "null_bins")
"""Options that plans did not have at first: as by default, they leave keys as they were."""


def dataset_path(folder: BatchFolder, export: Exporting) -> Path:
    """Return the path of the data set."""
    return folder.path / f"dataset.{export.format}"


def dataset_key(folder: BatchFolder, export: Exporting) -> str:
    """Return the hash of all that the data set depends on; ``results.jsonl`` must exist."""
    content = {"results": file_digest(folder.results), "export": _settings_of(export)}
    return key_of("export", content)


def is_exported(folder: BatchFolder, export: Exporting) -> bool:
    """Tell if the data set exists and was made of the current results."""
    if not dataset_path(folder, export).exists() or not folder.results.exists():
        return False
    return _noted(folder).get("key") == dataset_key(folder, export)


def export_dataset(folder: BatchFolder, export: Exporting) -> None:
    """Write the data set with its card, or continue one that was begun.

    Sources that have been there stay. Where one of them has changed, or the settings have,
    the whole data set is written again.
    """
    from sd2core.datasets.writing import write_dataset

    out = dataset_path(folder, export)
    note = folder.path / _NOTE
    settings = key_of("export", {"settings": _settings_of(export)})
    if _noted(folder).get("settings") != settings or _is_stale(out, folder, export):
        for path in (*folder.path.glob("dataset.*"),):
            remove(path)
    atomic_write_text(note, json.dumps({"settings": settings}) + "\n")
    written = write_dataset(out, _sources(folder, export), export)
    if written.failed:
        first = written.failed[0]
        raise Sd2Error(
            f"{len(written.failed)} of {written.sources + len(written.failed)} sources cannot be"
            f" exported, such as {first.key.title}: {first.reason}"
        )
    content = {"settings": settings, "key": dataset_key(folder, export)}
    atomic_write_text(note, json.dumps(content) + "\n")


def _settings_of(export: Exporting) -> dict[str, Any]:
    """Settings of a plan's data set; what is new in plans only where one says it."""
    unsaid = {*_NEW} - {*changed(export)}
    return {name: value for name, value in asdict(export).items() if name not in unsaid}


def _noted(folder: BatchFolder) -> dict[str, Any]:
    """Content of the note about the data set; empty where there is none."""
    try:
        content = read_json(folder.path / _NOTE)
    except Sd2Error:
        return {}
    return content if isinstance(content, dict) else {}


def _is_stale(out: Path, folder: BatchFolder, export: Exporting) -> bool:
    """Tell if the data set has a source that is no longer wanted or has changed."""
    from sd2core.datasets.reading import open_dataset

    if not out.exists():
        return False
    wanted = {(*one.key,): one.fingerprint() for one in _sources(folder, export)}
    try:
        with open_dataset(out) as dataset:
            return any(
                wanted.get((one["subject"], one["recording"], one["placement"]))
                != one["fingerprint"]
                for one in dataset.sources()
            )
    except Sd2Error:  # begun, and not come to its end
        return False


def rows_of(folder: BatchFolder) -> Iterator[Row]:
    """Yield the rows of the results."""
    with open_regular(folder.results) as stream:
        for line in whole_lines(stream):
            yield parse_json(line.decode(), folder.results, "lines that `sd2 batch` wrote")


def _sources(folder: BatchFolder, export: Exporting) -> Iterator[LazySource]:
    from sd2core.datasets.source import LazySource, SourceKey

    opened = lru_cache(maxsize=1)(_Opened)
    for row in rows_of(folder):
        name = Path(row["recording"]).with_suffix("").as_posix()
        key = SourceKey(row["subject"], name, row["placement"])
        load = partial(_source, folder, row, key, opened, export.imu)
        fingerprint = hashlib.sha256(json.dumps(row, sort_keys=True).encode()).hexdigest()[:32]
        yield LazySource(key, load, partial(str, fingerprint))


def _source(
    folder: BatchFolder,
    row: Row,
    key: SourceKey,
    opened: Callable[[str, str], _Opened],
    imu: Sequence[str],
    _: Progress,
) -> Source:
    from sd2core.datasets.recording_sources import labels_and_classes
    from sd2core.datasets.source import Source, labelled_spans
    from sd2core.labels.per_frame import label_per_frame
    from sd2core.mocap.recording_pairs import on_clock

    maps: dict[MapKind, DopplerMap] = {}
    kinds: tuple[MapKind, ...] = ("synthetic", "denoised", "simulated")
    for kind in kinds:
        if row[kind] is not None:
            maps[kind] = _map_at(folder.path / row[kind])
    scene, person = opened(row["source"], row["mesh"]), row.get("person", "")
    recording, people = scene.recording, scene.people
    first = maps["synthetic"] if "clock" not in row else _map_at(folder.path / row["clock"])
    if recording.radar is not None and key.placement == 0:
        radar = on_clock(scene.radar_of(first.axis), first.timebase)
        maps.setdefault(radar.kind, radar)
    names, classes = labels_and_classes(people.labels)
    maps, own = people.known(person, names, maps), people.labels_of(person)
    return Source(
        *key,
        VirtualSensor.from_dict(row["sensor"]),
        maps,
        label_per_frame(own, names, first.times_s),
        names,
        classes,
        tuple(row["target_m"]),
        {
            "recording": recording.title or key.recording,
            "simulated": recording.simulated,
            **people.shown(person, maps),
        },
        {place: scene.imu_of(place, person) for place in imu},
        labelled_spans(own, names),
    )


def _map_at(file: Path) -> DopplerMap:
    """Map of a file, without numbers per frame that are of no use to who learns."""
    doppler = DopplerMap.load(file)
    return replace(doppler, meta=without_shares(doppler.meta))


class _Opened:
    """Open recording, or mesh or video alone, whose sources share what is made once."""

    def __init__(self, source: str, mesh: str) -> None:
        from sd2core.datasets.people import People
        from sd2core.datasets.recording_sources import radar_map
        from sd2core.recording.recording import Recording, is_recording, open_recording

        path, self._mesh = Path(source), Path(mesh)
        self.recording = open_recording(path) if is_recording(path) else Recording(path.parent)
        self.people = People(self.recording, None, self.recording.effective_labels())
        self.radar_of = cache(partial(radar_map, self.recording))
        self.imu_of = cache(self._imu_of)

    def _imu_of(self, place: str, person: str) -> InertialSignals:
        """Inertial sensor at the frames of a mesh, the same from every placement."""
        from sd2core.imu.virtual import imu_at_frames

        return imu_at_frames(replace(self.people, mesh=self._opened_mesh).body(person), place)

    @cached_property
    def _opened_mesh(self) -> MeshSequence:
        if self.recording.mesh is not None:
            return self.recording.load_mesh()
        return open_mesh(self._mesh, None, {})
