"""A mesh of another program over the video, before it is taken and whenever it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import get_args

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QLayout, QScrollArea, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.foreign_mesh.model import MeshPreview
from sd2app.manual.help import with_help
from sd2app.palette import Palette
from sd2app.session.content import ReadMesh
from sd2app.session.session import Session
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.dialogs import Dialog, accepted, accepting, ask_file
from sd2app.widgets.inputs import CheckBox, Choice, FrameSlider, NumberBox, option_box
from sd2app.widgets.layouts import column_of, form_of, row_of
from sd2app.widgets.mesh_painting import draw_mesh, no_picture, paint_picture
from sd2app.widgets.panel import ElidedLabel, outlined, say, sentence, side_by_side
from sd2app.widgets.text import counted
from sd2core.files.turns import Turn
from sd2core.options.records import option_named
from sd2core.options.shared import MeshReading
from sd2core.recording.recording import Recording

_OPACITY = 0.65
_AXES = {"x180": "y was up", "x90": "z was up"}
_TURNS = {None: "not turned"} | {
    turn: f"{turn[0]} by {turn[1:]}°" + (f": {_AXES[turn]}" if turn in _AXES else "")
    for turn in dict.fromkeys((*_AXES, *get_args(Turn)))
}
_UNITS = {None: "metres", 0.01: "centimetres", 0.001: "millimetres", 0.0254: "inches"}
_DISTANCE_M = 3.0
"""Shown where it is not known yet."""
_TICK_PX, _BOX_PX = 68, 140
_FACES = "Triangles (*.npy *.npz *.obj *.ply *.glb);;All files (*)"
_MODELS = "SMPL, SMPL-H, SMPL-X, MHR (*.npz *.pkl *.pt);;All files (*)"


class MeshOverPicture(Canvas):
    """The frame to look at, with the mesh over it."""

    USUAL_PX = 560, 420

    def __init__(self, preview: MeshPreview, colours: Palette, parent: QWidget) -> None:
        super().__init__(parent)
        self._preview, self._colours = preview, colours
        self.setMinimumSize(320, 240)
        self.setAccessibleName("The mesh over the video")
        self.follow(preview.changed, preview.picture_changed)

    def paint(self, painter: QPainter) -> None:
        """Paint the picture, and the mesh or why there is none."""
        preview, colours = self._preview, self._colours
        painter.fillRect(self.rect(), QColor(colours.well))
        picture = preview.picture
        if picture is None and preview.recording.video is not None:
            painter.setPen(QColor(colours.muted))
            text = preview.problem or "Reading the video…"
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        mesh, colour = preview.mesh, QColor(colours.overlay)
        # Dots cover little: they have to be stronger to be seen at all.
        opacity = 1.0 if mesh is not None and mesh.faces is None else _OPACITY
        camera, time_s = preview.camera, preview.time_s
        shown = no_picture(camera) if picture is None else picture
        box = paint_picture(painter, self.rect(), shown)
        draw_mesh(painter, box, mesh, time_s, camera, colour, opacity)


class MeshDialog(Dialog):
    """A view of :class:`MeshPreview`."""

    def __init__(self, preview: MeshPreview, palette: Palette, parent: QWidget) -> None:
        super().__init__("Mesh over the video", parent)
        self.preview = preview
        self.picture = MeshOverPicture(preview, palette, self)
        self._slider = FrameSlider(preview.show_frame, self)
        self._refreshers: list[Callable[[], None]] = []
        self._file = ElidedLabel(self, "title")
        self._file.setText(preview.recording.mesh.name if preview.recording.mesh else "")
        self._state, self._notes = sentence(""), sentence("")
        self._cure = outlined("", "What is unlikely is then put right", self._accept_cure, self)
        self._buttons, self._take = accepting(self, "Take")
        self._lay_out()
        preview.changed.connect(self._refresh)
        self._refresh()
        self.resize(980, 600)

    # --- building -------------------------------------------------------------------------

    def _lay_out(self) -> None:
        change = self.preview.change
        self._person = Choice("Person", self)
        self._person.activated.connect(
            lambda place: change(person=list(self.preview.persons)[place - 1] if place else None)
        )
        turn = Choice("How the mesh is turned", self, _TURNS, lambda value: change(turn=value))
        self._refreshers.append(lambda: turn.show_value(self.preview.read_as.turn))
        self._unit = Choice("Unit", self, _UNITS, lambda value: change(scale=value))
        self._focal = option_box(MeshReading, "focal_px", " px", step=10.0)
        self._rate = option_box(MeshReading, "fps", " frames/s", decimals=3)
        distance = option_box(MeshReading, "distance_m", " m", decimals=2, step=0.1)
        distance.setValue(_DISTANCE_M)
        for box in (self._focal, self._rate, distance):
            box.setFixedWidth(_BOX_PX)
        faces = self._file_row("faces", _FACES, self.preview.set_faces)
        model = self._file_row("body_model", _MODELS, lambda path: change(body_model=str(path)))
        form = form_of(
            ("Person", self._person),
            ("Turn", turn),
            ("Focal length", self._known("focal_px", self._focal)),
            ("Frame rate", self._known("frames_per_s", self._rate)),
            ("Unit", self._unit),
            ("Moved forward", self._known("distance_m", distance, "by:")),
            ("Faces", faces),
            ("Body model", model),
        )
        self._notes.setAlignment(Qt.AlignmentFlag.AlignTop)
        area = QScrollArea()
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setWidgetResizable(True)
        area.setWidget(self._notes)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        left = column_of((self.picture, 1), self._slider)
        cure = side_by_side(self._cure)
        right = column_of(self._file, form, self._state, cure, (area, 1), spacing_px=12)
        columns = row_of((left, 3), (right, 2), spacing_px=24)
        foot = with_help("Mesh over the video", self._buttons)
        self.setLayout(column_of((columns, 1), foot, spacing_px=16, margins_px=16))

    def _known(self, setting: str, box: NumberBox, text: str = "known:") -> QLayout:
        """A number that the file may say itself, and a box to tick for one that is typed."""
        change = self.preview.change
        known = CheckBox(
            text, self, lambda on: change(**{setting: box.value() if on else None}), box.toolTip()
        )
        known.setMinimumWidth(_TICK_PX)
        box.valueChanged.connect(lambda value: change(**{setting: value}))

        def refresh() -> None:
            value = getattr(self.preview.read_as, setting)
            known.show_checked(value is not None)
            box.setEnabled(value is not None)
            if value is not None:
                box.show_value(value)

        self._refreshers.append(refresh)
        return side_by_side(known, box)

    def _file_row(self, name: str, kinds: str, take: Callable[[Path], object]) -> QLayout:
        """A file that the mesh may need beside it, and a button to choose it."""
        shown, tip = ElidedLabel(self), option_named(MeshReading, name).sentence

        def ask() -> None:
            if path := ask_file(self, tip, kinds):
                take(path)

        def refresh() -> None:
            recording = self.preview.recording
            path = getattr(recording, name, None) or getattr(recording.mesh_reading, name, None)
            shown.setText("none given" if path is None else Path(path).name)

        self._refreshers.append(refresh)
        choose = outlined("Choose…", tip, ask, self, name=tip)
        return row_of((shown, 1), choose, spacing_px=8)

    # --- following the model --------------------------------------------------------------

    def _refresh(self) -> None:
        preview = self.preview
        for refresh in self._refreshers:
            refresh()
        self._slider.show_frame(preview.frame, preview.frames, preview.time_s)
        persons = preview.persons
        listed = [f"{name}: {counted(count, 'frame')}" for name, count in persons.items()]
        person = str(preview.read_as.person)
        chosen = [*persons].index(person) + 1 if person in persons else 0
        self._person.offer(["the one seen longest" if persons else "the only one", *listed], chosen)
        self._person.setEnabled(len(persons) > 1)
        scale = preview.read_as.scale
        if self._unit.findData(scale) < 0:
            self._unit.addItem(f"{scale:g} m", scale)
        self._unit.show_value(scale)
        if preview.read_as.focal_px is None:
            self._focal.show_value(preview.camera.focal_px)
        if preview.read_as.frames_per_s is None and preview.reader is not None:
            self._rate.show_value(preview.reader.timebase.frames_per_s)
        self._say_state()
        self._notes.setText(preview.notes)
        self._take.setEnabled(preview.taken is not None)

    def _say_state(self) -> None:
        preview = self.preview
        text, role = "", "muted"
        if preview.loading:
            text = "Reading the mesh…"
        elif preview.mesh_problem:
            text, role = preview.mesh_problem, "warning"
        elif preview.mesh is not None and preview.offers:
            text, role = preview.offers[0].text, "warning"
        elif not preview.someone:
            text, role = "The mesh has nobody in this frame.", "warning"
        say(self._state, text, role)
        self._state.setVisible(bool(text))
        self._cure.setVisible(bool(preview.offers))
        if preview.offers:
            self._cure.setText(preview.offers[0].cure.words)

    def _accept_cure(self) -> None:
        if self.preview.offers:
            self.preview.accept(self.preview.offers[0].cure)


class ForeignMeshFeature(Feature):
    """The dialog in which one says how a mesh is to be read, and sees what comes of it."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell

    def actions(self) -> Sequence[Action]:
        """Reading the mesh that is open another way."""
        document = self._session.document
        return (
            Action(
                "read_mesh", "File", "Lay the mesh over the video…", (),
                "Read the mesh another way (person, turn, focal length, unit) and see it over the"
                " video as it changes",
                self._read_again,
                lambda: document.recording is not None and document.recording.mesh is not None,
            ),
        )  # fmt: skip

    def ask(self, recording: Recording) -> ReadMesh | None:
        """Show the mesh of a recording over its video; None where it is not taken."""
        window = self._shell.dialog_parent
        preview = MeshPreview(recording, window)
        dialog = MeshDialog(preview, self._session.display.palette, window)
        taken = preview.taken if accepted(dialog) else None
        preview.close()
        preview.deleteLater()
        return taken

    def _read_again(self) -> None:
        recording = self._session.document.recording
        assert recording is not None
        if taken := self.ask(recording):
            self._session.edits.take_mesh("Read mesh another way", taken)
