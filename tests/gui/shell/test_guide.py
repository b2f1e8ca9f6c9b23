"""The guide is shown in a browser, without a network, and names what is in the window."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QDesktopServices
from PySide6.QtTest import QTest
from window_models import menu_of

from sd2app.shell import guide

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.fixture
def site(tmp_path, monkeypatch) -> Path:
    """Folder in which the window looks for the guide."""
    folder = tmp_path / "the site"
    folder.mkdir()
    monkeypatch.setattr(guide, "_FOLDERS", (tmp_path / "none", folder))
    return folder


@pytest.fixture
def shown(monkeypatch) -> list[Path]:
    """What the window asks the desktop to show."""
    paths: list[Path] = []

    def open_url(url) -> bool:
        assert url.isLocalFile()
        paths.append(Path(url.toLocalFile()))
        return True

    monkeypatch.setattr(QDesktopServices, "openUrl", open_url)
    return paths


def help_entry(window, text: str):
    entries = {one.text().replace("&", ""): one for one in menu_of(window, "&Help").actions()}
    return entries[text]


def test_keys_and_menu_show_it(window, site, shown) -> None:
    for name in (guide.MANUAL, guide.FIRST_FIVE_MINUTES):
        (site / name).write_text("a page")
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert shown == [site / "index.html"]
    help_entry(window, "First five minutes").trigger()
    assert shown[1:] == [site / "first-five-minutes.html"]


def test_a_guide_that_was_not_built_is_said_with_the_command(window, site, shown) -> None:
    told: list[str] = []
    window.warn = told.append
    help_entry(window, "Manual").trigger()
    assert not shown
    assert "has not been built" in told[0]
    assert "make docs" in told[0]


def test_without_a_browser_the_page_is_named(window, site, monkeypatch) -> None:
    (site / guide.MANUAL).write_text("a page")
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: False)
    told: list[str] = []
    window.warn = told.append
    help_entry(window, "Manual").trigger()
    assert str(site / guide.MANUAL) in told[0]


def pages_for_users() -> list[Path]:
    docs = REPOSITORY / "docs"
    folders = ("tutorials", "how-to", "concepts")
    inner = [page for folder in folders for page in sorted((docs / folder).glob("*.md"))]
    return [REPOSITORY / "README.md", docs / "first-five-minutes.md", *inner]


def test_menus_that_the_guide_names_are_there(window) -> None:
    named = [
        (page.name, menu, path)
        for page in pages_for_users()
        for menu, path in re.findall(
            r"\*(\w+) → ([^*]+)\*", " ".join(page.read_text("utf-8").split())
        )
    ]
    assert named
    for page, menu, path in named:
        at = window.menuBar()
        for text in (menu, *path.split(" → ")):
            entries = {one.text().replace("&", ""): one.menu() for one in at.actions()}
            assert text in entries, (page, menu, path)
            at = entries[text]
