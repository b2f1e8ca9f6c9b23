"""Radars by name: the paper's, or that of a recording."""

from __future__ import annotations

from pathlib import Path

from sd2core.io.radar.infineon import read_radar_config
from sd2core.radar_config import PAPER_RADAR, RadarConfig

PAPER = "paper"


def named_radar(name: str) -> RadarConfig:
    """The radar that is called so.

    Parameters
    ----------
    name : str
        ``paper``, or the path of a capture's ``config.json``.

    Raises
    ------
    Sd2Error
        When there is no such file, or it describes no possible radar.
    """
    return PAPER_RADAR if name == PAPER else read_radar_config(Path(name))
