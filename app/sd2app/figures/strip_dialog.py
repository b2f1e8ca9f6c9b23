"""Export a strip of frames: a preview above, the choices below."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)

from sd2app.figures.preview import FigurePreview
from sd2app.figures.strip import StripModel
from sd2app.palette import Palette
from sd2app.widgets.dialogs import ExportButtons, ask_figure
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.panel import side_by_side

_WAYS = (("spread", "spread evenly"), ("around", "around the cursor"), ("list", "list or ranges"))
_ROWS = (("video", "video"), ("mesh", "mesh"), ("overlay", "mesh over video"))


class StripDialog(QDialog):
    """A view of :class:`StripModel`."""

    def __init__(
        self, model: StripModel, palette: Palette, title: str, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._model = model
        self._name = title
        self.setWindowTitle("Export strip of frames")
        self._build_frames()
        self._build_looks()
        self._buttons = ExportButtons(self, self._ask)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(FigurePreview(model, palette, self), 1)
        layout.addLayout(self._lay_out())
        layout.addWidget(self._buttons)
        model.changed.connect(self._refresh)
        model.written.connect(lambda _: self.accept())
        self._refresh()
        self.resize(1040, 640)

    # --- building -------------------------------------------------------------------------

    def _build_frames(self) -> None:
        model = self._model
        self._way = Choice("Which frames", self)
        for way, text in _WAYS:
            self._way.addItem(text, way)
        self._way.currentIndexChanged.connect(lambda _: model.choose(way=self._way.currentData()))
        self._count = NumberBox(1, 100, " frames", "How many frames", decimals=0, step=1)
        self._count.valueChanged.connect(lambda value: model.choose(count=int(value)))
        self._step = NumberBox(1, 1000, " apart", "How many frames apart", decimals=0, step=1)
        self._step.valueChanged.connect(lambda value: model.choose(step=int(value)))
        self._list = QLineEdit(self)
        self._list.setToolTip("Frames such as 0,15,30, or ranges FROM:TO:STEP such as 0:90:15")
        self._list.setAccessibleName(self._list.toolTip())
        self._list.textEdited.connect(lambda text: model.choose(text=text))
        self._columns = NumberBox(
            1, 50, " side by side", "More frames than that go below", decimals=0, step=1
        )
        self._columns.valueChanged.connect(lambda value: model.set_options(columns=int(value)))

    def _build_looks(self) -> None:
        model = self._model
        self._rows = {}
        for row, text in _ROWS:
            box = QCheckBox(text, self)
            box.setEnabled(row in model.available)
            box.toggled.connect(lambda shown, row=row: model.set_row(row, shown))
            self._rows[row] = box
        self._shape = Choice("How the mesh is drawn", self)
        self._shape.addItem("surface", False)
        self._shape.addItem("dots", True)
        self._shape.currentIndexChanged.connect(
            lambda _: model.set_options(as_dots=self._shape.currentData())
        )
        self._colour = Choice("What the colour of the mesh means", self)
        self._colour.addItem("radial velocity", "velocity")
        self._colour.addItem("plain", "plain")
        self._colour.currentIndexChanged.connect(
            lambda _: model.set_options(colour=self._colour.currentData())
        )
        self._limit = NumberBox(0.1, 20.0, " m/s", "Where the colours end", decimals=1, step=0.5)
        self._limit.valueChanged.connect(lambda value: model.set_options(v_max_mps=value))
        self._whole = QCheckBox("whole picture", self)
        self._whole.setToolTip("Otherwise what is around the body in these frames")
        self._whole.toggled.connect(lambda whole: model.set_options(whole=whole))

    def _lay_out(self) -> QHBoxLayout:
        left, right = QFormLayout(), QFormLayout()
        for form in (left, right):
            form.setVerticalSpacing(8)
            form.setHorizontalSpacing(16)
        left.addRow("Frames", side_by_side(self._way, self._count, self._step, self._list))
        left.addRow("Columns", side_by_side(self._columns))
        right.addRow("Rows", side_by_side(*self._rows.values()))
        right.addRow("Mesh", side_by_side(self._shape, QLabel("colour"), self._colour, self._limit))
        right.addRow("Part", side_by_side(self._whole))
        columns = QHBoxLayout()
        columns.setSpacing(32)
        columns.addLayout(left, 1)
        columns.addLayout(right, 1)
        return columns

    # --- following the model --------------------------------------------------------------

    def _refresh(self) -> None:
        model, choice, options = self._model, self._model.choice, self._model.options
        for combo, value in (
            (self._way, choice.way),
            (self._shape, options.as_dots),
            (self._colour, options.colour),
        ):
            with QSignalBlocker(combo):
                combo.setCurrentIndex(combo.findData(value))
        self._count.show_value(choice.count)
        self._count.setVisible(choice.way != "list")
        self._step.show_value(choice.step)
        self._step.setVisible(choice.way == "around")
        self._list.setVisible(choice.way == "list")
        if self._list.text() != choice.text:
            self._list.setText(choice.text)
        self._columns.show_value(options.columns)
        for row, box in self._rows.items():
            with QSignalBlocker(box):
                box.setChecked(row in options.rows)
        self._limit.show_value(options.v_max_mps)
        self._limit.setEnabled(options.colour == "velocity")
        with QSignalBlocker(self._whole):
            self._whole.setChecked(options.whole)
        self._buttons.show_state(possible=not model.problem, exporting=model.exporting)

    def _ask(self) -> None:
        path = ask_figure(self, "Export strip of frames", self._name)
        if path is not None:
            self._model.export(path)
