"""The guide is read in the window, without a network."""

from __future__ import annotations

import re

import pytest
from PySide6.QtCore import QPoint, Qt, QUrl
from PySide6.QtGui import QDesktopServices, QTextDocument
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolButton
from window_models import menu_of

from sd2app.shell.guide import GETTING_STARTED, MANUAL, GuidePages, GuideWindow, page_path

LEFT = Qt.MouseButton.LeftButton
IMAGE = QTextDocument.ResourceType.ImageResource.value


@pytest.fixture
def guide(qtbot) -> GuideWindow:
    window = GuideWindow(None)
    qtbot.addWidget(window)
    window.show_page(MANUAL)
    return window


def click_link(pages: GuidePages, words: str) -> None:
    """Click on a link by its words."""
    cursor = pages.document().find(words)
    while not cursor.charFormat().anchorHref():
        cursor = pages.document().find(words, cursor)
        assert not cursor.isNull()
    cursor.setPosition(cursor.selectionStart() + 1)
    pages.setTextCursor(cursor)
    pages.ensureCursorVisible()
    at = pages.cursorRect(cursor).center() + QPoint(1, 0)
    QTest.mouseClick(pages.viewport(), LEFT, pos=at)


def page(pages: GuidePages) -> str:
    return pages.source().fileName()


def test_keys_and_menu_bring_it_up(window, qtbot) -> None:
    QTest.keyClick(window, Qt.Key.Key_F1)
    guide = window.findChild(GuideWindow)
    assert guide.isVisible()
    assert page(guide.pages) == MANUAL
    entries = {one.text().replace("&", ""): one for one in menu_of(window, "&Help").actions()}
    entries["Getting started"].trigger()
    assert window.findChildren(GuideWindow) == [guide]
    assert page(guide.pages) == GETTING_STARTED
    guide.close()


@pytest.mark.parametrize("name", [GETTING_STARTED, MANUAL])
def test_menus_that_it_names_are_there(window, name) -> None:
    words = page_path(name).read_text("utf-8").replace("\n", " ")
    named = re.findall(r"\*(\w+) → ([^*]+)\*", words)
    assert named
    for menu, path in named:
        within, at = path.split(" → "), menu_of(window, menu)
        for text in within:
            entries = {one.text().replace("&", ""): one.menu() for one in at.actions()}
            assert text in entries, (menu, path)
            at = entries[text]


def test_links_lead_from_page_to_page_and_back(guide) -> None:
    click_link(guide.pages, "Getting started")
    assert page(guide.pages) == GETTING_STARTED
    click_link(guide.pages, "manual")
    assert page(guide.pages) == MANUAL
    (back,) = (one for one in guide.findChildren(QToolButton) if one.text() == "Back")
    QTest.mouseClick(back, LEFT)
    assert page(guide.pages) == GETTING_STARTED


def test_a_link_into_a_page_goes_to_its_heading(guide) -> None:
    pages = guide.pages
    pages._follow(QUrl("formats.md#mesh-files"))
    assert page(pages) == "formats.md"
    first = pages.cursorForPosition(QPoint(60, 8)).block()
    assert "Mesh files" in (first.text(), first.next().text())


def test_pictures_are_there_and_no_wider_than_the_page(guide) -> None:
    for name in (MANUAL, GETTING_STARTED):
        pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", page_path(name).read_text("utf-8"))
        assert pictures
        for picture in pictures:
            image = guide.pages.loadResource(IMAGE, QUrl(picture))
            assert 200 < image.width() / image.devicePixelRatio() < guide.pages.viewport().width()


def test_the_web_is_left_to_a_browser_and_nothing_is_fetched(guide, monkeypatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: asked.append(url.toString()))
    before = guide.pages.source()
    guide.pages._follow(QUrl("https://example.org/page"))
    assert asked == ["https://example.org/page"]
    assert guide.pages.source() == before
    assert guide.pages.loadResource(IMAGE, QUrl("https://example.org/picture.png")) is None


def test_what_is_not_in_the_guide_is_said(guide) -> None:
    guide.pages._follow(QUrl("../sd2core/sensor.py"))
    assert guide._said.text().startswith("sensor.py is in the source code")
    assert page(guide.pages) == MANUAL
