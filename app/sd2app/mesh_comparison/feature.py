"""Comparison of the open mesh with another one of the same video: its window and views."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QBrush, QCloseEvent, QColor, QPainter, QPen
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from sd2app.feature import Action, Feature, Shell
from sd2app.manual.help import help_button
from sd2app.maps.track_mouse import SeekingPlot
from sd2app.mesh_comparison.model import ComparisonModel, joint_words
from sd2app.playback.feature import TimeRuler
from sd2app.session.display import DisplayModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.video.feature import OverlayModel
from sd2app.widgets.canvas import AT_RIGHT, Canvas, paint_axes
from sd2app.widgets.dialogs import ask_figure, ask_file, take_room
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import column_of, row_of
from sd2app.widgets.mesh_painting import draw_mesh, no_picture, paint_picture
from sd2app.widgets.panel import ElidedLabel, copy_button, fill, outlined, panel, say, splitter
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


class ComparisonWindow(QWidget):
    """Pictures, maps and curves follow the clock of the main window, and move it."""

    closed = Signal()

    def __init__(
        self,
        model: ComparisonModel,
        session: Session,
        shell: Shell,
        overlay: OverlayModel,
        map_view: Callable[[MapModel], QWidget],
    ) -> None:
        super().__init__(shell.dialog_parent, Qt.WindowType.Window)
        self.model, self._shell, self._session = model, shell, session
        model.setParent(self)
        simulated = " (simulated)" if session.document.simulated else ""
        self.setWindowTitle(f"{session.document.title}{simulated}: compare meshes")
        self.addActions([shell.action(name) for name in _SHARED_KEYS])
        head = self._head()
        pictures = [ComparedPicture(number, model, session, overlay) for number in (0, 1)]
        tracks = [*map(map_view, model.tracks), JointCurves(model, session)]
        panels = {name: panel(name) for name in ("pictures", "tracks", "joints")}
        fill(panels["pictures"], row_of(*((one, 1) for one in pictures)))
        fill(panels["tracks"], column_of(*((one, 1) for one in tracks), TimeRuler(session)))
        fill(panels["joints"], JointTable(model, session.display))
        parts = [panels["pictures"], panels["tracks"]]
        left = splitter(Qt.Orientation.Vertical, parts, (320, 420))
        body = splitter(Qt.Orientation.Horizontal, [left, panels["joints"]], (820, 400))
        self._notes = QLabel(self)
        self._notes.setWordWrap(True)
        self.setLayout(column_of(head, (body, 1), self._notes, spacing_px=8, margins_px=8))
        model.changed.connect(self._refresh)
        self._refresh()
        take_room(self, 1240, 820)

    def _head(self) -> QHBoxLayout:
        self._summary = ElidedLabel(self, "title")
        self._reference = Choice("The mesh that is taken to be right", self)
        # However long the names of the meshes are.
        self._reference.setSizeAdjustPolicy(
            Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self._reference.setMinimumContentsLength(14)
        self._reference.currentIndexChanged.connect(self.model.set_reference)
        tip = "Write maps and velocities of both (.png, .svg, .pdf)"
        self._export = outlined("Export figure…", tip, self._ask, self)
        against = QLabel("measured against", self)
        copy = copy_button(lambda: self.model.line, self)
        parts = (against, self._reference, self._export, copy, help_button("Compare meshes", self))
        return row_of((self._summary, 1), *parts, spacing_px=8)

    def _refresh(self) -> None:
        model, comparison = self.model, self.model.comparison
        self._reference.offer(list(model.labels), model.reference)
        self._reference.setEnabled(comparison is not None)
        self._export.setEnabled(comparison is not None and not model.busy)
        self._summary.setText(self._words())
        notes = " ".join(comparison.notes) if comparison is not None else ""
        say(self._notes, model.problem or notes, "warning" if model.problem else "muted")
        self._notes.setVisible(bool(self._notes.text()))

    def _words(self) -> str:
        model = self.model
        if model.busy:
            return "Comparing…"
        if model.problem:
            return "These cannot be compared"
        difference = model.difference
        if difference is None:
            return ""
        distance_cm = 100 * difference.distance_m.mean()
        error = difference.error_mps("hands")
        return (
            f"Joints {distance_cm:.1f} cm apart · hands' velocity off by {error:.2f} m/s ·"
            f" Doppler maps differ by {difference.map_l1:.2f} (relative L1)"
        )

    def _ask(self) -> None:
        name = self._session.document.file_name("-comparison")
        if path := ask_figure(self, "Export comparison", name):
            self._shell.attempt(lambda: self.model.save_figure(path))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop comparing, and discard the results."""
        self.model.close()
        event.accept()
        self.closed.emit()


_MESHES = (
    "Mesh or recording (*.npz *.zip zarr.json *.pkl *.obj *.ply *.glb recording.json);;"
    "All files (*)"
)
_SHARED_KEYS = ("play", "previous_frame", "next_frame", "back_second", "on_second", "zoom_fit")
"""Actions that work in the window of a comparison too."""


def mesh_of(path: Path) -> Path:
    """Mesh that a chosen file belongs to: a Zarr group is a folder, as are frames in files."""
    if path.name in ("zarr.json", "recording.json"):
        return path.parent
    if path.suffix.lower() in (".obj", ".ply", ".glb") and path.parent.is_dir():
        return path.parent
    return path


class MeshComparisonFeature(Feature):
    """Window of its own with two meshes side by side; ``map_view`` makes the view of a map."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        overlay: OverlayModel,
        map_view: Callable[[MapModel], QWidget],
    ) -> None:
        self._session, self._shell, self._overlay = session, shell, overlay
        self._map_view = map_view
        self._window: ComparisonWindow | None = None

    def actions(self) -> Sequence[Action]:
        """The comparison."""
        return (
            Action(
                "compare", "File", "Compare with mesh…", (),
                "Measure another mesh of this video against the one that is open",
                self.compare, self._session.has_mesh,
            ),
        )  # fmt: skip

    def compare(self, path: Path | None = None) -> None:
        """Measure another mesh, which is asked for, against the one that is open."""
        s, shell = self._session, self._shell
        path = path or self._ask()
        if path is None or not s.has_mesh():
            return
        self.close()
        model = ComparisonModel(s, path)
        window = ComparisonWindow(model, s, shell, self._overlay, self._map_view)
        window.closed.connect(self._forget)
        # It is about the recording that was open.
        s.document.opened.connect(window.close)
        self._window = window
        window.show()

    def _ask(self) -> Path | None:
        path = ask_file(self._shell.dialog_parent, "Compare with mesh", _MESHES)
        return None if path is None else mesh_of(path)

    def _forget(self) -> None:
        window, self._window = self._window, None
        if window is not None:
            window.deleteLater()

    def close(self) -> None:
        """Close the comparison, where one is open."""
        if self._window is not None:
            self._window.close()
