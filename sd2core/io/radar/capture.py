"""Raw radar samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.radar_config import RadarConfig
from sd2core.timebase import Timebase

Signal = NDArray[Any]
"""Samples relative to full scale, float32 or complex64 (frames, channels, chirps, samples)."""

_LARGEST = 1e9
"""What is larger, or infinite, is no sample in any unit."""


@dataclass(frozen=True, eq=False)
class LazySamples:
    """Samples that a function reads, and brings into this shape and type, some frames at a time."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[slice], NDArray[Any]]

    def __getitem__(self, frames: slice) -> NDArray[Any]:
        return self.read(frames)


Samples = NDArray[Any] | LazySamples
"""Array (frames, channels, chirps, samples), of uint16 counts around mid-scale, or of float32 or
complex64; it may be read by frames, as they are asked for."""


def by_transmitter(samples: Samples, transmitters: int) -> LazySamples:
    """Channels of each transmitter, of chirps that transmitters send in turns.

    From (frames, receivers, chirps of all, samples) to (frames, channels, chirps of one, samples).
    """
    frames, receivers, chirps, length = samples.shape
    each = chirps // transmitters
    shape = (frames, transmitters * receivers, each, length)
    return LazySamples(
        shape, samples.dtype, lambda some: sorted_by_transmitter(samples[some], transmitters)
    )


def sorted_by_transmitter(samples: NDArray[Any], transmitters: int) -> NDArray[Any]:
    """Frames with the channels of each transmitter, as :func:`by_transmitter` reads them."""
    _, receivers, chirps, length = samples.shape
    each = chirps // transmitters
    turns = np.asarray(samples).reshape(-1, receivers, each, transmitters, length)
    return turns.transpose(0, 3, 1, 2, 4).reshape(-1, transmitters * receivers, each, length)


