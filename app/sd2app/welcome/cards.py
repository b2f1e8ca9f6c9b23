"""Large buttons of the start page: a thing to begin with, and a recording with its picture."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QFont, QKeyEvent, QPainter, QPainterPath, QPaintEvent, QPalette, QPixmap
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget

from sd2app.widgets.icons import draw_panel_icon

_RADIUS_PX, _PAD_PX, _ICON_PX = 8.0, 14, 28
_WRAPPED = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)


class Card(QAbstractButton):
    """Button with a border that follows the pointer and the keyboard; Return presses it too."""

    def __init__(self, name: str, tip: str, height_px: int, parent: QWidget) -> None:
        super().__init__(parent)
        self.setText(name)
        self.setAccessibleName(name)
        self.setAccessibleDescription(tip)
        self.setToolTip(tip)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(height_px)

    def sizeHint(self) -> QSize:
        """Narrow; the row gives each an equal share."""
        return QSize(160, self.height())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press with Return as with Space."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the ground, what is on it, and the border."""
        colours, roles = self.palette(), QPalette.ColorRole
        chosen = self.isEnabled() and (self.underMouse() or self.hasFocus())
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            edge = QRectF(self.rect()).adjusted(1, 1, -1, -1)
            shape = QPainterPath()
            shape.addRoundedRect(edge, _RADIUS_PX, _RADIUS_PX)
            ground = roles.AlternateBase if self.isDown() else roles.Base
            painter.fillPath(shape, colours.color(ground))
            painter.save()
            painter.setClipPath(shape)
            self.paint_content(painter, edge)
            painter.restore()
            pen = painter.pen()
            pen.setColor(colours.color(roles.Highlight if chosen else roles.Mid))
            pen.setWidthF(2.0 if chosen else 1.0)
            painter.setPen(pen)
            painter.drawPath(shape)

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint what the card is about."""
        raise NotImplementedError

    def write(self, painter: QPainter, box: QRectF, text: str, *, bold: bool = False) -> float:
        """Write wrapped words from the top of a box, muted unless bold; returns their height."""
        font, group = QFont(self.font()), QPalette.ColorGroup.Active
        role = QPalette.ColorRole.WindowText if bold else QPalette.ColorRole.PlaceholderText
        if not self.isEnabled():
            group = QPalette.ColorGroup.Disabled
        if bold:
            font.setWeight(QFont.Weight.DemiBold)
        painter.setFont(font)
        painter.setPen(self.palette().color(group, role))
        used = painter.boundingRect(box, _WRAPPED, text)
        painter.drawText(box, _WRAPPED, text)
        return used.height()


class WayCard(Card):
    """A way to begin: icon, name, and a sentence on what comes of it."""

    def __init__(self, name: str, words: str, icon: str, parent: QWidget) -> None:
        super().__init__(name, words, 118, parent)
        self._words, self._icon = words, icon

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint the icon in the accent colour above the words."""
        box = edge.adjusted(_PAD_PX, _PAD_PX, -_PAD_PX, -_PAD_PX)
        accent = self.palette().color(QPalette.ColorRole.Highlight)
        place = QRectF(box.left(), box.top(), _ICON_PX, _ICON_PX)
        draw_panel_icon(painter, place, self._icon, accent)
        box.setTop(box.top() + _ICON_PX + 8)
        box.setTop(box.top() + self.write(painter, box, self.text(), bold=True) + 3)
        self.write(painter, box, self._words)


class RecentCard(Card):
    """A recording that was open lately, with its picture if there is one."""

    def __init__(self, name: str, place: str, tip: str, picture: QPixmap, parent: QWidget) -> None:
        super().__init__(name, tip, 176, parent)
        self._place, self._picture = place, picture

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint the picture over name and place, each in a line."""
        metrics = self.fontMetrics()
        words_px = 2 * metrics.height() + 18
        room = edge.adjusted(0, 0, 0, -words_px)
        painter.fillRect(room, self.palette().color(QPalette.ColorRole.AlternateBase))
        if self._picture.isNull():
            place = QRectF(0, 0, _ICON_PX, _ICON_PX)
            place.moveCenter(room.center())
            hatch = self.palette().color(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Text)
            draw_panel_icon(painter, place, "Video", hatch)
        else:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            size = QRectF(self._picture.rect())
            scale = max(room.width() / size.width(), room.height() / size.height())
            part = QRectF(0, 0, room.width() / scale, room.height() / scale)
            part.moveCenter(size.center())
            painter.drawPixmap(room, self._picture, part)
        line = QRectF(_PAD_PX, room.bottom() + 7, edge.width() - 2 * _PAD_PX, metrics.height())
        right = Qt.TextElideMode.ElideRight
        self.write(painter, line, metrics.elidedText(self.text(), right, int(line.width())),
                   bold=True)  # fmt: skip
        line.translate(0, metrics.height() + 2)
        left = Qt.TextElideMode.ElideLeft
        self.write(painter, line, metrics.elidedText(self._place, left, int(line.width())))
