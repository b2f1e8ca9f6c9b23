"""Figures for papers: dialogs of the maps, and of strips of frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QDialog, QLabel, QLayout, QLineEdit, QMessageBox, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.figures.model import DrawnFigure, MapFigure, StripModel
from sd2app.manual.help import with_help
from sd2app.maps.difference import DifferenceModel
from sd2app.palette import Palette
from sd2app.session.session import Session
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.dialogs import Dialog, ExportButtons, accepted, ask_figure, take_room
from sd2app.widgets.inputs import CheckBox, Choice, NumberBox, option_box
from sd2app.widgets.layouts import column_of, form_of, row_of
from sd2app.widgets.mesh_painting import paint_picture
from sd2app.widgets.panel import copy_button, side_by_side
from sd2core.cli.strip import Strip
from sd2core.labels.spans import Labels

_WAYS = {"spread": "spread evenly", "around": "around the cursor", "list": "list or ranges"}
_ROWS = {"video": "video", "mesh": "mesh", "overlay": "mesh over video"}


class FigurePreview(Canvas):
    """A figure on its own background, as large as there is room."""

    USUAL_PX = 960, 320

    def __init__(self, model: DrawnFigure, palette: Palette, parent: QWidget) -> None:
        super().__init__(parent)
        self._model, self._colours = model, palette
        self.setAccessibleName("Preview of the figure")
        self.setMinimumSize(480, 200)
        self.follow(model.drawn, model.changed)

    def paint(self, painter: QPainter) -> None:
        """Paint the figure, or a message."""
        painter.fillRect(self.rect(), QColor(self._colours.well))
        picture = self._model.picture
        if picture is not None and not self._model.problem:
            paint_picture(painter, self.rect().adjusted(8, 8, -8, -8), picture, enlarge=False)
            return
        painter.setPen(QColor(self._colours.muted))
        text = self._model.problem or "Drawing…"
        flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(self.rect().adjusted(16, 16, -16, -16), flags, text)


class FigureDialog(Dialog):
    """Preview, choices and a button to export; ``name`` is proposed for the file."""

    TITLE: ClassVar[str]
    USUAL_PX: ClassVar[tuple[int, int]]
    """Width and height at first."""
    COPY_TIP = "The same as a command for a terminal"

    def __init__(self, model: Any, palette: Palette, name: str, parent: QWidget) -> None:
        super().__init__(self.TITLE, parent)
        self._model, self._name = model, name
        self._buttons = ExportButtons(self, self._ask)
        copy = copy_button(lambda: self._model.line, self, self.COPY_TIP)
        foot = with_help("Export figure", self._buttons, copy)
        parts = ((FigurePreview(model, palette, self), 1), self._choices(), foot)
        self.setLayout(column_of(*parts, spacing_px=16, margins_px=16))
        model.changed.connect(self._refresh)
        model.written.connect(lambda _: self.accept())
        model.failed.connect(lambda text: QMessageBox.warning(self, self.TITLE, text))
        self._refresh()
        take_room(self, *self.USUAL_PX)

    def _choices(self) -> QLayout:
        raise NotImplementedError

    def _refresh(self) -> None:
        model = self._model
        self._buttons.show_state(possible=not model.problem, exporting=model.exporting)

    def _ask(self) -> None:
        if path := ask_figure(self, self.TITLE, self._name):
            self._model.export(path)


class MapFigureDialog(FigureDialog):
    """Choices of a :class:`MapFigure`."""

    TITLE = "Export figure of the maps"
    USUAL_PX = 900, 720
    COPY_TIP = (
        "These maps as a command for a terminal: with all labels, at the usual levels and accuracy"
    )

    def _choices(self) -> QLayout:
        model = self._model
        maps = [CheckBox(title, self, partial(model.set_shown, title)) for title in model.titles]
        time_range = Choice(
            "Time range of the recording",
            self,
            {False: "what is in view", True: "the whole recording"},
            lambda whole: model.choose(whole=whole),
        )
        more = []
        if model.has_labels:
            more.append(CheckBox("labels", self, lambda on: model.choose(with_labels=on)))
        if model.has_difference:
            more.append(
                CheckBox(
                    "difference to the radar", self, lambda on: model.choose(with_difference=on)
                )
            )
        for box in (*maps, *more):
            box.show_checked(True)
        rows: dict[str, Sequence[QWidget]] = {"Maps": maps, "Time range": [time_range]}
        if more:
            rows["With"] = more
        return form_of(
            *((name, side_by_side(*fields, spacing_px=16)) for name, fields in rows.items())
        )


class StripDialog(FigureDialog):
    """Choices of a :class:`StripModel`."""

    TITLE = "Export strip of frames"
    USUAL_PX = 1040, 640

    def _choices(self) -> QLayout:
        model = self._model
        self._way = Choice("Which frames", self, _WAYS, lambda way: model.choose(way=way))
        self._count = option_box(Strip, "count", " frames")
        self._count.valueChanged.connect(lambda value: model.choose(count=int(value)))
        self._step = NumberBox(1, 1000, " apart", "How many frames apart", decimals=0, step=1)
        self._step.valueChanged.connect(lambda value: model.choose(step=int(value)))
        self._typed = QLineEdit(self)
        self._typed.setToolTip("Frames such as 0,15,30, or ranges FROM:TO:STEP such as 0:90:15")
        self._typed.setAccessibleName(self._typed.toolTip())
        self._typed.textEdited.connect(lambda text: model.choose(text=text))
        self._columns = option_box(Strip, "columns", " side by side")
        self._columns.valueChanged.connect(lambda value: model.set_options(columns=int(value)))
        self._rows = {
            row: CheckBox(text, self, partial(model.set_row, row)) for row, text in _ROWS.items()
        }
        for row, box in self._rows.items():
            box.setEnabled(row in model.available)
        self._shape = Choice(
            "How the mesh is drawn",
            self,
            {False: "surface", True: "dots"},
            lambda as_dots: model.set_options(as_dots=as_dots),
        )
        self._colour = Choice(
            "What the colour of the mesh means",
            self,
            {"velocity": "radial velocity", "plain": "plain"},
            lambda colour: model.set_options(colour=colour),
        )
        self._limit = option_box(Strip, "v_max_mps", " m/s", decimals=1, step=0.5)
        self._limit.valueChanged.connect(lambda value: model.set_options(v_max_mps=value))
        self._whole = CheckBox(
            "whole picture",
            self,
            lambda whole: model.set_options(whole=whole),
            "Otherwise what is around the body in these frames",
        )
        left = form_of(
            ("Frames", side_by_side(self._way, self._count, self._step, self._typed)),
            ("Columns", side_by_side(self._columns)),
        )
        mesh = side_by_side(self._shape, QLabel("colour"), self._colour, self._limit)
        right = form_of(
            ("Rows", side_by_side(*self._rows.values())),
            ("Mesh", mesh),
            ("Part", side_by_side(self._whole)),
        )
        return row_of((left, 1), (right, 1), spacing_px=32)

    def _refresh(self) -> None:
        super()._refresh()
        choice, options = self._model.choice, self._model.options
        self._way.show_value(choice.way)
        self._shape.show_value(options.as_dots)
        self._colour.show_value(options.colour)
        self._whole.show_checked(options.whole)
        for row, box in self._rows.items():
            box.show_checked(row in options.rows)
        self._count.show_value(choice.count)
        self._count.setVisible(choice.way != "list")
        self._step.show_value(choice.step)
        self._step.setVisible(choice.way == "around")
        self._typed.setVisible(choice.way == "list")
        if self._typed.text() != choice.text:
            self._typed.setText(choice.text)
        self._columns.show_value(options.columns)
        self._limit.show_value(options.v_max_mps)
        self._limit.setEnabled(options.colour == "velocity")


class FiguresFeature(Feature):
    """Dialogs that draw what is on screen into a file.

    ``labels`` gives the labels that are drawn, ``denoiser`` the denoiser in words.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        difference: DifferenceModel,
        labels: Callable[[], Labels],
        denoiser: Callable[[], str],
    ) -> None:
        self._session, self._shell, self._difference = session, shell, difference
        self._labels, self._denoiser = labels, denoiser
        self.changing = tuple(track.came_or_went for track in session.maps.all)

    def actions(self) -> Sequence[Action]:
        """Figure of the maps, strip of frames."""
        s = self._session
        return (
            Action(
                "export_maps", "File", "Export figure of the maps…", (),
                "Write the Doppler maps one above the other, as they are shown (.png, .svg, .pdf)",
                self._export_maps, lambda: any(track.map is not None for track in s.maps.all),
            ),
            Action(
                "export_strip", "File", "Export strip of frames…", ("Ctrl+Shift+E",),
                "Write frames side by side, the video above its mesh (.png, .svg, .pdf)",
                self._export_strip, lambda: s.document.video is not None or s.has_mesh(),
            ),
        )  # fmt: skip

    def _export_maps(self) -> None:
        s, window = self._session, self._shell.dialog_parent
        model = MapFigure(s, self._difference, self._labels(), self._denoiser(), window)
        name = s.document.file_name("-maps")
        self._ask(MapFigureDialog(model, s.display.palette, name, window), model)

    def _export_strip(self) -> None:
        s, content = self._session, self._session.document.content
        if content is not None:
            window, name = self._shell.dialog_parent, s.document.file_name("-frames")
            model = StripModel(content, s.playback.time_s, window)
            self._ask(StripDialog(model, s.display.palette, name, window), model)

    @staticmethod
    def _ask(dialog: QDialog, model: DrawnFigure) -> None:
        accepted(dialog)
        model.close()
        model.deleteLater()