@dataclass(frozen=True, eq=False)
class RadarCapture:
    """Raw samples of a radar with what is needed to read them.

    Parameters
    ----------
    samples : array of uint16, float32 or complex64, shape (frames, channels, chirps, samples)
        Converter counts around mid-scale, or samples relative to full scale, whose phase grows
        with the distance; may be a memory map or read as needed. Channels are the receivers of
        the first transmitter, those of the second, and so on.
    config : RadarConfig
    timebase : Timebase
        One time per frame, the first at 0 s. A frame is the burst of
        ``chirps_per_frame`` chirps.
    start_unix_s : float or None
        Wall-clock time of the first frame where the recording knows it.
    simulated : bool
        True when the samples were computed, not measured.
    source : str
        Where it came from, for provenance.
    notes : tuple of str
        What the reader found odd and wants the user to know.
    meta : dict
        The recording's own description; holds the truth of a simulated one.
    full_scale_known : bool
        False where samples are in a unit of their own, so that nothing is known of clipping.
    frames_missing : int
        Frames that were sent while it was recorded, and are not in it.

    Examples
    --------
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> radar = sd2.PAPER_RADAR
    >>> counts = np.full((2, 1, radar.chirps_per_frame, radar.samples_per_chirp), 2048, np.uint16)
    >>> capture = sd2.RadarCapture(counts, radar, sd2.Timebase([0.0, 1 / 30]))
    >>> capture.read(0, 1).shape
    (1, 1, 64, 32)
    >>> float(capture.read(0, 1).max())
    0.0
    """

    samples: Samples
    config: RadarConfig
    timebase: Timebase
    start_unix_s: float | None = None
    simulated: bool = False
    source: str = ""
    notes: tuple[str, ...] = ()
    meta: dict[str, Any] = field(default_factory=dict)
    full_scale_known: bool = True
    frames_missing: int = 0

    def __post_init__(self) -> None:
        _check_samples(self.samples, self.config, self.source)
        frames = self.samples.shape[0]
        if len(self.timebase) != frames:
            raise Sd2Error(
                f"{self.source or 'The radar cube'}: {frames} frames but"
                f" {len(self.timebase)} times",
                "one time per frame",
            )

    def __repr__(self) -> str:
        radar = self.config.name or "a radar without a name"
        kind = "simulated" if self.simulated else "real"
        parts = [f"{kind}, {radar}", self.words, *([self.source] if self.source else [])]
        return f"<RadarCapture {' · '.join(parts)}>"

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return int(self.samples.shape[0])

    @property
    def words(self) -> str:
        """Number, length and rate of the frames, such as ``47 of 50 frames, …`` where some miss."""
        if not self.frames_missing:
            return self.timebase.words
        sent = self.frame_count + self.frames_missing
        return f"{self.frame_count} of {sent} frames, {self.timebase.pace}"

    @property
    def present(self) -> NDArray[np.bool_] | None:
        """Presence of a person per frame, (frames,), in simulations that state it; else None."""
        simulation = self.meta.get("simulation") if self.simulated else None
        gaps = simulation.get("without_person") if isinstance(simulation, dict) else None
        if not isinstance(gaps, list):
            return None
        present = np.ones(self.frame_count, bool)
        for gap in gaps:
            match gap:
                case [int(start), int(stop)] if 0 <= start < stop <= self.frame_count:
                    present[start:stop] = False
                case _:
                    raise Sd2Error(
                        f"{self.source}: without_person in meta.json holds {gap!r}",
                        f"pairs of frames, the first and the one after the last, up to"
                        f" {self.frame_count}",
                    )
        return present

    def channel(self, receiver: int | None = None, transmitter: int | None = None) -> RadarCapture:
        """One receiver or one transmitter, or one of each, by their numbers from 1 on.

        Without a number it is the capture itself. Raises Sd2Error if there is none of this number.
        """
        if receiver is None and transmitter is None:
            return self
        config = self.config
        parts = []
        for name, number, count in (
            ("transmitter", transmitter, config.transmitters),
            ("receiver", receiver, config.receivers),
        ):
            if number is not None and not 1 <= number <= count:
                raise Sd2Error(
                    f"{name.capitalize()} {number} of {self.source or 'a capture'} is asked for",
                    f"1 to {count}" if count > 1 else f"1: there is one {name}",
                    "Choose another one, or all",
                )
            parts.append(np.arange(count) if number is None else np.array([number - 1]))
        kept = (parts[0][:, None] * config.receivers + parts[1]).ravel()
        samples = self.samples
        shape = (samples.shape[0], len(kept), *samples.shape[2:])
        return replace(
            self,
            samples=LazySamples(shape, samples.dtype, lambda some: samples[some][:, kept]),
            config=replace(config, transmitters=len(parts[0]), receivers=len(parts[1])),
            notes=(
                *self.notes,
                *(f"Transmitter {n} only." for n in (transmitter,) if n is not None),
                *(f"Receiver {n} only." for n in (receiver,) if n is not None),
            ),
        )

    def read(self, start: int, stop: int) -> Signal:
        """Frames ``start`` to ``stop`` (exclusive) relative to full scale.

        Returns
        -------
        float32 or complex64 array, shape (n, channels, chirps, samples)
            Mid-scale is 0, the ends of the converter's range are -1 and (nearly) 1.

        Raises
        ------
        Sd2Error
            When a count is larger than the converter can give, or a sample is not finite.
        """
        if not 0 <= start < stop <= self.frame_count:
            raise IndexError(f"frames {start} to {stop} of {self.frame_count}")
        if self.samples.dtype.kind != "u":
            signal: Signal = np.array(self.samples[start:stop], self.samples.dtype, order="C")
            if not (np.abs(signal.view(np.float32)) < _LARGEST).all():
                raise Sd2Error(
                    f"{self.source or 'The radar cube'} holds a sample that is no finite number, or"
                    f" larger than {_LARGEST:g}, in frames {start} to {stop - 1}",
                    "finite samples",
                    "Copy it again, or write it again",
                )
            return signal
        half = np.float32(2.0 ** (self.config.adc_bits - 1))
        raw = np.asarray(self.samples[start:stop])
        top = int(raw.max())
        bits = self.config.adc_bits
        if top >= 2**bits:
            raise Sd2Error(
                f"{self.source or 'The radar cube'} holds a count of {top}, but the converter is"
                f" said to have {bits} bits",
                f"counts from 0 to {2**bits - 1}, or {top.bit_length()} or more bits",
                "Correct adc_resolution in meta.json (12 when it is not stated)",
            )
        counts = raw.astype(np.float32)
        counts -= half
        counts /= half
        return counts


def check_cube(samples: Samples, config: RadarConfig, source: str) -> None:
    """Raise Sd2Error for converter counts whose shape or type contradicts the configuration."""
    _check_shape(samples, config, source)
    if samples.dtype.kind != "u" or samples.dtype.itemsize != 2:
        raise Sd2Error(
            f"{source or 'The radar cube'} holds {samples.dtype}",
            "uint16 converter counts",
            "Use the raw radar.npy of the recording, not a processed copy",
        )


def _check_samples(samples: Samples, config: RadarConfig, source: str) -> None:
    if samples.dtype.kind not in "fc":
        check_cube(samples, config, source)
        is_real = True
    else:
        _check_shape(samples, config, source)
        is_real = samples.dtype == np.float32
    if is_real != (config.sampling == "real"):
        raise Sd2Error(
            f"{source or 'The radar cube'} holds {samples.dtype}",
            f"{config.sampling} samples, as the configuration says",
        )


def _check_shape(samples: Samples, config: RadarConfig, source: str) -> None:
    shape = tuple(samples.shape)
    cube = (config.channels, config.chirps_per_frame, config.samples_per_chirp)
    if len(shape) != 4 or shape[0] == 0 or shape[1:] != cube:
        times = f" of {config.transmitters} transmitters" if config.transmitters > 1 else ""
        raise Sd2Error(
            f"{source or 'The radar cube'} has shape {shape}",
            f"(frames, {config.receivers} receivers{times}, {cube[1]} chirps, {cube[2]} samples)"
            " as the configuration says, at least one frame",
            "Use the config.json that was recorded with this radar.npy",
        )
