"""The check of a place from the dialog Record, by real clicks; asserted on the models."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from answering import once_asked
from copied import copied_record
from finding import button_of
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QLabel, QToolButton, QWidget

from sd2app.live.dialog import CheckDialog, ListenDialog
from sd2app.live.process import ListenRequest, ListenSetup, PlaceCheck
from sd2app.settings import Settings
from sd2core.cli.listen import Listen
from sd2core.cli.record import Record
from sd2core.placements.placements import Place

LIMIT_MS = 60_000
LEFT = Qt.MouseButton.LeftButton


REQUEST = ListenRequest(Path("none.sd2"), way="test", camera="test")


@pytest.fixture
def check(parent) -> Iterator[PlaceCheck]:
    made = PlaceCheck(parent)
    yield made
    made.close()


def _click(dialog: QWidget, text: str) -> None:
    own = [*dialog.findChildren(QToolButton), *dialog.findChild(QDialogButtonBox).buttons()]
    (button,) = (one for one in own if one.text() == text and one.isVisible())
    assert button.isEnabled()
    QTest.mouseClick(button, LEFT)


def test_the_command_records_the_same(parent, qtbot) -> None:
    setup = ListenSetup(Settings.forgetful(), parent)
    setup.choose("way", "test")
    dialog = ListenDialog(setup, parent)
    for camera, kind in (("", Listen), ("test", Record)):
        setup.choose("camera", camera)
        QTest.mouseClick(button_of(dialog, "Copy command"), LEFT)
        command = copied_record()
        assert isinstance(command, kind)
        assert (command.out, command.radar, command.json) == (setup.chosen.folder, "test", False)


def test_what_cannot_be_recorded_cannot_be_copied_as_a_command(parent, tmp_path) -> None:
    setup = ListenSetup(Settings.forgetful(), parent)
    dialog = ListenDialog(setup, parent)
    copy = button_of(dialog, "Copy command")
    begin = button_of(dialog, "Record")
    for way in ("test", "replay"):  # of which no capture is chosen
        setup.choose("way", way)
        assert copy.isEnabled() == (not setup.chosen.problem) == begin.isEnabled()
    assert not copy.isEnabled()


@pytest.mark.slow
def test_the_place_that_is_found_goes_with_what_is_recorded(parent, qtbot) -> None:
    setup = ListenSetup(Settings.forgetful(), parent)
    setup.choose("way", "test")
    record = ListenDialog(setup, parent)
    record.show()
    (button,) = (one for one in record.findChildren(QToolButton) if one.text() == "Check…")
    assert not button.isEnabled()  # there is no camera
    setup.choose("camera", "test")
    seen: list[int] = []

    def watch(dialog: CheckDialog) -> None:
        check = dialog._check
        try:
            check.changed.connect(lambda: seen.extend([] if check.picture is None else [1]))
            qtbot.waitUntil(lambda: check.place is not None, timeout=LIMIT_MS)
            assert check.state == "running"
            assert 0 < check.left_s < 60
            _click(dialog, "Take over")
        finally:
            if dialog.isVisible():
                dialog.done(0)

    once_asked(CheckDialog, watch)
    _click(record, "Check…")
    assert seen  # pictures came
    place = setup.chosen.place
    assert place is not None
    assert place.range_m == pytest.approx(1.5, abs=0.3)
    words = setup.chosen.words()
    assert words[words.index("--placement") + 1] == f"{place.range_m},{place.azimuth_deg},0.0"
    assert any(place.words in one.text() for one in record.findChildren(QLabel))
    _click(record, "✕")
    assert "--placement" not in setup.chosen.words()


@pytest.mark.slow
def test_it_ends_when_told_and_begins_again(check, parent, qtbot) -> None:
    dialog = CheckDialog(check, REQUEST, parent)
    dialog.show()
    check.start(REQUEST)
    qtbot.waitUntil(lambda: bool(check.findings), timeout=LIMIT_MS)
    _click(dialog, "Stop")
    qtbot.waitUntil(lambda: check.state == "stopped", timeout=LIMIT_MS)
    assert [one.name for one in check.findings] == ["motion", "range", "view", "agreement"]
    marks = [one.accessibleName() for one in dialog.findChildren(QLabel)]
    assert marks.count("good") == sum(one.passed for one in check.findings)
    _click(dialog, "Again")
    assert check.busy
    assert not check.findings
    dialog.close()
    assert not check.busy  # camera and radar are free for a recording


def test_what_is_bad_is_marked_and_no_place_can_be_taken_over(check, parent) -> None:
    dialog = CheckDialog(check, REQUEST, parent)
    dialog.show()
    bad = {"name": "view", "passed": False, "sentence": "Nothing moves.", "numbers": {}}
    check._take({"event": "findings", "findings": [bad], "place": None, "left_s": 0})
    check._end(1, "")
    assert check.state == "stopped"
    labels = {one.accessibleName(): one for one in dialog.findChildren(QLabel)}
    assert labels["bad"].text() == "✗"
    (take,) = (one for one in dialog.findChildren(QToolButton) if one.text() == "Take over")
    assert not take.isEnabled()
    check._take({"event": "findings", "findings": [], "place": vars(Place(2.0)), "left_s": 0})
    check.changed.emit()
    assert take.isEnabled()


def test_why_it_cannot_be_checked_is_said(check, parent, qtbot, tmp_path) -> None:
    dialog = CheckDialog(check, REQUEST, parent)
    dialog.show()
    check.start(ListenRequest(tmp_path / "a.sd2", way="test", camera=str(tmp_path / "none.mp4")))
    qtbot.waitUntil(lambda: check.state == "failed", timeout=LIMIT_MS)
    assert any("none.mp4" in one.text() for one in dialog.findChildren(QLabel))
