"""Recording folders of Infineon's 60 GHz radars (BGT60 family), read and written.

A recording is a folder, usually called ``RadarIfxAvian_00``::

    radar.npy            uint16 (frames, receivers, chirps, samples); of transmitters in turns,
                         their chirps one after the other, or as many channels as pairs
    config.json          device_config.fmcw_single_shape
    radar_timestamp.csv  one unix time per frame, as the host received it
    meta.json            optional: adc_resolution, description; "simulated": true
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AliasPath, BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder, atomic_write, atomic_write_json, atomic_write_text
from sd2core.files.limits import open_regular
from sd2core.files.texts import errors_in, faults_in, lines_of, read_json
from sd2core.io.radar.capture import LazySamples, RadarCapture, Samples, by_transmitter, check_cube
from sd2core.io.radar.stored_arrays import stored_npy
from sd2core.radar_config import RadarConfig
from sd2core.timebase import Timebase

ADC_BITS = 12
"""Resolution of every converter of this family, used when meta.json is silent."""

_DATA, _CONFIG, _TIMES, _META = "radar.npy", "config.json", "radar_timestamp.csv", "meta.json"
INFINEON_FILES = (_CONFIG, _TIMES, _META)
"""What lies beside the samples."""
Model = TypeVar("Model", bound=BaseModel)
_FIRST_PLAUSIBLE_UNIX_S = 1e8
"""Smaller start times are seconds since the start, not a date."""
_LAST_PLAUSIBLE_UNIX_S = 1e11
"""Larger ones are not in seconds."""
_LARGEST_TIME_S = 1e15
"""What is larger, or infinite, is no time in any unit."""
_FAR_TOO_SLOW = 100
"""Typical steps of this many frame repetition times are no pauses: the unit is another."""


class _Shape(BaseModel):
    """``device_config.fmcw_single_shape`` of config.json; other keys are left alone."""

    rx_antennas: list[int] = Field(min_length=1)
    tx_antennas: list[int] = Field(default=[1])
    mimo_mode: str | None = "off"
    start_frequency_Hz: float = Field(gt=0)
    end_frequency_Hz: float = Field(gt=0)
    num_chirps_per_frame: int = Field(ge=2)
    num_samples_per_chirp: int = Field(ge=2)
    chirp_repetition_time_s: float = Field(gt=0)
    frame_repetition_time_s: float = Field(gt=0)
    sample_rate_Hz: float = Field(gt=0)


class _Config(BaseModel):
    shape: _Shape = Field(validation_alias=AliasPath("device_config", "fmcw_single_shape"))


class _Meta(BaseModel):
    model_config = ConfigDict(extra="allow")

    adc_resolution: int = Field(default=ADC_BITS, ge=1, le=16)
    description: str = "Infineon radar"
    simulated: bool = False


def find_recording(path: Path) -> Path | None:
    """Find the folder with ``radar.npy`` in or at a path, or None; Sd2Error for several."""
    if path.is_file():
        return path.parent if path.name == _DATA else None
    if (path / _DATA).is_file():
        return path
    inside = sorted(entry.parent for entry in path.glob(f"[!.]*/{_DATA}"))
    if len(inside) > 1:
        names = ", ".join(folder.name for folder in inside)
        raise Sd2Error(
            f"{path} holds {len(inside)} radar recordings ({names})",
            "one recording",
            "Name the one to open",
        )
    if inside:
        return inside[0]
    return path if (path / _CONFIG).is_file() and (path / _TIMES).is_file() else None


def load_infineon(path: Path) -> RadarCapture:
    """Read the recording that :func:`find_recording` finds; the samples are mapped, not loaded.

    Raises Sd2Error if a file is missing or damaged, or the files contradict each other.
    """
    folder = find_recording(path) or path
    meta = _read_meta(folder / _META)
    config = _read_config(folder / _CONFIG, meta)
    _check_exists(folder / _DATA)
    expected = "the whole radar.npy as recorded, uint16 (frames, receivers, chirps, samples)"
    stored = stored_npy(folder / _DATA, expected)
    counts = LazySamples(stored.shape, stored.dtype, lambda some: stored.read((some,)))
    samples, config, about_turns = _in_turns(counts, config, folder)
    check_cube(samples, config, str(folder / _DATA))
    timebase, start_unix_s, notes = _read_times(folder / _TIMES, samples.shape[0], config)
    capture = RadarCapture(
        samples=samples,
        config=config,
        timebase=timebase,
        start_unix_s=start_unix_s,
        simulated=meta.simulated,
        source=str(folder / _DATA),
        notes=(*about_turns, *notes),
        meta=meta.model_dump(),
    )
    capture.read(0, 1)  # refuses counts beyond the converter
    return capture


def read_radar_config(path: Path) -> RadarConfig:
    """Read the radar of a config.json, and of the meta.json beside it where there is one.

    Raises Sd2Error if the file is missing, damaged or describes no possible radar.
    """
    if not path.is_file():
        raise Sd2Error(f"There is no file {path}", "the config.json of a radar recording")
    return _read_config(path, _read_meta(path.parent / _META))


def write_capture(
    folder: Path | str,
    samples: ArrayLike,
    config: RadarConfig,
    times_s: ArrayLike,
    *,
    simulated: bool,
    start_unix_s: float = 0.0,
    meta: dict[str, Any] | None = None,
) -> Path:
    """Write a recording folder in one step; an older recording there is replaced.

    Parameters
    ----------
    folder : path
        Becomes the folder with ``radar.npy``. A folder that is something else
        than a radar recording is never replaced.
    samples : uint16 array, shape (frames, channels, chirps, samples)
        As in a :class:`~sd2core.io.radar.capture.RadarCapture`.
    config : RadarConfig
    times_s : array_like, shape (frames,)
        Time of every frame relative to ``start_unix_s``.
    simulated : bool
        Written into ``meta.json``; never call computed samples measured.
    start_unix_s : float
        Wall-clock time of time 0; 0 when there is none.
    meta : dict
        Further entries of ``meta.json``, e.g. how it was simulated and the truth.
    """
    folder = Path(folder)
    check_replaceable(folder)
    timebase = Timebase(times_s)
    cube = np.asarray(samples)
    check_cube(cube, config, f"The recording for {folder}")
    if len(timebase) != len(cube):
        raise Sd2Error(f"{len(cube)} radar frames but {len(timebase)} times", "one time per frame")
    turns = config.transmitters  # which send one chirp after the other
    cube = cube.reshape(len(cube), turns, config.receivers, *cube.shape[2:])
    cube = cube.transpose(0, 2, 3, 1, 4).reshape(len(cube), config.receivers, -1, cube.shape[4])
    shape = {
        "rx_antennas": list(range(1, config.receivers + 1)),
        "tx_antennas": list(range(1, turns + 1)),
        "start_frequency_Hz": config.start_frequency_hz,
        "end_frequency_Hz": config.end_frequency_hz,
        "num_chirps_per_frame": config.chirps_per_frame * turns,
        "num_samples_per_chirp": config.samples_per_chirp,
        "chirp_repetition_time_s": config.chirp_repetition_s / turns,
        "frame_repetition_time_s": config.frame_repetition_s,
        "sample_rate_Hz": config.sample_rate_hz,
        "mimo_mode": "tdm" if turns > 1 else "off",
    }
    described = {
        "description": config.name,
        "adc_resolution": config.adc_bits,
        "simulated": simulated,
        **(meta or {}),
    }
    times = timebase.times_s + start_unix_s
    folder.parent.mkdir(parents=True, exist_ok=True)
    with atomic_folder(folder) as new:
        atomic_write_json(new / _CONFIG, {"device_config": {"fmcw_single_shape": shape}})
        atomic_write_json(new / _META, described)
        atomic_write_text(new / _TIMES, "".join(f"{time!r}\n" for time in times.tolist()))
        with atomic_write(new / _DATA) as stream:
            np.save(stream, cube, allow_pickle=False)
    return folder


def check_replaceable(folder: Path) -> None:
    """Raise Sd2Error for a folder that holds something else than a radar recording."""
    ours = folder.is_dir() and ((folder / _DATA).is_file() or not any(folder.iterdir()))
    if folder.exists() and not ours:
        raise Sd2Error(
            f"{folder} exists and is not a radar recording",
            "a new folder, or a radar recording to replace",
            "Choose another name",
        )


def _check_exists(path: Path) -> None:
    if not path.exists():
        raise Sd2Error(
            f"{path} is missing",
            f"{_DATA}, {_CONFIG} and {_TIMES} in one folder",
            "Copy the whole recording folder",
        )


def _validated(model: type[Model], path: Path) -> Model:
    _check_exists(path)
    expected = "the configuration that Infineon's recorder writes (device_config.fmcw_single_shape)"
    with faults_in(path, expected, "Use the file that was recorded with this radar.npy"):
        return model.model_validate(read_json(path, "a JSON text"))


def _read_meta(path: Path) -> _Meta:
    return _validated(_Meta, path) if path.exists() else _Meta()


def _read_config(path: Path, meta: _Meta) -> RadarConfig:
    shape = _validated(_Config, path).shape
    mode = (shape.mimo_mode or "off").lower()
    # Without MIMO, several transmitters send together, as one.
    transmitters = len(shape.tx_antennas) if mode == "tdm" else 1
    if mode not in ("off", "tdm") or transmitters < 1:
        raise Sd2Error(
            f"{path}: mimo_mode is {mode!r} with {len(shape.tx_antennas)} transmitters",
            "mimo_mode 'off', or 'tdm' with the transmitters that take turns",
            "Record again with one transmitter",
        )
    if shape.num_chirps_per_frame % transmitters:
        raise Sd2Error(
            f"{path}: {shape.num_chirps_per_frame} chirps per frame of {transmitters} transmitters"
            " in turns",
            f"a multiple of {transmitters}",
            "Use the file that was recorded with this radar.npy",
        )
    with errors_in(path):
        return RadarConfig(
            start_frequency_hz=shape.start_frequency_Hz,
            end_frequency_hz=shape.end_frequency_Hz,
            samples_per_chirp=shape.num_samples_per_chirp,
            chirps_per_frame=shape.num_chirps_per_frame // transmitters,
            chirp_repetition_s=shape.chirp_repetition_time_s * transmitters,
            frame_repetition_s=shape.frame_repetition_time_s,
            sample_rate_hz=shape.sample_rate_Hz,
            receivers=len(shape.rx_antennas),
            adc_bits=meta.adc_resolution,
            name=meta.description,
            transmitters=transmitters,
        )


def _in_turns(
    counts: Samples, config: RadarConfig, folder: Path
) -> tuple[Samples, RadarConfig, tuple[str, ...]]:
    """Channels of transmitters that take turns, by the shape of the file; what was assumed."""
    turns = config.transmitters
    if turns == 1:
        return counts, config, ()
    stated = turns * config.chirps_per_frame
    assumed = (
        f"{turns} transmitters take turns, chirp by chirp: each sends every"
        f" {1e6 * config.chirp_repetition_s:.1f} µs, which divides v_max by {turns}."
    )
    shape = (config.receivers, stated, config.samples_per_chirp)
    if counts.shape[1:] == shape:
        return by_transmitter(counts, turns), config, (assumed,)
    # A frame may also hold as many chirps of each.
    with errors_in(folder / _CONFIG):
        config = replace(config, chirps_per_frame=stated)
    if counts.shape[1:] == (config.receivers, turns * stated, config.samples_per_chirp):
        return by_transmitter(counts, turns), config, (assumed,)
    order = "Channels are assumed to be the receivers of one transmitter, then those of the next."
    return counts, config, (assumed, order)


def _read_times(
    path: Path, frames: int, config: RadarConfig
) -> tuple[Timebase, float | None, tuple[str, ...]]:
    """Times of the frames from the host's clock, or from the configuration with a note."""
    nominal_s = config.frame_repetition_s
    regular = Timebase(np.arange(frames) * nominal_s)
    fallback = f"frames are placed every {1e3 * nominal_s:g} ms, as {_CONFIG} says"
    if not path.exists():
        return regular, None, (f"{path.name} is missing: {fallback}.",)
    times = _parse_times(path)
    plausible = times.size > 0 and _FIRST_PLAUSIBLE_UNIX_S < times[0] < _LAST_PLAUSIBLE_UNIX_S
    start_unix_s = float(times[0]) if plausible else None
    steps = np.diff(times)
    if len(times) != frames:
        which = "fewer" if len(times) < frames else "more"
        why = f"has {len(times)} times for {frames} frames, {which} than it should"
    elif frames == 1:
        return regular, start_unix_s, ()
    elif not np.isfinite(times).all() or (steps <= 0).any():
        bad = int(np.flatnonzero(~(steps > 0))[0])
        why = f"does not increase from frame {bad} to {bad + 1}"
    elif (usual_s := float(np.median(steps))) > _FAR_TOO_SLOW * nominal_s:
        why = f"has steps of {usual_s:g} s, which looks like milliseconds; it should hold seconds"
        start_unix_s = None
    # No frame can follow sooner than the radar sends one; the host read several at once.
    elif (least_s := float(steps.min())) < 0.5 * nominal_s:
        why = f"has steps down to {1e3 * least_s:.1f} ms, so frames were buffered before they got"
        why += " their time"
    else:
        notes = _notes_on_steps(path.name, steps, nominal_s)
        return Timebase(times - times[0]), start_unix_s, notes
    return regular, start_unix_s, (f"{path.name} {why}: {fallback}.",)


