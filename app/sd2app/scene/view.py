"""The 3D view of the window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, get_args

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QSize, Qt
from PySide6.QtGui import QCloseEvent, QGuiApplication, QMouseEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.scene.camera import Preset
from sd2app.scene.inertial import LIMB_HINT, PLACING_HINT, InertialHand, LimbHand
from sd2app.scene.navigation import Navigator
from sd2app.scene.offscreen_backend import ImageBackend, NoOpenGL
from sd2app.scene.overlay import Overlay
from sd2app.scene.scene import Scene
from sd2app.session.maps import part_words
from sd2app.widgets.canvas import MenuPart
from sd2app.widgets.panel import sentence
from sd2app.widgets.picture import picture_menu
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    # The view alone loads no kernels.
    from sd2app.imu.model import ImuModel
    from sd2app.maps.limbs import LimbsModel
    from sd2app.maps.model import SynthesisModel
    from sd2app.sensor.placements import PlacementsModel
    from sd2app.session.session import Session
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.mesh.things import Surroundings

_MOUSE = (
    QEvent.Type.MouseMove,
    QEvent.Type.MouseButtonPress,
    QEvent.Type.MouseButtonRelease,
    QEvent.Type.MouseButtonDblClick,
)
_REACH_PX = 8.0
"""Distance from the pointer within which vertices are looked for."""
_NOTCH = 120.0
"""Angle of one notch of the wheel in Qt's units."""


