"""What is in a scene beside the person: pages of other bodies, things and walls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np
from PySide6.QtWidgets import QLineEdit, QToolButton, QWidget

from sd2app.maps.model import SynthesisModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, form_of, pane, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.errors import Sd2Error
from sd2core.io.bodies import with_bodies
from sd2core.io.things import with_things
from sd2core.mesh.bodies import LATEST_S, MAX_BODIES, Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import FARTHEST_THING_M, MAX_THINGS, SHELF, SIZES_M, Thing
from sd2core.mesh.walls import DIRECTIONS, DISTANCES_M, LOSSES_DB, MAX_WALLS, Wall

Fields = Mapping[str, Sequence[NumberBox | QLineEdit]]
"""Boxes of each field of a thing, body or wall; of a field with several numbers, one for each."""


class SceneList(QWidget):
    """Adds, changes and takes away what a scene has of one kind; each step can be undone.

    Parameters
    ----------
    session : Session
    kind : {"things", "bodies", "walls"}
        Field of the recording.
    most : int
        How many there may be.
    rows : mapping of str to Fields
        What can be typed of each, by the names of the rows.
    warn : callable
        Told why something is not taken.
    """

    first_number = 1
    remove_text = "Remove"

    def __init__(
        self,
        session: Session,
        kind: Literal["things", "bodies", "walls"],
        most: int,
        rows: Mapping[str, Fields],
        warn: Callable[[str], None],
    ) -> None:
        super().__init__()
        self._session, self._kind, self._most, self._warn = session, kind, most, warn
        self._shown: tuple[Any, ...] = ()
        self._adding: tuple[QToolButton, ...] = ()
        self._fields = {name: boxes for row in rows.values() for name, boxes in row.items()}
        for box in chain(*self._fields.values()):
            changed = box.valueChanged if isinstance(box, NumberBox) else box.editingFinished
            changed.connect(self._type)
        self._which = Choice(f"{kind.capitalize()} in the scene", self)
        self._which.currentIndexChanged.connect(self._refresh_fields)
        remove = outlined(self.remove_text, "Take it out of the scene", self._remove, self)
        typed = [
            (name, pane(row_of(*chain(*row.values()), spacing_px=4, margins_px=0)))
            for name, row in rows.items()
        ]
        which = row_of((self._which, 1), remove, spacing_px=6)
        self.about = pane(which, form_of(*typed, gaps_px=(8, 3)), spacing_px=6)

    def start(self, *adding: QToolButton) -> None:
        """Follow the recording; ``adding`` are the buttons that add one."""
        self._adding = adding
        self._session.document.changed.connect(self._refresh)
        self._refresh()

    @property
    def kept(self) -> tuple[Any, ...]:
        """All in the recording."""
        recording = self._session.document.recording
        return () if recording is None else getattr(recording, self._kind)

    def take(self, make: Callable[[], Any], number: int | None = None) -> None:
        """Add one, or put it in another's place, if it can be made and its file be read."""
        mesh, edits = self._session.document.mesh, self._session.edits
        try:
            one = make()
            if mesh is not None:
                self.check(mesh, one)
        except Sd2Error as error:
            self._warn(str(error))
            self._refresh_fields()
            return
        if number is None:
            edits.add_to_scene(one)
        else:
            edits.change_in_scene(number, one)

    def check(self, mesh: MeshSequence, one: Any) -> None:
        """Raise Sd2Error if one cannot be in the scene of a mesh."""

    def name_of(self, one: Any) -> str:
        """Name of one in the list."""
        return str(one.name)

    def values(self, number: int, name: str) -> tuple[Any, ...]:
        """Values in the boxes of a field."""
        value = getattr(self.kept[number], name)
        return value if isinstance(value, tuple) else (value,)

    @property
    def _current(self) -> int | None:
        number = self._which.currentIndex()
        return number if 0 <= number < len(self.kept) else None

    def _type(self) -> None:
        if (number := self._current) is None:
            return
        changes: dict[str, Any] = {}
        for name, boxes in self._fields.items():
            typed = list(map(_typed, boxes))
            if any(map(_differs, boxes, self.values(number, name))):
                changes[name] = tuple(typed) if len(typed) > 1 else typed[0]
        if changes:
            self.take(lambda: replace(self.kept[number], **changes), number)

    def _remove(self) -> None:
        if (number := self._current) is not None:
            self._session.edits.remove_from_scene(number, self.kept[number])

    def _refresh(self) -> None:
        kept, before, current = self.kept, self._shown, self._which.currentIndex()
        for button in self._adding:
            button.setEnabled(self._session.document.mesh is not None and len(kept) < self._most)
        self.about.setVisible(bool(kept))
        if kept != before:
            self._shown = kept
            # The one that was changed, or the newest.
            changed = [at for at, one in enumerate(kept) if one not in before]
            current = changed[-1] if changed else current
        names = [
            f"{number}: {self.name_of(one)}" for number, one in enumerate(kept, self.first_number)
        ]
        self._which.offer(names, min(max(current, 0), len(kept) - 1))
        self._refresh_fields()

    def _refresh_fields(self) -> None:
        if (number := self._current) is None:
            return
        for name, boxes in self._fields.items():
            for box, value in zip(boxes, self.values(number, name), strict=True):
                if isinstance(box, NumberBox):
                    box.show_value(value)
                else:
                    box.setText(value)


