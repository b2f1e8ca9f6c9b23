"""Raw radar samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.radar_config import RadarConfig
from sd2core.timebase import Timebase


@dataclass(frozen=True, eq=False)
class RadarCapture:
    """Raw samples of an FMCW radar with what is needed to read them.

    Parameters
    ----------
    samples : uint16 array, shape (frames, receivers, chirps, samples)
        Converter counts around mid-scale; may be a memory map.
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

    samples: NDArray[np.uint16]
    config: RadarConfig
    timebase: Timebase
    start_unix_s: float | None = None
    simulated: bool = False
    source: str = ""
    notes: tuple[str, ...] = ()
    meta: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_cube(self.samples, self.config, self.source)
        frames = self.samples.shape[0]
        if len(self.timebase) != frames:
            raise Sd2Error(
                f"{self.source or 'The radar cube'}: {frames} frames but"
                f" {len(self.timebase)} times",
                "one time per frame",
            )

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return int(self.samples.shape[0])

    @property
    def present(self) -> NDArray[np.bool_] | None:
        """Presence of a person per frame, (frames,), in simulations that state it; else None."""
        found = self.meta.get("simulation")
        gaps = found.get("without_person") if self.simulated and isinstance(found, dict) else None
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

    def read(self, start: int, stop: int) -> NDArray[np.float32]:
        """Frames ``start`` to ``stop`` (exclusive) relative to full scale.

        Returns
        -------
        float32 array, shape (n, receivers, chirps, samples)
            Mid-scale is 0, the ends of the converter's range are -1 and (nearly) 1.

        Raises
        ------
        Sd2Error
            When a count is larger than the converter can give.
        """
        if not 0 <= start < stop <= self.frame_count:
            raise IndexError(f"frames {start} to {stop} of {self.frame_count}")
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


def check_cube(samples: NDArray[np.uint16], config: RadarConfig, source: str) -> None:
    """Raise Sd2Error for samples whose shape or type contradicts the configuration."""
    shape = tuple(samples.shape)
    cube = (config.receivers, config.chirps_per_frame, config.samples_per_chirp)
    if len(shape) != 4 or shape[0] == 0 or shape[1:] != cube:
        raise Sd2Error(
            f"{source or 'The radar cube'} has shape {shape}",
            f"(frames, {cube[0]} receivers, {cube[1]} chirps, {cube[2]} samples) as the"
            " configuration says, at least one frame",
            "Use the config.json that was recorded with this radar.npy",
        )
    if samples.dtype.kind != "u" or samples.dtype.itemsize != 2:
        raise Sd2Error(
            f"{source or 'The radar cube'} holds {samples.dtype}",
            "uint16 converter counts",
            "Use the raw radar.npy of the recording, not a processed copy",
        )
