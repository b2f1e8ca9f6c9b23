"""Source of segments: maps of one recording from one sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.imu.signals import InertialSignals
from sd2core.labels.per_frame import BACKGROUND, plain_name
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.options.exporting import KINDS as KINDS
from sd2core.progress import Progress
from sd2core.sensor import Vector, VirtualSensor, spherical_from_position
from sd2core.timebase import Timebase

FROM_A_MESH: tuple[MapKind, ...] = ("synthetic", "denoised")
"""Kinds that say nothing where there is no person; the others are of a radar."""

_LONGEST_LIST = 64
"""Longest list kept in the provenance: a longer one has a number per frame, and is left out."""


class SourceKey(NamedTuple):
    """Key of a source, unique in a data set."""

    subject: str
    recording: str
    placement: int

    @property
    def title(self) -> str:
        """Name for messages."""
        at = f", placement {self.placement}" if self.placement else ""
        return f"{self.recording} of {self.subject}{at}"


class LabelledSpan(NamedTuple):
    """Stretch of a source that has a label, on its clock."""

    start_s: float
    end_s: float  # Exclusive.
    label: int  # Index into the source's labels.


@dataclass(frozen=True, eq=False)
class Outline:
    """Outline of a source before its maps are made, enough to count segments."""

    kinds: tuple[MapKind, ...]  # Kinds of its maps.
    times_s: NDArray[np.float64]
    present: NDArray[np.bool_] | None  # Frames with a person; None: all.
    label: NDArray[np.integer]  # Index into ``labels``, per frame.
    labels: tuple[str, ...]  # The first is :data:`BACKGROUND`.
    spans: tuple[LabelledSpan, ...]
    damaged: int = 0  # Frames lost to damaged chunks of its files.


@dataclass(frozen=True, eq=False)
class Source:
    """Maps of one recording as one sensor sees it, with a label per frame.

    Parameters
    ----------
    recording : str
        Unique within the subject.
    placement : int
        0 for the recording's own sensor; 1 and up are the same movement seen from elsewhere.
    maps : mapping of kind to DopplerMap
        On one axis and one clock. A map's ``present`` is False in frames of which it says
        nothing: in a synthetic or denoised map those without a person, in a radar's map
        those that the radar did not record.
    label : int array, shape (frames,)
        Index into ``labels``, the first of which is :data:`BACKGROUND`.
    classes : mapping of str to str
        Class that a classifier learns for a label; labels that are not learnt from are absent.
    target_m : tuple of 3 floats, optional
        Mean place of the body, from which range and angles of the sensor follow.
    imu : mapping of str to InertialSignals
        Inertial sensors by their places, sampled at the frames of the maps.
    spans : tuple of LabelledSpan, optional
        Labelled stretches, which may overlap; None: the runs of frames with a label.
    provenance : dict
        Origin of the maps, as JSON can hold it, besides what the maps say of themselves.

    Raises
    ------
    Sd2Error
        When these do not fit together.
    """

    subject: str
    recording: str
    placement: int
    sensor: VirtualSensor
    maps: Mapping[MapKind, DopplerMap]
    label: NDArray[np.integer]
    labels: tuple[str, ...] = (BACKGROUND,)
    classes: Mapping[str, str] = field(default_factory=dict)
    target_m: Vector | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    imu: Mapping[str, InertialSignals] = field(default_factory=dict)
    spans: tuple[LabelledSpan, ...] | None = None

    def __post_init__(self) -> None:
        title = self.key.title
        if not self.maps:
            raise Sd2Error(f"{title} has no map", f"one at least of {', '.join(KINDS)}")
        first = next(iter(self.maps.values()))
        for kind, doppler in self.maps.items():
            if doppler.kind != kind:
                raise Sd2Error(f"{title}: the {kind} map is of kind {doppler.kind}", kind)
            if doppler.axis != first.axis:
                raise Sd2Error(
                    f"{title}: the {kind} map has {doppler.axis.words}, the {first.kind} one"
                    f" {first.axis.words}",
                    "one velocity axis",
                )
            if not np.array_equal(doppler.times_s, first.times_s):
                raise Sd2Error(f"{title}: the {kind} map has a clock of its own", "one clock")
            if not np.isfinite(doppler.values).all() or (doppler.values < 0).any():
                raise Sd2Error(
                    f"{title}: the {kind} map holds values that are negative or not finite",
                    "finite values, zero or more",
                )
        for name, signals in self.imu.items():
            if not np.array_equal(signals.times_s, first.times_s):
                raise Sd2Error(f"{title}: the sensor {name} has a clock of its own", "one clock")
        _check_labels(title, self.label, self.labels, len(first.timebase))
        if self.spans is None:
            object.__setattr__(self, "spans", runs_of(self.label, first.times_s))

    @property
    def key(self) -> SourceKey:
        """Key of the source."""
        return SourceKey(self.subject, self.recording, self.placement)

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Times of the frames on the clock of the recording, (frames,)."""
        return next(iter(self.maps.values())).times_s

    @property
    def known(self) -> dict[MapKind, NDArray[np.bool_]]:
        """Frames that each map covers, (frames,)."""
        return {kind: one.present_mask for kind, one in self.maps.items()}

    @property
    def present(self) -> NDArray[np.bool_]:
        """Frames with a person, as far as known, (frames,).

        Maps of a mesh say it. Where there is none, all frames count that a radar recorded.
        """
        known = self.known
        of_mesh = [known[kind] for kind in FROM_A_MESH if kind in known]
        if of_mesh:
            return np.logical_and.reduce(of_mesh)
        return np.logical_or.reduce(list(known.values()))

    @property
    def spherical(self) -> tuple[float, float, float]:
        """Range (m), azimuth and elevation (degrees) of the sensor from the body; or NaN."""
        if self.target_m is None:
            return (float("nan"),) * 3
        return spherical_from_position(self.target_m, self.sensor.position_m)

    def outline(self) -> Outline:
        """Return the outline, without the values."""
        assert self.spans is not None
        return Outline(
            tuple(self.maps), self.times_s, self.present, self.label, self.labels, self.spans
        )

    def made_of(self) -> dict[str, Any]:
        """Return the provenance of the source and its maps, without per-frame values."""
        maps = {
            kind: {"unit": one.unit, "null_bins": list(one.null_bins)} | _short(one.meta)
            for kind, one in self.maps.items()
        }
        if {"synthetic", "denoised"} <= maps.keys():
            maps["denoised"].pop("input", None)  # said of the synthetic map itself
        imu = {name: _short(one.meta) for name, one in self.imu.items()}
        return _short(self.provenance) | {"maps": maps} | ({"imu": imu} if imu else {})


