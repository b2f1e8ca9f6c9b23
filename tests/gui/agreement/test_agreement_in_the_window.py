"""Another person's labels beside one's own, by real keys and clicks in the whole window."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from finding import button_of, words_in
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFileDialog, QToolButton
from window_models import models_of

from sd2app.agreement.feature import AgreementPanel, OtherTimeline
from sd2core.labels.formats import write_labels
from sd2core.labels.spans import Labels, LabelTrack, Span

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def compared(window, qtbot, monkeypatch, tmp_path):
    """Mine: "there" 0.2 to 0.8 s, "back" 1 to 2 s. Ben's: "there" the same, "back" from 1.5 s."""
    spans = (Span(1, "Ben", 0.2, 0.8, "there"), Span(2, "Ben", 1.5, 2.0, "back"))
    path = tmp_path / "ben.eaf"
    write_labels(path, Labels((LabelTrack("Ben"),), spans), models_of(window).playback.timebase)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    qtbot.keyClick(window, Qt.Key.Key_K, CONTROL | Qt.KeyboardModifier.ShiftModifier)
    model = models_of(window).agreement
    qtbot.waitUntil(lambda: model.measures is not None, timeout=10_000)
    return window


def test_side_by_side_and_from_one_difference_to_the_next(compared, qtbot) -> None:
    c = models_of(compared)
    below, panel = compared.findChild(OtherTimeline), compared.findChild(AgreementPanel)
    assert below.isVisible()
    assert compared.side.shown == "Agreement"
    assert panel.isVisible()
    assert below.accessibleName() == "Labels of ben, read-only"
    assert [one.frames for one in c.agreement.disagreements] == [15]
    qtbot.keyClick(compared, Qt.Key.Key_N, SHIFT)
    assert c.playback.frame == 30
    assert any("You: back." in words for words in words_in(panel, "plain"))
    c.playback.seek_frame(59)
    qtbot.keyClick(compared, Qt.Key.Key_P, SHIFT)
    assert c.playback.frame == 30
    qtbot.mouseClick(button_of(panel, "Copy command"), LEFT)
    line = shlex.split(QGuiApplication.clipboard().text())
    assert line[:3] == ["sd2", "labels", "agree"]
    assert [Path(file).name for file in line[3:]] == [c.document.recording.folder.name, "ben.eaf"]


def test_a_file_that_holds_no_labels_is_said(window, qtbot, monkeypatch, tmp_path) -> None:
    path = tmp_path / "broken.eaf"
    path.write_text("<ANNOTATION_DOCUMENT>")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    qtbot.keyClick(window, Qt.Key.Key_K, CONTROL | Qt.KeyboardModifier.ShiftModifier)
    qtbot.waitUntil(lambda: "broken.eaf" in window.messages.text, timeout=10_000)
    assert not models_of(window).agreement.active


def test_editing_is_followed_and_nothing_of_theirs_is_changed(compared, qtbot) -> None:
    c, below = models_of(compared), compared.findChild(OtherTimeline)
    qtbot.mouseClick(below, LEFT, pos=QPoint(round(below.scale.x_of(1.515)), below.height() - 8))
    assert c.playback.frame == 45
    assert not c.labels.selected
    qtbot.keyClick(compared, Qt.Key.Key_P)
    c.playback.seek_frame(45)
    qtbot.keyClick(compared, Qt.Key.Key_BracketLeft)
    qtbot.waitUntil(lambda: not c.agreement.busy, timeout=10_000)
    assert c.agreement.disagreements == ()
    assert len(c.agreement.other.labels.spans) == 2


def test_the_end_takes_them_away(compared, qtbot) -> None:
    panel = compared.findChild(AgreementPanel)
    end = next(one for one in panel.findChildren(QToolButton) if one.text() == "End")
    qtbot.mouseClick(end, LEFT)
    assert not compared.findChild(OtherTimeline).isVisible()
    assert not models_of(compared).agreement.active


def test_another_recording_is_not_compared(compared, qtbot, recording_copy) -> None:
    compared.open_paths([recording_copy])
    qtbot.waitUntil(lambda: compared.settled, timeout=20_000)
    assert not models_of(compared).agreement.active


def test_what_their_file_left_out_is_said_below_its_name(window, qtbot, monkeypatch, tmp_path):
    path = tmp_path / "ida.csv"
    path.write_text("start_s,end_s,label\n0.2,0.8,there\n1.6,1.1,back\n")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    qtbot.keyClick(window, Qt.Key.Key_K, CONTROL | SHIFT)
    c, panel = models_of(window), window.findChild(AgreementPanel)
    qtbot.waitUntil(lambda: c.agreement.measures is not None, timeout=10_000)
    (said,) = [one for one in words_in(panel, "muted") if "taken" in one]
    assert said.startswith("1 span on 1 track taken")
    assert "1 left out (" in said
    end = next(one for one in panel.findChildren(QToolButton) if one.text() == "End")
    qtbot.mouseClick(end, LEFT)
    assert not any("taken" in one for one in words_in(panel, "muted"))
