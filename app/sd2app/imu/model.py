"""Inertial sensors of the open recording, what a real one measured, and both in words."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ProblemModel, ReportingModel
from sd2app.session.session import Session
from sd2app.widgets.time_axis import clock_text
from sd2core.errors import Sd2Error
from sd2core.imu.files import read_signals, write_signals
from sd2core.imu.mounting import mounted, place_near
from sd2core.imu.signals import InertialSignals
from sd2core.imu.virtual import virtual_imu
from sd2core.mesh.sequence import MeshSequence
from sd2core.plausibility.samples import judge_inertial
from sd2core.recording.recording import Recording

_FOLDED = "inertial/folded"


def place_words(place: str) -> str:
    """Place in words: ``left wrist``, ``vertex 4711``."""
    return f"vertex {place}" if place.isdecimal() else place.replace("-", " ")


class ImuModel(ReportingModel, ProblemModel):
    """Sensors of the recording, of which one is shown; its signals are computed in the background.

    A recording has any number of virtual sensors, and one file of a real one.
    """

    changed = Signal()  # sensors, signals, or what is known of them
    noted = Signal(str)

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._document = session, session.document
        self.signals: InertialSignals | None = None  # of the current sensor, simulated
        self.measured: InertialSignals | None = None  # of the real one, on its own clock
        self.vertices: Mapping[str, int] = {}  # that sensors sit on, by their places
        self.folded = session.settings.stored(_FOLDED, False)
        self._chosen: str | None = None
        self._request: tuple[Any, ...] = (None,)  # mesh, places, current one
        self._known: dict[str, InertialSignals] = {}
        self._read: Path | None = None  # file that is read, or being read
        self._runner = LatestRunner("inertial sensor", self, self._receive, self._refuse)
        self._runner.partial.connect(self._take_seats)
        self._reader = LatestRunner("inertial file", self, self._take_file, self._refuse_file)
        self._adder = LatestRunner("added inertial file", self, self._add, self._fail)
        self._document.opened.connect(session.placing.end)
        self._document.opened.connect(self._follow)
        self._document.changed.connect(self._follow)

    # --- what there is --------------------------------------------------------------------

    @property
    def places(self) -> tuple[str, ...]:
        """Places of the virtual sensors."""
        recording = self._document.recording
        return () if recording is None else recording.imu_places

    @property
    def current(self) -> str | None:
        """Place of the virtual sensor that is shown; None without any."""
        if self._chosen in self.places:
            return self._chosen
        return next(iter(self.places), None)

    @property
    def file(self) -> Path | None:
        """File of the real sensor."""
        recording = self._document.recording
        return None if recording is None else recording.imu

    @property
    def file_words(self) -> str:
        """Words for the samples of the file."""
        simulated = self.measured is not None and self.measured.simulated
        return "simulated file" if simulated else "measured"

    @property
    def offset_s(self) -> float:
        """Time on the recording's clock of the first sample of the real sensor."""
        recording = self._document.recording
        return 0.0 if recording is None else recording.imu_offset_s

    @property
    def shift_s(self) -> float:
        """Time added to the real sensor's, to have it on the recording's clock."""
        return 0.0 if self.measured is None else self.offset_s - float(self.measured.times_s[0])

    @property
    def visible(self) -> bool:
        """True if there is a sensor to be shown."""
        return bool(self.places) or self.measured is not None

    @property
    def why_not(self) -> str:
        """Reason why no sensor can be placed; empty if one can."""
        mesh = self._document.mesh
        if mesh is None:
            return (
                "There is no body to fix a sensor to: add its mesh first"
                " (File → Add to this recording…)"
            )
        return "" if mesh.faces is not None else "A point cloud has no surface to fix a sensor to"

    @property
    def file_name(self) -> str:
        """Proposed name of a file of the shown signals."""
        place = "" if self.current is None else place_words(self.current).replace(" ", "-")
        return self._document.file_name(f"-{place}.csv")

    # --- requests -------------------------------------------------------------------------

    def place_at(self, vertex: int) -> str:
        """Place to which a click on a vertex leads."""
        mesh = self._document.mesh
        return str(vertex) if mesh is None else place_near(mesh, vertex)

    def place(self, vertex: int) -> None:
        """Put a sensor where a vertex was clicked, and show it."""
        self._session.placing.end()
        if not self.why_not:
            self._chosen = self.place_at(vertex)
            if self._chosen not in self.places:
                places = (*self.places, self._chosen)
                self._session.edits.change("Place inertial sensor", {"imu_places": places})
            self._follow()

    def remove(self, place: str) -> None:
        """Take a virtual sensor away."""
        left = tuple(one for one in self.places if one != place)
        self._session.edits.change("Remove inertial sensor", {"imu_places": left})

    def remove_file(self) -> None:
        """Show the samples of no file."""
        none = {"imu": None, "imu_offset_s": 0.0}
        self._session.edits.change("Remove inertial sensor's file", none)

    def show(self, place: str) -> None:
        """Show another sensor of the recording."""
        self._chosen = place
        self._follow()

    def set_folded(self, folded: bool) -> None:
        """Show the title of the track alone, or all of it."""
        if folded != self.folded:
            self.folded = folded
            self._session.settings.set_value(_FOLDED, folded)
            self.changed.emit()

    def add_file(self, path: Path) -> None:
        """Read a real sensor's samples, and add them to the recording."""
        recording = self._document.recording
        if recording is not None:
            self._adder.submit(lambda emit: (recording, path, read_signals(path)))

    def save(self, path: Path) -> None:
        """Write the signals that are shown; OSError or Sd2Error where that fails."""
        assert self.signals is not None
        write_signals(path, self.signals)
        self.noted.emit(f"The samples are in {path}.")

    # --- following ------------------------------------------------------------------------

    def _follow(self) -> None:
        self._follow_file()
        mesh, places, current = request = self._document.mesh, self.places, self.current
        if request == self._request:
            return
        if mesh is not self._request[0]:
            self._known.clear()
            self.vertices = {}
        self._request, self.problem = request, ""
        self.signals = known = self._known.get(current or "")
        if mesh is None or current is None:
            self._runner.cancel()
            self.problem = "" if current is None else self.why_not
        else:
            self._runner.submit(lambda emit: _feel(mesh, places, current, known, emit))
        self.changed.emit()

    def _take_seats(self, vertices: Mapping[str, int]) -> None:
        self.vertices = vertices
        self.changed.emit()

    def _receive(self, signals: InertialSignals) -> None:
        self._known[self._request[-1]] = self.signals = signals
        self.changed.emit()

    # --- the real sensor ------------------------------------------------------------------

    def _follow_file(self) -> None:
        path = self.file
        if path == self._read:
            if self.measured is not None:
                self.changed.emit()  # its offset
            return
        self._read, self.measured = path, None
        self._reader.cancel()
        # One that is missing was named when the recording was opened.
        if path is not None and path.exists():
            self._reader.submit(lambda emit: (path, read_signals(path)))
        self.changed.emit()

    def _take_file(self, read: tuple[Path, InertialSignals]) -> None:
        self._read, signals = read
        self.measured = signals
        for finding in judge_inertial(
            signals.times_s, signals.acceleration_mps2, signals.turn_rate_radps
        ):
            self.noted.emit(str(finding))
        self.changed.emit()

    def _refuse_file(self, error: Exception) -> None:
        self._fail(error)
        self.changed.emit()

    def _add(self, added: tuple[Recording, Path, InertialSignals]) -> None:
        recording, path, signals = added
        if recording is not self._document.recording:
            return
        self._reader.cancel()
        self._take_file((path, signals))
        first_s, last_s = map(float, signals.times_s[[0, -1]])
        clock = self._session.playback.timebase
        same_clock = last_s >= clock.start_s and first_s < clock.end_s
        shown = {"imu": path, "imu_offset_s": first_s if same_clock else clock.start_s}
        self._session.edits.change("Add inertial sensor's file", shown)
        if not same_clock:
            self.noted.emit(
                f"{path.name} has a clock of its own: its first sample is put at the start of the"
                " recording. Drag the title of its track to align it."
            )


