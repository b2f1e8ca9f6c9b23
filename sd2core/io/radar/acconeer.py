"""Recordings of Acconeer's A121, a pulsed radar at 60.5 GHz, by its exploration tool.

An HDF5 file holds sessions, in them groups and entries, one entry per sensor::

    generation                                   "a121"
    sessions/session_0/session_config            JSON: groups of sensors and their configuration
    sessions/session_0/group_0/entry_0/metadata  JSON: length of a step, highest sweep rate
    sessions/session_0/group_0/entry_0/sensor_id
    …/entry_0/result/frame                       int16 real and imag, (frames, sweeps, points)
    …/entry_0/result/tick                        time of every frame, in ticks of the server

Recordings of 2022 (version 5 of the tool) have one group ``session`` in place of
``sessions/session_0``. Every point is at a distance of its own: there is no range to be formed.
Sweeps are slow time; with one sweep per frame, the frames are.
Layout, carrier and widths of the pulses are those of Acconeer's exploration tool
(github.com/acconeer/acconeer-python-exploration, ``a121/algo/_utils.py``).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, open_hdf5_file, refusing_damage, text_of
from sd2core.files.texts import errors_in, faults_in, parse_json
from sd2core.io.radar.capture import LazySamples, RadarCapture
from sd2core.radar_config import SPEED_OF_LIGHT_MPS, RadarConfig
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    import h5py

CARRIER_HZ = 60.5e9
"""Carrier of the A121 (``RADIO_FREQUENCY`` of the exploration tool)."""
PULSE_WIDTHS_M = {1: 0.04, 2: 0.07, 3: 0.14, 4: 0.19, 5: 0.32}
"""Width of a profile's envelope at half its height (``ENVELOPE_FWHM_M``)."""

_JOINED = 32
"""Frames of one sweep that are taken as one."""
_EXPECTED = "a complete recording of the A121 by Acconeer's exploration tool (.h5)"
_PARTS = np.dtype([("real", "<i2"), ("imag", "<i2")])
_FULL = np.float32(32768.0)
Model = TypeVar("Model", bound=BaseModel)


