"""Export a figure of the maps: a preview above, the choices below."""

from __future__ import annotations

from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFormLayout,
    QVBoxLayout,
    QWidget,
)

from sd2app.figures.map_figure import FigureModel
from sd2app.figures.preview import FigurePreview
from sd2app.palette import Palette
from sd2app.widgets.dialogs import ExportButtons, ask_figure
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import side_by_side


class MapFigureDialog(QDialog):
    """A view of :class:`FigureModel`."""

    def __init__(
        self, model: FigureModel, palette: Palette, name: str, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._model, self._name = model, name
        self.setWindowTitle("Export figure of the maps")
        self._buttons = ExportButtons(self, self._ask)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(FigurePreview(model, palette, self), 1)
        layout.addLayout(self._choices())
        layout.addWidget(self._buttons)
        model.changed.connect(self._refresh)
        model.written.connect(lambda _: self.accept())
        self._refresh()
        self.resize(900, 720)

    def _choices(self) -> QFormLayout:
        model = self._model
        maps = [
            self._box(title, lambda on, title=title: model.set_shown(title, on))
            for title in model.titles
        ]
        stretch = Choice("Time range of the recording", self)
        stretch.addItem("what is in view", False)
        stretch.addItem("the whole recording", True)
        stretch.currentIndexChanged.connect(lambda at: model.choose(whole=stretch.itemData(at)))
        more = []
        if model.has_labels:
            more.append(self._box("labels", lambda on: model.choose(with_labels=on)))
        if model.has_difference:
            more.append(
                self._box("difference to the radar", lambda on: model.choose(with_difference=on))
            )
        form = QFormLayout()
        form.setHorizontalSpacing(16)
        form.setVerticalSpacing(8)
        form.addRow("Maps", side_by_side(*maps, spacing_px=16))
        form.addRow("Stretch", side_by_side(stretch, spacing_px=16))
        if more:
            form.addRow("With", side_by_side(*more, spacing_px=16))
        return form

    def _box(self, text: str, chosen: object) -> QCheckBox:
        box = QCheckBox(text, self)
        box.setChecked(True)
        box.toggled.connect(chosen)
        return box

    def _refresh(self) -> None:
        model = self._model
        self._buttons.show_state(possible=not model.problem, exporting=model.exporting)

    def _ask(self) -> None:
        path = ask_figure(self, "Export figure of the maps", self._name)
        if path is not None:
            self._model.export(path)
