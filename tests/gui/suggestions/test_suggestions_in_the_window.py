"""Suggestions by real keys and clicks in the whole window, on a map in which little moves."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QToolButton
from window_models import models_of

from sd2app.suggestions.bar import SuggestionBar
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis

NONE = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def moving(window, qtbot):
    """Something moves from frame 5 to 15 and from 40 to 50; nothing is marked."""
    c = models_of(window)
    values = np.ones((32, 60), np.float32)
    values[:, 5:15] = values[:, 40:50] = 100.0
    c.synthetic.set_map(DopplerMap(values, VelocityAxis(), c.playback.timebase, "synthetic"))
    for _ in range(2):
        qtbot.keyClick(window, Qt.Key.Key_N)
        qtbot.keyClick(window, Qt.Key.Key_Backspace)
        c.playback.seek_frame(0)
    return window


def key(window, qtbot, name: str, modifier=NONE) -> None:
    qtbot.keyClick(window, getattr(Qt.Key, f"Key_{name}"), modifier)


def asked(window, qtbot) -> None:
    key(window, qtbot, "F")
    qtbot.waitUntil(lambda: not models_of(window).suggestions.busy, timeout=10_000)


def decided(window) -> list[tuple[str, str]]:
    return [(span.label, span.origin) for span in models_of(window).labels.labels.spans]


def test_found_by_a_key_and_decided_on_by_one_key_each(moving, qtbot) -> None:
    bar, c = moving.findChild(SuggestionBar), models_of(moving)
    assert not bar.isVisible()
    asked(moving, qtbot)
    assert bar.isVisible()
    assert decided(moving) == [("gesture", "suggestion")] * 2
    assert len(c.labels.selected) == 1
    key(moving, qtbot, "3")
    assert decided(moving) == [("up-to-down", "person"), ("gesture", "suggestion")]
    key(moving, qtbot, "W")
    assert decided(moving) == [("up-to-down", "person")]
    for _ in range(2):
        key(moving, qtbot, "Z", Qt.KeyboardModifier.ControlModifier)
    assert decided(moving) == [("gesture", "suggestion")] * 2
    c.labels.set_label("down-to-up")
    key(moving, qtbot, "Y", Qt.KeyboardModifier.ShiftModifier)
    assert decided(moving) == [("down-to-up", "person")] * 2


def test_the_bar_does_the_same(moving, qtbot) -> None:
    asked(moving, qtbot)
    bar = moving.findChild(SuggestionBar)
    buttons = {one.text(): one for one in bar.findChildren(QToolButton)}
    for text in ("Reject", "Accept"):
        qtbot.mouseClick(buttons[text], Qt.MouseButton.LeftButton)
    assert decided(moving) == [("left-to-right", "person")]
    assert not buttons["Accept"].isEnabled()
    assert bar.findChildren(QToolButton)[-1].accessibleName() == "Close the suggestions"
    qtbot.mouseClick(buttons["✕"], Qt.MouseButton.LeftButton)
    assert not bar.isVisible()


def test_suggestions_are_saved_with_the_labels(moving, qtbot, tmp_path) -> None:
    from sd2core.recording.recording import open_recording

    asked(moving, qtbot)
    models_of(moving).document.save_as(tmp_path / "saved.sd2")
    assert [span.origin for span in open_recording(tmp_path / "saved.sd2").labelled.spans] == [
        "suggestion"
    ] * 2


@pytest.mark.slow
def test_while_it_plays_a_label_key_marks_also_with_a_suggestion_selected(moving, qtbot) -> None:
    asked(moving, qtbot)
    c = models_of(moving)
    assert [span.origin for span in c.labels.selected] == ["suggestion"]
    c.playback.toggle()
    key(moving, qtbot, "3")
    c.playback.toggle()
    assert [mark.label for mark in c.labels.marks] == ["up-to-down"]
    assert len(c.suggestions.pending) == 2
