"""Walls and floors that mirror waves: which there are, how far away, and what they take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sd2app.sensor.scene_list import SceneList
from sd2app.session.session import Session
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
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
