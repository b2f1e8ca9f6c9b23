"""Dialog of what is as the user likes it, whatever is open."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QWidget

from sd2app.labels.marking import LONGEST_MS, Reaction
from sd2app.manual.help import with_help
from sd2app.settings import Settings
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.panel import outlined, side_by_side

_THEMES = {None: "as the system", False: "light", True: "dark"}


class PreferencesDialog(Dialog):
    """Each preference in a row; what is changed holds at once.

    Parameters
    ----------
    settings : Settings
    reaction : Reaction
    use_theme : callable
        Shows a theme: dark, light, or (None) the system's.
    open_keys, open_labels : callable
        Open the lists of keys and of labels.
    parent : QWidget
    """

    def __init__(
        self,
        settings: Settings,
        reaction: Reaction,
        use_theme: Callable[[bool | None], object],
        open_keys: Callable[[], object],
        open_labels: Callable[[], object],
        parent: QWidget,
    ) -> None:
        super().__init__("Preferences", parent)
        theme = Choice("Dark or light", self, _THEMES, use_theme)
        theme.show_value(settings.dark)
        reaction_ms = NumberBox(
            0.0, LONGEST_MS, " ms", "Marks made while it plays begin and end earlier by so much",
            decimals=0, step=50.0,
        )  # fmt: skip
        reaction_ms.show_value(reaction.reaction_ms)
        reaction_ms.valueChanged.connect(lambda value: reaction.set_reaction_ms(round(value)))

        def go(then: Callable[[], object]) -> None:
            self.accept()
            then()

        keys = outlined("All keys…", "To be found and changed", lambda: go(open_keys), self)
        labels = outlined("Label set…", "Names, keys and colours", lambda: go(open_labels), self)
        rows = form_of(
            ("Theme", theme),
            ("Reaction time", reaction_ms),
            ("Keys and labels", side_by_side(keys, labels)),
        )
        self.setLayout(column_of(rows, with_help("Preferences", closing(self))))
