"""Two meshes beside each other: pictures, velocities of a joint, table of all joints."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSignalBlocker, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPen
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from sd2app.maps.track_mouse import SeekingPlot
from sd2app.mesh_comparison.model import ComparisonModel, joint_words
from sd2app.session.display import DisplayModel
from sd2app.session.session import Session
from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.canvas import AT_RIGHT, Canvas, paint_axes
from sd2app.widgets.mesh_painting import draw_mesh, no_picture, paint_picture
from sd2app.widgets.time_axis import paint_title, signed_text, ticks
from sd2core.mesh.presence import runs

_TITLE_PX = 24
_MIN_OPACITY = 0.2
"""Lowest opacity, so that the compared meshes stay visible."""
_MIN_MPS = 0.2
"""Smallest range of the velocity axis."""


def colour_of(display: DisplayModel, number: int) -> QColor:
    """Colour of a mesh, in pictures and curves alike."""
    return QColor(display.palette.synthetic if number == 0 else display.palette.real)


class ComparedPicture(Canvas):
    """One of the two meshes over the picture on screen."""

    USUAL_PX = 400, 300 + _TITLE_PX

    def __init__(
        self, number: int, comparison: ComparisonModel, session: Session, overlay: OverlayModel
    ) -> None:
        super().__init__()
        self._number, self._comparison = number, comparison
        self._session, self._overlay = session, overlay
        self.setMinimumSize(240, 180)
        # With a video the picture is what one waits for.
        clock = session.playback if session.video.reader is None else session.video
        self.follow(
            comparison.changed, session.display.theme_changed, overlay.changed, clock.frame_changed
        )

    def paint(self, painter: QPainter) -> None:
        """Title, and the picture below."""
        s, comparison = self._session, self._comparison
        colours, colour = s.display.palette, colour_of(s.display, self._number)
        painter.fillRect(self.rect(), QColor(colours.panel))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawRoundedRect(QRectF(8, 7, 10, 10), 2, 2)
        title = comparison.labels[self._number]
        if self._number == comparison.reference:
            title += " (reference)"
        paint_title(painter, QRectF(24, 0, self.width() - 32, _TITLE_PX), title, colours.text)
        ground = QRect(0, _TITLE_PX, self.width(), self.height() - _TITLE_PX)
        painter.fillRect(ground, QColor(colours.well))
        camera, reader, picture = s.document.camera, s.video.reader, s.video.picture
        time_s = s.playback.time_s
        if reader is not None and picture is not None:
            time_s = reader.timebase.time_of(s.video.shown_frame)
        opacity = max(self._overlay.style.opacity, _MIN_OPACITY)
        mesh = comparison.mesh(self._number)
        box = paint_picture(painter, ground, no_picture(camera) if picture is None else picture)
        draw_mesh(painter, box, mesh, time_s, camera, colour, opacity)


class JointCurves(SeekingPlot):
    """Velocity of one joint towards the sensor, from both meshes; click or drag seeks."""

    TOP_PX, BOTTOM_PX = _TITLE_PX, 4
    USUAL_PX = 640, 140

    def __init__(self, comparison: ComparisonModel, session: Session) -> None:
        super().__init__(session)
        self._comparison = comparison
        self.setMinimumHeight(96)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.follow(comparison.changed, session.span.changed)

    def paint(self, painter: QPainter) -> None:
        """Title, axis, lines, cursor."""
        colours, scale, plot = self._display.palette, self.scale, self.plot_rect()
        painter.fillRect(self.rect(), QColor(colours.panel))
        heading = QRectF(8, 0, self.width() - 16, _TITLE_PX)
        paint_title(painter, heading, joint_words(self._comparison.joint), colours.text)
        painter.setPen(QColor(colours.muted))
        painter.drawText(heading, AT_RIGHT, "towards the sensor +  /  away −   m/s")
        curves = [self._comparison.curve(number) for number in (0, 1)]
        known = np.concatenate([velocity[np.isfinite(velocity)] for _, velocity in curves])
        limit = max(1.1 * float(np.abs(known).max(initial=0.0)), _MIN_MPS)

        def y_of(velocity_mps: float) -> float:
            return plot.center().y() - velocity_mps / limit * plot.height() / 2

        most = max(int(plot.height() / (painter.fontMetrics().height() * 1.8)), 2)
        upwards = [(y_of(each), signed_text(round(each, 6))) for each in ticks(-limit, limit, most)]
        paint_axes(painter, plot, colours, (), upwards, "")
        painter.setClipRect(plot)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for number, (times_s, velocity) in enumerate(curves):
            reference = number == self._comparison.reference
            painter.setPen(QPen(colour_of(self._display, number), 2.0 if reference else 1.5))
            for start, stop in runs(np.isfinite(velocity)):  # stretches without a gap
                points = zip(times_s[start:stop], velocity[start:stop], strict=True)
                painter.drawPolyline([QPointF(scale.x_of(t), y_of(v)) for t, v in points])
        painter.setPen(QPen(QColor(colours.muted), 1))
        x = scale.x_of(self._playback.time_s)
        painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))


_HEADS = (
    ("Joint", "Click to see its velocity over time"),
    ("Distance\ncm", "Mean distance between the two"),
    ("Velocity\nm/s", "RMS difference of the velocities towards the sensor"),
    ("Correl.\nr", "Correlation of those velocities"),
    ("Jitter\nm/s³", "RMS third difference: how much the joint trembles in the first mesh"),
    ("Jitter\nm/s³", "The same in the second mesh"),
)


class JointTable(QTableWidget):
    """A row per joint; the current one is drawn."""

    def __init__(self, comparison: ComparisonModel, display: DisplayModel) -> None:
        super().__init__(0, len(_HEADS))
        self._comparison = comparison
        self._display = display
        self.setHorizontalHeaderLabels([text for text, _ in _HEADS])
        for column, (_, tip) in enumerate(_HEADS):
            head = self.horizontalHeaderItem(column)
            assert head is not None
            head.setToolTip(tip)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(22)
        self.setShowGrid(False)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setFrameShape(QTableWidget.Shape.NoFrame)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.currentCellChanged.connect(self._choose)
        comparison.changed.connect(self._refresh)
        display.theme_changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        joints = self._comparison.joints
        with QSignalBlocker(self):
            self.setRowCount(len(joints))
            for number, name in enumerate(joints):
                for column, text in enumerate(self._cells(number, name)):
                    self.setItem(number, column, self._item(column, text))
                if name == self._comparison.joint:
                    self.setCurrentCell(number, 0)

    def _cells(self, joint: int, name: str) -> tuple[str, ...]:
        """Name of a joint, its differences, and how much it trembles in either mesh."""
        comparison, difference = self._comparison.comparison, self._comparison.difference
        assert comparison is not None  # it has joints
        assert difference is not None
        same = difference.correlation[joint]
        return (
            joint_words(name),
            f"{100 * difference.distance_m[joint]:.1f}",
            f"{difference.velocity_rms_mps[joint]:.2f}",
            "–" if math.isnan(same) else f"{same:.2f}".replace("-", "−"),
            *(f"{one.jitter_mps3[joint]:.0f}" for one in comparison.differences),
        )

    def _item(self, column: int, text: str) -> QTableWidgetItem:
        item = QTableWidgetItem(text)
        if column:
            item.setTextAlignment(AT_RIGHT)
        if column >= len(_HEADS) - 2:
            number = column - (len(_HEADS) - 2)
            item.setForeground(QBrush(QColor(colour_of(self._display, number))))
        return item

    def _choose(self, row: int) -> None:
        joints = self._comparison.joints
        if 0 <= row < len(joints):
            self._comparison.set_joint(joints[row])
