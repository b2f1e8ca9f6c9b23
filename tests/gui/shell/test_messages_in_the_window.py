"""What the window says by itself: over the content, away from the pointer, kept in a list."""

from __future__ import annotations

from pathlib import Path

import pytest
from answering import once_asked
from finding import panel_of
from grey_video import write_video
from PySide6.QtCore import QPoint, QRect, Qt, QTimer
from PySide6.QtGui import QCursor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QToolButton, QWidget
from window_models import models_of

from sd2app.fit.feature import FitOffer
from sd2app.labels.recovery import LabelNotice
from sd2app.shell.messages import MessageNotice, MessagesDialog
from sd2app.widgets.notices import Notice, NoticeStack

PANELS = ("video", "scene", "tracks", "spectrum", "side")
LEFT = Qt.MouseButton.LeftButton


def places(window) -> dict[str, QRect]:
    """Place on the screen of every part and of every button that is not a notice's."""
    buttons = {f"line {n}": one for n, one in enumerate(_buttons(window))}
    parts = {**panels_of(window), **buttons}
    return {
        name: QRect(part.mapToGlobal(QPoint(0, 0)), part.size()) for name, part in parts.items()
    }


def panels_of(window) -> dict[str, QWidget]:
    """Parts of the window by their names."""
    return {name: panel_of(window, name) for name in PANELS}


def _buttons(window) -> list[QWidget]:
    return [
        button
        for button in window.findChildren(QToolButton)
        if button.isVisible() and not window.findChild(NoticeStack).isAncestorOf(button)
    ]


def shown(window, kind: type[Notice]) -> Notice:
    """The notice of a kind, once it has its place."""
    QApplication.processEvents()
    notice = window.findChild(kind)
    assert notice.isVisible()
    return notice


def cross_of(notice: Notice) -> QToolButton:
    """Button that closes a notice."""
    return next(one for one in notice.findChildren(QToolButton) if one.text() == "✕")


@pytest.fixture
def pointer_elsewhere(window):
    """The pointer where no notice comes."""
    QCursor.setPos(window.mapToGlobal(QPoint(4, 4)))


def test_nothing_moves_when_something_is_said(window, pointer_elsewhere) -> None:
    before = places(window)
    window.warn("The first thing cannot be read.\nIt is to be a mesh.")
    notice = shown(window, MessageNotice)
    assert places(window) == before
    window.note("Something was done.")
    models_of(window).label_session.notes = ("The edits of a session cannot be read.",)
    models_of(window).label_session.changed.emit()
    other = shown(window, LabelNotice)
    assert places(window) == before
    inside = panel_of(window, "scene").mapTo(window, QPoint(0, 0)).x()
    assert notice.mapTo(window, QPoint(0, 0)).x() >= inside
    assert not notice.geometry().intersects(other.geometry())
    for one in (notice, other):
        QTest.mouseClick(cross_of(one), LEFT)
    QApplication.processEvents()
    assert not window.findChild(NoticeStack).isVisible()
    assert places(window) == before


def test_several_failures_are_one_notice_with_a_list(window, pointer_elsewhere) -> None:
    for name in "ABCDEFGH":
        window.warn(f"File {name} is missing.")
        window.warn("The disk is full.")
    notice = shown(window, MessageNotice)
    said = notice.text.splitlines()
    assert said[0].startswith("9 things went wrong: ")
    assert said[-3:] == ["• File H is missing.", "• The disk is full.", "3 more: View → Messages"]
    window.note("Something was done.")
    assert notice.text.splitlines() == said
    assert window.findChild(NoticeStack).rect().contains(notice.geometry())
    QTest.mouseClick(cross_of(notice), LEFT)
    assert window.messages.text == ""


def test_what_is_under_the_pointer_stays_there(window) -> None:
    c, scene = models_of(window), panel_of(window, "scene")
    aim = QPoint(scene.width() - 60, scene.height() - 40)
    QCursor.setPos(scene.mapToGlobal(aim))
    under = window.childAt(scene.mapTo(window, aim))
    window.warn("This cannot be read.")
    shown(window, MessageNotice)
    assert window.childAt(scene.mapTo(window, aim)) is under
    assert c.document.undo_stack.count() == 0


def test_what_is_said_goes_by_itself_a_failure_once_it_can_have_been_read(
    window, pointer_elsewhere, qtbot, monkeypatch
) -> None:
    window.note("Something was done.")
    notice = shown(window, MessageNotice)
    timer = notice.findChild(QTimer)
    assert timer.isActive()
    remark_ms = timer.interval()
    timer.timeout.emit()
    assert window.messages.text == ""
    assert not notice.isVisible()
    window.warn("This cannot be read.")
    assert timer.isActive()
    assert timer.interval() > 2 * remark_ms
    monkeypatch.setattr(notice, "isActiveWindow", lambda: False)  # the user is elsewhere
    timer.timeout.emit()
    assert shown(window, MessageNotice).text == "This cannot be read."
    monkeypatch.undo()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    timer.timeout.emit()
    assert not notice.isVisible()
    assert [one.text for one in window.messages.history[-2:]] == [
        "Something was done.",
        "This cannot be read.",
    ]
    # Once it is gone, or was closed, the same is said again.
    for _ in range(2):
        window.warn("This cannot be read.")
        assert shown(window, MessageNotice).text == "This cannot be read."
        QTest.mouseClick(cross_of(notice), LEFT)


def test_everything_that_was_said_is_listed(window, qtbot, pointer_elsewhere) -> None:
    window.messages.forget()
    window.warn("This cannot be read.")
    window.note("Something was done.")
    window.messages.dismiss()
    asked: list[list[str]] = []

    def read(dialog: MessagesDialog) -> None:
        asked.append([line.split("   ")[1] for line in dialog.list.toPlainText().splitlines()])
        buttons = dialog.findChild(QDialogButtonBox).buttons()
        clear = next(one for one in buttons if one.text() == "Clear")
        QTest.mouseClick(clear, LEFT)
        assert dialog.list.toPlainText() == ""
        QTest.keyClick(dialog, Qt.Key.Key_Escape)

    once_asked(MessagesDialog, read)
    window.action("messages").trigger()
    assert asked == [["Something was done.", "Failed: This cannot be read."]]
    assert window.messages.history == ()


def test_the_offer_of_a_fit_lies_over_the_content(empty_window, qtbot, tmp_path: Path) -> None:
    window = empty_window
    video = tmp_path / "walk.mp4"
    write_video(video)
    with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
        window.open_paths([video])
    offer = shown(window, FitOffer)
    assert offer.text.startswith("walk.mp4 has no mesh")
    assert "walk.mp4 has no mesh" in window.messages.history[-1].text
    with_it = {name: part.geometry() for name, part in panels_of(window).items()}
    QTest.mouseClick(cross_of(offer), LEFT)
    assert not offer.isVisible()
    assert {name: part.geometry() for name, part in panels_of(window).items()} == with_it
    assert models_of(window).fit_on_screen.offered is None
