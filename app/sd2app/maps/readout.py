"""What is under the pointer, in words and per vertex of the frame on screen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sd2app.session.maps import Reading
from sd2app.session.session import Session
from sd2app.widgets.time_axis import clock_text
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import Vector


@dataclass(frozen=True)
class Readout:
    """Scattering of the frame on screen as the sensor sees it."""

    torso_range_m: float
    visible_share: float
    beyond_share: float
    share_in_beam: float | None  # None without a beam


def torso_of(mesh: MeshSequence, frame: int) -> Vector:
    """Median vertex of a frame: inside the torso whatever the limbs do."""
    x, y, z = np.median(mesh.frame(frame), axis=0)
    return float(x), float(y), float(z)


def reading_lines(reading: Reading) -> tuple[str, ...]:
    """Time and range, where it is known; velocity with its sign, and level; in words."""
    if reading.velocity_mps > 0:
        direction = "approaching"
    else:
        direction = "receding" if reading.velocity_mps < 0 else "still"
    velocity = f"{reading.velocity_mps:+.3f}".replace("-", "−")
    value = f"{reading.value:.3g}"
    if reading.deviation is not None:
        value += f" ± {reading.deviation:.2g}"
    when = [clock_text(reading.time_s), f"frame {reading.frame}"]
    if reading.range_m is not None:
        when.append(f"body at {reading.range_m:.2f} m")
    what = [f"{velocity} m/s {direction}", reading.text or f"{reading.level} ({value})"]
    if reading.note:
        what.append(reading.note)
    return tuple("  ·  ".join(parts) for parts in (when, what))


def body_range_m(session: Session, time_s: float) -> float | None:
    """Distance from the virtual sensor to the torso at a time, None without a person then."""
    mesh = session.document.mesh
    frame = None if mesh is None else mesh.person_at(time_s)
    if mesh is None or frame is None:
        return None
    return math.dist(torso_of(mesh, frame), session.sensor.sensor.position_m)
