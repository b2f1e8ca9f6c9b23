"""The button that Return presses in a dialog does what the title of the dialog says."""

from __future__ import annotations

import pytest
from answering import once_asked
from PySide6.QtWidgets import QDialog, QPushButton


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("action", "title", "primary"),
    [
        ("cut_out", "Export cut-outs", "Export…"),
        ("export_labels", "Export labels", "Export…"),
        ("export_maps", "Export figure of the maps", "Export…"),
        ("add_track", "Add track", "Add track"),
        ("listen", "Record", "Record"),
        ("messages", "Messages", "Close"),
    ],
)
def test_return_does_what_the_title_says(labelled, qtbot, action, title, primary) -> None:
    seen: list[tuple[str, list[str]]] = []

    def look(dialog: QDialog) -> None:
        buttons = dialog.findChildren(QPushButton)
        usual = [one.text().replace("&", "") for one in buttons if one.isDefault()]
        seen.append((dialog.windowTitle(), usual))
        dialog.reject()

    once_asked(QDialog, look)
    labelled.action(action).trigger()
    assert seen == [(title, [primary])]
