"""Sources of all that can be exported: recordings, pairs, Doppler maps and radar files."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import gesture_classes
from sd2core.datasets.kept_maps import denoised
from sd2core.datasets.people import people_shown
from sd2core.datasets.recording_sources import Making, labels_and_classes, recording_sources
from sd2core.datasets.source import (
    LazySource,
    Outline,
    Source,
    SourceKey,
    labelled_spans,
    runs_of,
)
from sd2core.denoise.files import default_name, find_model
from sd2core.errors import Sd2Error
from sd2core.files.digests import cached_digest
from sd2core.files.paths import check_distinct
from sd2core.files.tables import counted
from sd2core.io.kinds import kind_of
from sd2core.io.radar import holds_map, load_recorded_map
from sd2core.labels.formats import read_label_file
from sd2core.labels.per_frame import label_per_frame
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.pairs.rows import UNKNOWN, check_labels, lost_frames, read_around
from sd2core.pairs.store import SPLIT, limbs_of, open_takes
from sd2core.pairs.summary import REMAKE, TakeEntry, names_together
from sd2core.progress import Progress, silent
from sd2core.recording.recording import SUFFIX, is_recording
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

_EXPECTED = "recordings (.sd2), pairs (.zarr), Doppler maps (.npz), or folders of recordings"


def gather(
    paths: Sequence[Path],
    making: Making,
    *,
    subjects: Sequence[str] | None = None,
    label_files: Sequence[Path] = (),
) -> list[LazySource]:
    """Return the sources of all files named, in their order.

    Parameters
    ----------
    paths : sequence of Path
        Recordings, folders of recordings, pairs, Doppler maps.
    subjects : sequence of str, optional
        Subject of each recording and each map, in their order; by default the one that a
        recording names, or else each shows another person, named like the file or its folder.
        Pairs name their subjects themselves.
    label_files : sequence of Path
        One for each map (``.npz``), or none.

    Raises
    ------
    Sd2Error
        When a path is something else, or their numbers do not fit.
    """
    files = [one for path in paths for one in _expanded(Path(path))]
    check_distinct(files)
    pairs = [path for path in files if not is_recording(path) and kind_of(path) == "pairs"]
    single = [path for path in files if path not in pairs]
    names = people_shown(single) if subjects is None else list(subjects)
    if len(names) != len(single):
        raise Sd2Error(
            f"{len(names)} people are named for {len(single)} recordings and maps",
            "one for each, in their order",
        )
    maps = [path for path in single if not is_recording(path)]
    if label_files and len(label_files) != len(maps):
        raise Sd2Error(
            f"{counted(len(label_files), 'label file')} for {counted(len(maps), 'map')}",
            "one for each map",
        )
    without_body = [*pairs, *maps] if making.imu else []
    if without_body:
        raise Sd2Error(
            f"{', '.join(map(str, without_body))}: no body that inertial sensors could be fixed to",
            "recordings with a mesh",
            "Leave it out, or export without inertial sensors",
        )
    labelled = dict(zip(maps, label_files, strict=False))
    sources = pair_sources(pairs, making) if pairs else []
    recordings = {path: name for path, name in zip(single, names, strict=True) if path not in maps}
    sources += recording_sources(list(recordings), list(recordings.values()), making)
    for path, name in zip(single, names, strict=True):
        if path in maps:
            sources.append(map_source(path, name, labelled.get(path)))
    return sources


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings directly in a folder, by name."""
    return sorted(path for path in folder.glob(f"*{SUFFIX}") if is_recording(path))


def _expanded(path: Path) -> list[Path]:
    """Return the path, or the recordings in it where it is a folder of them."""
    if is_recording(path):
        return [path]
    if path.is_dir():
        inside = recordings_in(path)
        if inside:
            return inside
    kind = kind_of(path)
    if kind in ("pairs", "map") or (kind == "radar" and holds_map(path)):
        return [path]
    raise Sd2Error(f"{path} is of kind {kind}", _EXPECTED)


# -- Doppler maps: files of `sd2 synth` and the like, and radars' own recordings -----------------