class SceneView(QWidget):
    """Mesh, sensor, camera and planned places; the sensor can be dragged, a place picked.

    It changes no model: a drag goes to the session's edits, a click on a place to the model of
    placements, which makes it an edit, and what is on screen follows the models' signals.
    Vertices and colours are fetched when the picture is drawn, so a hidden view costs nothing.
    """

    def __init__(
        self,
        session: Session,
        synthesis: SynthesisModel,
        placements: PlacementsModel,
        inertial: ImuModel,
        limbs: LimbsModel,
    ) -> None:
        super().__init__()
        self._session, self._synthesis, self._placements = session, synthesis, placements
        self._inertial = inertial
        self._backend: ImageBackend | None = None
        self.menu_parts: Sequence[MenuPart] = ()
        self.setMinimumSize(200, 150)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        try:
            self._backend = ImageBackend(self)
        except NoOpenGL as problem:
            self._explain(str(problem))
            return
        self.scene = Scene(self._backend.renderer)
        self.navigator = Navigator(self.scene, session.edits, placements.use, self.request_render)
        self.overlay = Overlay(self.scene, self.navigator, self)
        self.inertial_hand = InertialHand(self.scene, session, inertial)
        self.limb_hand = LimbHand(self.scene, self.navigator, self.inertial_hand, limbs)
        self.setAccessibleName("Scene")
        self._frame: int | None = None
        self._stale_scattering = True
        self._planned: object = None
        self._dragged = False
        self._around: Surroundings | None = None
        self._others: tuple[MeshSequence, ...] = ()
        self._backend.installEventFilter(self)
        for signal, slot in (
            (session.display.theme_changed, self._follow_theme),
            (session.display.mesh_changed, self._follow_colour),
            (session.document.opened, self._attach),
            (session.sensor.dragging_changed, self._follow_sensor),
            (session.document.changed, self._follow_things),
            (session.sensor.dragging_changed, self._follow_things),
            (session.playback.frame_changed, self._follow_clock),
            (session.sensor.changed, self._follow_sensor),
            (synthesis.frame_changed, self._follow_scattering),
            (placements.changed, self._follow_placements),
            (inertial.changed, self._follow_inertial),
            (limbs.changed, self._follow_limbs),
            (session.placing.changed, self._follow_placing),
        ):
            signal.connect(slot)
            slot()
        self._lay_out()
        self._backend.start(self._prepare)

    def sizeHint(self) -> QSize:
        """A comfortable size."""
        return QSize(600, 450)

    def set_view(self, preset: Preset) -> None:
        """Look from one of the ready-made places."""
        if preset not in get_args(Preset):
            raise ValueError(f"view {preset!r} is not one of {get_args(Preset)}")
        if self._backend is not None:
            self.scene.look_from(preset)
            self.request_render()

    def request_render(self) -> None:
        """Draw again."""
        if self._backend is not None:
            self._backend.request_render()
            self.overlay.update()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Release everything of VTK."""
        event.accept()
        backend, self._backend = self._backend, None
        if backend is not None:
            backend.removeEventFilter(self)
            backend.shut_down()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fill the view."""
        self._lay_out()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the mouse for the widget that shows the picture."""
        if self._backend is None:
            return False
        kind = event.type()
        if isinstance(event, QMouseEvent) and kind in _MOUSE:
            self._handle_mouse(event)
        elif isinstance(event, QWheelEvent):
            self.navigator.wheel(*_place(event), event.angleDelta().y() / _NOTCH)
        elif kind == QEvent.Type.Leave:
            self.navigator.leave()
            self.overlay.show_reading((0.0, 0.0), "")
            self.overlay.hint = PLACING_HINT if self.inertial_hand.placing else ""
        else:
            if kind == QEvent.Type.Hide:
                self.navigator.let_go()
            return False
        self._choose_cursor()
        return True

    def _handle_mouse(self, event: QMouseEvent) -> None:
        kind, place = event.type(), _place(event)
        if kind == QEvent.Type.MouseMove:
            if not event.buttons():
                self.navigator.let_go()  # a menu or a dialog may have taken the release
            self.navigator.move(*place, event.modifiers())
            at_body = not event.buttons() and not self._at_something
            part = self.limb_hand.part_at(*place) if at_body else None
            self.overlay.show_reading(place, self._words_at(place, part) if at_body else "")
            if not self.inertial_hand.placing:
                self.overlay.hint = "" if part is None else LIMB_HINT
        elif kind == QEvent.Type.MouseButtonRelease:
            if not self.navigator.release(*place, event.button()):
                return  # a drag
            if event.button() == Qt.MouseButton.LeftButton:
                if self.inertial_hand.placing:
                    self.inertial_hand.click(*place)
                elif not self._at_something:
                    self.limb_hand.click(*place, event.modifiers())
            elif event.button() == Qt.MouseButton.RightButton:
                menu = picture_menu(self, self.menu_parts, QPointF(*place))
                menu.popup(event.globalPosition().toPoint())
        elif kind == QEvent.Type.MouseButtonDblClick and self.navigator.target is None:
            self.set_view("overview")
        else:
            # Also the second press of a double click: a hurried hand takes the sensor.
            self.navigator.press(*place, event.button(), event.modifiers())

    def _words_at(self, place: tuple[float, float], part: str | None) -> str:
        """Words for what is under the pointer, or what a click would place there."""
        words = self.inertial_hand.words_at(*place)
        if words or self.inertial_hand.placing:
            return words
        reading = "" if self.navigator.target is not None else self.reading_at(*place)
        return "  ·  ".join(filter(None, [part and part_words(part), reading]))

    def reading_at(self, x_px: float, y_px: float) -> str:
        """Range, radial velocity and visibility of the vertex in front at a pixel, in words."""
        mesh, scattering = self._session.document.mesh, self._synthesis.frame
        if mesh is None or scattering is None or self._frame is None or self.overlay.message:
            return ""
        vertices_m = mesh.frame(self._frame)
        if len(vertices_m) != len(scattering.range_m):
            return ""
        x, y, depth = self.scene.pose.project(vertices_m).T
        near = np.flatnonzero((np.hypot(x - x_px, y - y_px) <= _REACH_PX) & (depth > 0.01))
        if not near.size:
            return ""
        vertex = near[depth[near].argmin()]
        velocity = f"{scattering.velocity_mps[vertex]:+.2f}".replace("-", "−")
        seen = "seen by the sensor" if scattering.visible[vertex] else "hidden from the sensor"
        return f"{scattering.range_m[vertex]:.2f} m  ·  {velocity} m/s  ·  {seen}"

    def offer_value(self, menu: QMenu, place: QPointF) -> None:
        """Offer to copy what is read of the mesh at a place."""
        words = self.reading_at(place.x(), place.y())
        copy = menu.addAction("Copy &value", lambda: QGuiApplication.clipboard().setText(words))
        copy.setEnabled(bool(words))

    @property
    def _at_something(self) -> bool:
        """True at what is no body."""
        target = self.navigator.target
        if target is None:
            return False
        return target.kind != "movable" or self.scene.movables.person_of(target.number) is None

    # What changed

    def _attach(self) -> None:
        self.scene.look_from("overview")
        self._frame = None
        self.scene.clear_mesh()
        document = self._session.document
        mesh, has_recording = document.mesh, document.recording is not None
        self.overlay.message = "No mesh in this recording" if has_recording and mesh is None else ""
        if mesh is not None:
            frame = mesh.timebase.frame_at(self._session.playback.time_s)
            with self._explaining():
                self.scene.set_mesh(mesh, frame)
                self._frame = frame
        self._follow_sensor()

    def _follow_clock(self) -> None:
        if self._session.document.mesh is not None:
            self._follow_scattering()

    def _follow_sensor(self) -> None:
        model, seen = self._session.sensor, self.scene.sensor_in_sight or self._dragged
        if self._dragged and not model.dragging:
            self.navigator.let_go()  # an edit, or another recording, ended the drag
        self._dragged = model.dragging
        self.scene.set_sensor(model.sensor)
        # Not while the hand turns the view, and not for who looks at something else.
        if seen and not model.dragging and not self.navigator.busy:
            self.scene.keep_sensor_in_sight()
        self.navigator.look_again()
        self._follow_scattering()

    def _follow_scattering(self) -> None:
        self._stale_scattering = True
        self.request_render()

    def _follow_colour(self) -> None:
        display = self._session.display
        self.scene.body.set_as_dots(display.as_dots)
        self.scene.change_colours(mode=display.mesh_colour)
        self._follow_scattering()

    def _follow_theme(self) -> None:
        self.scene.set_colours(self._session.display.palette)
        self.request_render()

    def _follow_placements(self) -> None:
        model, radar = self._placements, self._placements.radar
        planned = (model.planned, model.shown, radar)
        if planned == self._planned:
            return
        self._planned = planned
        sensors = model.planned.sensors if model.shown else ()
        range_m = np.array([place.range_m for place in model.planned.places])
        coverage = model.planned.coverage
        self.scene.set_markers(
            sensors, range_m, None if coverage is None else coverage.beyond(radar)
        )
        self.overlay.marker_words = [place.words for place in model.planned.places]
        self.navigator.look_again()
        self.request_render()

    def _follow_things(self) -> None:
        mesh = self._session.document.mesh
        around, others = (None, ()) if mesh is None else (mesh.surroundings, mesh.others)
        # One that is dragged is drawn where the hand is, without being made again.
        if (around is self._around and others == self._others) or self.navigator.held_thing:
            return
        self._around, self._others = around, others
        self.scene.set_things(around)
        with self._explaining():
            self.scene.set_people(others, self._frame or 0)
        self.limb_hand.show()
        named = [one.thing.name for one in self.scene.movables.things]
        self.overlay.thing_names = named + ([] if mesh is None else list(mesh.persons[1:]))
        self.navigator.look_again()
        self.request_render()

    def _follow_inertial(self) -> None:
        self.scene.set_inertial(self._inertial.vertices.values())
        self.request_render()

    def _follow_limbs(self) -> None:
        self.limb_hand.show()
        self._follow_scattering()

    def _follow_placing(self) -> None:
        self.overlay.hint = PLACING_HINT if self.inertial_hand.placing else ""
        self.overlay.show_reading((0.0, 0.0), "")
        self._choose_cursor()
        self.overlay.update()

    # Drawing

    def _prepare(self, size_px: tuple[float, float], pixel_scale: float) -> None:
        """Fetch what changed since the last picture, right before the next."""
        mesh = self._session.document.mesh
        if mesh is not None and self.scene.has_mesh:
            with self._explaining():
                self._fetch(mesh)
        self.scene.margins = replace(self.scene.margins, right=self.overlay.legend_room_px)
        self.scene.prepare(size_px, pixel_scale)

    def _fetch(self, mesh: MeshSequence) -> None:
        time_s = self._session.playback.time_s
        frame = mesh.timebase.frame_at(time_s)
        covered, someone = mesh.timebase.covers(time_s), bool(mesh.presence.present[frame])
        self.scene.show_mesh(covered and someone)
        anybody = any(bool(body.presence.present[frame]) for body in mesh.bodies)
        why = "No person at this time" if covered else "No mesh at this time"
        self.overlay.message = "" if covered and anybody else why
        if frame != self._frame:
            self._frame = frame
            self.scene.set_vertices(mesh.frame(frame))
        for person in self.scene.movables.people:
            person.show_frame(frame, covered)
        if self._stale_scattering:
            self._fetch_scattering()

    def _fetch_scattering(self) -> None:
        self._stale_scattering = False
        if self.scene.colouring.mode == "plain":
            return
        scattering = self._synthesis.frame
        self.scene.change_colours(v_max_mps=self._synthesis.v_max_mps)
        if scattering is None:
            self.scene.set_scattering(None, None)
        else:
            self.scene.set_scattering(scattering.velocity_mps, scattering.visible)

    @contextmanager
    def _explaining(self) -> Iterator[None]:
        # A mesh that is read from disk frame by frame can go away.
        try:
            yield
        except (Sd2Error, OSError) as error:
            self.overlay.message = f"The mesh cannot be read: {error}"

    def _lay_out(self) -> None:
        for child in self.findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            child.setGeometry(self.rect())

    def _choose_cursor(self) -> None:
        if self._backend is None:
            return
        navigator, target = self.navigator, self.navigator.target
        if navigator.holds_sensor or navigator.held_thing:
            shape = Qt.CursorShape.ClosedHandCursor
        elif target is not None:
            at_marker, shapes = target.kind == "marker", Qt.CursorShape
            shape = shapes.PointingHandCursor if at_marker else shapes.OpenHandCursor
        elif self.inertial_hand.placing:
            shape = Qt.CursorShape.CrossCursor
        else:
            shape = Qt.CursorShape.ArrowCursor
        if self._backend.cursor().shape() != shape:
            self._backend.setCursor(shape)

    def _explain(self, problem: str) -> None:
        label = sentence(problem)
        label.setParent(self)
        label.setAlignment(Qt.AlignmentFlag.AlignCenter)
        label.setMargin(24)


def _place(event: QMouseEvent | QWheelEvent) -> tuple[float, float]:
    return (event.position().x(), event.position().y())
