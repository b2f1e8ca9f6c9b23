"""Radar samples of one's own: an array, and a small TOML beside it that describes it.

The array is a NumPy file (``.npy``), a dataset of an HDF5 file (``.h5``) or the samples of a SigMF
recording (``.sigmf-data``). The description has the same name with the suffix ``.toml``; see
:class:`RadarDescription` and docs/radar-files.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder, atomic_write, atomic_write_json, atomic_write_text
from sd2core.files.texts import errors_in, faults_in, read_json, read_toml
from sd2core.files.toml import toml_lines
from sd2core.io.radar.capture import LazySamples, RadarCapture
from sd2core.io.radar.infineon import check_replaceable
from sd2core.io.radar.points import PointsDescription, has_columns_told
from sd2core.io.radar.stored_arrays import (
    DATA,
    MATLAB_SUFFIX,
    META,
    SUFFIXES,
    StoredArray,
    open_stored,
)
from sd2core.radar_config import RadarConfig, Sampling
from sd2core.timebase import Timebase

DATA_NAME = "radar.npy"
"""Name of the samples in a folder of their own."""
Axis = Literal["frame", "transmitter", "receiver", "chirp", "sample", "iq", "stream"]

_LOWEST_HZ = 1e5
"""A carrier or a bandwidth below is stated in another unit."""
_META = "meta.json"
_EXPECTED = "the description of radar samples (docs/radar-files.md)"
_ORDER = ("frame", "transmitter", "receiver", "chirp", "sample", "iq")
_GAPLESS = {"stream": ("chirp", "sample"), "chirp": ("chirp",), "frame": ()}
"""Axes along which a recording is long, and those that it is cut into."""
_PLAIN: dict[int, tuple[Axis, ...]] = {
    1: ("stream",),
    2: ("chirp", "sample"),
    3: ("frame", "chirp", "sample"),
    4: ("frame", "receiver", "chirp", "sample"),
    5: ("frame", "transmitter", "receiver", "chirp", "sample"),
}
"""Axes of arrays that are not described otherwise, by the number of dimensions."""


class RadarDescription(BaseModel):
    """Content of a description in SI units; `sd2 radar describe --help` says what each means."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["sd2-radar"] = "sd2-radar"
    version: Literal[1] = 1
    name: str = Field(default="", max_length=200)
    simulated: bool = False
    sampling: Sampling = "complex"  # of complex samples, with an image band or without
    dataset: str | None = None
    axes: tuple[Axis, ...]
    carrier_hz: float = Field(gt=0, le=1e15)  # middle of the samples of a chirp
    bandwidth_hz: float | None = Field(default=None, ge=0, le=1e15)  # of them; 0: a continuous wave
    slope_hz_per_s: float | None = Field(
        default=None, ge=-1e24, le=1e24
    )  # instead; negative for chirps that fall
    sample_rate_hz: float | None = Field(default=None, ge=1e-9, le=1e15)
    chirp_repetition_s: float | None = Field(default=None, ge=1e-15, le=1e9)
    frame_repetition_s: float | None = Field(default=None, ge=1e-15, le=1e9)
    samples_per_chirp: int | None = Field(default=None, ge=1, le=2**24)
    chirps_per_frame: int | None = Field(default=None, ge=2, le=2**24)
    sign: Literal[1, -1] = 1
    zero: float = Field(default=0.0, ge=-1e12, le=1e12)
    full_scale: float | None = Field(default=None, ge=1e-12, le=1e12)
    range_start_m: float | None = Field(default=None, ge=-1e9, le=1e9)
    range_step_m: float | None = Field(default=None, ge=1e-9, le=1e9)


def description_of(path: Path) -> Path:
    """Path of the description that belongs to a file."""
    return path.with_suffix(".toml")


def is_describable(path: Path) -> bool:
    """True if a file is of a kind that can be described."""
    return path.suffix.lower() in SUFFIXES


def is_described(path: Path) -> bool:
    """True if a file of samples can be described, and a description of samples is beside it."""
    return is_describable(path) and description_of(path).is_file() and not has_columns_told(path)


def read_description(path: Path) -> RadarDescription:
    """Read a description; Sd2Error if it is damaged."""
    with faults_in(path, _EXPECTED):
        return RadarDescription.model_validate(read_toml(path, _EXPECTED))


