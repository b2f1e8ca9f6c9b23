"""Sources from pairs: synthetic Doppler beside a radar's, take by take, read as needed."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.denoising import Denoising
from sd2core.datasets.source import KINDS, LazySource, Outline, Source, SourceKey
from sd2core.denoise.files import DEFAULT_NAME, find_model
from sd2core.files.digests import cached_digest
from sd2core.labels.label_set import GESTURES
from sd2core.maps import DopplerMap, MapKind
from sd2core.pairs.store import open_takes
from sd2core.progress import Progress
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase


def pair_sources(
    paths: Sequence[Path], kinds: tuple[MapKind, ...] = KINDS, model: str | None = None
) -> list[LazySource]:
    """One source per take; values are read when it is its turn.

    Subjects of the same name in different stores are different people: they are then called
    ``STORE:NAME``.

    Parameters
    ----------
    paths : sequence of Path
    kinds : tuple of str
        Wanted. Denoised maps are made from the synthetic ones.
    model : str, optional
        Denoiser, by file or name; None: the bundled one.

    Raises
    ------
    Sd2Error
        When a path holds no pairs, or the model does not exist.
    """
    stores = [_Store(path, kinds, model) for path in paths]
    people = Counter(name for one in stores for name in {take["subject"] for take in one.takes})
    return [
        one.lazy(number, f"{one.path.stem}:{name}" if people[name] > 1 else name)
        for one in stores
        for number, name in enumerate(take["subject"] for take in one.takes)
    ]


_ROWS = ("synthetic", "radar", "times_s", "label")


class _Store:
    def __init__(self, path: Path, kinds: tuple[MapKind, ...], model: str | None) -> None:
        self.path = path
        self._header, self.takes, self._arrays = open_takes(path)
        radar: MapKind = self._header["kind"]
        self._radar = radar
        self._kinds = tuple(
            kind for kind in ("synthetic", "denoised", radar) if kind in kinds
        )  # fmt: skip
        self._axis = VelocityAxis(int(self._header["bins"]), float(self._header["v_max_mps"]))
        self._null_bins = tuple(self._header["null_bins"])
        self._labels = tuple(self._header["labels"])
        self._model = find_model(model or DEFAULT_NAME) if "denoised" in self._kinds else None
        self._denoising = Denoising()

    def lazy(self, number: int, subject: str) -> LazySource:
        take = self.takes[number]
        key = SourceKey(subject, take["name"], take["placement"])
        return LazySource(
            key,
            lambda progress: self._source(key, take, progress),
            lambda: self._fingerprint(take),
            lambda: self._outline(take),
        )

    def _fingerprint(self, take: dict[str, Any]) -> str:
        """Of the take's own rows: a store may grow."""
        model = "" if self._model is None else cached_digest(self._model)
        told = {name: value for name, value in take.items() if name not in ("start", "stop")}
        sums = hashlib.blake2b(
            json.dumps([told, self._header["kind"], self._kinds, model]).encode(), digest_size=16
        )
        for name in _ROWS:
            sums.update(np.ascontiguousarray(self._part(name, take)).data)
        return sums.hexdigest()

    def _part(self, name: str, take: dict[str, Any]) -> Any:
        return np.asarray(self._arrays[name][take["start"] : take["stop"]])

    def _outline(self, take: dict[str, Any]) -> Outline:
        label = self._part("label", take)
        return Outline(self._kinds, self._part("times_s", take), None, label, self._labels)

    def _source(self, key: SourceKey, take: dict[str, Any], progress: Progress) -> Source:
        clock = Timebase(self._part("times_s", take))
        sensor = VirtualSensor(tuple(take["sensor_position_m"]))
        meta = {"sensor": {"position_m": list(sensor.position_m)}}

        def as_map(name: str, kind: MapKind, unit: str) -> DopplerMap:
            values = self._part(name, take).T
            return DopplerMap(values, self._axis, clock, kind, unit, self._null_bins, meta=meta)

        maps: dict[MapKind, DopplerMap] = {}
        if {"synthetic", "denoised"} & {*self._kinds}:
            maps["synthetic"] = as_map("synthetic", "synthetic", "share of vertices")
        if self._model is not None:
            maps["denoised"] = self._denoising.denoised(maps["synthetic"], self._model)
        if self._radar in self._kinds:
            maps[self._radar] = as_map("radar", self._radar, "power")
        known = {one.name: one.gesture_class for one in GESTURES.labels}
        return Source(
            key.subject,
            key.recording,
            key.placement,
            sensor,
            {kind: maps[kind] for kind in self._kinds},
            self._part("label", take).astype(np.int16),
            self._labels,
            {name: known[name] for name in self._labels if known.get(name)},
            None,
            {"pairs": self.path.name, "take": take["name"]},
        )
