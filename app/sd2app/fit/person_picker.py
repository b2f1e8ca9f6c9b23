"""A frame of the video on which a rectangle is drawn around a person."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.fit.setup import FitSetupModel
from sd2app.palette import Palette
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.mesh_painting import paint_picture

_DIMMED = 110


class PersonPicker(Canvas):
    """Picture on which a drag draws a rectangle and a click removes it."""

    USUAL_PX = 560, 420

    def __init__(self, setup: FitSetupModel, palette: Palette, parent: QWidget) -> None:
        super().__init__(parent)
        self._setup = setup
        self._colours = palette
        self._from: QPointF | None = None
        self._to = QPointF()
        self.setMinimumSize(320, 240)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setAccessibleName("Drag a rectangle around the person")
        self.follow(setup.changed, setup.picture_changed)

    @property
    def box(self) -> QRectF:
        """Rectangle of the picture."""
        size = self._setup.size
        if size is None:
            return QRectF()
        scale = min(self.width() / size[0], self.height() / size[1])
        box = QRectF(0, 0, size[0] * scale, size[1] * scale)
        box.moveCenter(QRectF(self.rect()).center())
        return box

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Set a corner of the rectangle."""
        if event.button() == Qt.MouseButton.LeftButton and self._setup.picture is not None:
            self._from = self._to = event.position()
            self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the opposite corner."""
        if self._from is not None:
            self._to = event.position()
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Take the rectangle, or remove it where nothing was drawn."""
        if self._from is None or event.button() != Qt.MouseButton.LeftButton:
            return
        corner, self._from = self._from, None
        end = event.position()
        self.update()
        box, size = self.box, self._setup.size
        if size is None:
            return
        if (end - corner).manhattanLength() < 6:
            self._setup.change(person=None)
            return
        scale = size[0] / box.width()
        (x0, y0), (x1, y1) = (
            ((point.x() - box.x()) * scale, (point.y() - box.y()) * scale)
            for point in (corner, end)
        )
        self._setup.set_person(x0, y0, x1, y1)

    def paint(self, painter: QPainter) -> None:
        """Paint the picture, dimmed outside the rectangle."""
        painter.fillRect(self.rect(), QColor(self._colours.well))
        picture = self._setup.picture
        if picture is None:
            painter.setPen(QColor(self._colours.muted))
            text = "Reading the video…" if self._setup.reading else ""
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        paint_picture(painter, self.rect(), picture)
        rectangle = self._rectangle()
        if rectangle is None:
            return
        person = self._setup.choices.person
        drawn_here = self._from is not None or (
            person is not None and person.frame == self._setup.frame
        )
        if drawn_here:
            self._dim_around(painter, rectangle)
        pen = QPen(QColor(self._colours.overlay), 2)
        # In another frame the person is elsewhere.
        pen.setStyle(Qt.PenStyle.SolidLine if drawn_here else Qt.PenStyle.DotLine)
        painter.setPen(pen)
        painter.drawRect(rectangle)

    def _dim_around(self, painter: QPainter, inside: QRectF) -> None:
        around = QPainterPath()  # odd-even: what both rectangles have stays as it is
        around.addRect(self.box)
        around.addRect(inside)
        painter.fillPath(around, QColor(0, 0, 0, _DIMMED))

    def _rectangle(self) -> QRectF | None:
        """Rectangle on the widget: the one being drawn, else the chosen one."""
        if self._from is not None:
            return QRectF(self._from, self._to).normalized().intersected(self.box)
        person, size = self._setup.choices.person, self._setup.size
        if person is None or size is None:
            return None
        box = self.box
        scale = box.width() / size[0]
        return QRectF(
            box.x() + person.x * scale,
            box.y() + person.y * scale,
            person.width * scale,
            person.height * scale,
        )
