"""The window in which two meshes of one video stand side by side."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QCloseEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from sd2app.manual.help import help_button
from sd2app.mesh_comparison.model import ComparisonModel
from sd2app.mesh_comparison.views import ComparedPicture, JointCurves, JointTable
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.dialogs import ask_figure, take_room
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import column_of, row_of
from sd2app.widgets.panel import ElidedLabel, copy_button, fill, outlined, panel, say, splitter


class ComparisonWindow(QWidget):
    """Pictures, maps and curves follow the clock of the main window, and move it."""

    closed = Signal()

    def __init__(
        self,
        model: ComparisonModel,
        session: Session,
        overlay: OverlayModel,
        *,
        map_view: Callable[[MapModel], QWidget],
        ruler: QWidget,
        keys: list[QAction],
        attempt: Callable[[Callable[[], None]], object],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.model, self._attempt, self._session = model, attempt, session
        model.setParent(self)
        simulated = " (simulated)" if session.document.simulated else ""
        self.setWindowTitle(f"{session.document.title}{simulated}: compare meshes")
        self.addActions(keys)
        head = self._head()
        pictures = [ComparedPicture(number, model, session, overlay) for number in (0, 1)]
        tracks = [*map(map_view, model.tracks), JointCurves(model, session)]
        panels = {name: panel(name) for name in ("pictures", "tracks", "joints")}
        fill(panels["pictures"], row_of(*((one, 1) for one in pictures)))
        fill(panels["tracks"], column_of(*((one, 1) for one in tracks), ruler))
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
            self._attempt(lambda: self.model.save_figure(path))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop comparing, and discard the results."""
        self.model.close()
        event.accept()
        self.closed.emit()
