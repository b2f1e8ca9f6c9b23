"""Store of pairs: synthetic Doppler and a radar's Doppler of the same movement.

On disk a Zarr store with all takes one after another along the frames, and beside the
arrays ``takes.jsonl``, one line per take. A take counts once its line is there, so a
writer that is killed leaves whole takes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder, full_disk_named
from sd2core.files.lock import FileLock
from sd2core.files.stores import (
    StoredArray,
    array_in,
    create_array,
    create_group,
    growing,
    open_group,
    put_rows,
)
from sd2core.files.texts import append_lines, drop_torn_line, refuse_change
from sd2core.maps import LimbMaps, joints_of
from sd2core.pairs.rows import check_labels, kept_parts, read_rows, row_kinds
from sd2core.pairs.summary import (
    FORMAT,
    INDEX_NAME,
    REMAKE,
    VERSION,
    PairFacts,
    PairKind,
    TakeEntry,
    TakeKey,
    is_pair_store,
    pair_facts,
    read_takes,
)
from sd2core.sensor import VelocityAxis

LOST = "frames_lost"
"""Entry of the provenance with the frames lost of each take, where chunks are damaged."""
LOCK_NAME = ".sd2-lock"
_ARRAYS = ("synthetic", "radar", "times_s", "label")
SPLIT = ("limbs", "kinematics")
"""Arrays that a store has where its input is split by the parts of the body."""
_CHUNK_FRAMES = 2250


@dataclass(frozen=True, eq=False)
class Take:
    """Uninterrupted part of a movement, seen by one sensor."""

    subject: str
    name: str  # Unique within the subject.
    synthetic: NDArray[np.float32]  # Input: share of vertices per bin, (frames, bins).
    radar: NDArray[np.float32]  # Target, on the same axis, (frames, bins).
    times_s: NDArray[np.float64]  # From the start of the take.
    # Index into :attr:`PairSet.labels` per frame: 0 is background, UNKNOWN what persons differ in.
    label: NDArray[np.int8]
    sensor_position_m: NDArray[np.float64]  # (0, 0, 0) is at the camera.
    placement: int = 0  # 0: the take's own sensor; 1 and up: the same movement from elsewhere.
    limbs: LimbMaps | None = None  # The input split by the parts of the body.

    def __post_init__(self) -> None:
        frames = len(self.times_s)
        if self.synthetic.ndim != 2 or self.synthetic.shape != self.radar.shape:
            raise Sd2Error(
                f"Take {self.title}: synthetic is of shape {self.synthetic.shape}, radar of"
                f" {self.radar.shape}",
                "(frames, bins), both the same",
            )
        if not len(self.synthetic) == len(self.label) == frames > 0:
            raise Sd2Error(
                f"Take {self.title}: {len(self.synthetic)} frames, {len(self.label)} labels,"
                f" {frames} times",
                "the same number, at least one",
            )
        if not (np.isfinite(self.times_s).all() and (np.diff(self.times_s) > 0).all()):
            raise Sd2Error(f"Take {self.title}: its times do not increase", "one after the other")
        values_of = {"synthetic": self.synthetic, "radar": self.radar}
        if self.limbs is not None:
            values_of["limbs"] = self.limbs.values
            if self.limbs.values.shape[1:] != self.synthetic.shape[::-1]:
                raise Sd2Error(
                    f"Take {self.title}: limb maps are of shape {self.limbs.values.shape}",
                    f"(parts, {self.synthetic.shape[1]} bins, {frames} frames)",
                )
        for name, values in values_of.items():
            if not (np.isfinite(values).all() and (values >= 0).all()):
                raise Sd2Error(
                    f"Take {self.title}: {name} holds values that are negative or not finite",
                    "finite values, zero or more",
                )

    @property
    def key(self) -> TakeKey:
        """Key of the take."""
        return TakeKey(self.subject, self.name, self.placement)

    def part(self, frames: slice) -> Take:
        """Part of the take, with the times of its frames."""
        return replace(
            self,
            synthetic=self.synthetic[frames],
            radar=self.radar[frames],
            times_s=self.times_s[frames],
            label=self.label[frames],
            limbs=None if self.limbs is None else self.limbs.of_frames(frames),
        )

    def inputs(self, parts: Sequence[str] = ()) -> NDArray[np.float32]:
        """Input of a model, (frames, bins), or (frames, parts · bins) of limb maps.

        Raises Sd2Error if there are no limb maps, or not of these parts.
        """
        if not parts:
            return self.synthetic
        if self.limbs is None:
            raise Sd2Error(
                f"Take {self.title} is not split by the parts of the body",
                "pairs with limb maps",
                "Make the pairs again with --limbs, or let the model take the map (inputs = map)",
            )
        return self.limbs.inputs(parts)

    @property
    def title(self) -> str:
        """Name for messages."""
        return self.key.title


@dataclass(frozen=True, eq=False)
class PairSet:
    """Takes that share an axis, a frame rate and labels."""

    kind: PairKind
    axis: VelocityAxis
    null_bins: tuple[int, ...]  # Bins set to zero in input and target.
    frame_rate_hz: float
    labels: tuple[str, ...]  # The first is the background.
    takes: tuple[Take, ...]
    provenance: dict[str, Any] = field(default_factory=dict)  # Origin of the set; kept as JSON.

    @property
    def lost_frames(self) -> int:
        """Number of frames that were left out because their chunks are damaged."""
        stores = self.provenance.get("mixed", [self.provenance])
        return sum(sum(one.get(LOST, {}).values()) for one in stores)

    @property
    def has_limbs(self) -> bool:
        """True if every take has limb maps."""
        return all(take.limbs is not None for take in self.takes)

    @property
    def subjects(self) -> tuple[str, ...]:
        """Subjects in the order of their first takes."""
        return tuple(dict.fromkeys(take.subject for take in self.takes))

    @property
    def frames(self) -> int:
        """Number of frames of all takes."""
        return sum(len(take.times_s) for take in self.takes)

    def of(self, subjects: Iterable[str]) -> PairSet:
        """Return the set of takes of these subjects.

        Raises Sd2Error when a subject has no take.
        """
        wanted = tuple(subjects)
        missing = [name for name in wanted if name not in self.subjects]
        if missing:
            raise Sd2Error(
                f"No takes of subject {', '.join(missing)}", f"one of {', '.join(self.subjects)}"
            )
        return replace(self, takes=tuple(take for take in self.takes if take.subject in wanted))

    def placements(self, *, first_only: bool) -> PairSet:
        """Return all takes, or only those seen by the movement's own sensor."""
        if not first_only:
            return self
        return replace(self, takes=tuple(take for take in self.takes if take.placement == 0))