def _feel(
    mesh: MeshSequence,
    places: tuple[str, ...],
    current: str,
    known: InertialSignals | None,
    emit: Emit,
) -> InertialSignals:
    """Compute in the background: where sensors sit first, then what the current one feels."""
    vertices, mesh = {}, mesh.body(mesh.persons[0] if mesh.others else None)
    for place in places:
        try:
            vertices[place] = mounted(mesh, place).vertex
        except Sd2Error:
            continue  # said once it is the current one
    emit(vertices)
    return known or virtual_imu(mesh, current, progress=lambda *_: emit(None))


AXES = ("x", "y", "z")
_NEAR_S = 0.05
"""Farthest sample whose values are read at a time."""


def status_parts(model: ImuModel) -> list[str]:
    """How the lines were made, or why there are none; the first parts matter most."""
    parts, signals = [], model.signals
    if signals is not None:
        parts.append(f"simulated, low pass {signals.meta['cutoff_hz']:.3g} Hz")
    elif model.current is not None:
        parts.append(model.problem or "being computed…")
    if model.measured is not None and model.file is not None:
        parts += [f"{model.file_words}: {model.file.name}", f"from {clock_text(model.offset_s)}"]
    return parts


def reading_lines(model: ImuModel, time_s: float) -> tuple[str, ...]:
    """Time, then acceleration and turn rate of each sensor; nothing where there are none."""
    lines = []
    if model.signals is not None:
        lines += _values_at("simulated", model.signals, time_s)
    if model.measured is not None:
        lines += _values_at(model.file_words, model.measured, time_s - model.shift_s)
    return (clock_text(time_s), *lines) if lines else ()


def _values_at(name: str, signals: InertialSignals, time_s: float) -> list[str]:
    """Acceleration and turn rate of the sample nearest to a time, if one is near."""
    nearest = int(np.abs(signals.times_s - time_s).argmin())
    if abs(signals.times_s[nearest] - time_s) > _NEAR_S:
        return []
    acceleration, turn_rate = signals.acceleration_mps2[nearest], signals.turn_rate_radps[nearest]
    if not np.isfinite([acceleration, turn_rate]).all():
        return [f"{name}: not known"]
    return [f"{name}: {_axes(acceleration, 1)} m/s²", f"{_axes(turn_rate, 2)} rad/s"]


def _axes(values: NDArray[np.float64], decimals: int) -> str:
    """Values with their signs, in the order of the axes."""
    return "  ".join(
        f"{axis} {value:+.{decimals}f}".replace("-", "−")
        for axis, value in zip(AXES, values.tolist(), strict=True)
    )
