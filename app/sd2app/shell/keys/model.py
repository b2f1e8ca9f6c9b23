"""Actions, labels and what the mouse does, each with its keys, as the rows of a list."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sd2app.labels.model import LabelsModel
from sd2app.shell.keys.bindings import KeyBindings
from sd2app.widgets.key_text import canonical, native
from sd2core.labels.edits import Change
from sd2core.labels.field_edits import change_label


@dataclass(frozen=True)
class KeyRow:
    """One row: an action, a label, or a use of the mouse."""

    menu: str
    text: str
    tip: str
    action: str = ""  # id of the action, if it is one
    label: str = ""  # name of the label, if it is one
    mouse: str = ""  # what the hand does, if it is neither


class KeyList:
    """Actions and their keys, which are changed through :class:`KeyBindings`."""

    def __init__(
        self,
        bindings: KeyBindings,
        labels: LabelsModel,
        mouse: Sequence[tuple[str, str]],
        apply: Callable[[Change], bool],
    ) -> None:
        self.bindings, self._labels, self._mouse, self._apply = bindings, labels, mouse, apply

    def rows(self, search: str = "") -> list[KeyRow]:
        """Rows with all these words in menu, name, tip or keys."""
        actions = [
            KeyRow(one.menu, one.text, one.tip, action=one.id) for one in self.bindings.actions
        ]
        labels = [
            KeyRow("Labels", f"Mark or relabel: {one.name}", "Begin or end a span", label=one.name)
            for one in self._labels.labels.label_set.labels
        ]
        first = next((k for k, row in enumerate(actions) if row.menu == "Labels"), len(actions))
        mouse = [KeyRow("Mouse", meaning, meaning, mouse=hand) for hand, meaning in self._mouse]
        words = search.casefold().split()
        return [
            row
            for row in (*actions[:first], *labels, *actions[first:], *mouse)
            if all(
                word in f"{row.menu} {row.text} {row.tip} {self.keys_text(row)}".casefold()
                for word in words
            )
        ]

    def is_usual(self, row: KeyRow) -> bool:
        """True if there is nothing to reset."""
        return not row.action or self.bindings.is_usual(row.action)

    def change(self, row: KeyRow, key: str, *, besides: bool = False) -> None:
        """Give a row another key, or one besides those it has; Sd2Error if it cannot have it."""
        if row.action:
            kept = self.bindings.keys_of(row.action) if besides else ()
            self.bindings.bind(row.action, (*kept, key))
        elif row.label:
            wanted = self.bindings.for_label(row.label, key)
            self._apply(lambda now: change_label(now.labels, row.label, key=wanted))

    def clear(self, row: KeyRow) -> None:
        """Take all keys of a row away."""
        if row.action:
            self.bindings.bind(row.action, ())
        elif row.label:
            self._apply(lambda now: change_label(now.labels, row.label, key=""))

    def reset(self, row: KeyRow) -> None:
        """Give a row its usual keys back; errors are those of :meth:`change`."""
        if row.action:
            self.bindings.reset(row.action)

    def keys_text(self, row: KeyRow) -> str:
        """The keys of a row, as they are written on this machine."""
        if row.mouse:
            return row.mouse
        if row.label:
            label = self._labels.labels.label_set.find(row.label)
            return "" if label is None else native(canonical(label.key))
        lent = self.bindings.lent(row.action)
        taken = [f"{native(key)}: now “{label}”" for key, label in lent.items()]
        return ", ".join([*map(native, self.bindings.keys_of(row.action)), *taken])
