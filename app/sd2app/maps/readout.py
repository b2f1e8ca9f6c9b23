"""What is under the pointer, in words and per vertex of the frame on screen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sd2app.session.maps import Reading
from sd2app.session.session import Session
from sd2app.widgets.time_axis import clock_text
from sd2core.doppler.synthesizer import FrameScattering, Synthesizer, Visibility
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.amplitude import range_weight
from sd2core.scattering.beam import share_in_beam
from sd2core.sensor import Vector


@dataclass(frozen=True)
class Readout:
    """Scattering of the frame on screen as the sensor sees it."""

    torso_range_m: float
    visible_share: float
    beyond_share: float
    share_in_beam: float | None  # None without a beam


class FrameReader:
    """Reads the frame on screen; what was read last is kept, as several views ask for the same."""

    def __init__(self, session: Session) -> None:
        self._document, self._sensor = session.document, session.sensor
        self._playback = session.playback
        self.forget()

    def forget(self) -> None:
        """Drop what was read of an earlier recording."""
        newest = lru_cache(maxsize=1)
        self._scattering_of, self._torso_of = newest(Synthesizer.frame), newest(_torso_m)

    def index(self) -> int | None:
        """Frame of the mesh on screen, None where there is no person."""
        mesh = self._document.mesh
        return None if mesh is None else mesh.person_at(self._playback.time_s)

    def torso_m(self) -> Vector | None:
        """Median vertex: inside the torso whatever the limbs do."""
        index, mesh = self.index(), self._document.mesh
        return None if index is None or mesh is None else self._torso_of(mesh, index)

    def scattering(
        self, synthesizer: Synthesizer, visibility: Visibility
    ) -> FrameScattering | None:
        """Velocity, range and visibility of every vertex."""
        index = self.index()
        if index is None:
            return None
        return self._scattering_of(synthesizer, self._sensor.sensor, index, visibility)

    def readout(self, frame: FrameScattering | None, v_max_mps: float) -> Readout | None:
        """Numbers beside the sensor, None without a mesh on screen."""
        torso_m, index, mesh = self.torso_m(), self.index(), self._document.mesh
        if frame is None or torso_m is None or index is None or mesh is None:
            return None
        sensor, within = self._sensor.sensor, None
        seen_mps = np.abs(frame.velocity_mps[frame.visible])
        if sensor.beam is not None:
            echo = frame.visible * range_weight(frame.range_m, 4.0, 1.0)
            within = share_in_beam(sensor, mesh.frame(index).T, echo)
        return Readout(
            torso_range_m=float(np.linalg.norm(np.subtract(sensor.position_m, torso_m))),
            visible_share=float(frame.visible.mean()),
            beyond_share=float((seen_mps > v_max_mps).mean()) if seen_mps.size else 0.0,
            share_in_beam=within,
        )


def _torso_m(mesh: MeshSequence, frame: int) -> Vector:
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
    return float(
        np.linalg.norm(np.subtract(_torso_m(mesh, frame), session.sensor.sensor.position_m))
    )
