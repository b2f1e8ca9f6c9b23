"""Menus and actions of labels and their tracks, which wait while edits are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from PySide6.QtGui import QAction, QActionGroup, QKeySequence
from PySide6.QtWidgets import QCheckBox, QInputDialog, QLineEdit, QMenu, QWidget

from sd2app.feature import Action, Shell
from sd2app.labels.edits import LabelEdits
from sd2app.labels.model import LabelsModel
from sd2app.widgets.dialogs import Dialog, accepted, accepting
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.text import canonical, counted, native
from sd2core.labels import field_edits
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Overlap


def editing(edits: LabelEdits, *rows: Action) -> tuple[Action, ...]:
    """Actions that change labels: disabled, with the reason, while edits are refused."""

    def why_not(question: Callable[[], str] | None) -> Callable[[], str]:
        return lambda: edits.refusal or (question() if question is not None else "")

    return tuple(replace(row, why_not=why_not(row.why_not)) for row in rows)


class LabelActions:
    """Action per label: its key marks, or relabels selected spans while paused without marks."""

    def __init__(
        self, edits: LabelEdits, use: Callable[[str], None], menu: QMenu, window: QWidget
    ) -> None:
        self._edits, self._use, self._menu, self._window = edits, use, menu, window
        self._first = menu.addSeparator()
        self._actions: list[QAction] = []
        self._shown: LabelSet | None = None
        edits.labels.choices_changed.connect(self._follow)
        self._follow()

    def refresh(self) -> None:
        """Disable the actions while edits are refused."""
        refusal = self._edits.refusal
        labels = self._shown.labels if self._shown is not None else ()
        for action, label in zip(self._actions, labels, strict=True):
            action.setEnabled(not refusal)
            action.setToolTip(refusal or _tip(label))

    def _follow(self) -> None:
        offered = self._edits.labels.labels.label_set
        if offered == self._shown:
            return
        self._shown = offered
        for action in self._actions:
            self._menu.removeAction(action)
            action.deleteLater()
        self._actions = [self._made(label) for label in offered.labels]
        self._menu.insertActions(self._first, self._actions)
        self.refresh()

    def _made(self, label: Label) -> QAction:
        action = QAction(swatch_icon(label.colour), label.name, self._window)
        if label.key:
            action.setShortcut(QKeySequence(canonical(label.key)))
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _=False: self._use(label.name))
        return action


def _tip(label: Label) -> str:
    keys = f" ({native(canonical(label.key))})" if label.key else ""
    return (
        "Begin a span with this frame, or end the one that has begun; with a span selected,"
        f" give it this label{keys}"
    )


class LabelTracks:
    """Edits of the track for new spans, and the choice of it."""

    def __init__(self, shell: Shell, edits: LabelEdits) -> None:
        self._shell, self._edits, self._labels = shell, edits, edits.labels

    @property
    def free(self) -> bool:
        """True if spans of the track may overlap."""
        track = self._labels.track
        return bool(track) and self._labels.labels.track(track).overlap == "free"

    def step(self, towards: Literal[-1, 1]) -> None:
        """Make the next or the previous track the one for new spans."""
        names = [track.name for track in self._labels.targets]
        place = names.index(self._labels.track) + towards if self._labels.track else -1
        if 0 <= place < len(names):
            self._labels.set_track(names[place])

    def ask_to_add(self) -> None:
        """Ask for a name, and add a track."""
        taken = self._names
        names = (f"Track {number}" for number in range(len(taken) + 1, 2 * len(taken) + 3))
        new_name = next(name for name in names if name not in taken)
        dialog = TrackDialog(new_name, self._shell.dialog_parent)
        if accepted(dialog):
            self.add(dialog.name, dialog.overlap)

    def add(self, name: str, overlap: Overlap) -> bool:
        """Add a track for new spans; False where it was refused."""
        done = self._edits.apply(lambda now: field_edits.add_track(now.labels, name, overlap))
        if done:
            self._labels.set_track(name)
        return done

    def rename(self) -> None:
        """Ask for another name of the track."""
        old = self._labels.track
        text, accepted = QInputDialog.getText(
            self._shell.dialog_parent, "Rename track", "Name", text=old
        )
        new = text.strip()
        if accepted and self._edits.apply(
            lambda now: field_edits.change_track(now.labels, old, name=new)
        ):
            self._labels.set_track(new)

    def remove(self) -> None:
        """Remove the track, and report the spans removed with it."""
        gone, count = self._labels.track, len(self._labels.labels.of_track(self._labels.track))
        if self._edits.apply(lambda now: field_edits.remove_track(now.labels, gone)) and count:
            self._shell.note(
                f"Removed {gone!r} with {counted(count, 'span')}; undo brings them back."
            )

    def move(self, towards: Literal[-1, 1]) -> None:
        """Move the track up or down."""
        track, names = self._labels.track, self._names
        place = names.index(track) + towards if track else -1
        if 0 <= place < len(names):
            self._edits.apply(lambda now: field_edits.move_track(now.labels, track, place))

    def toggle_overlap(self) -> None:
        """Allow or forbid that spans of the track overlap."""
        track = self._labels.track
        overlap: Overlap = "exclusive" if self.free else "free"
        self._edits.apply(lambda now: field_edits.change_track(now.labels, track, overlap=overlap))

    def put_spans(self, towards: Literal[-1, 1]) -> None:
        """Move the selected spans to the track below or above."""
        names, chosen = [track.name for track in self._labels.targets], self._labels.selected
        marked = bool(chosen) and chosen[0].track in names
        place = names.index(chosen[0].track) + towards if marked else -1
        if 0 <= place < len(names):
            self._edits.give("track", names[place])
            self._labels.set_track(self._labels.selected[0].track)

    @property
    def _names(self) -> list[str]:
        return [track.name for track in self._labels.labels.tracks]


class TrackDialog(Dialog):
    """Name of a new track, and a choice if its spans may overlap."""

    def __init__(self, name: str, parent: QWidget) -> None:
        super().__init__("Add track", parent)
        self._name = QLineEdit(name, self)
        self._name.setAccessibleName("Name of the track")
        self._name.selectAll()
        self._free = QCheckBox("Spans may overlap, e.g. of two hands", self)
        buttons, accept = accepting(self, "Add track")
        self._name.textChanged.connect(lambda text: accept.setEnabled(bool(text.strip())))
        self.setLayout(column_of(form_of(("Name", self._name), ("", self._free)), buttons))

    @property
    def name(self) -> str:
        """Name typed."""
        return self._name.text().strip()

    @property
    def overlap(self) -> Overlap:
        """Overlap chosen."""
        return "free" if self._free.isChecked() else "exclusive"


def offer_tracks(menu: QMenu, labels: LabelsModel) -> None:
    """List the tracks for new spans first in a menu, as they are when it is shown."""
    group, first = QActionGroup(menu), menu.addSeparator()

    def fill() -> None:
        for action in group.actions():
            action.deleteLater()
            group.removeAction(action)
            menu.removeAction(action)
        for track in labels.targets:
            # An ampersand would underline what comes after it.
            action = QAction(track.name.replace("&", "&&"), menu)
            action.setCheckable(True)
            action.setChecked(track.name == labels.track)
            action.setToolTip(_TIPS[track.overlap])
            action.triggered.connect(lambda _=False, name=track.name: labels.set_track(name))
            menu.insertAction(first, group.addAction(action))

    menu.aboutToShow.connect(fill)


_TIPS: dict[Overlap, str] = {"free": "Spans may overlap", "exclusive": "One span at a time"}
