"""The manual's window, by real keys and a real mouse."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt, QUrl
from PySide6.QtGui import QDesktopServices, QTextCursor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton

from sd2app.command_line import full_parser
from sd2app.manual.help import ManualWindow
from sd2app.manual.pages import Manual, manual_folder
from sd2app.manual.view import address
from sd2app.palette import DARK, LIGHT
from sd2app.settings import Settings
from sd2app.widgets.theme import apply_theme

LEFT = Qt.MouseButton.LeftButton
MANUAL = Manual(manual_folder(), full_parser)


@pytest.fixture
def manual(qtbot) -> Iterator[ManualWindow]:
    """The window on its first page."""
    window = ManualWindow(MANUAL, Settings.forgetful())
    window.show_address(address("index.md"))
    qtbot.waitExposed(window)
    yield window
    window.close()
    # What is still there would be styled anew with all others.
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def show(manual: ManualWindow, place: str) -> None:
    manual.show_address(address(place))


def click(manual: ManualWindow, words: str) -> None:
    """Click a link by its words, or other words of the page."""
    view = manual.view
    found = view.document().find(words)
    assert not found.isNull(), words
    view.setTextCursor(found)
    middle = QTextCursor(view.document())
    middle.setPosition((found.selectionStart() + found.selectionEnd()) // 2)
    QTest.mouseClick(view.viewport(), LEFT, pos=view.cursorRect(middle).center())


def headings_in_view(manual: ManualWindow) -> list[str]:
    """Headings on screen, from top to bottom."""
    view, layout = manual.view, manual.view.document().documentLayout()
    top = view.verticalScrollBar().value()
    found, block = [], view.document().begin()
    while block.isValid():
        place = layout.blockBoundingRect(block).center().y() - top
        if block.blockFormat().headingLevel() and 0 <= place <= view.viewport().height():
            found.append(block.text())
        block = block.next()
    return found


def button(manual: ManualWindow, name: str) -> QToolButton:
    return next(one for one in manual.findChildren(QToolButton) if one.accessibleName() == name)


@pytest.mark.one_in(11)
@pytest.mark.parametrize("name", MANUAL.titles)
def test_every_page_is_shown_with_its_headings_in_the_column(manual, name: str) -> None:
    show(manual, name)
    assert manual.view.page == name
    block, headings = manual.view.document().begin(), []
    while block.isValid():
        if block.blockFormat().headingLevel():
            headings.append(block.text())
        block = block.next()
    assert headings == [one.heading for one in MANUAL.sections(name)]
    assert manual.view.document().size().width() <= manual.view.viewport().width()
    assert manual.view.horizontalScrollBar().maximum() == 0


def test_links_are_followed_and_one_goes_back_and_forward(manual) -> None:
    assert not button(manual, "Back").isEnabled()
    click(manual, "first five minutes")
    assert manual.view.page == "first-five-minutes.md"
    assert manual.windowTitle().startswith("First five minutes")
    click(manual, "installation")
    assert manual.view.page == "how-to/install.md"
    QTest.keyClick(manual, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert manual.view.page == "first-five-minutes.md"
    QTest.mouseClick(button(manual, "Back"), LEFT)
    assert manual.view.page == "index.md"
    QTest.mouseClick(button(manual, "Forward"), LEFT)
    assert manual.view.page == "first-five-minutes.md"


def test_going_back_scrolls_to_where_one_was(manual) -> None:
    show(manual, "first-five-minutes.md")
    manual.view.verticalScrollBar().setValue(700)
    show(manual, "formats.md")
    manual.view.backward()
    assert manual.view.verticalScrollBar().value() == 700


def test_anchors_lead_to_headings(manual) -> None:
    show(manual, "formats.md#data-sets")
    assert headings_in_view(manual)[0] == "Data sets"
    show(manual, "how-to/install.md")
    click(manual, "the library alone")
    assert manual.view.page == "how-to/install.md"
    assert "The library alone" in headings_in_view(manual)
    manual.close()
    show(manual, "formats.md#labels")
    assert headings_in_view(manual)[0] == "Labels"


def test_a_click_in_the_contents_opens_a_page_and_the_contents_follow(manual) -> None:
    contents = manual.contents
    item = contents.topLevelItem(1)
    QTest.mouseClick(contents.viewport(), LEFT, pos=contents.visualItemRect(item).center())
    assert manual.view.page == "first-five-minutes.md"
    show(manual, "how-to/install.md")
    assert contents.currentItem().text(0) == "Install"
    assert contents.currentItem().parent().text(0) == "How-to"


def test_search_as_one_types_and_a_click_on_what_it_finds(manual) -> None:
    show(manual, "glossary.md")
    QTest.keyClick(manual, Qt.Key.Key_F, Qt.KeyboardModifier.ControlModifier)
    assert manual.search.hasFocus()
    QTest.keyClicks(manual.search, "own radar")
    assert manual.view.page == "search"
    lines = manual.view.toPlainText().splitlines()
    assert lines[:2] == ["Search", "Compare with your own radar"]
    assert manual.search.hasFocus()
    click(manual, "Open a radar file")
    assert manual.view.page == "how-to/open-a-radar-file.md"
    assert "Samples of your own" in headings_in_view(manual)
    manual.view.backward()
    assert manual.view.page == "search"
    manual.view.backward()
    assert manual.view.page == "glossary.md"


def test_return_opens_the_first_and_escape_gives_the_search_up(manual) -> None:
    manual.search.setFocus()
    QTest.keyClicks(manual.search, "own radar")
    QTest.keyClick(manual.search, Qt.Key.Key_Return)
    assert manual.view.page == "tutorials/your-own-radar.md"
    QTest.keyClicks(manual.search, " xyzzy")
    assert "No page has all these words." in manual.view.toPlainText()
    QTest.keyClick(manual.search, Qt.Key.Key_Return)
    assert manual.view.page == "search"
    QTest.keyClick(manual.search, Qt.Key.Key_Escape)
    assert manual.search.text() == ""
    assert manual.view.page == "tutorials/your-own-radar.md"


def test_what_lies_outside_opens_the_browser(manual, monkeypatch) -> None:
    opened: list[QUrl] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    show(manual, "how-to/install.md")
    click(manual, "PyTorch's page")
    assert [url.host() for url in opened] == ["pytorch.org"]
    assert manual.view.page == "how-to/install.md"


def test_pictures_are_there_and_fit(manual) -> None:
    show(manual, "concepts/aliasing.md")
    column_px = manual.view.lineWrapColumnOrWidth() - 2 * manual.view.document().documentMargin()
    for name in ("../images/sample.png", "../images/concepts/aliasing.svg"):
        image = manual.view.loadResource(2, QUrl(name))
        assert 300 < image.width() / image.devicePixelRatio() <= column_px


def test_it_follows_the_theme_where_it_is(manual) -> None:
    show(manual, "first-five-minutes.md#play")
    application, grounds = QApplication.instance(), []
    before = manual.view.verticalScrollBar().value()
    for dark in (False, True):
        apply_theme(application, dark)
        QApplication.processEvents()
        picture = manual.view.viewport().grab().toImage()
        grounds.append(picture.pixelColor(QPoint(4, 4)).name())
    assert grounds == [LIGHT.panel, DARK.panel]
    assert manual.view.verticalScrollBar().value() == before


def test_it_comes_back_where_it_was(qtbot) -> None:
    settings, sizes = Settings.forgetful(), []
    for width_px in (760, 700):
        window = ManualWindow(MANUAL, settings)
        qtbot.addWidget(window)
        sizes.append(window.width())
        window.resize(width_px, 600)
        QTest.keyClick(window, Qt.Key.Key_W, Qt.KeyboardModifier.ControlModifier)
        window.close()
    assert sizes == [1000, 760]