@dataclass(frozen=True, eq=False)
class LazySource:
    """Source that is made only when it is needed.

    ``load`` makes the source; it may raise ``Sd2Error``, which leaves out this source alone.
    ``fingerprint`` gives a hash of everything that the source is made of and of the settings, and
    may read files and raise ``Sd2Error``; a data set that holds a source of this key and of another
    fingerprint is not continued. ``outline`` foretells the content cheaply; needed for a dry run.
    ``remarks`` say what of its files is taken and what not.
    """

    key: SourceKey
    load: Callable[[Progress], Source]
    fingerprint: Callable[[], str]
    outline: Callable[[], Outline] | None = None
    remarks: tuple[str, ...] = ()


def labelled_spans(labels: Labels, names: tuple[str, ...]) -> tuple[LabelledSpan, ...]:
    """Return all spans but suggestions, with their labels as indices."""
    return tuple(
        LabelledSpan(span.start_s, span.end_s, names.index(plain_name(span.label)))
        for span in labels.decided
    )


def runs_of(label: NDArray[np.integer], times_s: NDArray[np.float64]) -> tuple[LabelledSpan, ...]:
    """Return the runs of frames with a label other than background."""
    edges = np.flatnonzero(np.diff(label, prepend=0, append=0))
    ends_s = np.append(times_s, Timebase(times_s).end_s)
    return tuple(
        LabelledSpan(float(times_s[start]), float(ends_s[stop]), int(label[start]))
        for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        if label[start]
    )


def _check_labels(
    title: str, label: NDArray[np.integer], labels: tuple[str, ...], frames: int
) -> None:
    if not labels or labels[0] != BACKGROUND or len(set(labels)) < len(labels):
        raise Sd2Error(
            f"{title}: the labels are {', '.join(labels) or 'none'}",
            f"{BACKGROUND} first, and each once",
        )
    if label.shape != (frames,) or label.dtype.kind not in "iu":
        raise Sd2Error(
            f"{title}: {frames} frames, labels of shape {label.shape} and type {label.dtype}",
            "a whole number per frame",
        )
    if frames and not 0 <= label.min() <= label.max() < len(labels):
        raise Sd2Error(
            f"{title}: labels from {label.min()} to {label.max()}", f"0 to {len(labels) - 1}"
        )


def _short(value: Any) -> Any:
    if isinstance(value, Mapping):
        short = {str(name): _short(inner) for name, inner in value.items()}
        return {name: inner for name, inner in short.items() if inner is not None}
    if isinstance(value, list | tuple):
        return None if len(value) > _LONGEST_LIST else [_short(inner) for inner in value]
    return value


def each_once(sources: Iterable[LazySource]) -> list[LazySource]:
    """Return all sources; Sd2Error for two of one key, which nothing would tell apart."""
    listed, seen = [*sources], set[SourceKey]()
    for one in listed:
        if one.key in seen:
            raise Sd2Error(
                f"Two sources are {one.key.title}",
                "subject, recording and placement once",
                "Say whom each shows, as by --subjects anna,ben, or rename one of the files",
            )
        seen.add(one.key)
    return listed