def write_description(description: RadarDescription | PointsDescription, data: Path) -> Path:
    """Write the description of a file beside it; Sd2Error if something else is there."""
    path = description_of(data)
    if path.exists():
        try:
            if not has_columns_told(data):
                read_description(path)
        except Sd2Error as error:
            raise Sd2Error(
                f"{path} is there, and is no description of radar data",
                "a name that is free",
                "Move it away",
            ) from error
    fields = description.model_dump(exclude_defaults=True)
    content = {"format": description.format, "version": description.version, **fields}
    atomic_write_text(path, "\n".join(toml_lines(content, path.parent)) + "\n")
    return path


def write_described(
    folder: Path | str,
    samples: NDArray[np.complex64],
    config: RadarConfig,
    times_s: ArrayLike,
    *,
    simulated: bool,
    meta: dict[str, Any] | None = None,
) -> Path:
    """Write a folder of complex samples with their description; an older recording is replaced.

    Parameters
    ----------
    folder : path
        Becomes the folder with ``radar.npy`` and ``radar.toml``.
    samples : complex64 array, shape (frames, receivers, chirps, samples)
        Relative to full scale, as a converter of up to 16 bits gives them.
    config : RadarConfig
        Of one transmitter, with complex samples.
    times_s : array_like, shape (frames,)
        Times of the frames, which follow one another regularly.
    simulated : bool
    meta : dict
        Written to ``meta.json``, e.g. how it was simulated and the truth.
    """
    folder = Path(folder)
    check_replaceable(folder)
    capture = RadarCapture(samples, config, Timebase(times_s))
    half = 2.0 ** (config.adc_bits - 1)
    with_range = not config.is_continuous
    description = RadarDescription(
        name=config.name,
        simulated=simulated,
        sampling=config.sampling,
        axes=(*_PLAIN[4], "iq"),
        carrier_hz=config.centre_frequency_hz,
        bandwidth_hz=config.bandwidth_hz,
        sample_rate_hz=config.sample_rate_hz if with_range else None,
        chirp_repetition_s=config.chirp_repetition_s,
        frame_repetition_s=config.frame_repetition_s,
        full_scale=half,
    )
    shape = (*capture.samples.shape, 2)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with atomic_folder(folder) as new:
        write_description(description, new / DATA_NAME)
        if meta:
            atomic_write_json(new / _META, meta)
        with atomic_write(new / DATA_NAME) as stream:
            header = {"descr": "<i2", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(stream, header)
            for frame in range(shape[0]):
                parts = capture.read(frame, frame + 1).view(np.float32)
                stream.write(np.rint(np.float32(half) * parts).astype("<i2").tobytes())
    return folder


def plain_axes(path: Path, dataset: str | None) -> tuple[tuple[Axis, ...] | None, tuple[int, ...]]:
    """Axes of the array in a file where nobody names others, and its shape.

    They go by dimensions and type. None where several are as likely: those of MATLAB have no
    usual order.
    """
    stored = open_stored(path, dataset)
    last: tuple[Axis, ...] = ()
    dimensions, suffix = len(stored.shape), path.suffix.lower()
    if suffix in (META, DATA) and dimensions == 2:
        return ("stream", "receiver"), stored.shape
    if dimensions > 3 and stored.shape[-1] == 2 and stored.dtype.kind != "c":
        last, dimensions = ("iq",), dimensions - 1
    if dimensions not in _PLAIN or suffix == MATLAB_SUFFIX:
        return None, stored.shape
    return _PLAIN[dimensions] + last, stored.shape


def load_described(path: Path) -> RadarCapture:
    """Open a file by the description beside it; frames are read as they are needed.

    Raises Sd2Error if one of them is damaged, or they contradict each other.
    """
    return capture_of(path, read_description(description_of(path)))


def capture_of(path: Path, description: RadarDescription) -> RadarCapture:
    """Open a file by a description; Sd2Error as :func:`load_described`."""
    stored = open_stored(path, description.dataset)
    with errors_in(description_of(path)):
        sizes = _sizes(stored, description)
        config, averaged = _config(stored, description, sizes)
    axes = description.axes
    along = axes.index(_longest(axes))
    inner = _GAPLESS[axes[along]]  # axes that are made of it
    each = math.prod(sizes[name] for name in inner)
    is_complex = config.sampling != "real"
    scale = np.float32(1.0 / (description.full_scale or 1.0))
    falling = (description.slope_hz_per_s or 0.0) < 0
    # Order of the axes of the file that are there, as ours.
    present = ["frame", *inner, *axes[:along], *axes[along + 1 :]]
    order = [present.index(name) for name in _ORDER if name in present]

    def read(some: slice) -> NDArray[Any]:
        start, stop, _ = some.indices(sizes["frame"])
        place = [slice(None)] * len(stored.shape)
        place[along] = slice(start * each, stop * each)
        raw = np.moveaxis(np.asarray(stored.read(tuple(place))), along, 0)
        if inner:
            raw = raw.reshape(-1, *(sizes[name] for name in inner), *raw.shape[1:])
        signal = raw.transpose(order).reshape(
            stop - start, config.channels, sizes["chirp"], sizes["sample"], -1
        )
        with np.errstate(over="ignore", invalid="ignore"):  # refused when it is read
            if "iq" in axes:
                parts = signal.astype(np.float32)
                cube = parts[..., 0] + np.complex64(1j) * parts[..., 1]
            else:
                cube = signal[..., 0].astype(np.complex64 if is_complex else np.float32)
            # I and Q come of one converter.
            cube -= np.float32(description.zero) * (np.complex64(1 + 1j) if is_complex else 1)
            cube *= scale
            if averaged:
                cube = cube.mean(axis=3, keepdims=True)
        if description.sign < 0 and is_complex:
            cube = cube.conj()
        # Samples of a real chirp in reverse have the phases of its negative frequencies.
        if falling != (description.sign < 0 and not is_complex):
            cube = cube[..., ::-1]
        return cube

    shape = (sizes["frame"], config.channels, config.chirps_per_frame, config.samples_per_chirp)
    notes = [
        "The phase is taken to "
        + ("grow" if description.sign > 0 else "fall")
        + " with the distance, as the description says; walk towards the radar to check."
    ]
    if config.transmitters > 1:
        notes.append(
            f"{config.transmitters} transmitters take turns; a chirp of the same one every"
            f" {1e6 * config.chirp_repetition_s:.1f} µs."
        )
    if averaged:
        notes.append(f"Every {sizes['sample']} samples are averaged to one.")
    return RadarCapture(
        samples=LazySamples(shape, np.dtype(np.complex64 if is_complex else np.float32), read),
        config=config,
        timebase=Timebase(np.arange(sizes["frame"]) * config.frame_repetition_s),
        simulated=description.simulated,
        source=str(path),
        notes=tuple(notes),
        meta={
            **_of_simulation(path, description),
            "format": "described",
            "description": description.model_dump(exclude_defaults=True),
        },
        full_scale_known=description.full_scale is not None,
    )


def _of_simulation(path: Path, description: RadarDescription) -> dict[str, Any]:
    """Facts of a simulated recording, in a file beside it."""
    beside = path.with_name(_META)
    if not (description.simulated and path.name == DATA_NAME and beside.is_file()):
        return {}
    content = read_json(beside)
    if not isinstance(content, dict):
        raise Sd2Error(f"{beside} holds no table", "what a simulated recording says of itself")
    return content


def _longest(axes: Sequence[Axis]) -> Axis:
    """Axis along which a recording is long: frames, or what has no gaps."""
    return next((name for name in ("stream", "frame") if name in axes), "chirp")


def _sizes(stored: StoredArray, description: RadarDescription) -> dict[str, int]:
    """Length of every axis, by name; 1 of those that are not there."""
    axes = description.axes
    named: dict[str, int] = dict(zip(axes, stored.shape, strict=False))
    if len(axes) != len(stored.shape) or len(named) < len(axes):
        raise Sd2Error(
            f"axes are {', '.join(axes)}, for an array of shape {stored.shape}",
            "one different name for every axis",
        )
    if named.get("iq", 2) != 2 or ("iq" in named and stored.dtype.kind == "c"):
        raise Sd2Error(
            f"The axis iq has {named['iq']} entries of {stored.dtype}", "2, of real numbers"
        )
    if "stream" in named:
        if not set(axes) <= {"stream", "receiver"} or axes[0] != "stream":
            raise Sd2Error(f"axes are {', '.join(axes)}", "stream, or stream and receiver")
        chirps, samples = description.chirps_per_frame, description.samples_per_chirp
        if chirps is None or samples is None:
            raise Sd2Error(
                "A stream has no frames of its own", "chirps_per_frame and samples_per_chirp"
            )
        named |= {
            "frame": named["stream"] // (chirps * samples),
            "chirp": chirps,
            "sample": samples,
        }
    elif not {"chirp", "sample"} <= set(axes):
        raise Sd2Error(f"axes are {', '.join(axes)}", "at least chirp and sample")
    elif "frame" not in named:
        if description.chirps_per_frame is None:
            raise Sd2Error("Chirps without gaps have no frames of their own", "chirps_per_frame")
        named |= {
            "frame": named["chirp"] // description.chirps_per_frame,
            "chirp": description.chirps_per_frame,
        }
    if min(named.values()) < 1:
        raise Sd2Error(f"The array has shape {stored.shape}", "at least one whole frame")
    return {name: named.get(name, 1) for name in _ORDER}


def _config(
    stored: StoredArray, radar: RadarDescription, sizes: dict[str, int]
) -> tuple[RadarConfig, bool]:
    """Configuration, and True if the samples of a chirp are averaged to one."""
    samples = sizes["sample"]
    if stored.dtype.kind not in "iufc":
        raise Sd2Error(f"The array is of {stored.dtype}", "numbers")
    is_complex = stored.dtype.kind == "c" or "iq" in radar.axes
    if (radar.bandwidth_hz is None) == (radar.slope_hz_per_s is None):
        raise Sd2Error(
            f"bandwidth_hz is {radar.bandwidth_hz}, slope_hz_per_s {radar.slope_hz_per_s}",
            "one of the two",
        )
    if (radar.range_start_m is None) != (radar.range_step_m is None):
        raise Sd2Error("One of range_start_m and range_step_m is missing", "both, or none")
    if radar.range_step_m is not None and not is_complex:
        raise Sd2Error(
            f"The samples are real ({stored.dtype}), at distances",
            "complex samples (I and Q): real ones do not tell approaching from receding",
            "Record I and Q, with the axis iq where they are apart",
        )
    rate_hz, chirp_s, frame_s = (
        radar.sample_rate_hz,
        radar.chirp_repetition_s,
        radar.frame_repetition_s,
    )
    if "stream" in radar.axes:
        if rate_hz is None or chirp_s is not None or frame_s is not None:
            raise Sd2Error(
                "Chirps and frames of a stream follow one another",
                "sample_rate_hz, and neither chirp_repetition_s nor frame_repetition_s",
            )
        chirp_s = samples / rate_hz
        frame_s = chirp_s * sizes["chirp"]
    elif "frame" not in radar.axes and chirp_s is not None:
        if frame_s is not None:
            raise Sd2Error("Chirps without gaps follow one another", "no frame_repetition_s")
        frame_s = chirp_s * sizes["chirp"]
    if chirp_s is None or frame_s is None:
        raise Sd2Error("It states no times", "chirp_repetition_s and frame_repetition_s")
    for name, value, such in (
        ("carrier_hz", radar.carrier_hz, "60 GHz is 60e9"),
        ("bandwidth_hz", radar.bandwidth_hz or math.inf, "1 GHz is 1e9; 0 for a continuous wave"),
    ):
        if value < _LOWEST_HZ:
            raise Sd2Error(f"{name} is {value:g}", f"Hz: {such}")
    has_beat = radar.bandwidth_hz != 0 and radar.range_step_m is None
    if rate_hz is None:
        if has_beat:
            raise Sd2Error("It states no sample_rate_hz", "samples per second within a chirp")
        rate_hz = samples / chirp_s
    if samples / rate_hz > chirp_s * (1 + 1e-9):
        raise Sd2Error(
            f"{samples} samples at {rate_hz:g} Hz last longer than a chirp of {chirp_s:g} s",
            "sample_rate_hz in Hz, chirp_repetition_s in seconds",
        )
    bandwidth_hz = radar.bandwidth_hz
    if bandwidth_hz is None:
        assert radar.slope_hz_per_s is not None
        bandwidth_hz = abs(radar.slope_hz_per_s) * samples / rate_hz
    averaged = bandwidth_hz == 0 and samples > 1
    if averaged:
        samples, rate_hz = 1, 1.0 / chirp_s
    ranges_m: tuple[float, ...] = ()
    if radar.range_start_m is not None and radar.range_step_m is not None:
        ranges_m = tuple((radar.range_start_m + radar.range_step_m * np.arange(samples)).tolist())
    bits = 24
    if radar.full_scale is not None and stored.dtype.kind in "iu":
        bits = max(1, round(math.log2(radar.full_scale)) + 1)
    config = RadarConfig(
        start_frequency_hz=radar.carrier_hz - 0.5 * bandwidth_hz,
        end_frequency_hz=radar.carrier_hz + 0.5 * bandwidth_hz,
        samples_per_chirp=samples,
        chirps_per_frame=sizes["chirp"],
        chirp_repetition_s=chirp_s,
        frame_repetition_s=frame_s,
        sample_rate_hz=rate_hz,
        receivers=sizes["receiver"],
        adc_bits=bits,
        name=radar.name or f"{radar.carrier_hz / 1e9:.4g} GHz radar",
        sampling=radar.sampling if is_complex else "real",
        transmitters=sizes["transmitter"],
        ranges_m=ranges_m,
    )
    return config, averaged