class PairWriter:
    """Writer that appends takes to a new store or to one that was begun.

    ``path`` is the folder of the Zarr store, made when it is not there; what is there already must
    agree with the other arguments, which are those of :class:`PairSet`. With ``parts``, every take
    has limb maps of them. Raises Sd2Error when the
    path holds something else, or pairs of another kind.
    """

    def __init__(
        self,
        path: Path,
        *,
        kind: PairKind,
        axis: VelocityAxis,
        null_bins: Sequence[int],
        frame_rate_hz: float,
        labels: Sequence[str],
        provenance: dict[str, Any],
        parts: Sequence[str] = (),
    ) -> None:
        self._path = Path(path)
        header = {
            "format": FORMAT,
            "version": VERSION,
            "kind": kind,
            "bins": axis.bins,
            "v_max_mps": axis.v_max_mps,
            "null_bins": list(null_bins),
            "frame_rate_hz": float(frame_rate_hz),
            "labels": list(labels),
            "provenance": json.loads(json.dumps(provenance)),
            "parts": list(parts),
            "joints": list(joints_of(parts)),
        }
        if not (self._path / "zarr.json").exists() or _stillborn(self._path):
            _begin(self._path, header)
        self._group = _reopened(self._path, header)
        names = row_kinds(axis.bins, parts, header["joints"])
        self._arrays = {name: growing(self._group, self._path, name) for name in names}
        takes = read_takes(self._path, provenance)
        drop_torn_line(self._path / INDEX_NAME)
        self._done = {take.key: take.rows for take in takes}
        self._frames = max((take.stop for take in takes), default=0)
        self._bytes = self._index_bytes()

    @property
    def done(self) -> Set[TakeKey]:
        """Keys of the takes written so far."""
        return self._done.keys()

    def holds(self, take: Take) -> bool:
        """True if a take is there; Sd2Error if the one that is there was made of something else."""
        rows = self._done.get(take.key)
        if rows is None:
            return False
        for name in _ARRAYS:
            stored = array_in(self._group, self._path, name, "frames")[rows]
            if not np.array_equal(stored, getattr(take, name)):
                raise Sd2Error(
                    f"{self._path} holds the take {take.title} already, made of something else",
                    "the same mesh, radar, clocks and labels as before",
                    "Make the pairs anew, under another name",
                )
        return True

    def append(self, take: Take) -> None:
        """Add one take.

        Raises Sd2Error when it is there already, or of other bins or labels, or another process
        writes takes.
        """
        if take.key in self._done:
            raise Sd2Error(f"{self._path} already holds the take {take.title}", "each take once")
        header = self._group.attrs
        if take.synthetic.shape[1] != header["bins"]:
            raise Sd2Error(
                f"Take {take.title} has {take.synthetic.shape[1]} bins",
                f"{header['bins']}, as {self._path} has",
            )
        check_labels(take.label, len(header["labels"]), f"Take {take.title}")
        parts = () if take.limbs is None else take.limbs.parts
        if list(parts) != header.get("parts", []):
            raise Sd2Error(
                f"Take {take.title} is split into the parts {list(parts)}",
                f"{header.get('parts', [])}, as {self._path} has",
            )
        lock = FileLock(self._path / LOCK_NAME)
        with full_disk_named(self._path):
            alone = lock.take()
            try:
                # It would write over the takes of the other.
                if not alone or self._index_bytes() != self._bytes:
                    raise Sd2Error(
                        f"Another process writes to {self._path}",
                        "one at a time",
                        "Wait until it ends; the same command goes on where it was",
                    )
                self._write(take)
                self._bytes = self._index_bytes()
            finally:
                lock.release(delete=True)

    def _index_bytes(self) -> int:
        index = self._path / INDEX_NAME
        return index.stat().st_size if index.exists() else 0

    def _write(self, take: Take) -> None:
        start, stop = self._frames, self._frames + len(take.times_s)
        written = {name: getattr(take, name) for name in _ARRAYS}
        if take.limbs is not None:
            written["limbs"] = take.limbs.values.transpose(2, 0, 1)
        if "kinematics" in self._arrays:
            if take.limbs is None or take.limbs.kinematics is None:
                raise Sd2Error(f"Take {take.title} has no kinematics", f"some, as {self._path} has")
            written["kinematics"] = take.limbs.kinematics.transpose(2, 0, 1)
        for name, values in written.items():
            # What a killed writer left beyond the last line is written over.
            put_rows(self._arrays[name], start, values)
        x, y, z = (float(value) for value in take.sensor_position_m)
        entry = TakeEntry(**take.key._asdict(), start=start, stop=stop, sensor_position_m=(x, y, z))
        append_lines(self._path / INDEX_NAME, [json.dumps(entry.model_dump()) + "\n"])
        self._done[take.key] = entry.rows
        self._frames = stop


