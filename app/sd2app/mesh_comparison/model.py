"""The mesh of the recording and another of the same video, measured against each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sd2app.background.latest import Emit, ProblemModel
from sd2app.session.content import UNTITLED, reference_of
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2app.widgets.text import quoted
from sd2core.cli.compare_meshes import CompareMeshes
from sd2core.errors import Sd2Error
from sd2core.files.paths import is_there
from sd2core.files.tables import capitalised
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.records import words_of
from sd2core.recording.recording import MeshReading, Recording, is_recording, open_recording
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.compare.meshes import Comparison, Difference

JOINT = "hand.R"
"""Joint whose curves are shown at first."""


class ComparisonModel(ProblemModel):
    """Two meshes: number 0 is the recording's, number 1 the other.

    Others read the attributes; the methods change them.
    """

    def __init__(self, session: Session, other: Path) -> None:
        super().__init__()
        self._session, self._other = session, other
        self.reference = 0  # number of the mesh that the other is measured against
        self.joint = JOINT  # the one whose velocity is shown
        self.comparison: Comparison | None = None
        self._meshes: tuple[MeshSequence, MeshSequence] | None = None  # that it is of
        self.tracks = (MapModel("", self), MapModel("", self))
        self._runner = ListedRunner("compare", session.jobs, self, self._receive, self._refuse)
        self._runner.cancelled.connect(self.changed)
        session.sensor.changed.connect(self._follow_sensor)
        session.sensor.dragging_changed.connect(self._follow_sensor)
        self.work_out()

    # --- what is there --------------------------------------------------------------------

    @property
    def labels(self) -> tuple[str, str]:
        """Names of the two meshes."""
        recording = self._session.document.recording
        own = name_of(recording.mesh) if recording and recording.mesh else "this recording"
        other = name_of(self._other)
        return (own, other) if own != other else (f"{own} (open)", f"{other} (other)")

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that were compared."""
        if self.comparison is None:
            return ()
        from sd2core.compare.joints import JOINTS

        return JOINTS

    @property
    def difference(self) -> Difference | None:
        """Difference of the mesh that is not the reference."""
        comparison = self.comparison
        return comparison.differences[1 - comparison.reference] if comparison else None

    @property
    def line(self) -> str:
        """Command for a terminal that compares the two meshes."""
        recording = self._session.document.recording
        # The recording knows how its mesh is read.
        own = recording and (recording.mesh if recording.folder == UNTITLED else recording.folder)
        options = CompareMeshes(
            meshes=(own or Path("mesh.zarr"), self._other),
            names=self.labels,
            reference=self.labels[self.reference],
            sensor=self._session.sensor.sensor.position_m,
            focal_px=self._session.document.camera.focal_px,
        )
        return quoted(words_of("compare-meshes", options))

    def mesh(self, number: int) -> MeshSequence | None:
        """One of the two, all of its frames."""
        return self._meshes[number] if self._meshes else None

    def curve(self, number: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times, and velocities of the joint towards the sensor; NaN without a person."""
        comparison = self.comparison
        if comparison is None:
            return np.zeros(0), np.zeros(0)
        velocity = comparison.velocity_mps[number][:, self.joints.index(self.joint)]
        return comparison.times_s, np.where(comparison.measured, velocity, np.nan)

    # --- what one can do ------------------------------------------------------------------

    def set_joint(self, joint: str) -> None:
        """Show another joint."""
        if joint != self.joint:
            self.joint = joint
            self.changed.emit()

    def set_reference(self, number: int) -> None:
        """Measure against the other one."""
        if number != self.reference:
            self.reference = number
            self.work_out()

    def work_out(self) -> None:
        """Compare again with the present sensor."""
        document = self._session.document
        recording, own = document.recording, document.mesh
        if recording is None or own is None:
            return
        known = self.mesh(1)
        # Without its beam, as the command for a terminal: bodies are compared, not antennas.
        sensor = VirtualSensor(self._session.sensor.sensor.position_m)
        other, reference = self._other, self.reference
        labels, focal_px = self.labels, document.camera.focal_px

        def compare(emit: Emit) -> tuple[tuple[MeshSequence, MeshSequence], Comparison]:
            from sd2core.compare.meshes import compare_meshes

            mesh = known or load_other(other, recording, focal_px)
            comparison = compare_meshes(
                (own, mesh),
                labels,
                reference=reference,
                sensor=sensor,
                progress=lambda done, total: emit((done, total)),
            )
            return (own, mesh), comparison

        self.problem = ""
        self._runner.submit(compare, f"Comparing with {other.name}")
        self.changed.emit()

    def save_figure(self, path: Path) -> None:
        """Write maps and curves; raises Sd2Error and OSError."""
        from sd2core.compare.figure import draw_comparison
        from sd2core.files.figure_files import save_figure

        if self.comparison is not None:
            save_figure(draw_comparison(self.comparison), path)

    # --- inside ---------------------------------------------------------------------------

    def _follow_sensor(self) -> None:
        sensor, comparison = self._session.sensor, self.comparison
        place_m = sensor.sensor.position_m
        if not sensor.dragging and (comparison is None or comparison.sensor.position_m != place_m):
            self.work_out()

    def _receive(self, result: tuple[tuple[MeshSequence, MeshSequence], Comparison]) -> None:
        self._meshes, comparison = result
        self.comparison = comparison
        top = max(reference_of(one.values, one.null_bins) for one in comparison.maps)
        for number, (track, label) in enumerate(zip(self.tracks, self.labels, strict=True)):
            track.title = label
            l1 = comparison.differences[number].map_l1
            is_reference = number == comparison.reference
            track.set_status("reference" if is_reference else f"relative L1 {l1:.2f}")
            track.set_map(comparison.maps[number])
            track.set_reference(top)  # one level for both
        self.changed.emit()


def joint_words(name: str) -> str:
    """``hand.R`` as ``Right hand``."""
    part, _, side = name.partition(".")
    words = {"L": f"left {part}", "R": f"right {part}"}.get(side, part)
    return capitalised(words)


def name_of(path: Path) -> str:
    """Name of a mesh: that of its folder where the file's own name says nothing."""
    plain = path.name in ("mesh.zarr", "mesh.npz") and path.parent != UNTITLED
    return path.parent.name if plain else path.name


def load_other(path: Path, recording: Recording, focal_px: float) -> MeshSequence:
    """Load the mesh of another recording, or a file placed by the video of this one.

    Raises Sd2Error if it cannot be read.
    """
    if is_recording(path):
        return open_recording(path).load_mesh()
    if not is_there(path):
        raise Sd2Error(f"There is no file {path}", "another mesh of this recording")
    reading = MeshReading(focal_px=recording.mesh_reading.focal_px or focal_px)
    return Recording(UNTITLED, video=recording.video, mesh=path, mesh_reading=reading).load_mesh()
