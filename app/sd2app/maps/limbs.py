"""The synthetic map of one part of the body alone."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.maps.model import SynthesisModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2core.files.tables import capitalised
from sd2core.maps import OF
from sd2core.mesh.vertex_parts import PARTS


def title_of(track: MapModel) -> str:
    """Title of a map, with the part of the body that is shown alone."""
    return f"{track.title} · {part_words(track.part)}" if track.part else track.title


def part_words(part: str) -> str:
    """Part of the body in words, after a person's name in a scene of several."""
    person, of, own = part.rpartition(OF)
    if of:
        return f"{person}{of}{part_words(own)}"
    if part not in PARTS:  # a person
        return part
    name, _, side = part.partition(".")
    words = "head and trunk" if name == "trunk" else name.replace("_", " ")
    return {"L": f"left {words}", "R": f"right {words}"}.get(side, words)


class LimbsModel(QObject):
    """Splits the synthetic map while one part of the body is shown."""

    failed = Signal(str)

    def __init__(self, session: Session, synthesis: SynthesisModel, parent: QObject) -> None:
        super().__init__(parent)
        self.track, self._synthesis = session.maps.synthetic, synthesis
        self._document = session.document
        synthesis.completed.connect(self._check)
        session.document.opened.connect(lambda: self.show(""))

    @property
    def part(self) -> str:
        """Part that is shown alone; empty for the whole body."""
        return self.track.part

    @property
    def persons(self) -> tuple[str, ...]:
        """Names of the people in a scene of several; empty of one alone."""
        mesh = self._document.mesh
        return mesh.persons if mesh is not None and mesh.others else ()

    def show(self, part: str) -> None:
        """Show one part or person alone, or (empty) all."""
        self.track.set_part(part)
        self._synthesis.want_limbs("one part shown", bool(part))

    def _check(self) -> None:
        made = self.track.map
        split = None if made is None or not self._synthesis.split else made.limbs
        known = split is not None and split.shown(self.part) is not None
        if self.part and self._synthesis.complete and not known:
            self.show("")
            self.failed.emit(
                "This mesh cannot be split by the parts of the body: it needs the closed surface"
                " of one whole body, with faces."
            )


class LimbMenu(QMenu):
    """The whole body, or one part of it; in a scene of several, everybody, or one of them."""

    def __init__(self, model: LimbsModel, parent: QWidget) -> None:
        super().__init__("Synthetic map by limb", parent)
        self._model = model
        self.setToolTip("Show the Doppler of one person or one part of the body alone")
        self._group = QActionGroup(self)
        self._group.triggered.connect(lambda action: model.show(action.data()))
        self._persons: tuple[str, ...] | None = None
        self.aboutToShow.connect(self._update)
        self._update()

    def _update(self) -> None:
        if self._persons != self._model.persons:
            self._offer(self._model.persons)
        for action in self.actions():
            action.setChecked(action.data() == self._model.part)
            action.setEnabled(self._model.track.map is not None)

    def _offer(self, persons: tuple[str, ...]) -> None:
        """Offer everybody, each of several people, and the parts of each."""
        self._persons = persons
        self.clear()
        limbs = [f"{person}{OF}{part}" for person in persons for part in PARTS]
        for part in ("", *persons, *(limbs or PARTS)):
            words = (
                capitalised(part_words(part)) if part else "Everybody" if persons else "Whole body"
            )
            action = self.addAction(part if part in persons else words)
            action.setData(part)
            action.setCheckable(True)
            self._group.addAction(action)