def read_pairs(path: Path) -> PairSet:
    """Read a store of pairs.

    Frames in damaged chunks are left out: a take is read in parts of the same name around them.

    Raises
    ------
    Sd2Error
        When it is none, of a newer version, empty or damaged.
    """
    path = Path(path)
    facts, lazily = open_takes(path)
    arrays, lost = read_rows(lazily, facts.frames)
    lost_in = {take.key.title: int(lost[take.rows].sum()) for take in facts.takes}
    lost_in = {title: frames for title, frames in lost_in.items() if frames}
    kept = [part for take in facts.takes for part in kept_parts(take, lost)]
    if not kept:
        raise Sd2Error(
            f"{path} is damaged: all takes are lost", "chunks as they were written", REMAKE
        )
    split: dict[str, Any] = {}
    split |= {name: arrays.pop(name) for name in SPLIT if name in arrays}
    try:
        takes = tuple(
            Take(
                subject=entry.subject,
                name=entry.name,
                placement=entry.placement,
                sensor_position_m=np.array(entry.sensor_position_m, np.float64),
                limbs=limbs_of(facts, split, entry),
                **{name: array[entry.rows] for name, array in arrays.items()},
            )
            for entry in kept
        )
    except Sd2Error as error:
        raise Sd2Error(f"{path}: {error.found}", error.expected, REMAKE) from error
    for take in takes:
        check_labels(take.label, len(facts.labels), f"{path}: take {take.title}", REMAKE)
    return PairSet(
        kind=facts.kind,
        axis=VelocityAxis(facts.bins, facts.v_max_mps),
        null_bins=facts.null_bins,
        frame_rate_hz=facts.frame_rate_hz,
        labels=facts.labels,
        takes=takes,
        provenance=facts.provenance | ({LOST: lost_in} if lost_in else {}),
    )


