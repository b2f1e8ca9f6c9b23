"""Keys as the user has bound them, and the list of all that has some."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.feature import Action
from sd2app.labels.model import LabelsModel
from sd2app.settings import Settings
from sd2app.widgets.text import canonical, native
from sd2core.errors import Sd2Error
from sd2core.labels.edits import Change
from sd2core.labels.field_edits import change_label

_CHOSEN = "keys"
_RESERVED = {
    "Tab": "goes from field to field",
    "Backtab": "goes from field to field",
    "Shift+Tab": "goes from field to field",
    "Shift+Backtab": "goes from field to field",
    "Return": "ends typing",
    "Enter": "ends typing",
}


class KeyBindings(QObject):
    """The keys of every action. No key does two things.

    A key that the user gives to an action is free, or is refused with the name of who has it.
    Labels come with the recording: where one has a key of an action, it has it for as long.
    """

    changed = Signal()  # some action has other keys

    def __init__(
        self, actions: Iterable[Action], labels: LabelsModel, settings: Settings, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._actions = {one.id: one for one in actions}
        self._labels, self._settings = labels, settings
        self._chosen = _stored(settings.table(_CHOSEN), self._actions)
        self._of_labels: dict[str, str] = {}
        self._follow()
        labels.choices_changed.connect(self._follow_labels)

    @property
    def actions(self) -> Sequence[Action]:
        """All of them, in the order of the menus."""
        return tuple(self._actions.values())

    def keys_of(self, action_id: str) -> tuple[str, ...]:
        """The keys that do an action now."""
        return tuple(key for key in self._wanted(action_id) if key not in self._of_labels)

    def lent(self, action_id: str) -> Mapping[str, str]:
        """Keys of an action that a label has taken, each with the label's name."""
        return {
            key: self._of_labels[key] for key in self._wanted(action_id) if key in self._of_labels
        }

    def is_usual(self, action_id: str) -> bool:
        """True if the user has left its keys as they are."""
        return action_id not in self._chosen

    def owner(self, key: str, besides: str = "") -> str:
        """Action or label that has a key, in words; empty if none but ``besides`` has it."""
        key = canonical(key)
        if key in self._of_labels:
            return f"the label “{self._of_labels[key]}”"
        for action in self._actions.values():
            if action.id != besides and key in self._wanted(action.id):
                return f"“{action.text}” ({action.menu})"
        for menu in dict.fromkeys(action.menu for action in self._actions.values()):
            if key == f"Alt+{menu[0]}":
                return f"the menu {menu} itself"
        return ""

    def bind(self, action_id: str, keys: Iterable[str]) -> None:
        """Give an action these keys, and no others.

        Raises Sd2Error if one is no key, is reserved or is taken; nothing is changed then.
        """
        wanted = tuple(dict.fromkeys(canonical(key) for key in keys))
        text = self._actions[action_id].text
        for key in wanted:
            self.check(key, f"“{text}”", besides=action_id)
        if wanted == self._usual(action_id):
            self._chosen.pop(action_id, None)
        else:
            self._chosen[action_id] = wanted
        self._store()

    def check(self, key: str, what: str, besides: str = "") -> None:
        """Refuse a key that cannot be given to something; see :meth:`bind`."""
        shown = native(key)
        if not key:
            raise Sd2Error(f"{what} was to get a key that this program does not know", "one key")
        if key in _RESERVED:
            raise Sd2Error(f"{shown} {_RESERVED[key]}", f"another key for {what}")
        if owner := self.owner(key, besides):
            raise Sd2Error(f"{shown} belongs to {owner}", f"a free key for {what}")

    def for_label(self, name: str, key: str) -> str:
        """The key that a label is to get, as labels have it; errors are those of :meth:`bind`."""
        label, key = self._labels.labels.label_set.find(name), canonical(key)
        if label is not None and label.key and canonical(label.key) == key:
            return label.key
        if len(key) > 1:
            raise Sd2Error(f"{native(key)} was to mark “{name}”", "one character, without Ctrl")
        self.check(key, f"the label “{name}”")
        return key.lower()

    def reset(self, action_id: str) -> None:
        """Give an action its usual keys back; errors are those of :meth:`bind`."""
        self.bind(action_id, self._usual(action_id))

    def reset_all(self) -> None:
        """Give every action its usual keys back."""
        self._chosen.clear()
        self._store()

    def _store(self) -> None:
        self._settings.keep_table(_CHOSEN, self._chosen)
        self._follow()

    def _follow_labels(self) -> None:
        of_labels = self._label_keys()
        if of_labels != self._of_labels:
            self._follow()

    def _follow(self) -> None:
        self._of_labels = self._label_keys()
        self.changed.emit()

    def _label_keys(self) -> dict[str, str]:
        labels = self._labels.labels.label_set.labels
        return {canonical(label.key): label.name for label in labels if label.key}

    def _usual(self, action_id: str) -> tuple[str, ...]:
        return tuple(canonical(key) for key in self._actions[action_id].keys)

    def _wanted(self, action_id: str) -> tuple[str, ...]:
        """The chosen keys, or the usual ones but those that were chosen for another action."""
        if action_id in self._chosen:
            return self._chosen[action_id]
        taken = {key for keys in self._chosen.values() for key in keys}
        return tuple(key for key in self._usual(action_id) if key not in taken)


def _stored(content: Mapping[str, Any], known: Mapping[str, object]) -> dict[str, tuple[str, ...]]:
    """Stored keys, as far as they can be understood; of two with one key the first has it."""
    chosen: dict[str, tuple[str, ...]] = {}
    taken: set[str] = set(_RESERVED)
    for action_id, keys in content.items():
        if action_id not in known or not isinstance(keys, list):
            continue
        kept = dict.fromkeys(canonical(key) for key in keys if isinstance(key, str))
        chosen[action_id] = tuple(key for key in kept if key and key not in taken)
        taken.update(chosen[action_id])
    return chosen


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
