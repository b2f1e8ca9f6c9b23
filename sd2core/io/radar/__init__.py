"""Radar recordings: one module per maker's format, and radars by name."""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.io.kinds import RADAR_MAP_SUFFIXES
from sd2core.io.radar.capture import RadarCapture
from sd2core.io.radar.infineon import (
    check_replaceable,
    find_recording,
    load_infineon,
    read_radar_config,
    write_capture,
)
from sd2core.io.radar.kkt import RecordedMap, load_kkt
from sd2core.radar_config import PAPER_RADAR, RadarConfig

__all__ = [
    "PAPER",
    "SUPPORTED",
    "RadarCapture",
    "RecordedMap",
    "check_replaceable",
    "holds_map",
    "load_capture",
    "load_recorded_map",
    "named_radar",
    "read_radar_config",
    "write_capture",
]

PAPER = "paper"
"""Name of the paper's radar."""

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

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> capture = sd2.load_capture(resource_path("swipes.sd2") / "radar")
    >>> capture.simulated, capture.samples.shape
    (True, (450, 1, 64, 32))
    """
    path = Path(path).expanduser()
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", SUPPORTED, "Check the path")
    if holds_map(path):
        raise Sd2Error(
            f"{path} holds maps of a radar and no raw samples",
            SUPPORTED,
            "Open it in the window, or write its map with `sd2 radar FILE --out map.npz`",
        )
    folder = find_recording(path)
    if folder is None:
        holds = sorted(entry.name for entry in path.iterdir())[:6] if path.is_dir() else []
        found = f"; it holds {', '.join(holds) or 'nothing'}" if path.is_dir() else ""
        raise Sd2Error(f"{path} is not a radar recording that can be read{found}", SUPPORTED)
    return load_infineon(folder)


def holds_map(path: Path | str) -> bool:
    """True if a radar recording, by its name, holds maps: read it by `load_recorded_map`."""
    return Path(path).suffix.lower() in RADAR_MAP_SUFFIXES


def load_recorded_map(path: Path | str) -> RecordedMap:
    """Open a radar recording that holds a Doppler map and labels instead of samples.

    Raises Sd2Error if it is none that is known (:mod:`sd2core.io.radar.kkt`), or is damaged.
    """
    return load_kkt(Path(path).expanduser())


def named_radar(name: str) -> RadarConfig:
    """Radar by its name: ``paper``, or the path of a capture's ``config.json``.

    Raises Sd2Error if there is no such file, or it describes no possible radar.
    """
    return PAPER_RADAR if name == PAPER else read_radar_config(Path(name))
