"""Search of all that the window offers: some words of it, and Return does it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QPalette
from PySide6.QtWidgets import QMainWindow, QMenu, QTreeWidgetItem, QWidget

from sd2app.widgets.dialogs import Dialog
from sd2app.widgets.inputs import SearchLine
from sd2app.widgets.layouts import column_of
from sd2app.widgets.panel import say, sentence
from sd2app.widgets.table import entry_list

_MOVING = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
_SIZE_PX = 640, 480


@dataclass(frozen=True)
class MenuEntry:
    """Action of the menus, and those that it stands in."""

    menus: tuple[str, ...]  # those that it stands in, the outermost first
    text: str
    tip: str  # what it does, or why it cannot be done now
    action: QAction

    def rank(self, words: Iterable[str]) -> int | None:
        """How well words of a search fit, 0 best; None where one of them fits nothing."""
        beginnings = self.text.casefold().split()
        about = f"{' '.join(self.menus)} {self.tip}".casefold()
        rank = 0
        for word in words:
            if any(one.startswith(word) for one in beginnings):
                continue
            if word in self.text.casefold():
                rank += 1
            elif word in about:
                rank += 4
            else:
                return None
        return rank


def entries_of(window: QMainWindow) -> list[MenuEntry]:
    """Entries of the menu bar, and of menus of the window besides, each once, as they are now."""
    entries: dict[QAction, MenuEntry] = {}
    for one in chain(_entries(window.menuBar(), ()), _entries(window, ())):
        entries.setdefault(one.action, one)
    return list(entries.values())


def _entries(menu: QWidget, menus: tuple[str, ...]) -> Iterator[MenuEntry]:
    if isinstance(menu, QMenu):
        menu.aboutToShow.emit()  # what it lists may be others by now
    for entry in menu.actions():
        text = _plain(entry.text())
        inner = QMenu.menuInAction(entry)
        if isinstance(inner, QMenu):
            yield from _entries(inner, (*menus, text))
        elif text and not entry.isSeparator():
            yield MenuEntry(menus, text, entry.toolTip(), entry)


def _plain(text: str) -> str:
    """Text of an entry without the mark of its letter, and without its key."""
    return text.split("\t")[0].replace("&&", "\0").replace("&", "").replace("\0", "&")


def matching(entries: Iterable[MenuEntry], text: str) -> list[MenuEntry]:
    """Entries that have all words of a search, the best first; what can be done before the rest."""
    words = text.casefold().split()
    ranked = [(rank, one) for one in entries if (rank := one.rank(words)) is not None]
    order = sorted(ranked, key=lambda at: (at[0], bool(words) and not at[1].action.isEnabled()))
    return [one for _, one in order]


class ActionSearch(Dialog):
    """A line to type in, and what is found; an entry that is disabled says why."""

    def __init__(self, window: QMainWindow) -> None:
        super().__init__("Find an action", window)
        self._entries = entries_of(window)
        self.chosen: QAction | None = None
        self._line = SearchLine("What do you want to do?", self)
        self._list = entry_list("Actions found", ("Action", "Where", "Keys"), 0, self)
        self._list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._list.itemClicked.connect(lambda: self._choose())
        self._list.currentItemChanged.connect(lambda: self._explain())
        self._about = sentence("")
        self.setLayout(column_of(self._line, (self._list, 1), self._about))
        self.resize(*_SIZE_PX)
        self._line.textChanged.connect(self._find)
        self._find("")

    def _find(self, text: str) -> None:
        self._matches = matching(self._entries, text)
        grey = self.palette().color(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Text)
        self._list.clear()
        for one in self._matches:
            keys = ", ".join(
                key.toString(QKeySequence.SequenceFormat.NativeText)
                for key in one.action.shortcuts()
            )
            item = QTreeWidgetItem(self._list, [one.text, " › ".join(one.menus), keys])
            if not one.action.isEnabled():
                # Grey, and still marked by the arrow keys, to say why.
                for column in range(item.columnCount()):
                    item.setForeground(column, grey)
        self._list.setCurrentIndex(self._list.model().index(0, 0))
        self._explain()

    @property
    def current(self) -> MenuEntry | None:
        """Entry that Return would do."""
        row = self._list.currentIndex().row()
        return self._matches[row] if 0 <= row < len(self._matches) else None

    def _explain(self) -> None:
        if self.current is None:
            self._about.setText("" if self._matches else "Nothing has all these words.")
            return
        role = "muted" if self.current.action.isEnabled() else "warning"
        say(self._about, self.current.tip, role)

    def _choose(self) -> None:
        if self.current is not None and self.current.action.isEnabled():
            self.chosen = self.current.action
            self.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return does what is marked; arrows move the mark while one types."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._choose()
        elif event.key() in _MOVING:
            self._list.keyPressEvent(event)
        else:
            super().keyPressEvent(event)
