"""Actions of all features as Qt actions of one window, with its menus."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMainWindow, QMenu, QWidget

from sd2app.feature import Action
from sd2app.session.session import Session
from sd2app.shell.keys.model import KeyBindings
from sd2app.widgets.icons import transport_icon
from sd2app.widgets.text import native

_LINE = "-"
_FILLED = "@"

LAYOUT: Mapping[str, tuple[str, ...]] = {
    "File": (
        "new_from_video", "listen", "open", "@recent", "add", "read_mesh",
        "refine_mesh", "compare", "relink", "-", "save",
        "save_as", "export_map", "export_maps", "export_strip", "export_dataset", "-", "batch",
        "any_command", "-", "recover_labels", "-", "start_page", "quit",
    ),
    "Edit": (
        "undo", "redo", "-", "placements", "things", "bodies", "place_inertial", "align",
        "align_by_hand", "-",
        "preferences",
    ),
    "View": (
        "zoom_in", "zoom_out", "zoom_fit", "-", "reset_reference", "uncertain", "-",
        "pane_video", "pane_scene", "pane_spectrum", "side_panel",
        "-", "messages",
    ),
    "Play": ("play", "back_second", "on_second", "loop"),
    "Labels": (
        "suggest", "find_gestures", "-", "end_marks", "add_track", "-", "next_span",
        "previous_span", "find_spans", "-", "label_set", "import_labels", "export_labels",
        "cut_out", "compare_labels", "-", "restore_labels", "edit_labels_here",
    ),
    "Model": (
        "@denoisers", "difference", "live", "-", "@classifiers", "show_classes",
        "train_classifier", "study",
    ),
    "Help": (
        "first_five_minutes", "manual", "find_action", "keys", "-", "sample", "tour", "-", "about",
    ),
}  # fmt: skip
"""Menus of the menu bar: ids of actions, ``-`` lines, ``@`` places that a feature fills."""

ELSEWHERE: Mapping[str, tuple[str, ...]] = {
    "Start": ("open_radar",),
    "Scene": (
        "colour_velocity", "colour_range", "colour_visibility", "colour_plain", "dots",
        "draw_placements", "view_three_quarter", "view_camera", "view_sensor", "view_side",
        "view_top",
    ),
    "Video": ("overlay", "overlay_dots"),
    "Maps": ("@limbs", "export_denoised", "texture", "compare_models"),
    "Models": ("open_model", "model_card", "open_classifier", "classifier_card"),
    "Playing": (
        "previous_frame", "next_frame", "first_frame", "last_frame", "slower", "faster",
    ),
    "Panels": (
        "show_sensor", "show_trade", "show_train", "show_labels", "show_agree",
        "pane_over", "sensor_to_camera", "aim_sensor", "measure", "export_inertial",
    ),
    "Mark": ("@label keys", "-", "carve_marks", "leave"),
    "Spans": (
        "span_starts_here", "span_ends_here", "nudge_back", "nudge_on", "-", "split_span",
        "merge_spans", "meet_spans", "duplicate_spans", "delete_spans", "fill_gaps", "-",
        "loop_span", "select_all", "spans_up", "spans_down",
    ),
    "Tracks": (
        "@tracks", "-", "previous_track", "next_track", "-", "rename_track", "overlap",
        "track_up", "track_down", "remove_track",
    ),
    "Suggestions": (
        "accept_suggestion", "reject_suggestion", "accept_suggestions", "reject_suggestions",
    ),
    "Agreement": ("next_disagreement", "previous_disagreement", "end_comparison"),
    "Layouts": ("layout_look", "layout_label", "layout_learn", "layout_capture"),
    "Preferences": ("dark",),
}  # fmt: skip
"""Likewise what is in no menu of the bar, because a button or a context menu has it: by its place.
Its keys hold, and *Find an action* has it."""


def in_order(actions: Iterable[Action]) -> tuple[Action, ...]:
    """Actions by their menus, in each as it stands there, and then those that stand elsewhere.

    Raises ValueError for one that stands nowhere.
    """
    menus = list(LAYOUT)
    places = [entry for one in (LAYOUT, ELSEWHERE) for entries in one.values() for entry in entries]
    return tuple(sorted(actions, key=lambda one: (menus.index(one.menu), places.index(one.id))))


def menus_in(bar: QWidget) -> Iterator[QMenu]:
    """Menus of a menu bar, or of the window besides it, and those within them."""
    for entry in bar.actions():
        menu = QMenu.menuInAction(entry)
        if menu is not None:
            yield menu
            yield from menus_in(menu)


def give_mnemonics(menu: QMenu) -> None:
    """Underline a letter of every entry that has none, of its own as far as letters go."""
    entries = [entry for entry in menu.actions() if not entry.isSeparator()]
    taken = {letter for entry in entries if (letter := _mnemonic(entry.text()))}
    # Short texts first, which have the fewest letters to choose from.
    for entry in sorted(entries, key=lambda one: len(set(one.text()))):
        text = entry.text()
        if _mnemonic(text):
            continue
        shown = text.split("\t")[0]
        places = [place for place, letter in enumerate(shown) if letter.isalnum()]
        # Beginnings of words first.
        places.sort(key=lambda place: place > 0 and shown[place - 1].isalnum())
        free = [place for place in places if shown[place].upper() not in taken] or places
        if free:
            entry.setText(f"{text[: free[0]]}&{text[free[0] :]}")
            taken.add(shown[free[0]].upper())


def _mnemonic(text: str) -> str:
    return QKeySequence.mnemonic(text).toString()[-1:]


class Menus:
    """Makes the Qt actions, keeps them enabled and checked as the features say."""

    def __init__(
        self, window: QMainWindow, session: Session, actions: Iterable[Action], keys: KeyBindings
    ) -> None:
        self._window, self._session, self._keys = window, session, keys
        self._rows = {row.id: row for row in actions}
        self._actions: dict[str, QAction] = {}
        for row in self._rows.values():
            action = QAction(row.text, window)
            action.setCheckable(row.checked is not None)
            action.triggered.connect(lambda _=False, run=row.run: run())
            self._actions[row.id] = action
        keys.changed.connect(self._follow_keys)
        self._follow_keys()

    def __getitem__(self, name: str) -> QAction:
        return self._actions[name]

    def fill(self, fillers: Mapping[str, Callable[[QMenu], object]]) -> None:
        """Make the menus; ``fillers`` fill the places that are a feature's own."""
        window, bar = self._window, self._window.menuBar()
        for name, entries in LAYOUT.items():
            self._fill(bar.addMenu(f"&{name}"), entries, fillers)
        self.elsewhere = {name: QMenu(name, window) for name in ELSEWHERE}
        for name, menu in self.elsewhere.items():
            self._fill(menu, ELSEWHERE[name], fillers)
            window.addAction(menu.menuAction())  # so that keys of its entries hold
        for menu in (*menus_in(bar), *menus_in(window)):
            # Again when it is opened: what it lists may be others by then.
            menu.aboutToShow.connect(partial(give_mnemonics, menu))
            menu.aboutToShow.connect(self.refresh)
            give_mnemonics(menu)

    def _fill(
        self, menu: QMenu, entries: Iterable[str], fillers: Mapping[str, Callable[[QMenu], object]]
    ) -> None:
        menu.setToolTipsVisible(True)
        for entry in entries:
            if entry == _LINE:
                menu.addSeparator()
            elif entry.startswith(_FILLED):
                fillers[entry[1:]](menu)
            else:
                menu.addAction(self._actions[entry])

    def refresh(self, rows: Collection[Action] | None = None) -> None:
        """Follow the models, with all actions or some."""
        rows = self._rows.values() if rows is None else rows
        for row in rows:
            action = self._actions[row.id]
            reason = "" if row.why_not is None else row.why_not()
            action.setEnabled(row.enabled() and not reason)
            if row.why_not is not None:
                action.setToolTip(reason or self._tips[row.id])
            if row.checked is not None:
                action.setChecked(row.checked())
        stack = self._session.document.undo_stack
        self._actions["undo"].setText(f"&Undo {stack.undoText().lower()}".rstrip())
        self._actions["redo"].setText(f"&Redo {stack.redoText().lower()}".rstrip())
        playing = self._session.playback.playing
        if playing != (self._actions["play"].text() == "&Pause"):
            self._actions["play"].setText("&Pause" if playing else "&Play")
            self._set_icon("play", "pause" if playing else "play")

    def refresh_one(self, name: str) -> None:
        """Follow the models with one action, which changes with every frame."""
        self._actions[name].setEnabled(self._rows[name].enabled())

    def restyle(self) -> None:
        """Draw the icons in the colour of the theme."""
        for row in self._rows.values():
            if row.icon:
                self._set_icon(row.id, row.icon)
        if self._session.playback.playing:
            self._set_icon("play", "pause")

    def _set_icon(self, name: str, icon: str) -> None:
        self._actions[name].setIcon(transport_icon(icon, self._session.display.palette.text))

    def _follow_keys(self) -> None:
        # A key that changes hands has no owner in between.
        for action in self._actions.values():
            action.setShortcuts([])
        for name, action in self._actions.items():
            action.setShortcuts([QKeySequence(key) for key in self._keys.keys_of(name)])
        self._tips = {row.id: self._tip(row) for row in self._rows.values()}
        for name, tip in self._tips.items():
            self._actions[name].setToolTip(tip)

    def _tip(self, row: Action) -> str:
        keys = ", ".join(map(native, self._keys.keys_of(row.id)))
        return f"{row.tip} ({keys})" if keys else row.tip
