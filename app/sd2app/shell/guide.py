"""The guide: pages of ``docs/`` that come with the program, read without a network."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QImage
from PySide6.QtWidgets import QDialog, QTextBrowser, QWidget

from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence
from sd2core.errors import Sd2Error

GETTING_STARTED, MANUAL = "getting-started.md", "manual.md"
_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "docs", _PACKAGE.parents[1] / "docs")
"""Place of the pages in a wheel, and in a checkout."""
_MARGIN_PX = 24


def page_path(name: str) -> Path:
    """Path of a page of the guide; raises Sd2Error if it did not come with the program."""
    for folder in _FOLDERS:
        if (folder / name).is_file():
            return folder / name
    raise Sd2Error(
        f"The page {name} is in neither {_FOLDERS[0]} nor {_FOLDERS[1]}",
        "an installation with its guide",
        "Install SD² Studio again",
    )


class GuideWindow(QDialog):
    """Pages with links between them, beside the main window."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("SD² Studio: guide")
        self.pages = pages = GuidePages(self)
        self._said = sentence("")
        pages.said.connect(self._said.setText)
        back = outlined("Back", "The page before", pages.backward, self)
        on = outlined("Forward", "The page after", pages.forward, self)
        contents = outlined("Manual", "Its first page", lambda: self.show_page(MANUAL), self)
        for button, available in ((back, pages.backwardAvailable), (on, pages.forwardAvailable)):
            button.setEnabled(False)
            available.connect(button.setEnabled)
        bar = row_of(back, on, contents, STRETCH, self._said, spacing_px=6)
        self.setLayout(column_of(bar, (pages, 1), spacing_px=8, margins_px=8))
        self.resize(820, 760)

    def show_page(self, name: str) -> None:
        """Bring up a page; raises Sd2Error if it is not there."""
        path = page_path(name)
        self.show()
        self.raise_()
        self.activateWindow()
        self.pages.setSource(QUrl.fromLocalFile(str(path)))
        self.pages.setFocus()


class GuidePages(QTextBrowser):
    """One page; a link within the guide turns to another, one into the web opens a browser."""

    said = Signal(str)  # why a link leads nowhere; empty for one that does

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName("Page of the guide")
        self.setOpenLinks(False)
        self.document().setDocumentMargin(_MARGIN_PX)
        self.anchorClicked.connect(self._follow)
        self.sourceChanged.connect(self._turned)

    def loadResource(self, kind: int, name: QUrl | str) -> Any:
        """Read pages and pictures from the disk only, wide pictures as wide as the page."""
        url = self.source().resolved(QUrl(name))
        if not url.isLocalFile():
            return None
        if kind != 2:  # QTextDocument.ResourceType.ImageResource
            return super().loadResource(kind, url)
        image, ratio = QImage(url.toLocalFile()), self.devicePixelRatioF()
        room_px = round((self.viewport().width() - 2 * _MARGIN_PX - 16) * ratio)
        if image.width() > room_px > 0:
            image = image.scaledToWidth(room_px, Qt.TransformationMode.SmoothTransformation)
            image.setDevicePixelRatio(ratio)
        return image

    def _follow(self, link: QUrl) -> None:
        url = self.source().resolved(link)
        path = Path(url.toLocalFile())
        self.said.emit("")
        if not url.isLocalFile():
            QDesktopServices.openUrl(url)
        elif path.suffix == ".md" and path.is_file():
            self.setSource(url)
        else:
            self.said.emit(f"{path.name} is in the source code of the program, not in its guide.")

    def _turned(self, url: QUrl) -> None:
        """Go to the heading that a link names: in Markdown it has no anchor."""
        block = self.document().begin()
        while url.hasFragment() and block.isValid():
            if block.blockFormat().headingLevel() and _anchor(block.text()) == url.fragment():
                top_px = self.document().documentLayout().blockBoundingRect(block).top()
                self.verticalScrollBar().setValue(round(top_px))
                return
            block = block.next()


def _anchor(heading: str) -> str:
    """Name by which links call a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