def map_source(path: Path, subject: str, label_file: Path | None = None) -> LazySource:
    """Return the source of one Doppler map.

    ``path`` is a map (``.npz``), or a radar file that holds one with labels of its own.
    ``label_file`` is on the map's clock, in any format that `sd2 labels convert` reads; None: the
    labels of the radar's file, otherwise nothing is labelled.
    """
    key = SourceKey(subject, path.stem, 0)

    def fingerprint() -> str:
        sums = hashlib.blake2b(digest_size=16)
        for one in (path, label_file):
            sums.update(b"" if one is None else cached_digest(one).encode())
        return sums.hexdigest()

    def load(_: Progress) -> Source:
        doppler, labels, _remark = _read_map(path, label_file)
        names, classes = labels_and_classes(labels)
        return Source(
            *key,
            _sensor(doppler.meta),
            {doppler.kind: doppler},
            label_per_frame(labels, names, doppler.times_s),
            names,
            classes,
            None,
            {
                "file": path.name,
                "labels": None if label_file is None else label_file.name,
                "simulated": doppler.of_simulated,
            },
            spans=labelled_spans(labels, names),
        )

    remarks = () if label_file is None else (_read_map(path, label_file)[2],)
    return LazySource(key, load, fingerprint, lambda: load(silent).outline(), remarks)


def _read_map(path: Path, label_file: Path | None) -> tuple[DopplerMap, Labels, str]:
    """A map, its labels, and what of the file with labels is taken."""
    labels, remark = Labels(), ""
    if holds_map(path):
        recorded = load_recorded_map(path)
        doppler, labels = recorded.doppler, recorded.labels
    else:
        doppler = DopplerMap.load(path)
    if label_file is not None:
        reading = read_label_file(label_file, doppler.timebase)
        labels, remark = reading.labels, f"{label_file}: {reading.sentence}"
    return doppler, labels, remark


def _sensor(meta: dict[str, Any]) -> VirtualSensor:
    """Return the sensor that a map names; otherwise the camera."""
    sensor = meta.get("sensor")
    return VirtualSensor.from_dict(sensor) if isinstance(sensor, dict) else VirtualSensor()


# -- Pairs: synthetic Doppler beside a radar's, take by take -------------------------------------


def pair_sources(paths: Sequence[Path], making: Making) -> list[LazySource]:
    """Return one source per take of the stores of pairs.

    People are called as :func:`~sd2core.pairs.summary.names_together` says, and takes that several
    stores have of one of them ``STORE:TAKE``. Of the making count its kinds, model, texture and
    limbs: with those, stores without limb maps raise Sd2Error.
    """
    stores = [_PairStore(path, making) for path in paths]
    unsplit = [str(one.path) for one in stores if not one.facts.parts]
    if making.limbs and unsplit:
        raise Sd2Error(
            f"{', '.join(unsplit)}: pairs without limb maps",
            "pairs that are split by the parts of the body",
            "Make them again with `sd2 simulate campaign --limbs` or `sd2 pairs … --limbs`, or"
            " export without limbs",
        )
    together = names_together([one.facts for one in stores])
    keys = [
        (one, number, take.key._replace(subject=names[take.subject]))
        for one, names in zip(stores, together, strict=True)
        for number, take in enumerate(one.facts.takes)
    ]
    count = Counter(key for _, _, key in keys)
    return [
        one.lazy(number, key.subject, f"{one.path.stem}:{key.name}" if count[key] > 1 else key.name)
        for one, number, key in keys
    ]


