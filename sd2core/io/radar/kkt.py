"""Gesture recordings of KaiKuTek's 60 GHz sensor (K60168A): range-Doppler maps with labels.

An HDF5 file holds one short recording::

    DS1          float16 (2, 32 ranges, 32 Doppler bins, frames); map 0 is range-Doppler
    LABEL        integers (frames, 1): 1 while the gesture lasts, 0 otherwise
    DATA_CONFIG  attributes; Gesture_name is the class of what is labelled
    FRAME_COUNT  optional, uint16 (frames, 2): the sensor's counter, which wraps around

The layout was read off the recordings of github.com/ShengKai1020/Radar_Gesture_Predict;
the maker publishes none. There are no units in such a file, so what a velocity and a time
are is assumed here, and said in the notes (docs/formats.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, open_hdf5_file, refusing_damage
from sd2core.files.limits import check_there
from sd2core.labels.label_set import LONGEST_NAME, Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import runs
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    import h5py

FRAME_S = 0.035
"""Between frames. No file says it: counters and dates of four sessions give 28.6 frames/s."""
BIN_WIDTH_MPS = 0.125
"""Assumed for a Doppler bin, so that a map looks as wide as others do; nothing is known."""
TRACK = "Radar file"
"""Name of the track that the file's labels stand on."""

_RANGES = _DOPPLERS = 32
_MAX_FRAMES = 100_000
_COUNTER = 2**16
_GROUP, _NAME = "DATA_CONFIG", "Gesture_name"
_EXPECTED = "DS1 and LABEL, as in a gesture recording of a K60168A"
_COLOUR = "#009e73"


@dataclass(frozen=True, eq=False)
class RecordedMap:
    """A recording that holds maps and labels, and no raw samples."""

    doppler: DopplerMap  # of kind "real"; its clock begins at 0 s
    labels: Labels  # of the file, of origin "import"; perhaps none
    gesture: str  # class of the labels, as the file calls it
    source: str  # for provenance
    notes: tuple[str, ...]  # assumptions, and oddities of the file

    @property
    def timebase(self) -> Timebase:
        """One time per frame."""
        return self.doppler.timebase


def load_kkt(path: Path | str) -> RecordedMap:
    """Read a recording.

    The map's value is map 0 squared and summed over range. Doppler bin 0, whose sign is
    ambiguous, is left out: 31 bins remain, with zero velocity in the middle of the
    middle one. Bins are turned so that approaching is positive. Raises Sd2Error if the file is no
    HDF5, is damaged or cut off, holds something else, or values that no such recording has.
    """
    path = Path(path)
    expected = "a complete gesture recording (.h5)"
    check_there(path, expected)
    with open_hdf5_file(path, expected) as file, refusing_damage(path, expected):
        values = _values(file, path)  # (ranges, Dopplers, T)
        marks = _marks(file, path, values.shape[2])  # (T,)
        counts = _counts(file, path, values.shape[2])  # (T,) or None
        attributes = _attributes(file, path)
    timebase, notes = _clock(counts, values.shape[2])
    gesture = attributes.get(_NAME, "")
    if not (gesture.strip() and gesture.isprintable() and len(gesture) <= LONGEST_NAME):
        gesture = "gesture"
        notes += (f"The file does not name its gesture; its labels are called {gesture!r}.",)
    notes = (
        "The file has no units. Assumed are"
        f" {1 / FRAME_S:.1f} frames/s (what counters and dates of such files give) and"
        f" {BIN_WIDTH_MPS:g} m/s per Doppler bin (nothing is known); values are those of the"
        " sensor, squared and summed over range.",
        *notes,
    )
    doppler = DopplerMap(
        values=_over_ranges(values),
        axis=VelocityAxis(_DOPPLERS - 1, (_DOPPLERS - 1) * BIN_WIDTH_MPS / 2),
        timebase=timebase,
        kind="real",
        unit="(sensor's own unit)²",
        meta={
            "source": path.name,
            "format": "K60168A gesture recording",
            "velocity_assumed": True,
            "frame_rate_assumed": True,
            "recorded_by": attributes,
            "notes": list(notes),
        },
    )
    return RecordedMap(
        doppler=doppler,
        labels=_labels(marks, timebase, gesture),
        gesture=gesture,
        source=str(path),
        notes=notes,
    )


