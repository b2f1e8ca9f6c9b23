"""Raw radar recordings: one file per maker's format."""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.io.radar.capture import RadarCapture
from sd2core.io.radar.infineon import (
    check_replaceable,
    find_recording,
    load_infineon,
    read_radar_config,
    write_capture,
)

__all__ = [
    "SUPPORTED",
    "RadarCapture",
    "check_replaceable",
    "load_capture",
    "read_radar_config",
    "write_capture",
]

SUPPORTED = (
    "an Infineon recording: the folder with radar.npy, config.json and radar_timestamp.csv"
    " (or the folder above it, or its radar.npy)"
)


def load_capture(path: Path | str) -> RadarCapture:
    """Open a raw radar recording; the samples stay on disk.

    Parameters
    ----------
    path : path
        A folder or file of a supported format, see :data:`SUPPORTED`.

    Raises
    ------
    Sd2Error
        When nothing supported is there, or when it is damaged.
    """
    path = Path(path).expanduser()
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", SUPPORTED, "Check the path")
    folder = find_recording(path)
    if folder is None:
        holds = sorted(entry.name for entry in path.iterdir())[:6] if path.is_dir() else []
        found = f"; it holds {', '.join(holds) or 'nothing'}" if path.is_dir() else ""
        raise Sd2Error(f"{path} is not a radar recording that can be read{found}", SUPPORTED)
    return load_infineon(folder)
