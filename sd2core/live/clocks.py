"""Clocks of camera and radar, put on one by the times at which their frames arrived."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write, atomic_write_json, atomic_write_text
from sd2core.files.texts import read_json
from sd2core.io.radar.growing import HEAD_NAME, INDEX_NAME, frame_count, read_entries, read_head

if TYPE_CHECKING:
    from sd2core.recording.recording import Recording

CLOCKS_NAME = "clocks.json"
ARRIVALS_NAME = "live.arrivals"

_COMPARED = 1_000
"""Frames between which slopes are taken: half a million pairs."""
_DRIFT_FROM_S = 20.0
"""Over less, jitter looks like drift."""
_MAX_DRIFT = 1e-3
"""Quartz crystals are within 100 parts in a million: more is another frame rate."""


@dataclass(frozen=True)
class ClockLine:
    """A source's clock on that of this computer: ``start_s + rate · time``."""

    start_s: float  # on the monotonic clock, at time 0 of the source
    rate: float = 1.0  # seconds here per second of the source
    jitter_s: float = 0.0  # standard deviation of arrivals about the line, without outliers

    @property
    def drift_ppm(self) -> float:
        """By how much the source's clock is slow, in parts in a million."""
        return 1e6 * (self.rate - 1.0)


def fit_line(
    times_s: NDArray[np.float64], arrivals_s: NDArray[np.float64], rate: float | None = None
) -> ClockLine:
    """Fit a source's clock to the arrivals of its frames.

    The slope is that of Theil and Sen (H. Theil, "A rank-invariant method of linear and
    polynomial regression analysis", 1950), so that frames that were held up do not count; where
    its 95 % interval holds 1, or there are less than 20 s, the clocks are taken to run alike.

    Parameters
    ----------
    times_s : float64 array, shape (frames,)
        By the source's clock.
    arrivals_s : float64 array, shape (frames,)
        By the monotonic clock of this computer.
    rate : float, optional
        Of the line, where it is known from more frames than these.

    Raises
    ------
    Sd2Error
        If there is no frame, or the clocks differ by more than one in a thousand.
    """
    if not len(times_s):
        raise Sd2Error("No frame has arrived", "one at least")
    is_known, rate = rate is not None, rate or 1.0
    if not is_known and times_s[-1] - times_s[0] >= _DRIFT_FROM_S:
        from scipy.stats import theilslopes

        some = np.unique(np.linspace(0, len(times_s) - 1, _COMPARED).astype(int))
        # Around 1, where single slopes differ in their sixth digit.
        lag_s = (arrivals_s - times_s)[some]
        slope, _, low, high = theilslopes(lag_s, times_s[some])
        if not low <= 0.0 <= high:
            rate += float(slope)
        if abs(rate - 1.0) > _MAX_DRIFT:
            raise Sd2Error(
                f"Frames arrive every {rate:.4f} s for every second of their times",
                "clocks that differ by less than one in a thousand",
                "Set the frame rate that the radar runs with",
            )
    lag_s = arrivals_s - rate * times_s
    start_s = float(np.median(lag_s))
    jitter_s = 1.4826 * float(np.median(np.abs(lag_s - start_s)))
    return ClockLine(start_s, rate, jitter_s)


@dataclass(frozen=True)
class Clocks:
    """Facts about the clocks of a recording, ``clocks.json``.

    The time of an event is that of a frame's arrival less the source's delay.
    """

    video_first_s: float  # arrival of the first picture
    video_delay_s: float  # from the middle of an exposure to the arrival of its picture
    radar_delay_s: float  # from the middle of a burst of chirps to the arrival of its frame

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Read it of a recording; None where there is none."""
        path = folder / CLOCKS_NAME
        if not path.is_file():
            return None
        content: dict[str, Any] = read_json(path)
        try:
            return cls(**{name: float(content[name]) for name in cls.__dataclass_fields__})
        except (KeyError, TypeError, ValueError) as error:
            raise Sd2Error(f"{path} has no {error}", "clocks that `sd2 record` wrote") from error

    def write(self, folder: Path, **facts: Any) -> None:
        """Write it, with what else is told of the clocks."""
        about = {"format": "sd2-clocks", "version": 1, **vars(self), **facts}
        atomic_write_json(folder / CLOCKS_NAME, about)

    def recording_s(self, monotonic_s: float) -> float:
        """Time of an event on the clock of the recording, which is the video's."""
        return monotonic_s - (self.video_first_s - self.video_delay_s)

    def offset_s(self, radar: ClockLine) -> float:
        """Time 0 of the radar on the clock of the video."""
        return self.recording_s(radar.start_s - self.radar_delay_s)


def link_clocks(recording: Recording, clocks: Clocks, rate: float | None = None) -> ClockLine:
    """Align video and radar of a recording by the arrivals so far, and save it.

    ``rate`` is as of :func:`fit_line`. Sd2Error if the radar's arrivals are not there.
    """
    assert recording.radar is not None
    line = arrival_line(recording.radar, rate)
    recording.radar_offset_s = clocks.offset_s(line)
    recording.save()
    clocks.write(
        recording.folder,
        radar_offset_s=recording.radar_offset_s,
        radar_drift_ppm=line.drift_ppm,
        radar_jitter_s=line.jitter_s,
    )
    return line


def correct_drift(radar: Path, line: ClockLine) -> None:
    """Put the times of a growing capture, which has ended, on this computer's clock."""
    if line.rate == 1.0:
        return
    head = read_head(radar)
    entries = np.array(read_entries(radar, frame_count(radar, head)))
    entries["time_s"] *= line.rate
    note = f"Times are the radar's, made {line.drift_ppm:+.1f} millionths longer by its arrivals."
    with atomic_write(radar / INDEX_NAME) as stream:
        stream.write(entries.tobytes())
    corrected = head.model_copy(update={"notes": (*head.notes, note)})
    atomic_write_text(radar / HEAD_NAME, corrected.model_dump_json(indent=2) + "\n")


def arrival_line(radar: Path, rate: float | None = None) -> ClockLine:
    """Clock of a growing capture, by the arrivals that were kept; Sd2Error if none were.

    ``rate`` is as of :func:`fit_line`.
    """
    path = radar / ARRIVALS_NAME
    if not path.is_file():
        raise Sd2Error(f"There is no file {path}", "a recording of `sd2 record`")
    arrivals_s = np.fromfile(path, np.float64)
    frames = min(frame_count(radar, read_head(radar)), len(arrivals_s))
    return fit_line(np.array(read_entries(radar, frames)["time_s"]), arrivals_s[:frames], rate)