def place_boxes(what: str) -> list[NumberBox]:
    """Boxes of a place x, y, z in metres."""
    far, ways = FARTHEST_THING_M, (("x", "to the right"), ("y", "down"), ("z", "forward"))
    return [NumberBox(-far, far, " m", f"{what}, {axis}: {way}") for axis, way in ways]


def turn_box() -> NumberBox:
    """Box of a turn about the vertical."""
    return NumberBox(-360, 360, "°", "Turn, seen from above clockwise", decimals=1, step=5)


def _typed(box: NumberBox | QLineEdit) -> Any:
    return box.value() if isinstance(box, NumberBox) else box.text().strip()


def _differs(box: NumberBox | QLineEdit, value: Any) -> bool:
    """True if a box has been given another value than it showed."""
    if isinstance(box, NumberBox):
        return bool(abs(box.value() - value) > 0.51 * 10.0 ** -box.decimals())
    return bool(_typed(box) != value)


_BODY_FILES = "Meshes (*.npz *.zip *.pkl *.npy *.obj *.ply *.glb);;All files (*)"
_NO_BODIES = (
    "Another moving mesh in the same scene: the map is the sum of all, and each hides what is"
    " behind it. Drag it in the scene."
)
_BESIDE_M = 0.8


class BodiesPage(SceneList):
    """Add bodies, change them, take them away; ``warn`` says why a file is not taken."""

    first_number = 2

    def __init__(self, session: Session, warn: Callable[[str], None]) -> None:
        name = QLineEdit()
        name.setAccessibleName("Name of the person")
        later = NumberBox(-LATEST_S, LATEST_S, " s", "How much later it moves", decimals=3)
        rows: dict[str, Fields] = {
            "Name": {"person": [name]},
            "Moved": {"moved_m": place_boxes("Moved from where its file has it")},
            "Turn": {"turn_deg": [turn_box()]},
            "Later": {"start_s": [later]},
        }
        super().__init__(session, "bodies", MAX_BODIES, rows, warn)
        self.setObjectName("page")
        same = outlined("Add a copy", "The recording's own mesh, beside it", self._copy, self)
        add = outlined("Add file…", "A mesh of somebody else", self._add_file, self)
        parts = (
            row_of(title("Bodies"), STRETCH, same, add),
            sentence(_NO_BODIES),
            self.about,
            STRETCH,
        )
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(8, 4, 8, 4)))
        self.start(same, add)

    def check(self, mesh: MeshSequence, one: Body) -> None:
        """Raise Sd2Error if its file cannot be read."""
        with_bodies(mesh, [one])

    def _copy(self) -> None:
        recording = self._session.document.recording
        if recording is None or recording.mesh is None:
            return
        reading = recording.mesh_options()
        for name in ("faces", "things", "walls", "bodies", "called", "simulated"):
            reading.pop(name, None)
        path = str(recording.mesh.absolute())
        faces = None if recording.faces is None else str(recording.faces.absolute())
        beside_m = (_BESIDE_M, 0.0, 0.0)
        self._session.edits.add_body(Body(path, beside_m, reading=reading, faces=faces))

    def _add_file(self) -> None:
        path = ask_file(self, "Mesh of somebody else", _BODY_FILES)
        if path is not None:
            self._session.edits.add_body(Body(str(Path(path).absolute())))


_ABOUT = (
    "A wall, floor or ceiling mirrors waves: who moves before it is seen once more, farther away"
    " and slower or faster. It hides nothing; a screen does."
)
_ROOM_M = 0.5
"""Between a wall that is added and what stands before it."""


