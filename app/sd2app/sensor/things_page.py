"""Things and walls around the body: what stands there, where, and how large it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sd2app.maps.model import SynthesisModel
from sd2app.sensor.scene_list import SceneList, place_boxes, turn_box
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.io.things import with_things
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import MAX_THINGS, SHELF, SIZES_M, Thing
from sd2core.mesh.walls import DIRECTIONS, DISTANCES_M, LOSSES_DB, MAX_WALLS, Wall

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
_KINDS = "Meshes (*.obj *.ply *.glb *.stl);;All files (*)"
_NOTHING = (
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
        parts = head, sentence(_NOTHING), self.about, walls, STRETCH
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
            path = ask_file(self, "Mesh of a thing", _KINDS)
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
