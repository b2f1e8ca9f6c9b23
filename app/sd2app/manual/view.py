"""A page of the manual: its Markdown set as one reads it, in the colours of the theme."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, QUrl
from PySide6.QtGui import (
    QColor,
    QDesktopServices,
    QFont,
    QFontDatabase,
    QFontMetricsF,
    QImageReader,
    QPainter,
    QPaintEvent,
    QTextBlock,
    QTextBlockFormat,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
    QTextFrameFormat,
    QTextTable,
    QTextTableCellFormat,
)
from PySide6.QtWidgets import QTextBrowser, QWidget

from sd2app.manual.pages import Manual
from sd2app.palette import Palette, palette_for

SCHEME = "manual"
"""Of addresses of pages, as in ``manual:/how-to/install.md#a-checkout``."""
_COLUMNS = 84
"""Letters of a line of code; the column has some 80 letters of text then."""
_TEXT_SIZE, _CODE_SIZE = 1.15, 0.95  # by the size of letters in the rest of the window
_MARGIN_PX, _PADDING_PX, _RADIUS_PX, _CELL_PX, _INDENT_PX = 32, 12, 6, 6, 26
_HEADINGS = {1: (1.8, 0, 12), 2: (1.35, 24, 8), 3: (1.2, 18, 6)}
"""Size of letters, room above and below in pixels, by the level."""
_MARKDOWN, _IMAGE = (
    QTextDocument.ResourceType.MarkdownResource,
    QTextDocument.ResourceType.ImageResource,
)
_Property = QTextFormat.Property


def address(place: str) -> QUrl:
    """Address of a page, with the anchor of a heading if there is one."""
    return QUrl(f"{SCHEME}:/{place}")