def _notes_on_steps(name: str, steps_s: NDArray[np.float64], nominal_s: float) -> tuple[str, ...]:
    notes = []
    late = steps_s > 1.5 * nominal_s
    if late.any():
        notes.append(
            f"{name} has {int(late.sum())} gap{'s' if late.sum() > 1 else ''} of up to"
            f" {steps_s.max():.3f} s: frames are missing there."
        )
    # The host's clock wanders from frame to frame; only the mean tells the rate.
    mean_s = float(steps_s[~late].mean()) if not late.all() else nominal_s
    spread_s = float(np.abs(steps_s[~late] - mean_s).max()) if not late.all() else 0.0
    if spread_s > 0.1 * nominal_s:
        notes.append(
            f"The times in {name} jitter by up to {1e3 * spread_s:.0f} ms around"
            f" {1e3 * mean_s:.0f} ms; they are used as they are."
        )
    if abs(mean_s - nominal_s) > 0.02 * nominal_s:
        notes.append(
            f"Frames came every {1e3 * mean_s:.1f} ms; {_CONFIG} says {1e3 * nominal_s:.1f} ms."
        )
    return tuple(notes)


def _parse_times(path: Path) -> NDArray[np.float64]:
    """One number per line, NaN where it is no time; a heading in the first line is allowed."""
    times = []
    with open_regular(path) as stream:
        texts = (line.decode(errors="replace").strip() for line in lines_of(stream))
        for number, line in enumerate(filter(None, texts), start=1):
            try:
                times.append(float(line.removesuffix(",")))
            except ValueError as error:
                if number == 1 and not line[:1].isdigit():
                    continue
                raise Sd2Error(
                    f"{path}, line {number}: {line[:40]!r} is not a time",
                    "one unix time in seconds per line",
                    "Remove the file to place frames by the frame repetition time",
                ) from error
    times_s = np.array(times, dtype=np.float64)
    return np.where(np.abs(times_s) < _LARGEST_TIME_S, times_s, np.nan)
