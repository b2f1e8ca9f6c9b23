"""A guided session in its window, by real keys; asserted on the model and on what is recorded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from answering import once_asked
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QFileDialog, QScrollArea, QToolButton

from sd2app.live.dialog import ListenDialog
from sd2app.live.process import ListenRequest, ListenSetup
from sd2app.live.prompt_window import (
    GuidedModel,
    PromptWindow,
    Step,
    count_text,
    detail,
    has_picture,
    headline,
    progress_text,
)
from sd2app.settings import Settings
from sd2app.widgets.inputs import Choice
from sd2core.labels.label_set import GESTURES
from sd2core.live.protocol import PAPER
from sd2core.recording.recording import open_recording

LIMIT_MS = 120_000
PROTOCOL = """
format = "sd2-protocol"
version = 1
title = "Try"
people = ["anna"]
order = "fixed"
take_s = 3
pause_s = 3
countdown_s = 1
consent = "You are filmed."

[[gestures]]
name = "left-to-right"
instruction = "Swipe to your left"

[[gestures]]
name = "wave"
instruction = "Wave"
"""


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    path = tmp_path / "try.toml"
    path.write_text(PROTOCOL, encoding="utf-8")
    return path


@pytest.fixture
def model(parent) -> Iterator[GuidedModel]:
    made = GuidedModel(parent)
    yield made
    made.close()


def _request(protocol: Path, folder: Path) -> ListenRequest:
    return ListenRequest(folder, way="test", camera="test", protocol=str(protocol))


@pytest.mark.slow
def test_keys_steer_a_session_that_ends_in_labelled_recordings(
    model, parent, qtbot, protocol, tmp_path
) -> None:
    folder = tmp_path / "session"
    view = PromptWindow(model, parent)
    view.open_beside()

    def wait_for(*phases: str) -> Step:
        qtbot.waitUntil(
            lambda: model.step is not None and model.step.phase in phases, timeout=LIMIT_MS
        )
        assert model.step is not None
        return model.step

    model.start(_request(protocol, folder))
    assert wait_for("consent").person == "anna"
    assert "You are filmed." in view.accessibleDescription()
    QTest.keyClick(view, Qt.Key.Key_Space)  # is no agreement
    QTest.keyClick(view, Qt.Key.Key_Y)
    assert wait_for("ready").person == "anna"
    assert "You are filmed." not in view.accessibleDescription()
    QTest.keyClick(view, Qt.Key.Key_Space)
    assert wait_for("prompt").gesture == "left-to-right"
    assert "Swipe to your left" in view.accessibleDescription()
    QTest.keyClick(view, Qt.Key.Key_A)
    wait_for("pause")
    assert wait_for("countdown").number == 1
    qtbot.waitUntil(lambda: model.step.gesture == "wave", timeout=LIMIT_MS)
    QTest.keyClick(view, Qt.Key.Key_S)
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert model.missing == ("anna-wave-1",)
    assert {one.name for one in folder.iterdir()} == {"anna-left-to-right-1.sd2", "consent.json"}
    (span,) = open_recording(folder / "anna-left-to-right-1.sd2").labelled.spans
    assert span.label == "left-to-right"

    # Once more into the same folder, and not asked again; Escape stops, and then closes.
    model.start(_request(protocol, folder))
    assert wait_for("ready").gesture == "wave"
    QTest.keyClick(view, Qt.Key.Key_F11)
    assert view.isFullScreen()
    QTest.keyClick(view, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert model.missing == ("anna-wave-1",)
    QTest.keyClick(view, Qt.Key.Key_Escape)
    assert not view.isVisible()


def test_why_a_session_cannot_be_is_read_in_its_window(model, parent, qtbot, tmp_path) -> None:
    view = PromptWindow(model, parent)
    with qtbot.waitSignal(model.warned, timeout=LIMIT_MS):
        model.start(_request(tmp_path / "none.toml", tmp_path / "session"))
    assert model.state == "failed"
    assert "There is no protocol" in view.accessibleDescription()


def test_what_is_read_at_every_moment(model) -> None:
    model.state, model.consent = "running", "You are filmed."
    asked = ("p1", "left-to-right", "Swipe")
    read = []
    for step in (
        Step("consent", 1, 3, None, *asked),
        Step("ready", 1, 3, None, *asked),
        Step("opening", 1, 3, None, *asked),
        Step("countdown", 1, 3, 2, *asked),
        Step("prompt", 1, 3, 9, *asked),
        Step("pause", 2, 3, 4, *asked),
        Step("pause", 3, 3, 4),
    ):
        model.step = step
        read.append((headline(model), count_text(model), detail(model)))
    assert read == [
        ("p1, do you agree?", "", ""),
        ("p1, please", "", "Space begins."),
        ("Swipe", "", "Stand still"),
        ("Swipe", "2", "Stand still"),
        ("Swipe", "9", "Now"),
        ("Swipe", "4", "Next. Rest until then."),
        ("That was the last take", "4", "A makes it once more."),
    ]
    assert progress_text(model) == "Take 3 of 3"
    model.state, model.missing, model.not_agreed = "stopped", ("p1-wave-1", "p2-wave-1"), ("p2",)
    assert detail(model) == "2 takes missing: p1-wave-1, p2-wave-1\nNot agreed: p2"


def test_a_long_text_to_agree_to_is_scrolled_by_keys_and_declined_by_one(
    model, parent, qtbot, monkeypatch
) -> None:
    view = PromptWindow(model, parent)
    view.resize(640, 360)
    view.show()
    pressed: list[str] = []
    monkeypatch.setattr(model, "press", pressed.append)
    model.state, model.consent = "running", "\n\n".join(["You are filmed."] * 60)
    model.step = Step("consent", 1, 3, None, "p1", "wave", "Wave")
    model.changed.emit()
    bar = view.findChild(QScrollArea).verticalScrollBar()
    qtbot.waitUntil(bar.isVisible)
    QTest.keyClick(view, Qt.Key.Key_PageDown)
    assert bar.value() == bar.pageStep()
    for key in (Qt.Key.Key_N, Qt.Key.Key_Y):
        QTest.keyClick(view, key)
    assert pressed == ["n", "y"]


def test_the_window_turns_while_a_person_is_to_move_and_a_body_shows_how(model, parent) -> None:
    view = PromptWindow(model, parent)
    view.resize(640, 360)
    view.show()

    def shown(phase: str, gesture: str):
        model.state, model.step = "running", Step(phase, 1, 3, 5, "p1", gesture, "Go")
        model.changed.emit()
        return view.grab().toImage()

    assert all(has_picture(one.name) for one in GESTURES.labels[:4])
    still, moving = shown("countdown", "wave"), shown("prompt", "wave")
    assert still.pixelColor(2, 2) != moving.pixelColor(2, 2)
    with_body = shown("countdown", "up-to-down")
    ground = with_body.pixelColor(2, 2)
    # Body in the left third, words beside it; without a picture words are in the middle.
    left = [with_body.pixelColor(x, 180) for x in range(40, 240)]
    assert sum(one != ground for one in left) > 10
    assert all(still.pixelColor(x, 180) == ground for x in range(10, 160))


def test_the_dialog_offers_protocols_and_sets_a_session_up(
    empty_window, monkeypatch, protocol, tmp_path
) -> None:
    window, folder = empty_window, tmp_path / "session"
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(protocol), ""))
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(folder), ""))
    started: list[ListenRequest] = []
    guided = window.features.live.guided
    monkeypatch.setattr(guided, "start", started.append)

    def fill(dialog: ListenDialog) -> None:
        choices = {one.accessibleName(): one for one in dialog.findChildren(Choice)}
        choices["Where frames come from"].setCurrentIndex(2)
        choices["Protocol"].setCurrentIndex(2)
        (begin,) = (
            one for one in dialog.findChild(QDialogButtonBox).buttons() if one.text() == "Record"
        )
        assert not begin.isEnabled()  # takes are filmed
        choices["Camera"].setCurrentIndex(choices["Camera"].findData("test"))
        tools = dialog.findChildren(QToolButton)
        (into,) = (one for one in tools if one.text() == "Choose…" and one.isVisible())
        QTest.mouseClick(into, Qt.MouseButton.LeftButton)
        assert begin.isEnabled()
        QTest.mouseClick(begin, Qt.MouseButton.LeftButton)

    once_asked(ListenDialog, fill)
    window.action("listen").trigger()
    assert started == [_request(protocol, folder)]
    window.findChild(PromptWindow).close()


def test_a_session_has_a_folder_of_its_own_and_words_of_its_own(tmp_path) -> None:
    settings = Settings.forgetful()
    setup = ListenSetup(settings)
    assert setup.chosen.folder.suffix == ".sd2"
    setup.choose("protocol", PAPER)
    setup.choose("camera", "test")
    setup.choose("way", "test")
    setup.choose_folder(tmp_path / "session")
    assert (setup.chosen.folder, setup.chosen.problem) == (tmp_path / "session", "")
    words = setup.chosen.words()
    assert words[:1] == ["record"]
    assert words[words.index("--protocol") + 1] == PAPER
    assert "--previews" not in words
    (tmp_path / "session").mkdir()
    assert setup.chosen.continues
    setup.choose("protocol", str(tmp_path / "none.toml"))
    assert "There is no protocol" in setup.chosen.problem