class PageView(QTextBrowser):
    """Shows pages one after the other, with a history; other links open the browser."""

    def __init__(self, manual: Manual, parent: QWidget) -> None:
        super().__init__(parent)
        self._manual = manual
        self._shown = QUrl()  # source() is late while a page is loaded
        self._headings: dict[str, QTextBlock] = {}  # by their anchors
        self._code: list[list[QTextBlock]] = []
        self._ground = QColor()
        self._letters_pt = self.font().pointSizeF()
        code = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        code.setPointSizeF(_CODE_SIZE * self._letters_pt)
        self._column_px = round(_COLUMNS * QFontMetricsF(code).horizontalAdvance("m"))
        self._column_px += 2 * _PADDING_PX
        font = self.font()
        font.setPointSizeF(_TEXT_SIZE * self._letters_pt)
        self.setFont(font)
        self.setAccessibleName("Page of the manual")
        self.setFrameShape(self.Shape.NoFrame)
        self.setOpenLinks(False)
        self.setLineWrapMode(self.LineWrapMode.FixedPixelWidth)
        self.setLineWrapColumnOrWidth(self._column_px + 2 * _MARGIN_PX)
        self.document().setDocumentMargin(_MARGIN_PX)
        self.document().setIndentWidth(_INDENT_PX)
        self.anchorClicked.connect(self.follow)
        self.sourceChanged.connect(self._arrive)

    @property
    def page(self) -> str:
        """Name of the page that is shown."""
        return _name_in(self._shown)

    def follow(self, link: QUrl) -> None:
        """Open a page, or what lies outside the manual in the browser."""
        link = self._shown.resolved(link)
        if link.scheme() == SCHEME:
            self.setSource(link, _MARKDOWN)
        else:
            QDesktopServices.openUrl(link)

    def loadResource(self, kind: int, url: QUrl) -> Any:
        """Read a page, or a picture no wider than the column."""
        name = _name_in(self._shown.resolved(url))
        if kind == _MARKDOWN.value:
            self._shown, self._headings = url, {}
            return self._manual.text(name)
        if kind != _IMAGE.value:
            return None
        reader = QImageReader(str(self._manual.folder / name))
        ratio, size = self.devicePixelRatioF(), reader.size()
        widest = round(self._column_px * ratio)
        if size.width() > widest:
            reader.setScaledSize(QSize(widest, round(size.height() * widest / size.width())))
        image = reader.read()
        image.setDevicePixelRatio(ratio if size.width() > widest else 1.0)
        return image

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme; many changes of the palette are told that are none."""
        super().changeEvent(event)
        if event.type() != QEvent.Type.PaletteChange or not self.page:
            return
        if QColor(self._colours.well) != self._ground:
            scrolled = self.verticalScrollBar().value()
            self.reload()
            self.verticalScrollBar().setValue(scrolled)

    def _arrive(self, place: QUrl) -> None:
        """Dress a page that was just loaded, and go to the heading that its address says."""
        if not self._headings:
            self._dress()
        if heading := self._headings.get(place.fragment()):
            top = self.document().documentLayout().blockBoundingRect(heading).top()
            self.verticalScrollBar().setValue(round(top) - _PADDING_PX)

    # --- how it looks ---------------------------------------------------------------------

    @property
    def _colours(self) -> Palette:
        return palette_for(self.palette().base().color().lightness() < 128)

    def _dress(self) -> None:
        """Give text its sizes, room and colours."""
        document = self.document()
        colours = self._colours
        cursor = QTextCursor(document)
        cursor.beginEditBlock()
        anchors = iter(self._manual.sections(self.page))
        for block in _blocks(document):
            if block.blockFormat().headingLevel():
                self._headings[next(anchors).anchor] = block
            self._set_block(block)
        pieces = groupby(_blocks(document), _language)
        self._code = [list(lines) for language, lines in pieces if language is not None]
        self._ground = QColor(colours.well)
        for frame in document.rootFrame().childFrames():
            if isinstance(frame, QTextTable):
                _set_table(frame, colours)
        cursor.endEditBlock()

    def _set_block(self, block: QTextBlock) -> None:
        cursor = QTextCursor(block)
        cursor.movePosition(cursor.MoveOperation.EndOfBlock, cursor.MoveMode.KeepAnchor)
        room, letters, language = QTextBlockFormat(), QTextCharFormat(), _language(block)
        above, below, between = 0, 12, 5
        if level := block.blockFormat().headingLevel():
            factor, above, below = _HEADINGS[min(level, 3)]
            letters.setFontPointSize(factor * self._letters_pt)
            letters.setFontWeight(QFont.Weight.DemiBold)
        elif language is not None:
            # Room for the ground, and around it.
            before, after = _language(block.previous()), _language(block.next())
            above = 0 if before == language else _PADDING_PX + (4 if before is None else 20)
            below, between = 0 if after == language else _PADDING_PX + 14, 3
            letters.setFontPointSize(_CODE_SIZE * self._letters_pt)
            room.setNonBreakableLines(False)
            room.setLeftMargin(_PADDING_PX)
            room.setRightMargin(_PADDING_PX)
        elif cursor.currentTable() is not None:
            below, between = 0, 2
        elif block.textList() is not None:
            below = 4 if block.next().textList() is not None else 12
        room.setTopMargin(above)
        room.setBottomMargin(below)
        room.setLineHeight(between, QTextBlockFormat.LineHeightTypes.LineDistanceHeight.value)
        cursor.mergeBlockFormat(room)
        cursor.mergeCharFormat(letters)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint a ground behind code, then the text."""
        bounds = self.document().documentLayout().blockBoundingRect
        with QPainter(self.viewport()) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(self._ground)
            painter.translate(
                -self.horizontalScrollBar().value(), -self.verticalScrollBar().value()
            )
            for lines in self._code:
                place = bounds(lines[0]).united(bounds(lines[-1]))
                top, bottom = place.top() - _PADDING_PX, place.bottom() + _PADDING_PX
                ground = QRectF(_MARGIN_PX, top, self._column_px, bottom - top)
                painter.drawRoundedRect(ground, _RADIUS_PX, _RADIUS_PX)
        super().paintEvent(event)


def _name_in(place: QUrl) -> str:
    return place.path().lstrip("/")


def _blocks(document: QTextDocument) -> Iterator[QTextBlock]:
    block = document.begin()
    while block.isValid():
        yield block
        block = block.next()


def _language(block: QTextBlock) -> str | None:
    """Language of a line of code, None for other text."""
    shape = block.blockFormat()
    if not shape.hasProperty(_Property.BlockCodeFence):
        return None
    return str(shape.property(_Property.BlockCodeLanguage))


def _set_table(table: QTextTable, colours: Palette) -> None:
    """Draw lines between rows, and a ground behind the heading."""
    shape = table.format()
    shape.setBorder(0)
    shape.setBorderCollapse(True)
    shape.setTopMargin(4)
    shape.setBottomMargin(18)
    table.setFormat(shape)
    for row in range(table.rows()):
        for column in range(table.columns()):
            cell = table.cellAt(row, column)
            style = QTextTableCellFormat(cell.format().toTableCellFormat())
            style.setPadding(_CELL_PX)
            style.setBottomBorder(1)
            style.setBottomBorderBrush(QColor(colours.border))
            style.setBottomBorderStyle(QTextFrameFormat.BorderStyle.BorderStyle_Solid)
            if row == 0:
                style.setBackground(QColor(colours.well))
            cell.setFormat(style)
