"""Walls and floors that mirror waves: which there are, how far away, and what they take."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from PySide6.QtWidgets import QWidget

from sd2app.session.session import Session
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, form_of, pane, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.mesh.walls import DIRECTIONS, DISTANCES_M, LOSSES_DB, MAX_WALLS, Wall

_ABOUT = (
    "A wall, floor or ceiling mirrors waves: who moves before it is seen once more, farther away"
    " and slower or faster. It hides nothing; a screen does."
)
_ROOM_M = 0.5
"""Between a wall that is added and what stands before it."""


class WallsSection(QWidget):
    """Add walls, change them, take them away."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._shown: tuple[Wall, ...] = ()
        self._directions = Choice("Wall that is added", self, {name: name for name in DIRECTIONS})
        self._add = outlined("Add wall", "Put it around body and sensor", self._add_wall, self)
        self._which = Choice("Walls in the scene", self)
        self._which.currentIndexChanged.connect(self._refresh_fields)
        self._remove = outlined("Remove wall", "Take it out of the scene", self._remove_wall, self)
        far = "Distance of the wall from the camera"
        self._away = NumberBox(*DISTANCES_M, " m", far, decimals=3)
        self._loss = NumberBox(
            *LOSSES_DB, " dB", "Power that a reflection takes", decimals=1, step=1
        )
        self._angles = [
            NumberBox(-most, most, "°", f"Direction of the wall: {way}", decimals=1, step=5)
            for most, way in ((360, "to the right"), (90, "up"))
        ]
        for box in (self._away, self._loss, *self._angles):
            box.valueChanged.connect(self._type)
        rows = [
            (name, pane(row_of(*boxes, spacing_px=4, margins_px=0)))
            for name, boxes in (
                ("Distance", [self._away]),
                ("Loss", [self._loss]),
                ("Direction", self._angles),
            )
        ]
        which = row_of((self._which, 1), self._remove, spacing_px=6)
        self._about = pane(which, form_of(*rows, gaps_px=(8, 3)), spacing_px=6)
        head = row_of(title("Walls"), STRETCH, self._directions, self._add)
        self.setLayout(column_of(head, sentence(_ABOUT), self._about, spacing_px=6, margins_px=0))
        session.document.changed.connect(self._refresh)
        self._refresh()

    @property
    def _walls(self) -> tuple[Wall, ...]:
        recording = self._session.document.recording
        return () if recording is None else recording.walls

    @property
    def _current(self) -> int:
        return self._which.currentIndex()

    def _add_wall(self) -> None:
        mesh, walls = self._session.document.mesh, self._walls
        if mesh is None or len(walls) >= MAX_WALLS:
            return
        wall = Wall.named(self._directions.currentData(), 1.0)
        body_m = float((mesh.frame(0) @ wall.outward).max())
        away_m = body_m  # a floor is where the feet are
        if wall.name != "floor":
            sensor_m = float(np.dot(self._session.sensor.sensor.position_m, wall.outward))
            away_m = max(body_m, sensor_m) + _ROOM_M
        away_m = round(min(max(away_m, _ROOM_M), DISTANCES_M[1]), 2)
        self._session.edits.add_to_scene(replace(wall, distance_m=away_m))

    def _type(self) -> None:
        number, walls = self._current, self._walls
        if not 0 <= number < len(walls):
            return
        azimuth_deg, elevation_deg = (box.value() for box in self._angles)
        typed = Wall(self._away.value(), azimuth_deg, elevation_deg, self._loss.value())
        if self._rounded(typed) != self._rounded(walls[number]):
            self._session.edits.change_in_scene(number, typed)

    @staticmethod
    def _rounded(wall: Wall) -> tuple[float, ...]:
        """What the boxes show of a wall."""
        degrees = wall.azimuth_deg, wall.elevation_deg, wall.loss_db
        return round(wall.distance_m, 3), *(round(value, 1) for value in degrees)

    def _remove_wall(self) -> None:
        number, walls = self._current, self._walls
        if 0 <= number < len(walls):
            self._session.edits.remove_from_scene(number, walls[number])

    def _refresh(self) -> None:
        walls, before, current = self._walls, self._shown, self._current
        self._add.setEnabled(self._session.document.mesh is not None and len(walls) < MAX_WALLS)
        self._about.setVisible(bool(walls))
        if walls != before:
            self._shown = walls
            # The one that was changed, or the newest.
            changed = [at for at, one in enumerate(walls) if one not in before]
            current = changed[-1] if changed else current
        names = [f"{number}: {one.name}" for number, one in enumerate(walls, start=1)]
        self._which.offer(names, min(max(current, 0), len(walls) - 1))
        self._refresh_fields()

    def _refresh_fields(self) -> None:
        if not 0 <= self._current < len(self._walls):
            return
        wall = self._walls[self._current]
        self._away.show_value(wall.distance_m)
        self._loss.show_value(wall.loss_db)
        for box, value in zip(self._angles, (wall.azimuth_deg, wall.elevation_deg), strict=True):
            box.show_value(value)