class WallsSection(SceneList):
    """Add walls, change them, take them away."""

    remove_text = "Remove wall"

    def __init__(self, session: Session, warn: Callable[[str], None]) -> None:
        far, takes = "Distance of the wall from the camera", "Power that a reflection takes"
        across, up = (
            NumberBox(-most, most, "°", f"Direction of the wall: {way}", decimals=1, step=5)
            for most, way in ((360, "to the right"), (90, "up"))
        )
        rows = {
            "Distance": {"distance_m": [NumberBox(*DISTANCES_M, " m", far, decimals=3)]},
            "Loss": {"loss_db": [NumberBox(*LOSSES_DB, " dB", takes, decimals=1, step=1)]},
            "Direction": {"azimuth_deg": [across], "elevation_deg": [up]},
        }
        super().__init__(session, "walls", MAX_WALLS, rows, warn)
        self._directions = Choice("Wall that is added", self, {name: name for name in DIRECTIONS})
        add = outlined("Add wall", "Put it around body and sensor", self._add_wall, self)
        head = row_of(title("Walls"), STRETCH, self._directions, add)
        self.setLayout(column_of(head, sentence(_ABOUT), self.about, spacing_px=6, margins_px=0))
        self.start(add)

    def _add_wall(self) -> None:
        mesh = self._session.document.mesh
        if mesh is None:
            return
        wall = Wall.named(self._directions.currentData(), 1.0)
        body_m = float((mesh.frame(0) @ wall.outward).max())
        away_m = body_m  # a floor is where the feet are
        if wall.name != "floor":
            sensor_m = float(np.dot(self._session.sensor.sensor.position_m, wall.outward))
            away_m = max(body_m, sensor_m) + _ROOM_M
        away_m = round(min(max(away_m, _ROOM_M), DISTANCES_M[1]), 2)
        self.take(lambda: replace(wall, distance_m=away_m))


_FILE = "mesh file…"
_THING_FILES = "Meshes (*.obj *.ply *.glb *.stl);;All files (*)"
_NO_THINGS = (
    "A box, a table, a screen, a doorway, or a mesh file: what stands between sensor and body hides"
    " that part of it. Drag it in the scene."
)


class ThingsPage(SceneList):
    """Add things, change them, take them away; ``warn`` says why a file is not taken."""

    def __init__(
        self, session: Session, synthesis: SynthesisModel, warn: Callable[[str], None]
    ) -> None:
        sizes = [
            NumberBox(*SIZES_M, " m", f"Size: {name}", decimals=3)
            for name in ("width", "height", "depth")
        ]
        rows = {
            "Place": {"position_m": place_boxes("Middle of its foot")},
            "Turn": {"turn_deg": [turn_box()]},
            "Size": {"size_m": sizes},
        }
        super().__init__(session, "things", MAX_THINGS, rows, warn)
        self.setObjectName("page")
        self._synthesis = synthesis
        self._shelf = Choice("What is added", self, {name: name for name in (*SHELF, _FILE)})
        add = outlined("Add", "Put it between sensor and body", self._add_thing, self)
        head = row_of(title("Things"), STRETCH, self._shelf, add)
        walls = WallsSection(session, warn)
        parts = head, sentence(_NO_THINGS), self.about, walls, STRETCH
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(8, 4, 8, 4)))
        self.start(add)

    def check(self, mesh: MeshSequence, one: Thing) -> None:
        """Raise Sd2Error if its file cannot be read."""
        with_things(mesh, [one])

    def values(self, number: int, name: str) -> tuple[Any, ...]:
        """Values in the boxes of a field; of the size also where none is given."""
        return self._size_of(number) if name == "size_m" else super().values(number, name)

    def name_of(self, one: Thing) -> str:
        """Name of one in the list."""
        recording = self._session.document.recording
        exists = recording is None or one in recording.things_there
        return one.name if exists else f"{one.name} (file missing)"

    def _add_thing(self) -> None:
        mesh, shape = self._session.document.mesh, self._shelf.currentData()
        if shape == _FILE:
            path = ask_file(self, "Mesh of a thing", _THING_FILES)
            shape = None if path is None else str(Path(path).absolute())
        if mesh is None or shape is None:
            return
        body = self._synthesis.torso_m or (0.0, 0.0, 2.0)
        x, _, z = np.mean([body, self._session.sensor.sensor.position_m], axis=0).round(2).tolist()
        floor_m = round(float(mesh.frame(0)[:, 1].max()), 2)
        self.take(lambda: Thing(shape, (x, floor_m, z)))

    def _size_of(self, number: int) -> tuple[float, ...]:
        """Width, height and depth of a thing, without its turn."""
        thing, mesh = self.kept[number], self._session.document.mesh
        if thing.size_m is not None:
            return thing.size_m
        if not thing.is_file:
            return SHELF[thing.shape][0]
        around = None if mesh is None else mesh.surroundings
        if around is None or thing not in around.things:
            return (SIZES_M[0],) * 3
        x, y, z = around.surfaces[around.things.index(thing)][0].T
        turned = np.exp(1j * np.radians(thing.turn_deg)) * (x + 1j * z)
        return tuple(float(np.ptp(one)) for one in (turned.real, y, turned.imag))