class _Subsweep(BaseModel):
    """Equally spaced points of one profile; other keys are left alone."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    start_point: int = Field(ge=-(10**6), le=10**6)
    num_points: int = Field(ge=1, le=10**5)
    step_length: int = Field(ge=1, le=10**5)
    profile: str = Field(pattern=r"^PROFILE_[1-5]$")


class _Sensor(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    sweeps_per_frame: int = Field(ge=1)
    sweep_rate: float | None = Field(default=None, gt=0)
    frame_rate: float | None = Field(default=None, gt=0)
    subsweeps: list[_Subsweep] = Field(min_length=1)


class _Session(BaseModel):
    groups: list[dict[str, _Sensor]] = Field(min_length=1)


class _Metadata(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    base_step_length_m: float = Field(gt=0, lt=1)
    max_sweep_rate: float | None = Field(default=None, gt=0)


class _Server(BaseModel):
    ticks_per_second: float = Field(default=0.0, ge=0, allow_inf_nan=False)


def is_acconeer(file: h5py.File) -> bool:
    """True if an open HDF5 file looks like a recording of the exploration tool."""
    return "generation" in file and ("sessions" in file or "session" in file)


def a111_service(file: h5py.File, path: Path) -> str:
    """Service of an A111 that an open HDF5 file was recorded with; empty if it is none."""
    if "sensor_config_dump" not in file or "data" not in file:
        return ""
    try:
        return _text(file, path, "mode").strip().lower() or "unknown"
    except Sd2Error:
        return "unknown"


def refuse_a111(path: Path) -> RadarCapture:
    """Raise Sd2Error that names a recording of an A111, and says what can be done with it."""
    with open_hdf5_file(path, _EXPECTED) as file:
        service = a111_service(file, path)
    way = (
        f"Describe it: sd2 radar describe {path.name} --dataset data --axes chirp,receiver,sample"
        if service == "iq"
        else "Real values do not tell approaching from receding: record with its IQ service, or"
        " with an A121"
    )
    raise Sd2Error(
        f"{path} is a recording of Acconeer's A111, the older sensor, with its service {service}",
        "a recording of the A121",
        way,
    )


def load_acconeer(path: Path) -> RadarCapture:
    """Open a recording; frames are read as they are needed.

    Taken is the first entry of the first group of the first session, with all subsweeps; notes
    say what else there is. Raises Sd2Error if the file is damaged, of another sensor, or
    contradicts itself.
    """
    with open_hdf5_file(path, _EXPECTED) as file, refusing_damage(path, _EXPECTED):
        return _read(file, path)


def a121_radar(
    ranges_m: tuple[float, ...], width_m: float, sweeps: int, sweep_s: float, frame_s: float
) -> RadarConfig:
    """Radar that an A121 is with some settings.

    Parameters
    ----------
    ranges_m : tuple of float
        Distances of its points.
    width_m : float
        Width of its pulse, of :data:`PULSE_WIDTHS_M`.
    sweeps : int
        Sweeps of a frame.
    sweep_s, frame_s : float
        Between two sweeps, and two frames.
    """
    half_hz = 0.25 * SPEED_OF_LIGHT_MPS / width_m
    return RadarConfig(
        start_frequency_hz=CARRIER_HZ - half_hz,
        end_frequency_hz=CARRIER_HZ + half_hz,
        samples_per_chirp=len(ranges_m),
        chirps_per_frame=sweeps,
        chirp_repetition_s=sweep_s,
        # Ticks are rounded.
        frame_repetition_s=max(frame_s, sweeps * sweep_s),
        sample_rate_hz=len(ranges_m) / sweep_s,
        adc_bits=16,
        name="Acconeer A121, 60.5 GHz",
        sampling="complex",
        ranges_m=ranges_m,
    )


def _read(file: h5py.File, path: Path) -> RadarCapture:
    generation = _text(file, path, "generation")
    if generation != "a121":
        raise Sd2Error(f"{path} is of the sensor generation {generation!r:.40}", "a121")
    session, sessions = "session", 1
    if "sessions" in file:
        session, sessions = _first(file, path, "sessions", "session_")
    group, groups = _first(file, path, session, "group_")
    entry, entries = _first(file, path, group, "entry_")
    planned = _parsed(_Session, file, path, f"{session}/session_config")
    metadata = _parsed(_Metadata, file, path, f"{entry}/metadata")
    sensor_id = str(int(_array(file, path, f"{entry}/sensor_id", "iu", 0)[()]))
    if sensor_id not in planned.groups[0]:
        raise Sd2Error(
            f"{path}: session_config has no sensor {sensor_id} in its first group",
            f"one of {', '.join(planned.groups[0])}",
        )
    sensor = planned.groups[0][sensor_id]
    frames = _array(file, path, f"{entry}/result/frame", "V", 3)
    if frames.dtype != _PARTS or frames.shape[0] == 0:
        raise Sd2Error(
            f"{path}: result/frame is {frames.dtype} of shape {frames.shape}",
            "int16 real and imag, (frames, sweeps, points)",
        )
    ranges_m = (
        np.concatenate(
            [
                one.start_point + one.step_length * np.arange(one.num_points)
                for one in sensor.subsweeps
            ]
        )
        * metadata.base_step_length_m
    )
    shape = (len(frames), 1, sensor.sweeps_per_frame, len(ranges_m))
    if frames.shape != (shape[0], *shape[2:]):
        raise Sd2Error(
            f"{path}: result/frame has shape {frames.shape}",
            f"(frames, {shape[2]} sweeps, {shape[3]} points), as session_config says",
        )
    others = (("session", sessions), ("group", groups), ("sensor", entries))
    notes = [
        "Assumed: the phase grows with the distance, as in the exploration tool; walk towards the"
        " sensor to check.",
        *(f"The first of {count} {name}s is taken." for name, count in others if count > 1),
    ]
    if len(sensor.subsweeps) > 1:
        notes.append(
            f"All {len(sensor.subsweeps)} subsweeps are taken as they are, with their own gains."
        )
    joined = 1  # frames of the file that make one
    if sensor.sweeps_per_frame == 1:
        joined = min(_JOINED, len(frames))
        sweep_s = 0.0
    else:
        sweep_s = _sweep_s(sensor, metadata, path, notes)
    timebase, frame_s = _clock(file, path, entry, sensor, sweep_s, shape[0], notes)
    saturated = _flags(file, path, f"{entry}/result/data_saturated", shape[0])
    if saturated:
        notes.append(f"The sensor was saturated in {saturated} of {shape[0]} frames.")
    if sensor.sweeps_per_frame == 1:
        notes.append(
            f"Frames have one sweep: {joined} are taken as one, their sweeps {1e3 * frame_s:.3g} ms"
            " apart."
        )
        if left := shape[0] % joined:
            notes.append(f"The last {left} frames of one sweep fill no other, and are left out.")
        sweep_s, frame_s = frame_s, joined * frame_s
        shape = (len(frames) // joined, 1, joined, len(ranges_m))
        timebase = Timebase(timebase.times_s[::joined][: shape[0]])
    width_m = max(PULSE_WIDTHS_M[int(one.profile[-1])] for one in sensor.subsweeps)
    with errors_in(path):
        config = a121_radar(tuple(ranges_m.tolist()), width_m, shape[2], sweep_s, frame_s)
    place = f"{entry}/result/frame"

    def read(some: slice) -> NDArray[Any]:
        with open_hdf5_file(path, _EXPECTED) as again, refusing_damage(path, _EXPECTED):
            start, stop, _ = some.indices(shape[0])
            parts = again[place][start * joined : stop * joined].reshape(-1, *shape[2:])
        signal = np.empty((len(parts), 1, *shape[2:]), np.complex64)
        signal.real[:, 0], signal.imag[:, 0] = parts["real"], parts["imag"]
        signal /= _FULL
        return signal

    return RadarCapture(
        samples=LazySamples(shape, np.dtype(np.complex64), read),
        config=config,
        timebase=timebase,
        source=str(path),
        notes=tuple(notes),
        meta={"format": "Acconeer A121", "sensor": sensor_id, **sensor.model_dump()},
        full_scale_known=False,
    )


def _sweep_s(sensor: _Sensor, metadata: _Metadata, path: Path, notes: list[str]) -> float:
    """Time between sweeps."""
    if sensor.sweep_rate is not None:
        return 1.0 / sensor.sweep_rate
    if metadata.max_sweep_rate is None:
        raise Sd2Error(f"{path} states no sweep rate", "sweep_rate, or max_sweep_rate")
    notes.append(
        "No sweep rate is set; sweeps are taken to follow at the highest of the configuration,"
        f" {metadata.max_sweep_rate:.1f} Hz, as the sensor does then."
    )
    return 1.0 / metadata.max_sweep_rate


def _clock(
    file: h5py.File,
    path: Path,
    entry: str,
    sensor: _Sensor,
    sweep_s: float,
    frames: int,
    notes: list[str],
) -> tuple[Timebase, float]:
    """Times of the frames by the server's ticks, or by the stated rate; time between frames."""
    stated_s = None if sensor.frame_rate is None else 1.0 / sensor.frame_rate
    frame_s = stated_s or sensor.sweeps_per_frame * sweep_s
    server = _parsed(_Server, file, path, "server_info")
    ticks = _array(file, path, f"{entry}/result/tick", "iu", 1)
    if len(ticks) != frames:
        raise Sd2Error(f"{path} has {len(ticks)} ticks for {frames} frames", "one per frame")
    steps = np.diff(ticks[...].astype(np.float64))
    if server.ticks_per_second > 0 and frames > 1 and (steps > 0).all() and (steps < 1e15).all():
        clock = Timebase(np.append(0.0, np.cumsum(steps)) / server.ticks_per_second)
        if stated_s is None:
            frame_s = clock.frame_duration_s
            notes.append(
                f"No frame rate is set; by the ticks a frame comes every {1e3 * frame_s:.1f} ms."
            )
        return clock, frame_s
    if frame_s == 0.0:
        raise Sd2Error(f"{path} has one sweep per frame, and no rate of frames", "frame_rate")
    if frames > 1:
        why = "do not increase" if server.ticks_per_second > 0 else "have no length"
        notes.append(f"The ticks {why}: frames are placed every {1e3 * frame_s:g} ms.")
    return Timebase(np.arange(frames) * frame_s), frame_s


