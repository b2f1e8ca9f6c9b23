"""Every edit of a recording: done first, then pushed to the history as one step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from PySide6.QtGui import QUndoCommand

from sd2app.session.content import ReadMesh
from sd2app.session.document import DocumentModel
from sd2app.session.maps import MapModel
from sd2app.session.sensor import SensorModel
from sd2core.errors import Cure
from sd2core.labels.spans import Labels
from sd2core.mesh.bodies import Body, renamed
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.options.synthesis import HowCounted
from sd2core.placements.placements import Placements
from sd2core.radar_config import Clutter
from sd2core.recording.divergence import WORDS
from sd2core.recording.relinking import ROLES, Relinked
from sd2core.sensor import Vector, VirtualSensor, aimed_at

Offset = Literal["radar_offset_s", "imu_offset_s"]
"""Time on the recording's clock at which something measured begins."""
Assigning = Callable[[Any], None]
"""Gives something of the recording a value."""
_PLANNED = "Plan placements"
_ALIGNED: Mapping[str, str] = {
    "radar_offset_s": "Radar offset",
    "imu_offset_s": "Inertial sensor offset",
}


def _assign_references(references: Mapping[MapModel, tuple[float, bool]]) -> None:
    for track, (reference, by_hand) in references.items():
        track.set_reference(reference, by_hand=by_hand)


class Assign(QUndoCommand):
    """Sets one value of a model; models ignore a value that they have already."""

    def __init__(self, text: str, assign: Assigning, before: object, after: object) -> None:
        super().__init__(text)
        self._assign, self._before, self._after = assign, before, after

    def undo(self) -> None:
        """Assign the earlier value."""
        self._assign(self._before)

    def redo(self) -> None:
        """Assign the later value."""
        self._assign(self._after)


