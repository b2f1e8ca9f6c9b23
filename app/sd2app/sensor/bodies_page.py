"""Other people in the scene: whose mesh, where, how turned, how much later, and what called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QLineEdit, QWidget

from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, form_of, pane, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.errors import Sd2Error
from sd2core.io.bodies import with_bodies
from sd2core.mesh.bodies import LATEST_S, Body
from sd2core.mesh.things import FARTHEST_THING_M

_KINDS = "Meshes (*.npz *.zip *.pkl *.npy *.obj *.ply *.glb);;All files (*)"
_NOTHING = (
    "Another moving mesh in the same scene: the map is the sum of all, and each hides what is"
    " behind it. Drag it in the scene."
)
_BESIDE_M = 0.8


class BodiesPage(QWidget):
    """Add bodies, change them, take them away; ``warn`` says why a file is not taken."""

    def __init__(self, session: Session, warn: Callable[[str], None]) -> None:
        super().__init__()
        self.setObjectName("page")
        self._session, self._warn = session, warn
        self._shown: tuple[Body, ...] = ()
        self._same = outlined("Add a copy", "The recording's own mesh, beside it", self._copy, self)
        self._add = outlined("Add file…", "A mesh of somebody else", self._add_file, self)
        self._which = Choice("Other people in the scene", self)
        self._which.currentIndexChanged.connect(self._refresh_fields)
        self._remove = outlined("Remove", "Take it out of the scene", self._remove_body, self)
        self._name = QLineEdit(self)
        self._name.setAccessibleName("Name of the person")
        self._name.editingFinished.connect(self._type)
        far = FARTHEST_THING_M
        self._place = [
            NumberBox(-far, far, " m", f"Moved from where its file has it, {axis}: {way}")
            for axis, way in (("x", "to the right"), ("y", "down"), ("z", "forward"))
        ]
        self._turn = NumberBox(
            -360, 360, "°", "Turn, seen from above clockwise", decimals=1, step=5
        )
        self._later = NumberBox(-LATEST_S, LATEST_S, " s", "How much later it moves", decimals=3)
        for box in (*self._place, self._turn, self._later):
            box.valueChanged.connect(self._type)
        rows = [
            (name, pane(row_of(*boxes, spacing_px=4, margins_px=0)))
            for name, boxes in (
                ("Name", [self._name]),
                ("Moved", self._place),
                ("Turn", [self._turn]),
                ("Later", [self._later]),
            )
        ]
        which = row_of((self._which, 1), self._remove, spacing_px=6)
        self._about = pane(which, form_of(*rows, gaps_px=(8, 3)), spacing_px=6)
        head = row_of(title("Bodies"), STRETCH, self._same, self._add)
        parts = head, sentence(_NOTHING), self._about, STRETCH
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(8, 4, 8, 4)))
        session.document.changed.connect(self._refresh)
        self._refresh()

    @property
    def _bodies(self) -> tuple[Body, ...]:
        recording = self._session.document.recording
        return () if recording is None else recording.bodies

    @property
    def _current(self) -> int:
        return self._which.currentIndex()

    # --- changing -------------------------------------------------------------------------

    def _copy(self) -> None:
        recording = self._session.document.recording
        if recording is None or recording.mesh is None:
            return
        reading = recording.mesh_options()
        if reading.pop("faces", None) is not None:
            self._warn("The mesh of this recording has its faces in another file: save it as one.")
            return
        for name in ("things", "walls", "bodies", "called"):
            reading.pop(name, None)
        path = str(Path(recording.mesh).absolute())
        self._take(lambda: Body(path, (_BESIDE_M, 0.0, 0.0), reading=reading))

    def _add_file(self) -> None:
        path = ask_file(self, "Mesh of somebody else", _KINDS)
        if path is not None:
            self._take(lambda: Body(str(Path(path).absolute())))

    def _type(self) -> None:
        number, bodies = self._current, self._bodies
        if not 0 <= number < len(bodies):
            return
        body, changes = bodies[number], dict[str, object]()
        moved_m = tuple(box.value() for box in self._place)
        if not np.allclose(moved_m, body.moved_m, rtol=0, atol=5e-3):
            changes["moved_m"] = moved_m
        if abs(self._turn.value() - body.turn_deg) > 0.05:
            changes["turn_deg"] = self._turn.value()
        if abs(self._later.value() - body.start_s) > 5e-4:
            changes["start_s"] = self._later.value()
        if self._name.text().strip() != body.person:
            changes["person"] = self._name.text().strip()
        if changes:
            self._take(lambda: replace(body, **changes), number)  # type: ignore[arg-type]

    def _take(self, make: Callable[[], Body], number: int | None = None) -> None:
        """Add a body, or put it in another's place, if its file can be read."""
        mesh, edits = self._session.document.mesh, self._session.edits
        try:
            body = make()
            if mesh is not None:
                with_bodies(mesh, [body])
        except Sd2Error as error:
            self._warn(str(error))
            self._refresh_fields()
            return
        if number is None:
            edits.add_to_scene(body)
        else:
            edits.change_in_scene(number, body)

    def _remove_body(self) -> None:
        if 0 <= self._current < len(self._bodies):
            self._session.edits.remove_from_scene(self._current, self._bodies[self._current])

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        bodies, before, current = self._bodies, self._shown, self._current
        for button in (self._same, self._add):
            button.setEnabled(self._session.document.mesh is not None)
        self._about.setVisible(bool(bodies))
        if bodies != before:
            self._shown = bodies
            # The one that was changed, or the newest.
            changed = [at for at, one in enumerate(bodies) if one not in before]
            current = changed[-1] if changed else current
        names = [f"{number}: {one.name}" for number, one in enumerate(bodies, start=2)]
        self._which.offer(names, min(max(current, 0), len(bodies) - 1))
        self._refresh_fields()

    def _refresh_fields(self) -> None:
        if not 0 <= self._current < len(self._bodies):
            return
        body = self._bodies[self._current]
        self._name.setText(body.person)
        boxes = (*self._place, self._turn, self._later)
        for box, value in zip(boxes, (*body.moved_m, body.turn_deg, body.start_s), strict=True):
            box.show_value(value)