def _first(file: h5py.File, path: Path, place: str, prefix: str) -> tuple[str, int]:
    """Path of the first of numbered groups, and how many there are."""
    import h5py

    group = member_of(file, path, place)
    if not isinstance(group, h5py.Group):
        raise Sd2Error(f"{path} has no group {place}", _EXPECTED)
    names = [name for name in group if name.startswith(prefix)]
    if f"{prefix}0" not in names:
        raise Sd2Error(f"{path} has no {prefix}0 in {place}", _EXPECTED)
    return f"{place}/{prefix}0", len(names)


def _array(file: h5py.File, path: Path, place: str, kinds: str, dimensions: int) -> h5py.Dataset:
    import h5py

    member = member_of(file, path, place)
    if not isinstance(member, h5py.Dataset) or member.shape is None:
        raise Sd2Error(f"{path} has no array {place}", _EXPECTED)
    if member.dtype.kind not in kinds or len(member.shape) != dimensions:
        raise Sd2Error(
            f"{path}: {place} is {member.dtype} of shape {member.shape}",
            f"an array of {dimensions} dimensions",
        )
    return member


def _flags(file: h5py.File, path: Path, place: str, frames: int) -> int:
    """Number of frames that are flagged; 0 where the file does not say."""
    flags = member_of(file, path, place)
    if flags is None or getattr(flags, "shape", None) != (frames,):
        return 0
    return int(np.count_nonzero(flags[...]))


def _text(file: h5py.File, path: Path, place: str) -> str:
    return text_of(_array(file, path, place, "OS", 0), path, place)


def _parsed(model: type[Model], file: h5py.File, path: Path, place: str) -> Model:
    where = f"{place} of {path}"
    with faults_in(where, _EXPECTED):
        return model.model_validate(parse_json(_text(file, path, place), where, _EXPECTED))