def _over_ranges(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Power over velocity, ascending, positive when approaching: (31, T).

    In the recordings that the layout was read off, echoes above the middle bin move to
    higher range indices. Those are taken to be farther away, so such an echo recedes.
    """
    power = np.zeros(values.shape[1:])
    for at_range in values:  # One after the other: an hour of all of them takes a gigabyte.
        power += np.square(at_range.astype(np.float64))
    return power[:0:-1].astype(np.float32)


def _labels(marks: NDArray[np.bool_], timebase: Timebase, gesture: str) -> Labels:
    spans = tuple(
        Span(
            id=number,
            track=TRACK,
            start_s=float(timebase.edges_s[start]),
            end_s=float(timebase.edges_s[stop]),
            label=gesture,
            origin="import",
        )
        for number, (start, stop) in enumerate(runs(marks), start=1)
    )
    label_set = LabelSet(TRACK, (Label(gesture, _COLOUR, gesture_class=gesture),))
    return Labels((LabelTrack(TRACK),), spans, label_set)


def _clock(counts: NDArray[np.int64] | None, frames: int) -> tuple[Timebase, tuple[str, ...]]:
    """Times from 0 s on by the sensor's counter, or evenly spaced where it does not count."""
    regular = np.arange(frames)
    if counts is None:
        return Timebase(regular * FRAME_S), ()
    steps = np.diff(counts) % _COUNTER
    # Half a turn forward is a step back.
    if ((steps < 1) | (steps >= _COUNTER // 2)).any():
        note = "The frame counter does not count up; frames are placed evenly."
        return Timebase(regular * FRAME_S), (note,)
    numbers = np.concatenate([[0], np.cumsum(steps)])
    lost = int(numbers[-1]) - (frames - 1)
    notes = (f"The frame counter leaves out {lost} frames; there is a gap for them.",)
    return Timebase(numbers * FRAME_S), notes if lost else ()


def _values(file: h5py.File, path: Path) -> NDArray[np.floating]:
    dataset = _dataset(file, path, "DS1")
    shape = dataset.shape
    fits = len(shape) == 4 and shape[:3] == (2, _RANGES, _DOPPLERS) and shape[3] > 0
    if not fits or dataset.dtype.kind != "f":
        raise Sd2Error(
            f"DS1 of {path} is {dataset.dtype} of shape {shape}",
            f"floating-point numbers, (2, {_RANGES} ranges, {_DOPPLERS} Doppler bins, frames)",
            "Other sensors' recordings cannot be read",
        )
    if shape[3] > _MAX_FRAMES:
        raise Sd2Error(
            f"DS1 of {path} has {shape[3]:,} frames", f"up to {_MAX_FRAMES:,}, about an hour"
        )
    values: NDArray[np.floating] = dataset[0]
    good = np.isfinite(values) & (values >= 0)
    if not good.all():
        at_range, at_doppler, frame = np.argwhere(~good)[0]
        raise Sd2Error(
            f"DS1 of {path} holds {values[at_range, at_doppler, frame]:g} in frame {frame}"
            f" (range {at_range}, Doppler bin {at_doppler})",
            "finite values from 0 on",
        )
    return values


def _marks(file: h5py.File, path: Path, frames: int) -> NDArray[np.bool_]:
    dataset = _dataset(file, path, "LABEL")
    if dataset.dtype.kind not in "iub" or dataset.shape not in ((frames, 1), (frames,)):
        raise Sd2Error(
            f"LABEL of {path} is {dataset.dtype} of shape {dataset.shape}, DS1 has {frames} frames",
            f"integers of shape ({frames}, 1)",
        )
    marks = np.asarray(dataset[...]).reshape(frames)
    bad = np.flatnonzero((marks != 0) & (marks != 1))
    if bad.size:
        raise Sd2Error(f"LABEL of {path} is {marks[bad[0]]} in frame {bad[0]}", "0 or 1")
    return marks.astype(np.bool_)


def _counts(file: h5py.File, path: Path, frames: int) -> NDArray[np.int64] | None:
    """Frame counter of the sensor, (T,); None if there is none that fits."""
    dataset = member_of(file, path, "FRAME_COUNT")
    if dataset is None or dataset.dtype.kind not in "iu" or dataset.shape != (frames, 2):
        return None
    return np.asarray(dataset[:, 0], dtype=np.int64)


def _dataset(file: h5py.File, path: Path, name: str) -> h5py.Dataset:
    """An array that must be there."""
    import h5py

    member = member_of(file, path, name)
    if member is None:
        holds = ", ".join(sorted(map(str, file.keys()))[:6]) or "nothing"
        raise Sd2Error(
            f"{path} has no {name}; it holds {holds}",
            _EXPECTED,
            f"Samples of your own need a description: sd2 radar describe {path.name}",
        )
    if not isinstance(member, h5py.Dataset) or member.shape is None:
        raise Sd2Error(f"{name} of {path} is no array", _EXPECTED)
    return member


def _attributes(file: h5py.File, path: Path) -> dict[str, str]:
    """Notes of the recorder as text, but for ``Description``, which is the same in all files."""
    group = member_of(file, path, _GROUP)
    if group is None:
        return {}
    names = (_NAME, "Datatime", "Device", "FW_version", "Hand_type", "Mode")
    return {name: _text(group.attrs[name]) for name in names if name in group.attrs}


def _text(value: Any) -> str:
    """An attribute, or the first of an array of them, as one line."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text.strip()
