"""The radar's time offset found and applied in the real window, by the mouse."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from answering import once_asked
from copied import copied_record
from finding import button_of
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QToolButton
from window_models import menu_of, models_of

from sd2app.sensor import alignment
from sd2app.sensor.alignment import AlignmentDialog
from sd2app.sensor.panel import SensorPanel
from sd2app.widgets.chart import ChartView
from sd2app.widgets.inputs import NumberBox
from sd2core.cli.align import Align
from sd2core.doppler.alignment import align
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis()


def noise(offset_s: float, period_s: float) -> DopplerMap:
    """Fifteen seconds of random cells that repeat themselves."""
    frames = np.arange(450) + round(30 * offset_s)
    cells = np.random.default_rng(0).random((AXIS.bins, round(30 * period_s)), np.float32)
    return DopplerMap(
        cells[:, frames % cells.shape[1]], AXIS, Timebase.regular(450, 30.0), kind="real"
    )


@pytest.fixture
def motion(monkeypatch):
    """Compare long maps whose offset is known in place of the small recording's."""

    def show(offset_s: float, period_s: float) -> None:
        ours, theirs = noise(0.0, period_s), noise(offset_s, period_s)
        monkeypatch.setattr(
            alignment, "align", lambda synthetic, radar, **where: align(ours, theirs, **where)
        )

    return show


def find(window, qtbot, work) -> None:
    """Click on Find… beside the offset, and do something with the dialog once it has searched."""
    window.bring_up("Sensor", "Sensor")
    panel = window.findChild(SensorPanel)
    button = next(one for one in panel.findChildren(QToolButton) if one.text() == "Find…")
    assert button.isEnabled()
    answered = []

    def settled(dialog: AlignmentDialog) -> None:
        try:
            qtbot.waitUntil(lambda: not models_of(window).alignment.busy, timeout=20_000)
            work(dialog)
            answered.append(True)
        finally:
            if dialog.isVisible():
                dialog.reject()

    once_asked(AlignmentDialog, settled)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert answered


def words(dialog: AlignmentDialog) -> str:
    return "\n".join(one.text() for one in dialog.findChildren(QLabel) if one.isVisible())


def button(dialog: AlignmentDialog, text: str) -> QPushButton:
    return next(
        one for one in dialog.findChildren(QPushButton) if one.text().replace("&", "") == text
    )


@pytest.mark.slow
def test_the_command_looks_as_far_and_keeps_what_it_finds(window, qtbot, motion):
    motion(1.5, 60.0)

    def copy(dialog: AlignmentDialog) -> None:
        models_of(window).alignment.search(3.5)
        qtbot.mouseClick(button_of(dialog, "Copy command"), Qt.MouseButton.LeftButton)

    find(window, qtbot, copy)
    folder = models_of(window).document.recording.folder
    assert copied_record() == Align(recordings=(folder,), within=3.5, save=True)


def test_the_offset_is_found_shown_applied_and_taken_back(window, qtbot, motion):
    models = models_of(window)
    motion(1.5, 60.0)

    def apply(dialog: AlignmentDialog) -> None:
        found_s = models.alignment.result.offset_s
        assert found_s == pytest.approx(1.5, abs=0.01)
        assert f"offset of {found_s:.3f} s (now 0.000 s)" in words(dialog)
        assert "Confidence is high" in words(dialog)
        assert any(
            f"Best: {found_s:.3f} s" in mark.words for mark in dialog.findChild(ChartView).marks
        )
        assert button(dialog, "Align").isDefault()
        qtbot.keyClick(dialog, Qt.Key.Key_Return)

    find(window, qtbot, apply)
    found_s = models.alignment.result.offset_s
    assert models.document.recording.radar_offset_s == models.real.offset_s == found_s
    assert models.document.undo_stack.undoText() == "Radar offset"
    models.document.undo_stack.undo()
    assert models.document.recording.radar_offset_s == 0.0


@pytest.mark.slow
def test_cancel_changes_nothing(window, qtbot, motion):
    models = models_of(window)
    motion(1.5, 60.0)
    steps = models.document.undo_stack.count()
    find(
        window,
        qtbot,
        lambda dialog: qtbot.mouseClick(button(dialog, "Cancel"), Qt.MouseButton.LeftButton),
    )
    assert models.document.recording.radar_offset_s == 0.0
    assert models.document.undo_stack.count() == steps


@pytest.mark.slow
def test_what_repeats_itself_cannot_be_applied(window, qtbot, motion):
    motion(1.0, 2.0)

    def look(dialog: AlignmentDialog) -> None:
        assert "No offset stands out" in words(dialog)
        assert not button(dialog, "Align").isEnabled()

    find(window, qtbot, look)


def test_farther_is_searched_when_it_is_typed(window, qtbot, motion):
    model = models_of(window).alignment
    motion(7.0, 60.0)

    def type_more(dialog: AlignmentDialog) -> None:
        assert model.problem
        assert not button(dialog, "Align").isEnabled()
        box = dialog.findChild(NumberBox)
        qtbot.mouseClick(box.lineEdit(), Qt.MouseButton.LeftButton)
        box.selectAll()
        qtbot.keyClicks(box, "9")
        qtbot.keyClick(box, Qt.Key.Key_Return)
        qtbot.waitUntil(lambda: not model.busy and not model.problem, timeout=20_000)
        assert model.result.offset_s == pytest.approx(7.0, abs=0.01)
        assert dialog.isVisible()
        qtbot.mouseClick(button(dialog, "Align"), Qt.MouseButton.LeftButton)

    find(window, qtbot, type_more)
    assert models_of(window).document.recording.radar_offset_s == pytest.approx(7.0, abs=0.01)


def test_two_seconds_are_too_short(window, qtbot):
    find(window, qtbot, lambda dialog: words(dialog).index("do not overlap by 3 s"))


def test_without_a_radar_or_a_mesh_it_says_why_not(empty_window, qtbot, small_recording):
    window = empty_window
    models = models_of(window)

    def action():
        menu = menu_of(window, "&Edit")
        menu.aboutToShow.emit()
        return next(
            one for one in menu.actions() if one.text().replace("&", "") == "Align automatically…"
        )

    assert not action().isEnabled()
    assert "no radar" in action().toolTip()
    for name, words in (("mesh.npz", "no radar"), ("radar", "no mesh")):
        with qtbot.waitSignal(models.document.opened, timeout=20_000):
            window.open_paths([small_recording / name])
        qtbot.waitUntil(partial(shows, action, words), timeout=20_000)
        assert not action().isEnabled()


def shows(action, words: str) -> bool:
    return words in action().toolTip()
