"""Menu of the parts of the body that the synthetic map is shown of."""

from __future__ import annotations

from PySide6.QtGui import QAction, QColor, QIcon, QPixmap
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.maps.limbs import LimbsModel
from sd2app.session.limbs import colours_of, part_words
from sd2core.files.tables import capitalised


class LimbMenu(QMenu):
    """The whole body, or some parts of it; of several people, everybody, or some or their parts."""

    def __init__(self, model: LimbsModel, parent: QWidget) -> None:
        super().__init__("Synthetic map by limb", parent)
        self._model = model
        self.setToolTip("Show the Doppler of some people or parts of the body alone")
        self._offered: tuple[str, ...] = ()
        self.triggered.connect(self._choose)
        self.aboutToShow.connect(self._update)
        self._update()

    def _choose(self, action: QAction) -> None:
        if part := action.data():
            self._model.toggle(part)
        else:
            self._model.show()

    def _update(self) -> None:
        if self._offered != self._model.all_parts:
            self._offer(self._model.all_parts)
        parts = self._model.parts
        colours = colours_of(parts)
        for action in self.actions():
            part = action.data()
            action.setChecked(part in parts or not (parts or part))
            action.setEnabled(self._model.track.map is not None)
            swatch = QPixmap(12, 12)
            swatch.fill(QColor(colours.get(part, "transparent")))
            action.setIcon(QIcon(swatch))

    def _offer(self, parts: tuple[str, ...]) -> None:
        """Offer everything, and each of some people and parts."""
        self._offered, persons = parts, self._model.persons
        self.clear()
        for part in ("", *parts):
            words = capitalised(part_words(part)) if part and part not in persons else part
            action = self.addAction(words or ("Everybody" if persons else "Whole body"))
            action.setData(part)
            action.setCheckable(True)