class Edits:
    """Undoable edits of a recording.

    A drag is one step in the history. Another edit ends it first; it ends without a step where
    another recording is opened.
    """

    def __init__(self, document: DocumentModel, sensor: SensorModel) -> None:
        self._document = document
        self._sensor = sensor
        # Of what is held: name of the step, what assigns it and what reads it, and what was before.
        self._held: tuple[str, Assigning, Callable[[], Any]] | None = None
        self._before: Any = None
        self._dragged: Thing | Body | None = None
        document.opened.connect(self._forget)

    # --- drags ----------------------------------------------------------------------------

    @property
    def dragging(self) -> bool:
        """True while something is held, and is no step yet."""
        return self._held is not None

    def _begin_drag(self, text: str, assign: Assigning, read: Callable[[], Any]) -> None:
        self.end_drag()
        self._held, self._before = (text, assign, read), read()

    def end_drag(self) -> None:
        """End the drag, if there is one; it becomes one step in the history."""
        held, self._held = self._held, None
        self._sensor.set_dragging(False)
        if held is not None:
            text, assign, read = held
            self._push(text, assign, self._before, read())

    def _forget(self) -> None:
        """Let go of what belongs to the recording before."""
        if not self._document.same_recording:
            self._held = None
            self._sensor.set_dragging(False)

    # --- sensor and placements ------------------------------------------------------------

    def place_sensor(self, sensor: VirtualSensor, text: str = "Move sensor") -> None:
        """Place the sensor."""
        self._push(text, self._assign_sensor, self._sensor.sensor, sensor)

    def sensor_to_camera(self) -> None:
        """Put the sensor at the camera, looking along the optical axis."""
        beam = self._sensor.sensor.beam
        self.place_sensor(VirtualSensor(beam=beam), "Sensor to camera")

    def aim_sensor(self, target_m: Vector) -> None:
        """Turn the sensor towards a point."""
        self.place_sensor(aimed_at(self._sensor.sensor, target_m), "Aim sensor")

    def begin_sensor_drag(self) -> None:
        """Begin a drag of the sensor."""
        self._begin_drag("Move sensor", self._assign_sensor, lambda: self._sensor.sensor)
        self._sensor.set_dragging(True)

    def drag_sensor(self, position_m: Vector) -> None:
        """Move the sensor during a drag."""
        if self.dragging:
            self._assign_sensor(replace(self._sensor.sensor, position_m=position_m))

    def _assign_sensor(self, sensor: VirtualSensor) -> None:
        self._sensor.set_sensor(sensor)
        if self._document.recording is not None:
            self._document.recording.sensor = sensor

    def plan_placements(self, placements: Placements | None) -> None:
        """Plan other places for sensors around the body, or none."""
        self.change(_PLANNED, {"placements": placements})

    def type_placements(self, placements: Placements | None) -> None:
        """Plan other places while they are typed: all until the end is one step."""
        if self._held is None or self._held[0] != _PLANNED:
            self._begin_drag(_PLANNED, self._document.assign, lambda: self._fields(["placements"]))
        self._document.assign({"placements": placements})

    def restore(self, fields: Mapping[str, Any]) -> None:
        """Take over fields of an earlier session, or that were saved elsewhere."""
        rest = dict(fields)
        if "sensor" in rest:
            self.place_sensor(rest.pop("sensor"), "Restore sensor")
        self.change("Restore settings", rest)

    # --- things, bodies and walls -----------------------------------------------------------

    def add_to_scene(self, one: Thing | Body | Wall) -> None:
        """Put one more thing, body or wall into the scene."""
        self._set_in_scene("Add", one, lambda kept: (*kept, one))

    def add_body(self, body: Body) -> None:
        """Put another body into the scene, a step once its file was read."""
        document, add = self._document, partial(self.add_to_scene, body)
        if document.mesh is not None:
            document.meshes.read_body(document.mesh, body, add)

    def change_in_scene(self, number: int, one: Thing | Body | Wall) -> None:
        """Replace one by another, or by itself elsewhere; labels follow the name of a person."""
        stack, names = self._document.undo_stack, self._renamed(number, one)
        if names:
            stack.beginMacro(f"Rename {' and '.join(names)}")
        self._set_in_scene("Change", one, lambda kept: (*kept[:number], one, *kept[number + 1 :]))
        if names:
            self._document.renamed.emit(names)
            stack.endMacro()

    def _renamed(self, number: int, one: Thing | Body | Wall) -> dict[str, str]:
        """Old and new names of the persons who are called otherwise once a body is another."""
        recording = self._document.recording
        if recording is None or not isinstance(one, Body):
            return {}
        before, changed = recording.bodies_there, recording.bodies[number]
        after = [one if body is changed else body for body in before]
        return renamed(recording.subject, before, after)

    def begin_scene_drag(self, number: int) -> None:
        """Begin to drag a thing, or (counted on after the things) a body beside the first one.

        ``number`` counts what is shown: a thing whose file is missing is not.
        """
        mesh = self._document.mesh
        assert mesh is not None
        things = () if mesh.surroundings is None else mesh.surroundings.things
        movable = [*things, *(other.placed for other in mesh.others)]
        one = self._dragged = movable[number]
        assert one is not None
        fields = ["things" if number < len(things) else "bodies"]
        self._begin_drag(f"Move {one.name}", self._document.assign, lambda: self._fields(fields))
        self._sensor.set_dragging(True)

    def drag_in_scene(self, by_m: Vector) -> None:
        """Move a thing or body from where it was when the drag began."""
        one = self._dragged
        if self.dragging and one is not None:
            place = "position_m" if isinstance(one, Thing) else "moved_m"
            at_m = tuple(round(a + b, 3) for a, b in zip(getattr(one, place), by_m, strict=True))
            moved = replace(one, **{place: at_m})  # type: ignore[arg-type]
            for name, before in self._before.items():
                now = tuple(moved if this is one else this for this in before)
                self._document.assign({name: now})

    def remove_from_scene(self, number: int, one: Thing | Body | Wall) -> None:
        """Take a thing, body or wall out of the scene."""
        self._set_in_scene("Remove", one, lambda kept: kept[:number] + kept[number + 1 :])

    def _set_in_scene(
        self,
        text: str,
        one: Thing | Body | Wall,
        change: Callable[[tuple[Any, ...]], tuple[Any, ...]],
    ) -> None:
        recording = self._document.recording
        if recording is not None:
            name = {Thing: "things", Body: "bodies", Wall: "walls"}[type(one)]
            self.change(f"{text} {one.name}", {name: change(getattr(recording, name))})

    # --- labels and files -----------------------------------------------------------------

    def set_labels(self, text: str, labels: Labels) -> None:
        """Label the recording otherwise; undone, it has no labels of its own where it had none."""
        recording = self._document.recording
        if recording is not None and labels != self._document.labels:
            self._push(text, self._document.set_labels, recording.labels, labels)

    def add(self, paths: Sequence[Path], mesh: Mapping[str, Any] | None = None) -> None:
        """Add files, a step once they were read; they are opened where nothing is open.

        ``mesh`` holds fields of the recording that say how a mesh among them is read.
        """
        if self._document.recording is None:
            self._document.open(paths, mesh)
        else:
            self._document.read_added(paths, mesh, self._take_added)

    def _take_added(self, before: Mapping[str, Any]) -> None:
        now = self._fields(name for name in ("video", "mesh", "radar", "imu") if name in before)
        added = [WORDS[name] for name, path in now.items() if path]
        self._push_change(f"Add {' and '.join(added)}" if added else "Read files again", before)

    def relink(self, folder: Path) -> Relinked | None:
        """Look for missing files below a folder; what was found is read again."""
        recording = self._document.recording
        if recording is None:
            return None
        found = replace(recording)
        relinked = found.find_missing(folder)
        names = (*ROLES, "bodies", "things")
        self.change("Find missing files", {name: getattr(found, name) for name in names})
        return relinked

    # --- the mesh -------------------------------------------------------------------------

    def read_mesh(self, text: str, fields: Mapping[str, Any]) -> None:
        """Read another mesh, or the same one another way; a step once it was read."""
        recording = self._document.recording
        if recording is not None:
            self._document.meshes.read(recording, fields, partial(self.change, text))

    def take_mesh(self, text: str, read: ReadMesh) -> None:
        """Show a mesh that was read already, as one step."""
        self._document.meshes.keep(read)
        self.change(text, read.fields)

    def cure_mesh(self, cure: Cure) -> None:
        """Read the mesh with a setting that puts it right."""
        recording = self._document.recording
        if recording is not None:
            self.read_mesh(cure.words, {"mesh_reading": recording.mesh_reading.cured(cure)})

    # --- maps and what was measured -------------------------------------------------------

    def set_radar_offset(self, offset_s: float) -> None:
        """Align the capture."""
        self.change(_ALIGNED["radar_offset_s"], {"radar_offset_s": offset_s})

    def begin_offset_drag(self, name: Offset = "radar_offset_s") -> None:
        """Begin to drag what was measured in time."""
        self._begin_drag(_ALIGNED[name], self._document.assign, lambda: self._fields([name]))

    def drag_offset(self, seconds: float) -> None:
        """Shift it by ``seconds`` since the drag began."""
        if self.dragging:
            shifted = {name: round(before + seconds, 3) for name, before in self._before.items()}
            self._document.assign(shifted)

    def choose_count(self, count: HowCounted) -> None:
        """Count the vertices of synthetic maps another way."""
        self._push("Choose counting", self._document.set_count, self._document.count, count)

    def set_clutter(self, clutter: Clutter) -> None:
        """Remove static echoes another way."""
        document = self._document
        self._push("Choose clutter removal", document.set_clutter, document.clutter, clutter)

    def set_references(self, references: Mapping[MapModel, float], *, by_hand: bool) -> None:
        """Show other values of maps as 0 dB."""
        before = {track: (track.reference, track.by_hand) for track in references}
        after = {track: (reference, by_hand) for track, reference in references.items()}
        self._push("0 dB", _assign_references, before, after)

    # --- the history ----------------------------------------------------------------------

    def change(self, text: str, fields: Mapping[str, object]) -> None:
        """Change fields of the recording as one step."""
        self.end_drag()
        before = self._fields(fields)
        self._document.assign(fields)
        self._push_change(text, before)

    def _push_change(self, text: str, before: Mapping[str, object]) -> None:
        """Make one step of what was changed already."""
        self._push(text, self._document.assign, before, self._fields(before))

    def _fields(self, names: Iterable[str]) -> dict[str, object]:
        return {name: getattr(self._document.recording, name, None) for name in names}

    def _push(self, text: str, assign: Assigning, before: object, after: object) -> None:
        """Assign a value, as a step in the history where it is another one."""
        self.end_drag()
        assign(after)
        if before != after and self._document.content is not None:
            self._document.undo_stack.push(Assign(text, assign, before, after))
