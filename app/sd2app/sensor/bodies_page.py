"""Other people in the scene: whose mesh, where, how turned, how much later, and what called."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QLineEdit

from sd2app.sensor.scene_list import Fields, SceneList, place_boxes, turn_box
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.io.bodies import with_bodies
from sd2core.mesh.bodies import LATEST_S, MAX_BODIES, Body
from sd2core.mesh.sequence import MeshSequence

_KINDS = "Meshes (*.npz *.zip *.pkl *.npy *.obj *.ply *.glb);;All files (*)"
_NOTHING = (
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
        parts = row_of(title("Bodies"), STRETCH, same, add), sentence(_NOTHING), self.about, STRETCH
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
        path = ask_file(self, "Mesh of somebody else", _KINDS)
        if path is not None:
            self._session.edits.add_body(Body(str(Path(path).absolute())))
