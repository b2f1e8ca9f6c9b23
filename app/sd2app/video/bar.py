"""Bar above the video: mesh on or off, dots, opacity."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QSlider, QWidget

from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.inputs import action_button
from sd2app.widgets.panel import title

_STEPS = 20


class VideoBar(QWidget):
    """Bar with the mesh's visibility, dots or surface, and opacity."""

    def __init__(
        self, overlay: OverlayModel, action: Callable[[str], QAction], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._overlay = overlay
        self._mesh = action("overlay")
        self._slider = QSlider(Qt.Orientation.Horizontal, self)
        self._slider.setRange(1, _STEPS)
        self._slider.setFixedWidth(80)
        self._slider.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._slider.setAccessibleName("Opacity of the mesh over the video")
        self._slider.valueChanged.connect(lambda value: overlay.set_style(opacity=value / _STEPS))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(8, 2, 4, 2)
        layout.setSpacing(4)
        layout.addWidget(title("Video"))
        layout.addStretch(1)
        layout.addWidget(action_button(self._mesh, "Mesh"))
        layout.addWidget(self._slider)
        layout.addWidget(action_button(action("overlay_dots"), "Dots"))
        overlay.changed.connect(self._refresh)
        self._mesh.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        style = self._overlay.style
        with QSignalBlocker(self._slider):
            self._slider.setValue(round(style.opacity * _STEPS))
        self._slider.setEnabled(self._mesh.isEnabled() and style.shown)
        self._slider.setToolTip(f"Opacity of the mesh over the video: {style.opacity:.0%}")
