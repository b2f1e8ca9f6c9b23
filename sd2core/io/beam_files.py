"""Beams of antennas: by widths, by the name of a radar, or from a table."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, read_text
from sd2core.radar_profiles import BEAMS
from sd2core.scattering.beam import beam_of_cuts
from sd2core.sensor import Beam

_TABLE = "a table of at least 3 lines: angle_deg, azimuth_db, elevation_db (one way)"
_MAX_LINES = 100_000


def find_beam(text: str) -> Beam | None:
    """Beam of a text such as ``56,28``, ``iwr1443``, ``pattern.csv`` or ``none``.

    Two numbers are the widths at half power in azimuth and elevation, in degrees. Raises Sd2Error
    for what is none of these, and for a table that cannot be read.
    """
    if text == "none":
        return None
    if text in BEAMS:
        return BEAMS[text]
    try:
        azimuth, elevation = map(float, text.split(","))
    except ValueError:
        if Path(text).is_file() or Path(text).suffix:
            return read_beam(Path(text))
        raise Sd2Error(
            f"The beam is {text!r}",
            f"two widths as 56,28, a table (.csv), none, or {', '.join(BEAMS)}",
        ) from None
    return Beam(azimuth, elevation)


def read_beam(path: Path) -> Beam:
    """Read a beam from a table of ``angle_deg, azimuth_db, elevation_db``, with a heading or not.

    Raises Sd2Error where a line is not three numbers, or angles do not ascend through 0.
    """
    rows: list[list[float]] = []
    for number, line in enumerate(read_text(path, _TABLE).splitlines(), start=1):
        # Between semicolons, tabs and blanks commas are decimal ones.
        apart = next((one for one in ";\t," if one in line), None)
        cells = (line if apart == "," else line.replace(",", ".")).split(apart)
        if not line.strip() or line.startswith("#"):
            continue
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        if not rows and not row and len(cells) == 3:
            continue  # The heading.
        if len(row) != 3 or not all(map(math.isfinite, row)) or len(rows) == _MAX_LINES:
            raise Sd2Error(f"{path}: line {number} is {line[:60]!r}", _TABLE)
        rows.append(row)
    if len(rows) < 3:
        raise Sd2Error(f"{path} has {len(rows)} lines of numbers", _TABLE)
    with errors_in(path, ""):
        return beam_of_cuts(np.array(rows))
