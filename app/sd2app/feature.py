"""What the window asks of its features, and what it offers them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from PySide6.QtCore import SignalInstance
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

T = TypeVar("T")


def always() -> bool:
    """True at any time."""
    return True


@dataclass(frozen=True)
class Action:
    """Command of the user, with its usual keys; ``menu`` has others of its subject.

    ``checked`` makes it checkable and tells if it is on; ``why_not`` gives a reason that disables
    it, shown in place of the tip, or nothing. Its place in the menus is the shell's matter.
    """

    id: str
    menu: str
    text: str
    keys: tuple[str, ...]
    tip: str
    run: Callable[[], object]
    enabled: Callable[[], bool] = always
    checked: Callable[[], bool] | None = None
    icon: str = ""
    why_not: Callable[[], str] | None = None


@dataclass(frozen=True)
class Drop:
    """Use of files that are dropped on the window, in words and as a function."""

    text: str
    run: Callable[[], object]


class Keys(Protocol):
    """Keys of actions and labels, of which no two are alike."""

    def owner(self, key: str, besides: str = "") -> str:
        """Action or label that has a key, in words; empty if it is free."""

    def for_label(self, name: str, key: str) -> str:
        """Key that a label gets, as labels store it; refused with ``Sd2Error``."""


class Shell(Protocol):
    """Services of the window for its features: a parent for dialogs, messages, pages, files."""

    @property
    def dialog_parent(self) -> QWidget:
        """Parent of dialogs."""

    @property
    def keys(self) -> Keys:
        """Keys in use."""

    def action(self, name: str) -> QAction:
        """Action by its id, of any feature."""

    def place_menu(self, place: str) -> QMenu:
        """Menu of the actions that stand at a place of their own, such as spans."""

    def note(self, text: str) -> None:
        """Tell the user about something that was done."""

    def warn(self, text: str) -> None:
        """Tell the user about something that went wrong."""

    def show_messages(self) -> None:
        """Show what the user was told so far."""

    def attempt(self, work: Callable[[], T]) -> T | None:
        """Result of ``work``; an error is told to the user, and None returned."""

    def bring_up(self, panel: str, page: str = "") -> None:
        """Show a panel at the side, and a page of it."""

    @property
    def side_folded(self) -> bool:
        """True while the panel at the side is folded away."""

    def fold_side(self, folded: bool) -> None:
        """Fold the panel at the side away, or bring it back."""

    @property
    def starts(self) -> bool:
        """True while the start page is on screen."""

    def show_start(self, shown: bool) -> None:
        """Show the start page over what is open, or what is open again."""

    def save(self) -> bool:
        """Save the recording, asking where if need be; False where the user cancels."""

    def may_discard(self) -> bool:
        """True once unsaved edits are saved or given up by the user's decision."""

    def open_paths(self, paths: Sequence[Path]) -> None:
        """Open files in place of what is open."""


def report(shell: Shell, *models: Any) -> None:
    """Tell the user what models note, and what goes wrong in them."""
    for model in models:
        model.failed.connect(shell.warn)
        model.noted.connect(shell.note)


class Feature:
    """One subject of the window: builds, wires and closes its models, and hands over its views.

    A feature overrides what it has. Models are made in the constructor and need no display;
    panels and bars are made by their methods, which are called once.
    """

    changing: Sequence[SignalInstance] = ()
    """Signals after which an action of the feature may be possible that was not, or the reverse;
    what is open, and whether its labels can be edited, is followed for all."""
    closing: Sequence[Any] = ()
    """Models with a method ``close``, closed with the window in this order."""
    working: Sequence[Any] = ()
    """Models with a property ``busy``, which a picture of the window should wait for."""
    running: Sequence[Any] = ()
    """Models of runs in the background, which an earlier window may have begun."""

    @property
    def busy(self) -> bool:
        """True while something is being computed that a picture of the window should wait for."""
        return any(model.busy for model in self.working)

    def actions(self) -> Sequence[Action]:
        """Rows of the menus."""
        return ()

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """Functions that fill the places of the menus that follow a model, by their names."""
        return {}

    def panels(self) -> Mapping[str, QWidget]:
        """Views by the name of their place in the window."""
        return {}

    def bars(self) -> Sequence[QWidget]:
        """Bars above the content, which the user calls up; hidden otherwise."""
        return ()

    def notices(self) -> Sequence[QWidget]:
        """Each a ``Notice``, which lies over the content since it appears by itself."""
        return ()

    def attach(self) -> None:
        """Follow a recording that has just been opened."""

    def drop_of(self, path: Path) -> Drop | None:
        """Use of a file that is dropped on the window; None if it is none of this feature's."""
        return None

    def look_for_unfinished(self) -> None:
        """Find runs in the background that an earlier window began."""
        for model in self.running:
            model.look_for_runs()

    def may_close(self) -> bool:
        """Ask the user what becomes of running work; False if the window is to stay."""
        return True

    def close(self) -> None:
        """Stop every thread and let go of files."""
        for model in self.closing:
            model.close()
