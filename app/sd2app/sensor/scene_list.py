"""The list of what is in a scene beside the person: one kind, fields of one of them, its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any, Literal

from PySide6.QtWidgets import QLineEdit, QToolButton, QWidget

from sd2app.session.session import Session
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import form_of, pane, row_of
from sd2app.widgets.panel import outlined
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import FARTHEST_THING_M

Fields = Mapping[str, Sequence[NumberBox | QLineEdit]]
"""Boxes of each field of a thing, body or wall; of a field with several numbers, one for each."""


class SceneList(QWidget):
    """Adds, changes and takes away what a scene has of one kind; each step can be undone.

    Parameters
    ----------
    session : Session
    kind : {"things", "bodies", "walls"}
        Field of the recording.
    most : int
        How many there may be.
    rows : mapping of str to Fields
        What can be typed of each, by the names of the rows.
    warn : callable
        Told why something is not taken.
    """

    first_number = 1
    remove_text = "Remove"

    def __init__(
        self,
        session: Session,
        kind: Literal["things", "bodies", "walls"],
        most: int,
        rows: Mapping[str, Fields],
        warn: Callable[[str], None],
    ) -> None:
        super().__init__()
        self._session, self._kind, self._most, self._warn = session, kind, most, warn
        self._shown: tuple[Any, ...] = ()
        self._adding: tuple[QToolButton, ...] = ()
        self._fields = {name: boxes for row in rows.values() for name, boxes in row.items()}
        for box in chain(*self._fields.values()):
            changed = box.valueChanged if isinstance(box, NumberBox) else box.editingFinished
            changed.connect(self._type)
        self._which = Choice(f"{kind.capitalize()} in the scene", self)
        self._which.currentIndexChanged.connect(self._refresh_fields)
        remove = outlined(self.remove_text, "Take it out of the scene", self._remove, self)
        typed = [
            (name, pane(row_of(*chain(*row.values()), spacing_px=4, margins_px=0)))
            for name, row in rows.items()
        ]
        which = row_of((self._which, 1), remove, spacing_px=6)
        self.about = pane(which, form_of(*typed, gaps_px=(8, 3)), spacing_px=6)

    def start(self, *adding: QToolButton) -> None:
        """Follow the recording; ``adding`` are the buttons that add one."""
        self._adding = adding
        self._session.document.changed.connect(self._refresh)
        self._refresh()

    @property
    def kept(self) -> tuple[Any, ...]:
        """All in the recording."""
        recording = self._session.document.recording
        return () if recording is None else getattr(recording, self._kind)

    def take(self, make: Callable[[], Any], number: int | None = None) -> None:
        """Add one, or put it in another's place, if it can be made and its file be read."""
        mesh, edits = self._session.document.mesh, self._session.edits
        try:
            one = make()
            if mesh is not None:
                self.check(mesh, one)
        except Sd2Error as error:
            self._warn(str(error))
            self._refresh_fields()
            return
        if number is None:
            edits.add_to_scene(one)
        else:
            edits.change_in_scene(number, one)

    def check(self, mesh: MeshSequence, one: Any) -> None:
        """Raise Sd2Error if one cannot be in the scene of a mesh."""

    def name_of(self, one: Any) -> str:
        """Name of one in the list."""
        return str(one.name)

    def values(self, number: int, name: str) -> tuple[Any, ...]:
        """Values in the boxes of a field."""
        value = getattr(self.kept[number], name)
        return value if isinstance(value, tuple) else (value,)

    @property
    def _current(self) -> int | None:
        number = self._which.currentIndex()
        return number if 0 <= number < len(self.kept) else None

    def _type(self) -> None:
        if (number := self._current) is None:
            return
        changes: dict[str, Any] = {}
        for name, boxes in self._fields.items():
            typed = list(map(_typed, boxes))
            if any(map(_differs, boxes, self.values(number, name))):
                changes[name] = tuple(typed) if len(typed) > 1 else typed[0]
        if changes:
            self.take(lambda: replace(self.kept[number], **changes), number)

    def _remove(self) -> None:
        if (number := self._current) is not None:
            self._session.edits.remove_from_scene(number, self.kept[number])

    def _refresh(self) -> None:
        kept, before, current = self.kept, self._shown, self._which.currentIndex()
        for button in self._adding:
            button.setEnabled(self._session.document.mesh is not None and len(kept) < self._most)
        self.about.setVisible(bool(kept))
        if kept != before:
            self._shown = kept
            # The one that was changed, or the newest.
            changed = [at for at, one in enumerate(kept) if one not in before]
            current = changed[-1] if changed else current
        names = [
            f"{number}: {self.name_of(one)}" for number, one in enumerate(kept, self.first_number)
        ]
        self._which.offer(names, min(max(current, 0), len(kept) - 1))
        self._refresh_fields()

    def _refresh_fields(self) -> None:
        if (number := self._current) is None:
            return
        for name, boxes in self._fields.items():
            for box, value in zip(boxes, self.values(number, name), strict=True):
                if isinstance(box, NumberBox):
                    box.show_value(value)
                else:
                    box.setText(value)


def place_boxes(what: str) -> list[NumberBox]:
    """Boxes of a place x, y, z in metres."""
    far, ways = FARTHEST_THING_M, (("x", "to the right"), ("y", "down"), ("z", "forward"))
    return [NumberBox(-far, far, " m", f"{what}, {axis}: {way}") for axis, way in ways]


def turn_box() -> NumberBox:
    """Box of a turn about the vertical."""
    return NumberBox(-360, 360, "°", "Turn, seen from above clockwise", decimals=1, step=5)


def _typed(box: NumberBox | QLineEdit) -> Any:
    return box.value() if isinstance(box, NumberBox) else box.text().strip()


def _differs(box: NumberBox | QLineEdit, value: Any) -> bool:
    """True if a box has been given another value than it showed."""
    if isinstance(box, NumberBox):
        return bool(abs(box.value() - value) > 0.51 * 10.0 ** -box.decimals())
    return bool(_typed(box) != value)
