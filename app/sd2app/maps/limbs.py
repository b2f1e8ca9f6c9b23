"""The synthetic map of one part of the body alone."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.maps.model import SynthesisModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2core.files.tables import capitalised
from sd2core.mesh.vertex_parts import PARTS


def title_of(track: MapModel) -> str:
    """Title of a map, with the part of the body that is shown alone."""
    return f"{track.title} · {part_words(track.part)}" if track.part else track.title


def part_words(part: str) -> str:
    """Part of the body in words."""
    name, _, side = part.partition(".")
    words = "head and trunk" if name == "trunk" else name.replace("_", " ")
    return {"L": f"left {words}", "R": f"right {words}"}.get(side, words)


class LimbsModel(QObject):
    """Splits the synthetic map while one part of the body is shown."""

    failed = Signal(str)

    def __init__(self, session: Session, synthesis: SynthesisModel, parent: QObject) -> None:
        super().__init__(parent)
        self.track, self._synthesis = session.maps.synthetic, synthesis
        synthesis.completed.connect(self._check)
        session.document.opened.connect(lambda: self.show(""))

    @property
    def part(self) -> str:
        """Part that is shown alone; empty for the whole body."""
        return self.track.part

    def show(self, part: str) -> None:
        """Show one part alone, or (empty) the whole body."""
        self.track.set_part(part)
        self._synthesis.want_limbs("one part shown", bool(part))

    def _check(self) -> None:
        if self.part and self._synthesis.complete and not self._synthesis.split:
            self.show("")
            self.failed.emit(
                "This mesh cannot be split by the parts of the body: it needs the closed surface"
                " of one whole body, with faces."
            )


class LimbMenu(QMenu):
    """The whole body, or one part of it."""

    def __init__(self, model: LimbsModel, parent: QWidget) -> None:
        super().__init__("Synthetic map by limb", parent)
        self._model = model
        self.setToolTip("Show the Doppler of one part of the body alone")
        group = QActionGroup(self)
        for part in ("", *PARTS):
            words = part_words(part)
            action = self.addAction(capitalised(words) if part else "Whole body")
            action.setData(part)
            action.setCheckable(True)
            group.addAction(action)
        group.triggered.connect(lambda action: model.show(action.data()))
        self.aboutToShow.connect(self._update)

    def _update(self) -> None:
        for action in self.actions():
            action.setChecked(action.data() == self._model.part)
            action.setEnabled(self._model.track.map is not None)
