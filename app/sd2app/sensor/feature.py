"""The virtual sensor's panel, placements of others and their page, the radar's time offset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from sd2app.accuracy.model import AccuracyModel
from sd2app.feature import Action, Feature, Shell
from sd2app.maps.model import SynthesisModel
from sd2app.sensor.alignment import AlignmentDialog, AlignmentModel
from sd2app.sensor.panel import SensorPanel
from sd2app.sensor.placements import (
    NAMES,
    Kind,
    Name,
    PlacementFields,
    PlacementsModel,
    cost_source_text,
    cost_text,
    count_text,
    current_text,
    limit_facts,
    limits_text,
)
from sd2app.sensor.scene_pages import BodiesPage, ThingsPage
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_LEFT, AT_RIGHT, Canvas
from sd2app.widgets.dialogs import accepted, ask_file, ask_new
from sd2app.widgets.inputs import CheckBox, Choice, TypedLine
from sd2app.widgets.layouts import STRETCH, column_of, grid_of, pane, row_of
from sd2app.widgets.panel import (
    FactRows,
    InnerPages,
    LatePage,
    outlined,
    rule,
    sentence,
    show_words,
    title,
)
from sd2core.figures.colours import SEQUENTIAL
from sd2core.placements.placements import Placements, read_placements, write_placements

_READ = "Placements (*.json *.toml);;All files (*)"
_WRITTEN = "Placements (*.json)"
_KIND_TEXT: dict[Kind, str] = {"none": "None", "grid": "Grid", "cloud": "Random cloud"}
_FIELDS: dict[Name, tuple[str, str]] = {
    "range": ("Ranges, m", "Distance from the body's centre"),
    "azimuth": ("Azimuths, °", "0 is between body and camera, positive to the right"),
    "elevation": ("Elevations, °", "Positive is above the body's centre"),
    "count": ("Count", "How many places"),
    "seed": ("Seed", "Another number gives other places, the same one the same"),
}
"""Label and meaning of a field."""
_HOW: dict[Kind, str] = {
    "none": "",
    "grid": "Numbers such as 1, 2.5, or from:to:step",
    "cloud": "Ranges and angles as from:to",
}
_NOTHING = (
    "A map from every place around the body is more data to learn from. Plan a grid or a cloud of"
    " places: they are drawn in the scene, and a click on one puts the sensor there."
)
_NO_BODY = "There is no body in this recording to place sensors around."


class PlacementsPage(QWidget):
    """A view of :class:`PlacementsModel`; ``batch`` sets up a batch with the plan."""

    def __init__(
        self,
        placements: PlacementsModel,
        accuracy: AccuracyModel,
        shell: Shell,
        batch: Callable[[], None],
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self._model, self._accuracy, self._shell = placements, accuracy, shell
        self._fields = PlacementFields(placements, self)
        self._kind = Choice("What is planned", self, _KIND_TEXT, self._fields.set_kind)
        self._nothing = sentence("")
        self._planned = self._plan_part()
        self._take = outlined("Import…", "Take a plan from a file", self._import_plan, self)
        self._export = outlined(
            "Export…", "Write the plan, as for sd2 placements", self._export_plan, self
        )
        make = outlined("Batch…", "Make the maps, of many recordings", batch, self)
        head = row_of(title("Plan"), STRETCH, self._kind)
        buttons = row_of(self._take, self._export, make, STRETCH, spacing_px=6)
        parts = head, self._nothing, self._planned, buttons, STRETCH
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(8, 4, 8, 4)))
        placements.current_changed.connect(self._show_current)
        for signal in (placements.changed, accuracy.changed, self._fields.changed):
            signal.connect(self._refresh)
        self._refresh()

    def _plan_part(self) -> QWidget:
        model = self._model
        self._how, self._problem = sentence(""), sentence("", "warning")
        self._count, self._cost = title(""), title("", "What the maps cost")
        self._count.setAccessibleName("How many placements")
        self._scale = RangeScale(self)
        self._limits = FactRows(3, at_the_edge=True, parent=self)
        self._radar, self._source = sentence(""), sentence("")
        self._shown = CheckBox("In the scene", self, model.set_shown, "Draw them in the scene")
        self._current = sentence("", "plain")
        back, on = (
            outlined(text, "Put the sensor there", partial(model.step, by), self)
            for text, by in (("Previous", -1), ("Next", 1))
        )
        head = row_of((self._count, 1), self._shown, spacing_px=6)
        steps = row_of((self._current, 1), back, on, spacing_px=6)
        typed = self._form(), self._how, self._problem
        places = head, self._scale, self._limits, self._radar, steps
        return pane(*typed, rule(), *places, rule(), self._cost, self._source, spacing_px=6)

    def _form(self) -> QGridLayout:
        self._rows: dict[Name, tuple[QLabel, TypedLine]] = {}
        for name in NAMES:
            text, meaning = _FIELDS[name]
            label, line = QLabel(text, self), TypedLine(text, meaning, self)
            label.setObjectName("muted")
            label.setToolTip(meaning)
            line.typed.connect(lambda text, name=name: self._fields.set_text(name, text))
            line.ended.connect(self._fields.end)
            self._rows[name] = (label, line)
        return grid_of(*self._rows.values(), gaps_px=(8, 3))

    def _import_plan(self) -> None:
        parent = self._shell.dialog_parent
        if path := ask_file(parent, "Take placements", _READ):
            self._shell.attempt(lambda: self._model.edits.plan_placements(read_placements(path)))

    def _export_plan(self) -> None:
        plan, parent, name = self._model.plan, self._shell.dialog_parent, self._model.file_name
        if plan is None:
            return
        if path := ask_new(parent, "Export placements", name, _WRITTEN, ".json"):
            self._shell.attempt(lambda: self._write(path, plan))

    def _write(self, path: Path, plan: Placements) -> None:
        write_placements(path, plan)
        self._shell.note(f"The placements are in {path}.")

    def _refresh(self) -> None:
        model, fields = self._model, self._fields
        planned = fields.kind != "none"
        self._kind.show_value(fields.kind)
        self._kind.setEnabled(model.possible)
        self._nothing.setText(_NOTHING if model.possible else _NO_BODY)
        self._nothing.setVisible(not planned)
        self._planned.setVisible(planned)
        self._take.setEnabled(model.possible)
        self._export.setEnabled(planned)
        if not planned:
            return
        for name, (label, line) in self._rows.items():
            for widget in (label, line):
                widget.setVisible(name in fields.texts)
            line.show_text(fields.texts.get(name, ""))
        show_words(self._how, "" if fields.problem else _HOW[fields.kind])
        show_words(self._problem, fields.problem)
        self._count.setText(count_text(model))
        self._scale.show_ranges([place.range_m for place in model.planned.places])
        self._limits.show_facts(limit_facts(model))
        show_words(self._radar, limits_text(model))
        self._show_current()
        self._shown.show_checked(model.shown)
        cost, in_use = model.cost, self._accuracy.in_use
        self._cost.setText("Their cost is being computed…" if cost is None else cost_text(cost))
        known = cost is not None and in_use is not None
        show_words(self._source, cost_source_text(cost, in_use) if known else "")  # type: ignore[arg-type]

    def _show_current(self) -> None:
        if self._model.plan is not None:
            self._current.setText(current_text(self._model))


class RangeScale(Canvas):
    """Colour scale of the placements in the scene: near to far."""

    _BAR = 8

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._ends = ("", "")
        self.setAccessibleName("Colours of the placements: range")

    def show_ranges(self, ranges_m: list[float]) -> None:
        """Show the range from nearest to farthest, or nothing where all are equal."""
        ends = ("", "")
        if ranges_m and max(ranges_m) > min(ranges_m):
            ends = (f"{min(ranges_m):.3g} m", f"{max(ranges_m):.3g} m")
        self.setVisible(bool(ends[0]))
        if ends != self._ends:
            self._ends = ends
            self.update()

    def sizeHint(self) -> QSize:
        """Size of one line."""
        return QSize(120, self.fontMetrics().height() + 2)

    def minimumSizeHint(self) -> QSize:
        """Size of one line."""
        return QSize(60, self.fontMetrics().height() + 2)

    def paint(self, painter: QPainter) -> None:
        """Paint a colour bar between two texts."""
        painter.setPen(QColor(self.palette().text().color()))
        near, far = self._ends
        painter.drawText(self.rect(), AT_LEFT, near)
        painter.drawText(self.rect(), AT_RIGHT, far)
        left, right = (self.fontMetrics().horizontalAdvance(word) + 8 for word in (near, far))
        strip = np.ascontiguousarray(SEQUENTIAL).reshape(1, -1, 3)
        image = QImage(
            strip.data, strip.shape[1], 1, 3 * strip.shape[1], QImage.Format.Format_RGB888
        )
        top = (self.height() - self._BAR) / 2
        painter.drawImage(QRectF(left, top, self.width() - left - right, self._BAR), image)


class SensorFeature(Feature):
    """One sensor to move, many to plan; ``make_batch`` takes the plan to a batch."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        accuracy: AccuracyModel,
        synthesis: SynthesisModel,
        make_batch: Callable[[], None],
    ) -> None:
        self._session, self._shell, self._accuracy = session, shell, accuracy
        self._synthesis, self._make_batch = synthesis, make_batch
        self.placements = PlacementsModel(session, accuracy, session.parent)
        self.placements.failed.connect(shell.warn)
        came = session.maps.real.came_or_went
        align = session.aligning.changed
        self.changing = self.placements.changed, came, align, *synthesis.completeness
        self.alignment = AlignmentModel(session, synthesis, session.parent)
        self.closing = self.working = (self.placements, self.alignment)

    def actions(self) -> Sequence[Action]:
        """Sensor and placements."""
        edits, synthesis, placements = self._session.edits, self._synthesis, self.placements
        alignment, aligning = self.alignment, self._session.aligning
        return (
            Action(
                "sensor_to_camera", "Edit", "Sensor at the camera", ("Shift+Home",),
                "Put the sensor at the camera, looking along its axis", edits.sensor_to_camera,
            ),
            Action(
                "aim_sensor", "Edit", "Aim sensor at the body", ("A",),
                "Turn the sensor towards the body in this frame",
                self._aim, lambda: synthesis.torso_m is not None,
            ),
            Action(
                "placements", "Edit", "Placements…", ("Shift+S",),
                "Plan a grid or a cloud of sensors around the body, for a map from each",
                lambda: self._shell.bring_up("Sensor", "Placements"),
            ),
            Action(
                "things", "Edit", "Things…", (),
                "Put a box, a table, a screen, a mesh file, walls or a floor around the body",
                lambda: self._shell.bring_up("Sensor", "Things"),
            ),
            Action(
                "bodies", "Edit", "Bodies…", (),
                "Put somebody else into the scene, whose mesh is in another file",
                lambda: self._shell.bring_up("Sensor", "Bodies"),
            ),
            Action(
                "align", "Edit", "Align automatically…", (),
                "Find the time offset of the radar by the motion that mesh and radar both show",
                self._align, why_not=lambda: alignment.why_not,
            ),
            Action(
                "align_by_hand", "Edit", "Align by hand", (),
                "Show a grip on the radar's map, and on a real inertial sensor, which moves it in"
                " time; until this is chosen again, or Esc",
                aligning.toggle, checked=lambda: aligning.active,
                why_not=lambda: alignment.nothing_measured,
            ),
            Action(
                "draw_placements", "View", "Placements in the scene", (),
                "Draw the places that are planned for sensors",
                lambda: placements.set_shown(not placements.shown),
                lambda: placements.plan is not None, lambda: placements.shown,
            ),
            Action(
                "show_sensor", "View", "Sensor panel", ("S",),
                "Where the sensor is and what it sees",
                lambda: self._shell.bring_up("Sensor", "Sensor"),
            ),
        )  # fmt: skip

    def _aim(self) -> None:
        if self._synthesis.torso_m is not None:
            self._session.edits.aim_sensor(self._synthesis.torso_m)

    def _align(self) -> None:
        parent, display = self._shell.dialog_parent, self._session.display
        accepted(AlignmentDialog(self.alignment, display, parent))

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, of two pages."""
        shell = self._shell
        sensor = SensorPanel(self._session, self._synthesis, self.placements, shell)
        placements = LatePage(
            lambda: PlacementsPage(self.placements, self._accuracy, shell, self._make_batch)
        )
        things = LatePage(lambda: ThingsPage(self._session, self._synthesis, shell.warn))
        bodies = LatePage(lambda: BodiesPage(self._session, shell.warn))
        return {
            "Sensor": InnerPages(
                ("Sensor", "Where the sensor is and what it sees", sensor),
                ("Placements", "Many places around the body, for a map each", placements),
                ("Things", "What stands around the body, and walls", things),
                ("Bodies", "Who else moves in the scene", bodies),
                inset_px=8,
            )
        }
