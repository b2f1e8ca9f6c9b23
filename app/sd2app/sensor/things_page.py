"""Things around the body: what stands there, where, how it is turned, and how large it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QWidget

from sd2app.maps.model import SynthesisModel
from sd2app.sensor.walls_section import WallsSection
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, form_of, pane, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.errors import Sd2Error
from sd2core.io.things import with_things
from sd2core.mesh.things import FARTHEST_THING_M, SHELF, SIZES_M, Thing

_FILE = "mesh file…"
_KINDS = "Meshes (*.obj *.ply *.glb *.stl);;All files (*)"
_NOTHING = (
    "A box, a table, a screen, a doorway, or a mesh file: what stands between sensor and body hides"
    " that part of it. Drag it in the scene."
)


class ThingsPage(QWidget):
    """Add things, change them, take them away; ``warn`` says why a file is not taken."""

    def __init__(
        self, session: Session, synthesis: SynthesisModel, warn: Callable[[str], None]
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self._session, self._synthesis, self._warn = session, synthesis, warn
        self._shown: tuple[Thing, ...] = ()
        self._shelf = Choice("What is added", self, {name: name for name in (*SHELF, _FILE)})
        self._add = outlined("Add", "Put it between sensor and body", self._add_thing, self)
        self._which = Choice("Things in the scene", self)
        self._which.currentIndexChanged.connect(self._refresh_fields)
        self._remove = outlined("Remove", "Take it out of the scene", self._remove_thing, self)
        far = FARTHEST_THING_M
        self._place = [
            NumberBox(-far, far, " m", f"Middle of its foot, {axis}: {way}")
            for axis, way in (("x", "to the right"), ("y", "down"), ("z", "forward"))
        ]
        self._turn = NumberBox(
            -360, 360, "°", "Turn, seen from above clockwise", decimals=1, step=5
        )
        self._size = [
            NumberBox(*SIZES_M, " m", f"Size: {name}", decimals=3)
            for name in ("width", "height", "depth")
        ]
        for box in (*self._place, self._turn, *self._size):
            box.valueChanged.connect(self._type)
        rows = [
            (name, pane(row_of(*boxes, spacing_px=4, margins_px=0)))
            for name, boxes in (
                ("Place", self._place),
                ("Turn", [self._turn]),
                ("Size", self._size),
            )
        ]
        which = row_of((self._which, 1), self._remove, spacing_px=6)
        self._about = pane(which, form_of(*rows, gaps_px=(8, 3)), spacing_px=6)
        head = row_of(title("Things"), STRETCH, self._shelf, self._add)
        walls = WallsSection(session)
        parts = head, sentence(_NOTHING), self._about, walls, STRETCH
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(8, 4, 8, 4)))
        session.document.changed.connect(self._refresh)
        self._refresh()

    @property
    def _things(self) -> tuple[Thing, ...]:
        recording = self._session.document.recording
        return () if recording is None else recording.things

    @property
    def _current(self) -> int:
        return self._which.currentIndex()

    # --- changing -------------------------------------------------------------------------

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
        self._take(lambda: Thing(shape, (x, floor_m, z)), self._session.edits.add_to_scene)

    def _type(self) -> None:
        number, things = self._current, self._things
        if not 0 <= number < len(things):
            return
        thing = things[number]
        (x, y, z), (wide, high, deep) = (
            [box.value() for box in boxes] for boxes in (self._place, self._size)
        )
        changes: dict[str, object] = {}
        if not np.allclose((x, y, z), thing.position_m, rtol=0, atol=5e-3):
            changes["position_m"] = x, y, z
        if abs(self._turn.value() - thing.turn_deg) > 0.05:
            changes["turn_deg"] = self._turn.value()
        if not np.allclose((wide, high, deep), self._size_of(number), rtol=0, atol=5e-4):
            changes["size_m"] = wide, high, deep
        if changes:
            edits = self._session.edits
            self._take(
                lambda: replace(thing, **changes),  # type: ignore[arg-type]
                lambda changed: edits.change_in_scene(number, changed),
            )

    def _take(self, make: Callable[[], Thing], use: Callable[[Thing], None]) -> None:
        """Use a thing, if its file can be read."""
        mesh = self._session.document.mesh
        try:
            thing = make()
            if mesh is not None:
                with_things(mesh, [thing])
        except Sd2Error as error:
            self._warn(str(error))
        else:
            use(thing)

    def _remove_thing(self) -> None:
        if 0 <= self._current < len(self._things):
            self._session.edits.remove_from_scene(self._current, self._things[self._current])

    # --- showing --------------------------------------------------------------------------

    def _size_of(self, number: int) -> tuple[float, ...]:
        """Width, height and depth of a thing, without its turn."""
        thing, mesh = self._things[number], self._session.document.mesh
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

    def _refresh(self) -> None:
        things, before, current = self._things, self._shown, self._current
        self._add.setEnabled(self._session.document.mesh is not None)
        self._about.setVisible(bool(things))
        if things != before:
            self._shown = things
            # The one that was changed, or the newest.
            changed = [at for at, one in enumerate(things) if one not in before]
            current = changed[-1] if changed else current
        recording = self._session.document.recording
        there = () if recording is None else recording.things_there
        names = [
            f"{number}: {one.name}" + ("" if one in there else " (file missing)")
            for number, one in enumerate(things, start=1)
        ]
        self._which.offer(names, min(max(current, 0), len(things) - 1))
        self._refresh_fields()

    def _refresh_fields(self) -> None:
        if not 0 <= self._current < len(self._things):
            return
        thing = self._things[self._current]
        for boxes, values in (
            (self._place, thing.position_m),
            ([self._turn], (thing.turn_deg,)),
            (self._size, self._size_of(self._current)),
        ):
            for box, value in zip(boxes, values, strict=True):
                box.show_value(value)