def open_takes(path: Path) -> tuple[PairFacts, dict[str, StoredArray]]:
    """Open a store: its description, and arrays not yet read.

    Raises Sd2Error when it holds no pairs, of a newer version, empty or damaged.
    """
    facts = pair_facts(path)
    group = open_group(facts.path)
    arrays: dict[str, StoredArray] = {}
    for name, (row, kind) in row_kinds(facts.bins, facts.parts, facts.joints).items():
        arrays[name] = array_in(group, facts.path, name, "frames")
        _check_array(arrays[name], facts.frames, row, kind)
    return facts, arrays


def limbs_of(facts: PairFacts, arrays: Mapping[str, Any], take: TakeEntry) -> LimbMaps | None:
    """Limb maps of a take of a store; None where it has none."""
    if not facts.parts:
        return None
    limbs, moves = (
        np.asarray(arrays[name][take.rows]).transpose(1, 2, 0) if name in arrays else None
        for name in SPLIT
    )
    assert limbs is not None
    return LimbMaps(facts.parts, limbs, moves)


def _check_array(array: StoredArray, frames: int, row: tuple[int, ...], kind: str) -> None:
    """Refuse an array whose rows are of another shape or type, or that has too few frames."""
    if array.shape[:1] < (frames,):
        raise Sd2Error(
            f"{array.path}: the array {array.name} is missing or shorter than {INDEX_NAME} says",
            f"{frames} frames",
            REMAKE,
        )
    if array.shape[1:] != row or array.dtype != np.dtype(kind):
        raise Sd2Error(
            f"{array.path}: rows of {array.name} are {array.dtype} of shape {array.shape[1:]}",
            f"{kind} of shape {row}",
            REMAKE,
        )


def _stillborn(path: Path) -> bool:
    """True for pairs whose writer ended before it had made all arrays; no take is in them."""
    if not is_pair_store(path) or (path / INDEX_NAME).exists():
        return False
    return not all((path / name / "zarr.json").exists() for name in _ARRAYS)


def _begin(path: Path, header: dict[str, Any]) -> None:
    """Make a store without takes, which takes its name when it is whole."""
    if path.exists() and not is_pair_store(path) and (not path.is_dir() or any(path.iterdir())):
        raise Sd2Error(f"{path} is there and holds no pairs", "a new or empty folder")
    with atomic_folder(path) as folder:
        group = create_group(folder, header)
        for name, (row, kind) in row_kinds(
            header["bins"], header["parts"], header["joints"]
        ).items():
            chunks = (_CHUNK_FRAMES, *row)
            create_array(group, name, shape=(0, *row), dtype=kind, chunks=chunks, fill_value=0)


def _reopened(path: Path, header: dict[str, Any]) -> Any:
    if not is_pair_store(path):
        raise Sd2Error(f"{path} is there and holds no pairs", "a new or empty folder")
    group = open_group(path, "r+")
    attributes = dict(group.attrs)
    # Labels may have been put on it since (:mod:`sd2core.pairs.labelling`).
    attributes["labels"] = attributes.get("labels", [])[: len(header["labels"])]
    for name, value in header.items():
        refuse_change(path, attributes.get(name, []), value, name, "choose another folder")
    return group