class _PairStore:
    def __init__(self, path: Path, making: Making) -> None:
        self.path = path
        self._texture = making.texture
        self.facts, self._arrays = open_takes(path)
        self._radar: MapKind = self.facts.kind
        possible: tuple[MapKind, ...] = ("synthetic", "denoised", self._radar)
        self._kinds = tuple(kind for kind in possible if kind in making.kinds)
        self._axis = VelocityAxis(self.facts.bins, self.facts.v_max_mps)
        self._model: Path | None = None
        if "denoised" in self._kinds:
            self._model = find_model(making.model or default_name(limbs=self.facts.has_limbs))

    def lazy(self, number: int, subject: str, name: str) -> LazySource:
        take = self.facts.takes[number]
        key = SourceKey(subject, name, take.placement)
        return LazySource(
            key,
            lambda progress: self._source(key, take),
            lambda: self._fingerprint(take),
            lambda: self._outline(take),
        )

    def _fingerprint(self, take: TakeEntry) -> str:
        """Hash of the take's own rows, as a store may grow."""
        model = "" if self._model is None else cached_digest(self._model)
        texture = [] if self._texture is None else [self._texture]
        about = take.model_dump(exclude={"start", "stop"})
        sums = hashlib.blake2b(
            json.dumps([about, self._radar, self._kinds, model, *texture]).encode(),
            digest_size=16,
        )
        for name in self._arrays:
            sums.update(np.ascontiguousarray(self._part(name, take)).data)
        return sums.hexdigest()

    def _scene(self, take: TakeEntry) -> dict[str, Any]:
        """People of the scene that all maps of a take show, for provenance."""
        scenes = self.facts.provenance.get("scenes", {})
        scene = scenes.get(take.name.rpartition("-")[0])
        return {"scene": scene, "everybody": self._kinds} if scene else {}

    @cached_property
    def _lost(self) -> NDArray[np.bool_]:
        return lost_frames(self._arrays, self.facts.frames)

    def _part(self, name: str, take: TakeEntry) -> NDArray[Any]:
        """Frames of a take, zeros where they are lost."""
        return read_around(self._arrays[name], take.rows, self._lost)

    def _times_s(self, take: TakeEntry) -> NDArray[np.float64]:
        """Times of a take; those that are lost follow the others at the frame rate."""
        frame, kept = np.arange(take.stop - take.start), ~self._lost[take.rows]
        regular_s = frame / self.facts.frame_rate_hz
        if not kept.any():
            return regular_s
        offset_s = (self._part("times_s", take) - regular_s)[kept]
        return np.asarray(regular_s + np.interp(frame, frame[kept], offset_s))

    def _outline(self, take: TakeEntry) -> Outline:
        (label, present), times_s = self._label(take), self._times_s(take)
        runs, damaged = runs_of(label, times_s), int(self._lost[take.rows].sum())
        return Outline(self._kinds, times_s, present, label, self.facts.labels, runs, damaged)

    def _label(self, take: TakeEntry) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
        """Label of every frame, and where both are known."""
        label = self._part("label", take).astype(np.int16)
        check_labels(label, len(self.facts.labels), f"{self.path}: take {take.key.title}", REMAKE)
        return np.maximum(label, 0), (label != UNKNOWN) & ~self._lost[take.rows]

    def _source(self, key: SourceKey, take: TakeEntry) -> Source:
        lost = self._lost[take.rows]
        (label, present), clock = self._label(take), Timebase(self._times_s(take))
        sensor = VirtualSensor(take.sensor_position_m)
        meta = {"sensor": {"position_m": list(sensor.position_m)}}

        def as_map(name: str, kind: MapKind, unit: str) -> DopplerMap:
            values = self._part(name, take).T
            return DopplerMap(
                values,
                self._axis,
                clock,
                kind,
                unit,
                self.facts.null_bins,
                present=~lost,
                meta=meta,
            )

        maps: dict[MapKind, DopplerMap] = {}
        if {"synthetic", "denoised"} & {*self._kinds}:
            whole = as_map("synthetic", "synthetic", "share of vertices")
            split = {name: self._part(name, take) for name in SPLIT if name in self._arrays}
            own = take.model_copy(update={"start": 0, "stop": len(lost)})
            limbs = limbs_of(self.facts, split, own)
            maps["synthetic"] = replace(whole, limbs=limbs)
        if self._model is not None:
            maps["denoised"] = denoised(maps["synthetic"], self._model, self._texture)
        if self._radar in self._kinds:
            maps[self._radar] = as_map("radar", self._radar, "power")
        labels = self.facts.labels
        return Source(
            *key,
            sensor,
            {kind: replace(maps[kind], present=present) for kind in self._kinds},
            label,
            self.facts.labels,
            dict(zip(labels, gesture_classes(labels), strict=True)),
            None,
            {
                "pairs": self.path.name,
                "take": take.name,
                "simulated": self.facts.of_simulated,
                **self._scene(take),
                **({"damaged_frames": int(lost.sum())} if lost.any() else {}),
            },
        )
