"""Studies in the window, by mouse and keys, and their results."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QToolButton
from small_pairs import write_pairs
from study_results import some_results
from window_models import models_of

from sd2app.study.feature import StudySetupView
from sd2app.study.result_dialog import ClassResultDialog, ConfusionView
from sd2app.widgets.inputs import CheckBox, Choice
from sd2core.study.report import write_report


@pytest.fixture
def page(window, tmp_path, qtbot):
    """The page of studies with data, and a command that learns nothing."""
    feature = window.features.study
    feature.runs.select(None)
    window.action("study").trigger()
    setup = models_of(window).class_training.setup
    setup.add(write_pairs(tmp_path / "campaign.zarr"))
    qtbot.waitUntil(lambda: not setup.problem, timeout=10_000)
    view = window.findChild(StudySetupView)
    assert view.isVisible()
    yield view.parent()
    if feature.runs.under_way:
        feature.runs.run.tell("cancel")
        qtbot.waitUntil(lambda: feature.runs.run is None, timeout=20_000)


def press(page, text: str, qtbot) -> None:
    (button,) = [one for one in page.findChildren(QToolButton) if one.text() == text
                 and one.isVisible()]  # fmt: skip
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def said(page) -> str:
    return "\n".join(one.text() for one in page.findChildren(QLabel) if one.isVisible())


@pytest.mark.slow
def test_begun_by_clicks_and_its_conclusion_read(window, page, qtbot):
    runs = window.features.study.runs
    (same,) = [one for one in page.findChildren(CheckBox) if one.text() == "The same people"]
    qtbot.mouseClick(same, Qt.MouseButton.LeftButton, pos=QPoint(8, same.height() // 2))
    assert runs.is_on("same_people")
    assert "1 source" in said(page)
    press(page, "Start", qtbot)
    qtbot.waitUntil(lambda: runs.run is not None and not runs.run.under_way, timeout=20_000)
    assert "It helped." in said(page)
    assert "--same-people" in runs.run.about["arguments"]


@pytest.mark.slow
def test_a_result_is_opened_and_looked_at(window, page, tmp_path, qtbot, monkeypatch):
    path = tmp_path / "study.json"
    write_report(some_results(tmp_path), tmp_path)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    press(page, "Open a result…", qtbot)
    dialog = window.findChild(ClassResultDialog)
    left, right = dialog.findChildren(ConfusionView)
    assert left.matrix.title == "radar alone"
    assert right.matrix.title == "+ denoised"
    assert "horizontal taken for horizontal: 81.0 ± 1.0 %" in left.accessibleDescription()
    choice = dialog.findChild(Choice)
    choice.setFocus()
    qtbot.keyClick(choice, Qt.Key.Key_Up)
    assert right.matrix.title == "+ synthetic"
    dialog.grab()
    dialog.close()
    path.write_text("{}")
    press(page, "Open a result…", qtbot)
    assert "is no such result" in window.messages.text


def test_a_plan_is_chosen_and_run(window, page, tmp_path, qtbot, monkeypatch):
    plan: Path = tmp_path / "mine.toml"
    plan.write_text('title = "t"\nout = "made"\ndata = ["campaign.zarr"]\n')
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(plan), ""))
    press(page, "Run a plan…", qtbot)
    runs = window.features.study.runs
    qtbot.waitUntil(lambda: runs.run is not None and not runs.run.under_way, timeout=20_000)
    assert runs.run.result == tmp_path / "made" / "study.json"
