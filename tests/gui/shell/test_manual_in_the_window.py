"""The manual opens from the window: by F1, from the menu, and from the head of every panel."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from guide_pages import pages_to_follow
from PySide6.QtCore import QObject, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QToolButton
from window_models import menu_of

from sd2app.labels.exports import CutOutDialog, SpanGroup
from sd2app.manual.help import HELP
from sd2app.shell.program import ProgramFeature
from sd2app.shell.side_panel import RailButton

APP = Path(__file__).resolve().parents[3] / "app" / "sd2app"
SMALL = {"TrackDialog", "MessagesDialog", "ModelCardDialog", "ActionSearch"}
"""Dialogs that say all there is to say."""


@pytest.fixture
def manual(window) -> ProgramFeature:
    """What opens the manual; closed afterwards, as the window that is kept had none."""
    yield window.features.program.manual
    if window.features.program.manual.window is not None:
        window.features.program.manual.close()
        window.features.program.manual.answer()


def help_in(parent: QObject) -> QToolButton:
    """The one button that is shown there."""
    buttons = parent.findChildren(QToolButton)
    (one,) = [
        one for one in buttons if one.accessibleName() == "Help on this panel" and one.isVisible()
    ]
    assert one.text() == "?"
    assert one.toolTip().startswith("Help on this panel")
    return one


def place_in(manual) -> str:
    view = manual.window.view
    anchor = view.source().fragment()
    return f"{view.page}#{anchor}" if anchor else view.page


def test_a_key_and_the_menu_open_it_in_one_window(window, manual) -> None:
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert manual.window.isVisible()
    assert manual.window.view.page == "index.md"
    first = manual.window
    entries = {one.text().replace("&", ""): one for one in menu_of(window, "&Help").actions()}
    entries["First five minutes"].trigger()
    assert manual.window.view.page == "first-five-minutes.md"
    first.close()
    entries["Manual"].trigger()
    assert manual.window is first
    assert first.isVisible()


def test_without_its_pages_it_says_so(window, manual, monkeypatch, tmp_path) -> None:
    monkeypatch.setattr("sd2app.manual.help.manual_folder", lambda: tmp_path)
    told: list[str] = []
    window.warn = told.append
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert "index.md" in told[0]
    assert manual.window is None


def test_every_panel_at_the_side_has_help(window, manual) -> None:
    panels = (
        ("Sensor", "Sensor", "Sensor"),
        ("Sensor", "Placements", "Placements"),
        ("Accuracy", "", "Accuracy"),
        ("Train", "Denoiser", "Denoiser"),
        ("Train", "Classifier", "Classifier"),
        ("Labels", "Spans", "Labels"),
        ("Labels", "Label set", "Label set"),
        ("Agreement", "", "Agreement"),
    )
    assert {row[0] for row in panels} == {one.name for one in window.side.findChildren(RailButton)}
    for panel, page, topic in panels:
        window.bring_up(panel, page)
        QTest.mouseClick(help_in(window.side), Qt.MouseButton.LeftButton)
        assert place_in(manual) == HELP[topic]


def test_every_larger_dialog_has_help() -> None:
    named: set[str] = set()
    for file in sorted(APP.rglob("*.py")):
        text = file.read_text("utf-8")
        topics = re.findall(r'\b(?:help_button|with_help|show_help)\(\s*"([^"]+)"', text)
        named |= set(topics)
        dialogs = re.findall(r"^class (\w+)\((?:QDialog|Dialog|QFileDialog)\)", text, re.MULTILINE)
        if {*dialogs} - SMALL - {"OpenDialog", "Dialog"}:
            assert topics, file
    panels = {"Sensor", "Placements", "Accuracy", "Denoiser", "Classifier"}
    panels |= {"Labels", "Label set", "Agreement"}
    assert named | panels == set(HELP)


@pytest.mark.slow
def test_help_in_a_dialog_that_waits_can_be_read(window, manual) -> None:
    labels = window.features.labels
    groups = [SpanGroup("all", labels.model.labels.spans)]
    dialog = CutOutDialog(groups, labels.cut_out, labels.cut_out.source(), window)
    dialog.open()
    QTest.qWaitForWindowExposed(dialog)
    assert QApplication.activeModalWidget() is dialog
    QTest.keyClick(dialog, Qt.Key.Key_F1)
    assert place_in(manual) == HELP["Export cut-outs"]
    # The dialog blocks windows that are not its own.
    handle = manual.window.windowHandle()
    assert handle.transientParent() is dialog.windowHandle()
    (box,) = dialog.findChildren(QDialogButtonBox)
    assert help_in(dialog).x() < box.x()
    dialog.reject()
    assert manual.window.isVisible()
    window.action("manual").trigger()
    assert manual.window.windowHandle().transientParent() is None
    assert not dialog.isVisible()
    dialog.deleteLater()


@pytest.mark.slow
def test_it_closes_with_the_window(empty_window) -> None:
    QTest.keyClick(empty_window, Qt.Key.Key_F1)
    shown = empty_window.features.program.manual.window
    assert shown.isVisible()
    empty_window.close()
    assert not shown.isVisible()


def test_menus_that_the_guide_names_are_there(window) -> None:
    named = [
        (page.name, menu, path)
        for page in pages_to_follow()
        for menu, path in re.findall(
            r"\*(\w+) → ([^*]+)\*", " ".join(page.path.read_text("utf-8").split())
        )
    ]
    assert named
    for page, menu, path in named:
        at = window.menuBar()
        for text in (menu, *path.split(" → ")):
            entries = {one.text().replace("&", ""): one.menu() for one in at.actions()}
            assert text in entries, (page, menu, path)
            at = entries[text]
            if at is not None:
                at.aboutToShow.emit()  # some list what there is then
