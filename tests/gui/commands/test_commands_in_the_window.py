"""Any command as a form: by real mouse and keys, asserting on the model."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QToolButton,
    QWidget,
)

from sd2app.commands.feature import CommandWindow
from sd2app.commands.model import CommandForms, MeshRefining
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2app.widgets.panel import Fold


class Surroundings:
    """What the window of commands asks of the main window."""

    def __init__(self, parent: QWidget) -> None:
        self.dialog_parent = parent

    def attempt(self, work: Any) -> Any:
        return work()


@pytest.fixture
def window(qtbot, qapp, tmp_path: Path) -> Iterator[tuple[CommandForms, CommandWindow]]:
    forms = CommandForms(Settings.forgetful(), qapp, tmp_path / "runs")
    parent = QWidget()
    qtbot.addWidget(parent)
    forms.choose("synth")
    refining = MeshRefining(Session(parent, forms._settings), forms)
    window = CommandWindow(forms, refining, Surroundings(parent), parent)  # type: ignore[arg-type]
    window.show()
    qtbot.waitExposed(window)
    yield forms, window
    window.close()
    forms.close()


def named(window: QWidget, kind: type[Any], name: str) -> Any:
    """The widget of a kind that is called so, as a screen reader would say."""
    (found,) = (one for one in window.findChildren(kind) if one.accessibleName() == name)
    return found


def button(window: QWidget, text: str) -> QToolButton:
    (found,) = (
        one for one in window.findChildren(QToolButton) if one.text() == text and one.isVisible()
    )
    return found


def test_a_form_is_filled_in_and_its_command_copied(qtbot, window) -> None:
    forms, dialog = window
    assert not button(dialog, "Copy command").isEnabled()
    QTest.keyClicks(named(dialog, QLineEdit, "Mesh"), "walk.npz")
    QTest.keyClicks(named(dialog, QLineEdit, "Out"), "map.npz")
    fold = next(one for one in dialog.findChildren(Fold) if one.text() == "More options")
    QTest.mouseClick(fold, Qt.MouseButton.LeftButton)
    QTest.keyClicks(named(dialog, QLineEdit, "Bins"), "64")
    box = named(dialog, QCheckBox, "Limbs")
    QTest.mouseClick(box, Qt.MouseButton.LeftButton, pos=QPoint(8, box.height() // 2))
    assert (forms.record.bins, forms.record.limbs) == (64, True)
    QTest.mouseClick(button(dialog, "Copy command"), Qt.MouseButton.LeftButton)
    copied = QApplication.clipboard().text()
    assert copied == "sd2 synth walk.npz --out map.npz --bins 64 --limbs"


def test_what_is_missing_is_said_once_its_field_was_left(window) -> None:
    _, dialog = window

    def warned() -> list[str]:
        labels = dialog.findChildren(QLabel, "warning")
        return [one.text() for one in labels if one.isVisible() and one.text()]

    assert warned() == []
    assert "Mesh is missing" in button(dialog, "Start").toolTip()
    mesh, out = (named(dialog, QLineEdit, name) for name in ("Mesh", "Out"))
    mesh.setFocus()
    assert warned() == []
    QTest.keyClicks(out, "map.npz")
    out.setFocus()
    (said,) = warned()
    assert "Mesh is missing" in said
    QTest.keyClicks(mesh, "walk.npz")
    assert warned() == []
    assert "missing" not in button(dialog, "Start").toolTip()


def test_what_is_wrong_is_said_and_nothing_starts(window) -> None:
    forms, dialog = window
    QTest.keyClicks(named(dialog, QLineEdit, "Mesh"), "walk.npz")
    QTest.keyClicks(named(dialog, QLineEdit, "Out"), "map.npz")
    assert button(dialog, "Start").isEnabled()
    fold = next(one for one in dialog.findChildren(Fold) if one.text() == "More options")
    QTest.mouseClick(fold, Qt.MouseButton.LeftButton)
    QTest.keyClicks(named(dialog, QLineEdit, "Bins"), "many")
    assert "Bins: 'many' is not a number" in forms.problem
    assert not button(dialog, "Start").isEnabled()


def test_another_command_is_another_form(window) -> None:
    forms, dialog = window
    choice = named(dialog, QComboBox, "Command")
    choice.setFocus()
    QTest.keyClicks(choice, "denoise")
    assert forms.chosen.name == "denoise"
    assert named(dialog, QLineEdit, "Map").isVisible()
